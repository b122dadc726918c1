//! Recordings made here, complete, cut and damaged.

use std::collections::BTreeMap;
use std::io::Cursor;

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};

use super::*;
use crate::sink::bag::cdr::Cdr;
use crate::source::tests::Temp;
use crate::source::{Format, open};
use raywake_core::sweep::Timing;

/// Time of the first sweep, ns.
const BEGIN_NS: u64 = 1_700_000_000_000_000_000;
const PERIOD_NS: u64 = 100_000_000;

/// A message: topic, schema, time, content.
pub(crate) type Message = (&'static str, &'static str, u64, Vec<u8>);

/// A file with these messages.
pub(crate) fn file(messages: &[Message], options: WriteOptions) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer: Writer<_> = options.create(Cursor::new(&mut bytes)).unwrap();
    for (topic, name, log_time, data) in messages {
        let schema = writer.add_schema(name, "ros2msg", b"").unwrap();
        let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
        let (sequence, publish_time) = (0, *log_time);
        let header = MessageHeader { channel_id, sequence, log_time: *log_time, publish_time };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    bytes
}

/// Small chunks.
pub(crate) fn options() -> WriteOptions {
    WriteOptions::new().compression(Some(Compression::Zstd)).chunk_size(Some(50_000))
}

/// A floor, a sensor `height_m` above it and a post 5 m ahead; times spread over a revolution.
fn cloud(stamp_ns: u64, frame: &str, height_m: f32) -> Vec<u8> {
    let floor = (0..1600).map(|n| [(n / 40) as f32 - 19.5, (n % 40) as f32 - 19.5, -height_m]);
    let post = (0..10).map(|n| [5.0, 0.0, 0.1 * n as f32 - height_m]);
    let points: Vec<[f32; 3]> = floor.chain(post).collect();
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, frame);
    [1, points.len() as u32, 5].into_iter().for_each(|n| cdr.word(n));
    let fields = [("y", 0, 7), ("x", 4, 7), ("z", 8, 7), ("intensity", 16, 2), ("time", 20, 7)];
    fields.into_iter().for_each(|(name, offset, kind)| cdr.field(name, offset, kind));
    cdr.byte(0);
    [24, 24 * points.len() as u32].into_iter().for_each(|n| cdr.word(n));
    let last = points.len() - 1;
    cdr.bytes(|bytes| {
        for (n, [x, y, z]) in points.into_iter().enumerate() {
            [y, x, z, 0.0].into_iter().for_each(|v| bytes.extend(v.to_le_bytes()));
            bytes.extend([51, 0, 0, 0]);
            bytes.extend((0.1 * n as f32 / last as f32).to_le_bytes());
        }
    });
    cdr.byte(1);
    cdr.message()
}

fn transform(stamp_ns: u64, frames: [&str; 2], x: f64, z: f64) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.word(1);
    cdr.header(stamp_ns, frames[0]);
    cdr.text(frames[1]);
    cdr.doubles([x, 0.0, z, 0.0, 0.0, 0.0, 1.0]);
    cdr.message()
}

