//! Packets of real sensors, and synthetic captures.

mod arriving;
mod disorder;
mod hdl64;
#[path = "../../../../fuzz/src/packet.rs"]
mod packet;

pub(crate) use hdl64::calibrated;
use packet::velodyne as vlp16;

use std::fs;

use etherparse::PacketBuilder;
use md5::{Digest, Md5};
use raywake_registration::Odometry;

use super::hdl64::Hdl64;
use super::ouster::Ouster;
use super::velodyne::Velodyne;
use super::*;
use crate::source::tests::Temp;
use crate::source::{Format, open};
use raywake_core::sweep::Timing;

fn packets(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/packets").join(name)
}

fn options() -> OpenOptions {
    OpenOptions { unlocated: Unlocated::Accept, ..OpenOptions::default() }
}

fn opened(path: &Path) -> Capture {
    Capture::open(path, &options()).unwrap_or_else(|e| panic!("{e}"))
}

fn sweeps(source: &mut Capture) -> Vec<SweepData> {
    let sweeps = source.len();
    let read = |n| {
        let mut sweep = SweepData::default();
        source.read(n, &mut sweep).unwrap();
        sweep
    };
    (0..sweeps).map(read).collect()
}

fn wrong(path: &Path) -> String {
    open(path, &options()).err().expect("is opened").to_string()
}

/// The payloads of this length in a capture.
fn payloads(name: &str, length: usize) -> Vec<Vec<u8>> {
    let mut all = every_payload(name);
    all.retain(|payload| payload.len() == length);
    all
}

fn every_payload(name: &str) -> Vec<Vec<u8>> {
    let mut all = Vec::new();
    let datagrams = Datagrams::open(&packets(name)).unwrap();
    let each = datagrams.each(0, |datagram| {
        all.push(datagram.payload.to_vec());
        ControlFlow::Continue(())
    });
    each.unwrap();
    all
}

/// An Ethernet frame around a datagram.
fn frame(source: [u8; 4], payload: &[u8]) -> Vec<u8> {
    let builder = PacketBuilder::ethernet2([1; 6], [2; 6]).ipv4(source, [10, 0, 0, 1], 64);
    let mut frame = Vec::new();
    builder.udp(2368, 2368).write(&mut frame, payload).unwrap();
    frame
}

/// A file of these frames, 1 ms apart.
fn pcap(frames: &[Vec<u8>]) -> Vec<u8> {
    let mut file = Vec::new();
    let head = [0xa1b2_c3d4, 0x0004_0002, 0, 0, 1 << 18, 1];
    head.iter().for_each(|word: &u32| file.extend(word.to_le_bytes()));
    for (n, frame) in frames.iter().enumerate() {
        let (ms, length) = (n as u32, frame.len() as u32);
        [1_700_000_000 + ms / 1000, ms % 1000 * 1000, length, length]
            .iter()
            .for_each(|word| file.extend(word.to_le_bytes()));
        file.extend(frame);
    }
    file
}

/// The same as a pcapng, big-endian, with time in ns.
fn pcapng(frames: &[Vec<u8>]) -> Vec<u8> {
    let block = |kind: u32, body: Vec<u8>| {
        let length = (body.len() + 12) as u32;
        [&kind.to_be_bytes()[..], &length.to_be_bytes(), &body, &length.to_be_bytes()].concat()
    };
    let section = [&0x1a2b_3c4d_u32.to_be_bytes()[..], &[0, 1, 0, 0], &[0xff; 8]].concat();
    // Ethernet, no limit, time in 10^-9 s, the end of the options.
    let interface = [&[0, 1, 0, 0, 0, 0, 0, 0][..], &[0, 9, 0, 1, 9, 0, 0, 0], &[0; 4]].concat();
    let mut file = [block(0x0a0d_0d0a, section), block(1, interface)].concat();
    for (n, frame) in frames.iter().enumerate() {
        let time = 1_700_000_000_000_000_000 + 1_000_000 * n as u64;
        let length = (frame.len() as u32).to_be_bytes();
        let mut body = [&[0; 4][..], &time.to_be_bytes(), &length, &length, frame].concat();
        body.resize(body.len().next_multiple_of(4), 0);
        file.extend(block(6, body));
    }
    file
}

const BLOCKS: usize = velodyne::BLOCKS;

fn turns(packets: std::ops::Range<u32>) -> Vec<Vec<u8>> {
    packets.map(vlp16).collect()
}

/// A file of packets of a VLP-16, 75 per revolution.
pub(crate) fn recording(packets: u32) -> Vec<u8> {
    pcap(&from_one(&turns(0..packets)))
}

/// A file of the first packets that an Ouster sent, and its metadata.
pub(crate) fn published(count: usize) -> [Vec<u8>; 2] {
    let sent = every_payload("crc_test.pcap");
    let metadata = fs::read(packets("crc_test.json")).unwrap();
    [pcap(&from_one(&sent[..count.min(sent.len())])), metadata]
}

