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
/// `LINE_LIST` of `visualization_msgs/Marker`.
const LINE_LIST: u32 = 5;

/// Names of the fields of a return that are float32, and of the one that is uint8.
const FLOATS: [&str; 8] =
    ["x", "y", "z", "intensity", "velocity_x", "velocity_y", "speed", "p_moves"];
const STATUS: &str = "status";
/// Bytes of a return: with three that are not used, so that numbers stay aligned.
const STEP: u32 = 4 * FLOATS.len() as u32 + 4;
/// `FLOAT32` and `UINT8` of `sensor_msgs/PointField`.
const FLOAT32: u8 = 7;
const UINT8: u8 = 2;

/// A file while it is written; it takes its name when it is finished.
pub struct BagSink {
    writer: Writer<BufWriter<File>>,
    partial: Partial,
    /// Channels of transforms, returns and lines.
    channels: [u16; 3],
    sequence: u32,
    /// Added to stamps, ns.
    epoch_ns: u64,
}

impl BagSink {
    /// Begins a file; `epoch_ns` is added to the sweeps' stamps. Fails with the system's reason
    /// where it cannot be written.
    pub fn create(path: &Path, epoch_ns: u64) -> Result<BagSink, Error> {
        let (partial, file) = Partial::create(path)?;
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("raywake ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4));
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
                channel(&MARKER, "/raywake/motion")?,
            ];
            Ok((writer, channels))
        };
        let (writer, channels) = begin().map_err(|e| partial.error(e))?;
        Ok(BagSink { writer, partial, channels, sequence: 0, epoch_ns })
    }

    /// Writes a sweep and the flow of a pair that it begins.
    pub fn pair(&mut self, first: &SweepData, flows: &PairFlows) -> Result<(), Error> {
        let stamp_ns = self.epoch_ns.saturating_add((first.stamp_s * 1e9).round() as u64);
        let pose = &first.world_from_vehicle;
        self.write(0, stamp_ns, transform(stamp_ns, pose))?;
        let points = first.points.iter().zip(flows.points.iter());
        self.write(1, stamp_ns, cloud(stamp_ns, pose, points))?;
        self.write(2, stamp_ns, motion(stamp_ns, pose, flows.columns))
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

/// Returns with their flow, in the vehicle's frame.
fn cloud<'a>(
    stamp_ns: u64,
    pose: &Pose,
    returns: impl ExactSizeIterator<Item = (&'a Point, PointFlow)>,
) -> Vec<u8> {
    let mut cdr = Cdr::new();
    let count = returns.len() as u32;
    cdr.header(stamp_ns, VEHICLE);
    [1, count, FLOATS.len() as u32 + 1].into_iter().for_each(|n| cdr.word(n));
    fields(&mut cdr);
    // Least significant byte first.
    cdr.byte(0);
    cdr.word(STEP);
    cdr.word(STEP * count);
    cdr.bytes(|bytes| {
        bytes.reserve((STEP * count) as usize);
        for (point, flow) in returns {
            let [x, y, z] = point.position;
            let [vx, vy] = along_vehicle(pose, flow.velocity_world_mps);
            let speed = vx.hypot(vy);
            let values = [x, y, z, point.intensity, vx, vy, speed, flow.probability];
            values.iter().for_each(|v| bytes.extend_from_slice(&v.to_le_bytes()));
            bytes.extend_from_slice(&[flow.status as u8, 0, 0, 0]);
        }
    });
    // Whether no coordinate may be missing.
    cdr.byte(0);
    cdr.message()
}

/// Definitions of the fields of a return, a number each.
fn fields(cdr: &mut Cdr) {
    let fields = FLOATS.iter().map(|name| (*name, FLOAT32)).chain([(STATUS, UINT8)]);
    (0..).zip(fields).for_each(|(n, (name, kind))| cdr.field(name, 4 * n, kind));
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