fn odometry(stamp_ns: u64, child: &str, x: f64) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, "odom");
    cdr.text(child);
    cdr.doubles([x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    // Covariance and twist, which are not read.
    cdr.doubles([0.0; 36 + 6 + 36]);
    cdr.message()
}

const CLOUD: &str = "sensor_msgs/msg/PointCloud2";
const TF: &str = "tf2_msgs/msg/TFMessage";
const ODOMETRY: &str = "nav_msgs/msg/Odometry";

fn stamp(n: u64) -> u64 {
    BEGIN_NS + n * PERIOD_NS
}

/// `sweeps` sweeps of a lidar 1.8 m above the ground.
fn sweeps(sweeps: u64) -> Vec<Message> {
    let cloud = |n| ("/points", CLOUD, stamp(n) + 50_000_000, cloud(stamp(n), "lidar", 1.8));
    (0..sweeps).map(cloud).collect()
}

/// The same, and a second lidar at the rear, 20 ms later, on a vehicle that moves 1 m per sweep.
pub(crate) fn rig(count: u64) -> Vec<Message> {
    let mut all = vec![
        ("/tf_static", TF, BEGIN_NS, transform(0, ["base_link", "lidar"], 1.0, 1.8)),
        ("/tf_static", TF, BEGIN_NS, transform(0, ["base_link", "rear"], -2.0, 0.9)),
        ("/image", "sensor_msgs/msg/Image", BEGIN_NS, vec![0; 100_000]),
    ];
    for (n, front) in sweeps(count).into_iter().enumerate() {
        let later = stamp(n as u64) + 20_000_000;
        all.push(front);
        all.push(("/rear", CLOUD, later, cloud(later, "rear", 0.9)));
    }
    // Between the sweeps; the first is before the second sweep.
    let pose = |n: u64| (BEGIN_NS + 50_000_000 * (2 * n + 1), n as f64 + 0.5);
    all.extend(
        (0..count).map(pose).map(|(ns, x)| ("/odom", ODOMETRY, ns, odometry(ns, "lidar", x))),
    );
    all
}

pub(super) fn accept() -> OpenOptions {
    OpenOptions { unlocated: Unlocated::Accept, ..OpenOptions::default() }
}

#[test]
fn one_lidar_without_anything_else() {
    let temp = Temp::new();
    for (n, options) in [
        options(),
        options().compression(Some(Compression::Lz4)),
        options().compression(None),
        options().use_chunks(false),
    ]
    .into_iter()
    .enumerate()
    {
        let path = temp.write(&format!("{n}.mcap"), file(&sweeps(4), options));
        let mut source = open(&path, &accept()).unwrap();
        assert_eq!(
            (source.len(), source.name(), source.is_located()),
            (4, format!("{n}").as_str(), false)
        );
        assert_eq!((source.frame(2), source.stamp_s(2)), (stamp(2), 0.2));
        assert_eq!(source.overview().epoch_ns, BEGIN_NS);
        let rig = source.rig().clone();
        assert!((rig.ground_m + 1.8).abs() < 1e-6, "{rig:?}");
        let Timing::Offset { from_s, span_s } = rig.timing else { panic!("{rig:?}") };
        assert!(from_s == 0.0 && (span_s - 0.1).abs() < 1e-6);
        // In any order.
        for index in [3, 0, 1, 1] {
            let mut sweep = SweepData::default();
            source.read(index, &mut sweep).unwrap();
            let last = sweep.points[1609];
            assert_eq!((sweep.points.len(), last.position), (1610, [5.0, 0.0, 0.1 * 9.0 - 1.8]));
            assert!((last.intensity - 0.2).abs() < 1e-6 && (last.offset_s - 0.1).abs() < 1e-6);
            assert_eq!(sweep.frame, stamp(index as u64));
        }
        let needed = open(&path, &OpenOptions::default()).map(|_| ()).unwrap_err().to_string();
        assert!(needed.contains("poses are needed"), "{needed}");
    }
}

#[test]
fn two_lidars_in_one_vehicle_with_odometry_in_two_files() {
    let temp = Temp::new();
    let all = rig(6);
    let (first, second) = all.split_at(9);
    // Ordered by number, not alphabetically.
    temp.write("drive_2.mcap", file(first, options()));
    temp.write("drive_10.mcap", file(second, options()));
    let mut source = open(temp.path(), &accept()).unwrap();
    // There is no pose before the first one.
    assert_eq!(source.len(), 5, "{:?}", source.notes());
    assert!(
        source.describe().contains("poses from /odom (lidar in odom)"),
        "{}",
        source.describe()
    );
    for n in 0..5 {
        // The lidar is 1 m ahead of the vehicle and at 1.8 m.
        let away = source.pose(n).translation - DVec3::new(n as f64, 0.0, -1.8);
        assert!(away.length() < 1e-9, "{n}: {away}");
    }
    assert!((source.rig().ground_m).abs() < 1e-6);
    let places: Vec<DVec3> = source.rig().sensors.iter().map(|s| s.translation).collect();
    assert_eq!(places, [DVec3::new(1.0, 0.0, 1.8), DVec3::new(-2.0, 0.0, 0.9)]);
    let mut sweep = SweepData::default();
    source.read(1, &mut sweep).unwrap();
    let (front, rear) = (sweep.points[1609], sweep.points[3219]);
    assert_eq!((front.sensor, rear.sensor), (0, 1));
    assert!((front.position[0] - 6.0).abs() < 1e-6 && (rear.position[0] - 3.0).abs() < 1e-6);
    assert!((rear.offset_s - 0.12).abs() < 1e-6);
    let twice = OpenOptions { topics: vec!["/rear".into(); 2], ..accept() };
    let error = open(temp.path(), &twice).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("--topic /rear is given twice"), "{error}");
    let one = OpenOptions { topics: vec!["/rear".into()], ..accept() };
    let mut rear_only = open(temp.path(), &one).unwrap();
    rear_only.read(0, &mut sweep).unwrap();
    assert_eq!((sweep.points.len(), sweep.points[0].sensor), (1610, 0));
}

