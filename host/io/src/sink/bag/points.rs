//! Returns as `sensor_msgs/PointCloud2`.

use raywake_core::output::{PairFlows, PointFlow};
use raywake_core::pose::Pose;
use raywake_core::sweep::Point;

use super::VEHICLE;
use super::cdr::Cdr;
use crate::source::SweepData;

/// `FLOAT32`, `INT32` and `UINT8` of `sensor_msgs/PointField`.
const FLOAT32: u8 = 7;
const INT32: u8 = 5;
const UINT8: u8 = 2;
/// Fields of a return with its flow, four bytes each.
const WITH_FLOW: [(&str, u8); 9] = [
    ("x", FLOAT32),
    ("y", FLOAT32),
    ("z", FLOAT32),
    ("intensity", FLOAT32),
    ("velocity_x", FLOAT32),
    ("velocity_y", FLOAT32),
    ("speed", FLOAT32),
    ("p_moves", FLOAT32),
    // Followed by three unused bytes, so that numbers stay aligned.
    ("status", UINT8),
];
/// Fields of a return with its track.
const WITH_TRACK: [(&str, u8); 5] =
    [("x", FLOAT32), ("y", FLOAT32), ("z", FLOAT32), ("intensity", FLOAT32), ("track", INT32)];

/// Fields of a return by itself.
const ALONE: [(&str, u8); 5] =
    [("x", FLOAT32), ("y", FLOAT32), ("z", FLOAT32), ("intensity", FLOAT32), ("time", FLOAT32)];

/// Returns by themselves.
pub(super) fn alone(stamp_ns: u64, returns: &[Point]) -> Vec<u8> {
    let fields = |point: &Point| {
        let [x, y, z] = point.position;
        [x, y, z, point.intensity, point.offset_s].map(f32::to_le_bytes)
    };
    cloud(stamp_ns, &ALONE, returns.iter().map(fields))
}

/// A sweep with its flow.
pub(super) fn with_flow(stamp_ns: u64, sweep: &SweepData, flows: &PairFlows) -> Vec<u8> {
    let returns = sweep.points.iter().zip(flows.points.iter());
    let pose = &sweep.world_from_vehicle;
    cloud(stamp_ns, &WITH_FLOW, returns.map(|(point, flow)| flow_fields(pose, point, flow)))
}

/// A sweep with the tracks of its returns.
pub(super) fn with_tracks(stamp_ns: u64, sweep: &SweepData, tracks: &[i32]) -> Vec<u8> {
    let returns = sweep.points.iter().zip(tracks);
    cloud(stamp_ns, &WITH_TRACK, returns.map(|(point, track)| track_fields(point, *track)))
}

/// In the order of [`WITH_FLOW`].
fn flow_fields(pose: &Pose, point: &Point, flow: PointFlow) -> [[u8; 4]; WITH_FLOW.len()] {
    let [x, y, z] = point.position.map(f32::to_le_bytes);
    let [vx, vy] = pose.along_axes(flow.velocity_world_mps);
    let [i, vx, vy, speed, p] =
        [point.intensity, vx, vy, vx.hypot(vy), flow.probability].map(f32::to_le_bytes);
    [x, y, z, i, vx, vy, speed, p, [flow.status as u8, 0, 0, 0]]
}

/// In the order of [`WITH_TRACK`].
fn track_fields(point: &Point, track: i32) -> [[u8; 4]; WITH_TRACK.len()] {
    let [x, y, z] = point.position.map(f32::to_le_bytes);
    [x, y, z, point.intensity.to_le_bytes(), track.to_le_bytes()]
}

/// A cloud of returns with these fields, in the vehicle's frame.
fn cloud<const FIELDS: usize>(
    stamp_ns: u64,
    fields: &[(&str, u8); FIELDS],
    returns: impl ExactSizeIterator<Item = [[u8; 4]; FIELDS]>,
) -> Vec<u8> {
    let mut cdr = Cdr::new();
    let (count, step) = (returns.len() as u32, 4 * FIELDS as u32);
    cdr.header(stamp_ns, VEHICLE);
    [1, count, FIELDS as u32].into_iter().for_each(|n| cdr.word(n));
    (0..).zip(fields).for_each(|(n, (name, kind))| cdr.field(name, 4 * n, *kind));
    // Little-endian.
    cdr.byte(0);
    cdr.word(step);
    cdr.word(step * count);
    cdr.bytes(|bytes| {
        bytes.reserve((step * count) as usize);
        returns.for_each(|one| bytes.extend_from_slice(one.as_flattened()));
    });
    // `is_dense`: coordinates may be missing.
    cdr.byte(0);
    cdr.message()
}
