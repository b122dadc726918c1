//! Packets as they arrive.

use std::net::UdpSocket;
use std::time::{Duration, Instant};

use super::assembly::{Assembler, LiveSweep, PacketCounts};
use super::live::{LiveSensor, SensorModel};
use super::replay::Replay;
use super::*;
use crate::source::tests::fuzz::{Random, damaged};

const NOW_NS: u64 = 1_700_000_000_000_000_000;

/// The sweeps of packets that arrive one after another, and the counts of packets.
pub(super) fn assembled(
    sensor: &LiveSensor,
    packets: &[Vec<u8>],
) -> (Vec<SweepData>, PacketCounts) {
    let (mut assembler, mut sweeps) = (Assembler::new(sensor.clone()), Vec::new());
    for packet in packets {
        assembler.take(packet, Instant::now(), NOW_NS, |sweep| {
            let empty = LiveSweep::of(sensor);
            sweeps.push(std::mem::replace(sweep, empty).data);
        });
    }
    (sweeps, assembler.counts())
}

fn vlp() -> LiveSensor {
    LiveSensor::of(SensorModel::Vlp16, None).unwrap()
}

/// Compares with the sweeps of a capture of the same packets, except a last one that no packet
/// ends.
fn check(live: &[SweepData], recorded: &[SweepData]) {
    assert!(!live.is_empty() && live.len() + 1 >= recorded.len());
    let from = recorded[0].stamp_s;
    for (live, sweep) in live.iter().zip(recorded) {
        assert_eq!(live.points, sweep.points);
        assert_eq!(live.stamp_s, sweep.stamp_s - from);
        assert_eq!(live.frame, sweep.frame - recorded[0].frame);
        assert_eq!(live.dropped.sweeps_before, sweep.dropped.sweeps_before);
    }
}

#[test]
fn the_same_sweeps_as_those_of_a_capture() {
    let packets = turns(0..300);
    let (_folder, capture) = made(&from_one(&packets));
    let (live, counts) = assembled(&vlp(), &packets);
    check(&live, &sweeps(&mut capture.unwrap()));
    assert_eq!(counts, PacketCounts { packets: 300, ..PacketCounts::default() });
    // The first sweep already knows how long a revolution takes.
    let mut assembler = Assembler::new(vlp());
    let mut turns_ns = Vec::new();
    for packet in &packets {
        assembler.take(packet, Instant::now(), NOW_NS, |sweep| turns_ns.push(sweep.period_ns));
    }
    assert_eq!(turns_ns, [75.0 * 1_327_000.0; 3]);
    // If a capture begins with a revolution, that one is left out.
    let name = "OS-1-128_v2.3.0_1024x10_lb_n3";
    let metadata = super::packets("OS-1-128_v2.3.0_1024x10.json");
    let ouster = LiveSensor::of(SensorModel::Ouster, Some(&metadata)).unwrap();
    let (live, counts) = assembled(&ouster, &payloads(&format!("{name}.pcap"), 8448));
    let recorded = sweeps(&mut opened(&super::packets(&format!("{name}.pcap"))));
    assert_eq!((live[0].points.len(), live.len()), (recorded[1].points.len(), 1));
    assert_eq!((&live[0].points, counts.missing), (&recorded[1].points, 0));
}

#[test]
fn disorder_is_counted() {
    let packets = disorder::mixed();
    let (_folder, capture) = made(&from_one(&packets));
    let (live, counts) = assembled(&vlp(), &packets);
    check(&live, &sweeps(&mut capture.unwrap()));
    let expected = PacketCounts {
        packets: 546,
        foreign: 1,
        duplicates: 1,
        reordered: 1,
        missing: 206,
        ..PacketCounts::default()
    };
    assert_eq!(counts, expected);
}

#[test]
fn wrong_check_sums_are_counted() {
    let metadata = super::packets("crc_test.json");
    let sensor = LiveSensor::of(SensorModel::Ouster, Some(&metadata)).unwrap();
    let mut packets = every_payload("crc_test.pcap");
    let (_, sound) = assembled(&sensor, &packets);
    assert!(sound.packets > 10 && sound.unsound == 0, "{sound:?}");
    packets[5][200] ^= 1;
    let (_, counts) = assembled(&sensor, &packets);
    assert_eq!((counts.unsound, counts.packets), (1, sound.packets - 1), "{counts:?}");
}