#[test]
fn truncated_files_are_read_up_to_the_cut_and_damage_is_named() {
    let temp = Temp::new();
    let bytes = file(&sweeps(12), options());
    let whole = open(&temp.write("whole.mcap", &bytes), &accept()).unwrap().len();
    let mut lengths = Vec::new();
    for part in [0.2, 0.5, 0.8] {
        let cut = &bytes[..(part * bytes.len() as f64) as usize];
        let mut source = open(&temp.write("cut.mcap", cut), &accept()).unwrap();
        let notes = source.notes().join("\n");
        assert!(notes.contains("cut.mcap is cut off: read up to byte"), "{notes}");
        let last = source.len() - 1;
        source.read(last, &mut SweepData::default()).unwrap();
        lengths.push(source.len());
    }
    assert!(lengths.is_sorted() && lengths[0] > 0 && lengths[2] < whole, "{lengths:?}");
    let fails = |bytes: &[u8]| {
        let path = temp.write("bad.mcap", bytes);
        open(&path, &accept()).map(|_| ()).unwrap_err().to_string()
    };
    // Anywhere in a chunk.
    let mut damaged = bytes.clone();
    damaged[bytes.len() / 4] ^= 0x10;
    let error = fails(&damaged);
    assert!(error.contains("bad.mcap, byte"), "{error}");
    assert!(fails(b"bag").contains("not an MCAP file") && fails(b"").contains("not an MCAP"));
    assert!(fails(&bytes[..8]).contains("no clouds"), "{}", fails(&bytes[..8]));
    // A chunk with an unknown compression.
    let at = bytes.windows(4).position(|w| w == b"zstd").unwrap();
    let mut other = bytes.clone();
    other[at..at + 4].copy_from_slice(b"brot");
    assert!(fails(&other).contains("brot"), "{}", fails(&other));
}

#[test]
fn no_wrong_byte_panics() {
    let temp = Temp::new();
    // Without checksums, which would detect all damage.
    let bytes = file(&rig(2), options().compression(None).calculate_chunk_crcs(false));
    let path = temp.path().join("odd.mcap");
    let mut random = raywake_sim::Rng::new(3);
    let mut opened = 0;
    for _ in 0..300 {
        let mut odd = bytes.clone();
        for _ in 0..1 + random.bits() % 3 {
            let at = random.bits() as usize % odd.len();
            odd[at] = random.bits() as u8;
        }
        odd.truncate(odd.len() - random.bits() as usize % 200);
        std::fs::write(&path, &odd).unwrap();
        if let Ok(mut source) = open(&path, &accept()) {
            opened += 1;
            (0..source.len()).for_each(|n| drop(source.read(n, &mut SweepData::default())));
        }
    }
    assert!(opened > 0);
}

