//! Results as a recording of ROS 2 in an MCAP file, for Foxglove, Lichtblick, Rerun, rviz
//! (`ros2 bag play`) and whoever else reads those.
//!
//! | topic | message | what |
//! |---|---|---|
//! | `/tf` | `tf2_msgs/TFMessage` | the vehicle in the world, as the poses have it |
//! | `/raywake/points` | `sensor_msgs/PointCloud2` | returns of a sweep with their flow |
//! | `/raywake/motion` | `visualization_msgs/Marker` | half a second of motion of what moves |
//!
//! Fields of a return, all float32 but the last: `x y z` (m) and `intensity`; `velocity_x
//! velocity_y` (over ground, along the vehicle's axes) and `speed`, m/s; `p_moves`; `status`, a
//! uint8: the number of a [`raywake_core::output::Status`].
//!
//! A recording of objects has, in place of the last two:
//!
//! | topic | message | what |
//! |---|---|---|
//! | `/raywake/points` | `sensor_msgs/PointCloud2` | returns: `x y z intensity`, and `track` |
//! | `/raywake/objects` | `visualization_msgs/Marker` | a box for each object, red where it moves |
//!
//! `track` is an int32, the number of the return's track, or -1; a marker has the same number.

pub(crate) mod cdr;
mod schemas;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};
use raywake_core::output::{ColumnFlow, PairFlows, PointFlow};
use raywake_core::pose::Pose;
use raywake_core::sweep::Point;

use super::atomic::Partial;
use super::objects::{BoxMark, Content};
use crate::Error;
use crate::source::SweepData;
use cdr::Cdr;
use schemas::{MARKER, POINT_CLOUD, Schema, TRANSFORMS};

/// Frames of what is written.
const WORLD: &str = "world";
const VEHICLE: &str = "vehicle";

/// How far ahead in time a line shows a motion, s.
const AHEAD_S: f32 = 0.5;
/// Width of a line, m.
const LINE_M: f64 = 0.08;
/// Colour of what moves: red, green, blue, opacity.
const MOVING: [f32; 4] = [0.84, 0.15, 0.16, 1.0];
/// Colour of an object that stands.
const STANDING: [f32; 4] = [0.45, 0.5, 0.6, 0.6];
/// `CUBE` and `LINE_LIST` of `visualization_msgs/Marker`.
const CUBE: u32 = 1;
const LINE_LIST: u32 = 5;
/// How long a box is shown after its sweep, ns: some sweeps of most sensors.
const BOX_SHOWN_NS: u32 = 250_000_000;

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
    // Three bytes after it are not used, so that numbers stay aligned.
    ("status", UINT8),
];
/// Fields of a return with its track.
const WITH_TRACK: [(&str, u8); 5] =
    [("x", FLOAT32), ("y", FLOAT32), ("z", FLOAT32), ("intensity", FLOAT32), ("track", INT32)];

/// A file while it is written; it takes its name when it is finished.
pub struct BagSink {
    writer: Writer<BufWriter<File>>,
    partial: Partial,
    /// Channels of transforms, returns and marks.
    channels: [u16; 3],
    sequence: u32,
    /// Added to stamps, ns.
    epoch_ns: u64,
}

impl BagSink {
    /// Begins a file; `epoch_ns` is added to the sweeps' stamps. Fails with the system's reason
    /// where it cannot be written.
    pub fn create(path: &Path, epoch_ns: u64, content: Content) -> Result<BagSink, Error> {
        let (partial, file) = Partial::create(path)?;
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("raywake ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4));
        let marks = match content {
            Content::Flow => "/raywake/motion",
            Content::Objects => "/raywake/objects",
        };
        let begin = || -> mcap::McapResult<_> {
            let mut writer = options.create(file)?;
            let mut channel = |schema: &Schema, topic: &str| {
                let text = schema.text();
                let schema = writer.add_schema(schema.name, "ros2msg", text.as_bytes())?;
                writer.add_channel(schema, topic, "cdr", &BTreeMap::new())
            };
            let channels = [
                channel(&TRANSFORMS, "/tf")?,
                channel(&POINT_CLOUD, "/raywake/points")?,
                channel(&MARKER, marks)?,
            ];
            Ok((writer, channels))
        };
        let (writer, channels) = begin().map_err(|e| partial.error(e))?;
        Ok(BagSink { writer, partial, channels, sequence: 0, epoch_ns })
    }

    /// Writes a sweep and the flow of a pair that it begins.
    pub fn pair(&mut self, first: &SweepData, flows: &PairFlows) -> Result<(), Error> {
        let (stamp_ns, pose) = (self.stamp_ns(first), &first.world_from_vehicle);
        self.write(0, stamp_ns, transform(stamp_ns, pose))?;
        let returns = first.points.iter().zip(flows.points.iter());
        let returns = returns.map(|(point, flow)| with_flow(pose, point, flow));
        self.write(1, stamp_ns, cloud(stamp_ns, &WITH_FLOW, returns))?;
        self.write(2, stamp_ns, motion(stamp_ns, pose, flows.columns))
    }

    /// Writes a sweep, the number of the track of each of its returns (-1: of none), and the
    /// objects in it.
    pub fn objects(
        &mut self,
        sweep: &SweepData,
        tracks: &[i32],
        objects: impl Iterator<Item = BoxMark>,
    ) -> Result<(), Error> {
        let stamp_ns = self.stamp_ns(sweep);
        self.write(0, stamp_ns, transform(stamp_ns, &sweep.world_from_vehicle))?;
        let returns = sweep.points.iter().zip(tracks);
        let returns = returns.map(|(point, track)| with_track(point, *track));
        self.write(1, stamp_ns, cloud(stamp_ns, &WITH_TRACK, returns))?;
        objects.map(|object| cube(stamp_ns, &object)).try_for_each(|m| self.write(2, stamp_ns, m))
    }

    fn stamp_ns(&self, sweep: &SweepData) -> u64 {
        self.epoch_ns.saturating_add((sweep.stamp_s * 1e9).round() as u64)
    }

    fn write(&mut self, channel: usize, time_ns: u64, message: Vec<u8>) -> Result<(), Error> {
        let header = MessageHeader {
            channel_id: self.channels[channel],
            sequence: self.sequence,
            log_time: time_ns,
            publish_time: time_ns,
        };
        self.sequence = self.sequence.wrapping_add(1);
        let written = self.writer.write_to_known_channel(&header, &message);
        written.map_err(|e| self.partial.error(e))
    }

    /// Completes the file.
    pub fn finish(mut self) -> Result<(), Error> {
        self.writer.finish().map_err(|e| self.partial.error(e))?;
        self.partial.keep()
    }
}

/// The vehicle in the world.
fn transform(stamp_ns: u64, pose: &Pose) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.word(1);
    cdr.header(stamp_ns, WORLD);
    cdr.text(VEHICLE);
    cdr.pose(pose);
    cdr.message()
}