/// A capture of packets of one sensor, with the ground given by the user.
fn made(frames: &[Vec<u8>]) -> (Temp, Result<Capture, Error>) {
    let folder = Temp::new();
    let path = folder.write("made.pcap", pcap(frames));
    let capture = Capture::open(&path, &OpenOptions { ground_m: Some(-2.0), ..options() });
    (folder, capture)
}

fn from_one(packets: &[Vec<u8>]) -> Vec<Vec<u8>> {
    packets.iter().map(|packet| frame([10, 0, 0, 9], packet)).collect()
}

/// What the manufacturer decodes: MD5 of the fields of all packets, one row per beam.
#[test]
fn fields_of_an_os0() {
    let ouster = Ouster::read(&packets("OS-0-128-U1_v2.3.0_1024x10.json")).unwrap();
    let (mut ranges, mut reflectivities) = (Md5::new(), Md5::new());
    let (mut times, mut numbers) = (Md5::new(), Md5::new());
    let all = payloads("OS-0-128-U1_v2.3.0_1024x10.pcap", 8448);
    assert_eq!(all.len(), 64);
    for packet in &all {
        assert!(ouster.recognises(packet) && ouster.has_valid_checksum(packet));
        for beam in 0..128 {
            for column in 0..16 {
                let (range, reflectivity) =
                    ouster.measurement(packet, ouster.place(column).0, beam);
                ranges.update(range.to_le_bytes());
                reflectivities.update([reflectivity]);
            }
        }
        for column in 0..16 {
            let firing = ouster.firing(packet, column).unwrap();
            times.update(firing.clock_ns.to_le_bytes());
            numbers.update((firing.angle / 64).to_le_bytes());
            assert_eq!(firing.frame, Some(1491));
        }
    }
    let published = fs::read(packets("OS-0-128-U1_v2.3.0_1024x10_digest.json")).unwrap();
    let published: serde_json::Value = serde_json::from_slice(&published).unwrap();
    let hashes = [
        ("RANGE", ranges),
        ("REFLECTIVITY", reflectivities),
        ("TIMESTAMP", times),
        ("MEASUREMENT_ID", numbers),
    ];
    for (field, hash) in hashes {
        let hash: String = hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(published["packet_hash"][field], hash, "{field}");
    }
}

/// Three sweeps of a moving OS1 whose trajectory is known to the manufacturer.
#[test]
fn trajectory_of_an_os1() {
    let mut source = opened(&packets("OS-1-128_v2.3.0_1024x10_lb_n3.pcap"));
    let all = sweeps(&mut source);
    assert_eq!((all.len(), source.overview.frames.clone()), (3, vec![0, 1, 2]));
    let Timing::Offset { from_s, span_s } = source.rig().timing else { panic!() };
    assert!(from_s == 0.0 && (0.0998..0.1).contains(&span_s), "{span_s}");
    let mut odometry = raywake_alloc_guard::boxed!(Odometry, Odometry::new());
    let found = all.iter().map(|s| odometry.locate(s.stamp_s, &s.points, source.rig()));
    let found: Vec<Pose> = found.map(|l| l.world_from_vehicle).collect();
    let told = pose_files::read(&packets("OS-1-128_v2.3.0_1024x10_lb_n3_poses_kitti.txt"), &[0; 3]);
    let told: Vec<Pose> = told.unwrap().into_iter().flatten().collect();
    // The first step is 2.3 cm shorter here than there, the second one agrees within 1 mm.
    for (found, told) in found.iter().zip(&told) {
        let off = told.inverse() * *found;
        assert!(
            off.translation.length() < 0.03 && off.twist(1.0).angular.length() < 4e-3,
            "{off:?}"
        );
    }
}

/// A sweep is the same whether read alone or after others; and its poses may be in a file.
#[test]
fn any_order_with_poses() {
    let path = packets("OS-1-128_v2.3.0_1024x10_lb_n3.pcap");
    let poses = Some(packets("OS-1-128_v2.3.0_1024x10_lb_n3_poses_kitti.txt"));
    let mut source =
        Capture::open(&path, &OpenOptions { poses, ..OpenOptions::default() }).unwrap();
    assert!(source.is_located() && source.pose(2).translation.x > 0.49);
    let forwards = sweeps(&mut source);
    for n in (0..3).rev() {
        let mut sweep = SweepData::default();
        source.read(n, &mut sweep).unwrap();
        assert_eq!(sweep.points, forwards[n].points);
        assert!(sweep.points.len() > 90_000);
    }
    let refused = Capture::open(&path, &OpenOptions::default()).err().unwrap().to_string();
    assert!(refused.ends_with("sensor packets only: poses are needed, give a file with --poses"));
}