#[test]
fn messages_that_make_no_sense_are_skipped_or_named() {
    let temp = Temp::new();
    let open = |messages: &[Message]| {
        let path = temp.write("some.mcap", file(messages, options()));
        open(&path, &accept())
    };
    let fails = |messages: &[Message]| open(messages).map(|_| ()).unwrap_err().to_string();
    // Empty, repeated, back in time, and in another frame.
    let mut all = sweeps(3);
    let mut none = Cdr::new();
    none.header(stamp(3), "lidar");
    [0, 0, 0].into_iter().for_each(|n| none.word(n));
    all.push(("/points", CLOUD, stamp(3), none.message()));
    all.push(("/points", CLOUD, stamp(3), cloud(stamp(2), "lidar", 1.8)));
    all.push(("/points", CLOUD, stamp(4), cloud(stamp(0), "lidar", 1.8)));
    all.push(("/points", CLOUD, stamp(5), cloud(stamp(5), "other", 1.8)));
    let source = open(&all).unwrap();
    let notes = source.notes().join("\n");
    assert_eq!(source.len(), 3);
    assert!(notes.contains("skipped 1 messages without points"), "{notes}");
    assert!(notes.contains("skipped 2 messages that are not later"), "{notes}");
    assert!(notes.contains("skipped 1 messages in a different frame"), "{notes}");
    // A driver without a clock: the recording time is used.
    let at_zero = |n| ("/points", CLOUD, stamp(n), cloud(0, "lidar", 1.8));
    assert_eq!(open(&[at_zero(0), at_zero(1)]).unwrap().frame(1), stamp(1));
    let never = ("/points", CLOUD, u64::MAX, cloud(0, "lidar", 1.8));
    assert_eq!(open(&[at_zero(0), never]).unwrap().frame(1), i64::MAX as u64);
    // Two topics of one lidar.
    let mut twice = sweeps(2);
    twice.push(("/filtered", CLOUD, BEGIN_NS, cloud(BEGIN_NS, "lidar", 1.8)));
    let error = fails(&twice);
    assert!(
        error.contains("choose with --topic: /filtered (1 clouds in `lidar`), /points (2"),
        "{error}"
    );
    // Cut short; with a field beyond the point; with a field of unknown type.
    let (mut short, long) = (sweeps(2), sweeps(1)[0].3.clone());
    short[0].3.truncate(3000);
    assert!(fails(&short).contains("topic /points: truncated"), "{}", fails(&short));
    let place = long.windows(9).position(|w| w == b"intensity").unwrap() + 12;
    for (change, says) in
        [(place, "field `intensity` ends after"), (place + 4, "has unknown type 90")]
    {
        let mut odd = long.clone();
        odd[change] = 90;
        let error = fails(&[("/points", CLOUD, BEGIN_NS, odd)]);
        assert!(error.contains(says), "{error}");
    }
    // Invalid odometry leaves it to registration; links in a circle are an error.
    let mut sources = sweeps(3);
    let nan = odometry(BEGIN_NS, "lidar", f64::NAN);
    sources.push(("/odom", ODOMETRY, BEGIN_NS, nan));
    let source = open(&sources).unwrap();
    let notes = source.notes().join("\n");
    assert!(!source.is_located() && notes.contains("skipped 1 transforms"), "{notes}");
    let mut circle = sweeps(1);
    circle.insert(0, ("/tf_static", TF, 0, transform(0, ["a", "lidar"], 0.0, 0.0)));
    circle.insert(0, ("/tf_static", TF, 0, transform(0, ["lidar", "a"], 0.0, 0.0)));
    assert!(fails(&circle).contains("circle"), "{}", fails(&circle));
    // No clouds at all.
    let image = ("/image", "sensor_msgs/msg/Image", BEGIN_NS, vec![0; 100]);
    assert!(fails(&[image]).contains("available: /image (sensor_msgs/msg/Image)"));
}