/// Velocity over ground along the vehicle's axes; the plane's part of it.
fn along_vehicle(pose: &Pose, [x, y]: [f32; 2]) -> [f32; 2] {
    let v = pose.rotation.conjugate() * glam::dvec3(x.into(), y.into(), 0.0);
    [v.x as f32, v.y as f32]
}

/// Fields of a return as [`WITH_FLOW`] names them.
fn with_flow(pose: &Pose, point: &Point, flow: PointFlow) -> [[u8; 4]; WITH_FLOW.len()] {
    let [x, y, z] = point.position.map(f32::to_le_bytes);
    let [vx, vy] = along_vehicle(pose, flow.velocity_world_mps);
    let [i, vx, vy, speed, p] =
        [point.intensity, vx, vy, vx.hypot(vy), flow.probability].map(f32::to_le_bytes);
    [x, y, z, i, vx, vy, speed, p, [flow.status as u8, 0, 0, 0]]
}

/// Fields of a return as [`WITH_TRACK`] names them.
fn with_track(point: &Point, track: i32) -> [[u8; 4]; WITH_TRACK.len()] {
    let [x, y, z] = point.position.map(f32::to_le_bytes);
    [x, y, z, point.intensity.to_le_bytes(), track.to_le_bytes()]
}

/// Returns with these fields, in the vehicle's frame.
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
    // Least significant byte first.
    cdr.byte(0);
    cdr.word(step);
    cdr.word(step * count);
    cdr.bytes(|bytes| {
        bytes.reserve((step * count) as usize);
        returns.for_each(|one| bytes.extend_from_slice(one.as_flattened()));
    });
    // Whether no coordinate may be missing.
    cdr.byte(0);
    cdr.message()
}

/// The box of an object.
fn cube(stamp_ns: u64, object: &BoxMark) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, WORLD);
    cdr.text("objects");
    [object.id, CUBE, 0].into_iter().for_each(|n| cdr.word(n));
    let (sin, cos) = (0.5 * object.heading).sin_cos();
    let size = object.size.map(|v| f64::from(v).max(LINE_M));
    cdr.doubles(object.centre.into_iter().chain([0.0, 0.0, sin, cos]).chain(size));
    let colour = if object.moves { MOVING } else { STANDING };
    colour.into_iter().for_each(|v| cdr.float(v));
    [0, BOX_SHOWN_NS].into_iter().for_each(|n| cdr.word(n));
    cdr.byte(0);
    cdr.word(0);
    without_looks(&mut cdr);
    cdr.message()
}

/// Lines along the motion of columns that move; they last until the next sweep's.
fn motion(stamp_ns: u64, pose: &Pose, columns: &[ColumnFlow]) -> Vec<u8> {
    let moving = columns.iter().filter(|c| c.velocity_world_mps != [0.0; 2]);
    let lines: Vec<[[f32; 2]; 2]> = moving
        .map(|column| {
            let v = along_vehicle(pose, column.velocity_world_mps);
            let [x, y] = column.position_vehicle_m;
            [[x, y], [x + AHEAD_S * v[0], y + AHEAD_S * v[1]]]
        })
        .collect();
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, VEHICLE);
    cdr.text("motion");
    // Number, type, and to add or replace it.
    [0, LINE_LIST, 0].into_iter().for_each(|n| cdr.word(n));
    // Pose and scale.
    cdr.doubles([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, LINE_M, 0.0, 0.0]);
    MOVING.into_iter().for_each(|v| cdr.float(v));
    // It lasts, and stays in its frame.
    [0, 0].into_iter().for_each(|n| cdr.word(n));
    cdr.byte(1);
    cdr.word(2 * lines.len() as u32);
    lines.as_flattened().iter().for_each(|[x, y]| cdr.doubles([(*x).into(), (*y).into(), 0.0]));
    without_looks(&mut cdr);
    cdr.message()
}

/// The rest of a marker that has no colours of points, no texture, no text and no mesh.
fn without_looks(cdr: &mut Cdr) {
    cdr.word(0);
    cdr.text("");
    cdr.header(0, "");
    cdr.text("");
    cdr.bytes(|_| ());
    cdr.word(0);
    ["", "", ""].into_iter().for_each(|text| cdr.text(text));
    cdr.bytes(|_| ());
    cdr.byte(0);
}