/// A sensor that stands still, and one whose clock is set.
#[test]
fn endless_revolutions_are_bounded() {
    let mut still = turns(0..130);
    let stuck = (0..2000).map(|n| {
        let mut packet = vlp16(129);
        packet[1200..1204].copy_from_slice(&((130 + n) * 1327_u32).to_le_bytes());
        packet
    });
    still.extend(stuck);
    let (live, counts) = assembled(&vlp(), &still);
    let bytes = vlp().returns_max();
    assert!(live.iter().all(|s| s.points.len() <= bytes) && counts.over_capacity > 100_000);
    let mut set = turns(0..300);
    for packet in &mut set[150..] {
        let us = u32::from_le_bytes(packet[1200..1204].try_into().unwrap());
        packet[1200..1204].copy_from_slice(&(us + 1_800_000_000).to_le_bytes());
    }
    let (live, counts) = assembled(&vlp(), &set);
    assert_eq!((counts.clock_set, counts.missing, counts.reordered), (1, 0, 0));
    assert!(live.windows(2).all(|pair| pair[1].stamp_s > pair[0].stamp_s));
    assert!(live.last().unwrap().stamp_s < 0.5, "{}", live.last().unwrap().stamp_s);
}

/// Any bytes.
#[test]
fn nonsense_is_counted() {
    corrupt(&vlp(), &turns(0..4000));
}

/// Damages a quarter of the packets of a sensor.
pub(super) fn corrupt(sensor: &LiveSensor, packets: &[Vec<u8>]) {
    let mut random = Random(20);
    let maybe_damage = |packet: &Vec<u8>| match random.below(4) {
        0 => damaged(packet, &mut random),
        _ => packet.clone(),
    };
    let corrupted: Vec<Vec<u8>> = packets.iter().map(maybe_damage).collect();
    let (live, counts) = assembled(sensor, &corrupted);
    assert_eq!(counts.packets + counts.foreign, packets.len() as u64);
    assert!(counts.foreign > packets.len() as u64 / 40 && !live.is_empty(), "{counts:?}");
    assert!(live.iter().all(|sweep| sweep.points.len() <= sensor.returns_max()));
}

#[test]
fn a_capture_is_sent_again() {
    let folder = Temp::new();
    let path = folder.write("made.pcap", recording(230));
    let replay = Replay::open(&path, None).unwrap();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
    let to = socket.local_addr().unwrap();
    std::thread::scope(|scope| {
        let sent = scope.spawn(|| {
            let began = Instant::now();
            (replay.send(to, 5.0, || false).unwrap(), began.elapsed())
        });
        let (mut datagram, mut next) = ([0; 2000], 0);
        // On a busy machine the system may drop some.
        while let Ok(length) = socket.recv(&mut datagram) {
            let found = (next..230).find(|n| vlp16(*n) == datagram[..length]);
            next = found.expect("a packet of the capture, after those before it") + 1;
            let last = if next == 230 { 1 } else { 2000 };
            socket.set_read_timeout(Some(Duration::from_millis(last))).unwrap();
        }
        assert!(next > 100, "{next}");
        let (sent, elapsed) = sent.join().unwrap();
        // One was captured every millisecond.
        assert!(sent == 230 && elapsed > Duration::from_millis(45), "{sent}, {elapsed:?}");
    });
    assert_eq!(replay.send(to, 1e9, || true).unwrap(), 1);
}

#[test]
fn models() {
    let named = |model| LiveSensor::of(model, None).unwrap().name().to_owned();
    let models =
        [SensorModel::Vlp16, SensorModel::PuckHiRes, SensorModel::Vlp32c, SensorModel::Hdl32e];
    assert_eq!(models.map(named), ["VLP-16", "Puck Hi-Res", "VLP-32C", "HDL-32E"]);
    let metadata = super::packets("OS-1-128_v2.3.0_1024x10.json");
    assert!(LiveSensor::of(SensorModel::Ouster, None).is_err());
    assert!(LiveSensor::of(SensorModel::Vlp16, Some(&metadata)).is_err());
    assert!(LiveSensor::of(SensorModel::Ouster, Some(&super::packets("README.md"))).is_err());
}