#[test]
fn check_sums() {
    let told = |source: &Capture| source.notes().iter().any(|n| n.contains("wrong checksum"));
    assert!(!told(&opened(&packets("crc_test.pcap"))));
    let folder = Temp::new();
    folder.write("x.json", fs::read(packets("crc_test.json")).unwrap());
    let mut bytes = fs::read(packets("crc_test.pcap")).unwrap();
    bytes[50_000] ^= 1;
    let source = opened(&folder.write("x.pcap", bytes));
    let expected = "left out: packets with a wrong checksum, of 34 (1)";
    assert!(told(&source) && source.notes().iter().any(|n| n == expected), "{:?}", source.notes());
}

/// The lasers of an HDL-32E lie on cones around its axis.
#[test]
fn cones_of_an_hdl_32e() {
    let mut source = opened(&packets("sample_velodyne_hdl32.pcap"));
    let all = sweeps(&mut source);
    assert!(source.describe().contains("HDL-32E 192.168.17.162:2368"), "{}", source.describe());
    assert_eq!(all.len(), 1);
    let height = |tangent: f64, along: f64| (along - 0.02883) * tangent;
    let elevations: Vec<f64> = (0..32).map(|n| f64::from(n) * 4.0 / 3.0 - 30.67).collect();
    for point in &all[0].points {
        let [x, y, z] = point.position.map(f64::from);
        let along = x.hypot(y);
        let nearest = elevations.iter().map(|e| (height(e.to_radians().tan(), along) - z).abs());
        let off = nearest.fold(f64::INFINITY, f64::min);
        // The angles of the manual are rounded to 0.01°.
        assert!(off < 1e-3 + 2e-4 * along, "{point:?} is {off} m off");
    }
    // It makes nine revolutions a second, and most of it sees something.
    let last = all[0].points.iter().map(|p| p.offset_s).fold(0.0, f32::max);
    assert!((0.1..0.12).contains(&last) && all[0].points.len() > 40_000, "{last}");
}

/// Distance, azimuth and time by the manual's formulas.
#[test]
fn returns_of_a_vlp_16() {
    let (_folder, capture) = made(&from_one(&turns(0..300)));
    let mut capture = capture.unwrap();
    // Revolutions begin at the rear: half a revolution at each end is left out.
    assert_eq!((capture.len(), capture.notes().len()), (3, 1));
    let all = sweeps(&mut capture);
    for sweep in &all {
        assert!(sweep.points.iter().all(|p| p.intensity == 0.2 && p.position[0].is_finite()));
        let first = &sweep.points[15];
        // The 16th laser points up by 15°; it fires 34.56 µs after the first, from 11 mm lower.
        let angle = 15f64.to_radians();
        let z = 10.0 * angle.sin() - 0.04191 * angle.tan();
        assert!((f64::from(first.position[2]) - z).abs() < 1e-6, "{first:?}");
        assert!((first.offset_s - 34.56e-6).abs() < 1e-9, "{first:?}");
        let turned = 180.0 + 34.56e-6 / 110.592e-6 * 0.4;
        let azimuth = f64::from(-first.position[1]).atan2(first.position[0].into()).to_degrees();
        assert!((azimuth.rem_euclid(360.0) - turned).abs() < 1e-4, "{azimuth} {turned}");
    }
    assert_eq!(all[1].points.len(), 75 * 12 * 32);
    let between = all[1].stamp_s - all[0].stamp_s;
    assert!((between - 75.0 * 1327e-6).abs() < 1e-6, "{between}");
}

/// Strongest and last returns: each direction once.
#[test]
fn dual_returns() {
    let dual = |n: u32| {
        let mut packet = vlp16(n);
        packet[1204] = 0x39;
        for pair in 0..6 {
            let azimuth = packet[200 * pair + 2..][..2].to_vec();
            packet[200 * pair + 102..][..2].copy_from_slice(&azimuth);
            packet[200 * pair + 4] = 0;
        }
        packet
    };
    let packets: Vec<Vec<u8>> = (0..300).map(dual).collect();
    let (_folder, capture) = made(&from_one(&packets));
    let all = sweeps(&mut capture.unwrap());
    assert_eq!(all[1].points.len(), 75 * 6 * 32);
    // The first of each pair, the last returns, was changed.
    assert!(all[1].points.iter().all(|p| p.position.iter().map(|v| v * v).sum::<f32>() > 99.0));
}

/// The simulator also has the table of the VLP-32C's lasers, with azimuths in the opposite
/// direction.
#[test]
#[cfg(feature = "simulated")]
fn lasers_of_a_vlp_32c() {
    let mut packet = vlp16(0);
    packet[1205] = 0x28;
    let beams = raywake_sim::Sensor::vlp32c().beams;
    let lasers = Velodyne::of(&packet).unwrap().angles();
    assert_eq!((lasers.len(), beams.len()), (32, 32));
    for ([elevation, azimuth], beam) in lasers.iter().zip(&beams) {
        assert_eq!([elevation.to_radians(), azimuth.to_radians()], [beam.elevation, beam.azimuth]);
    }
}