#[test]
fn conflicting_pose_sources_are_refused() {
    let temp = Temp::new();
    let mut all = rig(4);
    let tf = |n: u64| ("/tf", TF, stamp(n), transform(stamp(n), ["map", "base_link"], 0.0, 0.0));
    all.extend((0..5).map(tf));
    let path = temp.write("two.mcap", file(&all, options()));
    let source = open(&path, &accept()).unwrap();
    let notes = source.notes().join("\n");
    assert!(!source.is_located(), "{notes}");
    assert!(notes.contains("2 sources give the pose of `base_link`"), "{notes}");
    // Without the odometry, the transforms are used.
    all.retain(|message| message.0 != "/odom");
    let path = temp.write("one.mcap", file(&all, options()));
    assert!(open(&path, &accept()).unwrap().describe().contains("/tf (base_link in map)"));
}

#[test]
fn files_other_than_recordings_get_advice() {
    let temp = Temp::new();
    for (name, says) in [
        ("a.bag", "mcap convert"),
        ("a.db3", "ros2 bag convert"),
        ("a.pcd", "raywake flow A B"),
        ("a.txt", "expected a folder, an .mcap or a .pcap file"),
    ] {
        let error = open(&temp.write(name, b""), &accept()).map(|_| ()).unwrap_err();
        assert!(error.to_string().contains(says), "{error}");
    }
    let topic = OpenOptions {
        format: Some(Format::Clouds),
        topics: vec!["/points".into()],
        ..OpenOptions::default()
    };
    let error = open(temp.path(), &topic).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("--topic"), "{error}");
}

/// As sent by Livox drivers: petals instead of a sensor's revolution, a time for each point.
fn livox(stamp_ns: u64, said: u32) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, "livox_frame");
    cdr.double(f64::from_bits(stamp_ns));
    cdr.word(said);
    [1, 0, 0, 0].into_iter().for_each(|byte| cdr.byte(byte));
    cdr.word(2000);
    for n in 0..2000u16 {
        let (sin, cos) = (f32::from(n) * 0.9).sin_cos();
        let range_m = 4.0 + 3.0 * (f32::from(n) * 0.1).sin();
        cdr.word(u32::from(n) * 50_000);
        [range_m * cos, range_m * sin, -1.8].into_iter().for_each(|v| cdr.float(v));
        [51, 16, (n % 4) as u8].into_iter().for_each(|byte| cdr.byte(byte));
    }
    cdr.message()
}

#[test]
fn petals_of_a_livox() {
    let temp = Temp::new();
    let message =
        |n| ("/livox/lidar", "livox_ros_driver2/msg/CustomMsg", stamp(n), livox(stamp(n), 2000));
    let mut all: Vec<Message> = (0..3).map(message).collect();
    let path = temp.write("livox.mcap", file(&all, options()));
    let mut source = open(&path, &accept()).unwrap();
    assert!(matches!(source.rig().timing, Timing::Offset { .. }) && source.len() == 3);
    let mut sweep = SweepData::default();
    source.read(2, &mut sweep).unwrap();
    assert_eq!(sweep.points.len(), 2000);
    let last = sweep.points[1999];
    assert!((last.offset_s - 0.09995).abs() < 1e-6 && last.position[2] == -1.8, "{last:?}");
    assert!((last.intensity - 0.2).abs() < 1e-6);
    // A message that states another number of points than it has is an error.
    all[1].3 = livox(stamp(1), 1999);
    let path = temp.write("said.mcap", file(&all, options()));
    let e = open(&path, &accept()).unwrap().read(1, &mut sweep).unwrap_err().to_string();
    assert!(e.contains("topic /livox/lidar: 2000 points, but the header says 1999"), "{e}");
}
