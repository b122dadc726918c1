//! Results as ROS 2 messages, in an MCAP file or to connected viewers, for Foxglove, Lichtblick,
//! Rerun, rviz, Autoware (`ros2 bag play`) and anything else that reads them.
//!
//! | topic | message | content |
//! |---|---|---|
//! | `/tf` | `tf2_msgs/TFMessage` | the vehicle in the world, according to the poses |
//! | `/raywake/points` | `sensor_msgs/PointCloud2` | returns of a sweep with their flow |
//! | `/raywake/motion` | `visualization_msgs/Marker` | half a second of motion, for rviz |
//! | `/raywake/scene` | `foxglove_msgs/SceneUpdate` | the same as arrows: Foxglove |
//!
//! Fields of a return, all float32 but the last: `x y z` (m) and `intensity`; `velocity_x
//! velocity_y` (over ground, along the vehicle's axes) and `speed`, m/s; `p_moves`; `status`, a
//! uint8: the number of a [`raywake_core::output::Status`].
//!
//! A stream of objects has these in place of all but the first:
//!
//! | topic | message | content |
//! |---|---|---|
//! | `/raywake/tracked_points` | `sensor_msgs/PointCloud2` | returns: `x y z intensity`, `track` |
//! | `/raywake/objects` | `visualization_msgs/Marker` | a box for each object, red if it moves |
//! | `/raywake/scene` | `foxglove_msgs/SceneUpdate` | boxes, arrows, names, all attributes |
//! | `/raywake/tracked_objects` | `autoware_perception_msgs/TrackedObjects` | for Autoware |
//!
//! A stream of both has all but `/raywake/tracked_points`. A stream of clouds has `/tf` and
//! `/points`: `x y z intensity`, and `time`, s after the stamp.
//!
//! `track` is an int32, the number of the return's track, or -1; the track's marker has the same
//! number.

pub(crate) mod cdr;
mod file;
#[cfg_attr(not(feature = "live"), path = "live_absent.rs")]
mod live;
mod markers;
mod points;
mod scene;
mod schemas;
mod tracked;

use std::path::PathBuf;

use raywake_core::output::{ColumnFlow, PairFlows};
use raywake_core::pose::Pose;
use raywake_core::sweep::Point;
use raywake_objects::tracked::TrackedObject;

use super::streams::{Content, StreamTargets};
use crate::Error;
use crate::source::SweepData;
use cdr::Cdr;
use file::MessageFile;
use live::LiveServer;
use schemas::{MARKER, POINT_CLOUD, SCENE, Schema, TRACKED_OBJECTS, TRANSFORMS};

/// Frames of the messages.
const WORLD: &str = "world";
const VEHICLE: &str = "vehicle";

/// How far ahead in time a line or an arrow shows a motion, s.
const AHEAD_S: f32 = 0.5;
/// Width of a line, m.
const LINE_M: f64 = 0.08;
/// Colour of anything moving: red, green, blue, opacity.
const MOVING: [f32; 4] = [0.84, 0.15, 0.16, 1.0];
/// Colour of a stationary object.
const STATIONARY: [f32; 4] = [0.45, 0.5, 0.6, 0.6];
/// How long a box is shown after its sweep, ns: a few sweeps of most sensors.
const BOX_SHOWN_NS: u32 = 250_000_000;

/// A topic: its name and the definition of its messages.
type Topic = (&'static str, Schema);

const TF: Topic = ("/tf", TRANSFORMS);
const POINTS: Topic = ("/raywake/points", POINT_CLOUD);
const TRACKED_POINTS: Topic = ("/raywake/tracked_points", POINT_CLOUD);
const CLOUDS: Topic = ("/points", POINT_CLOUD);
const MOTION: Topic = ("/raywake/motion", MARKER);
const BOXES: Topic = ("/raywake/objects", MARKER);
const SCENES: Topic = ("/raywake/scene", SCENE);
const TRACKED: Topic = ("/raywake/tracked_objects", TRACKED_OBJECTS);

/// The topics of a stream.
const fn topics(content: Content) -> &'static [Topic] {
    match content {
        Content::Flow => &[TF, POINTS, MOTION, SCENES],
        Content::Clouds => &[TF, CLOUDS],
        Content::FlowAndObjects => &[TF, POINTS, MOTION, BOXES, SCENES, TRACKED],
        Content::Objects => &[TF, TRACKED_POINTS, BOXES, SCENES, TRACKED],
    }
}

/// A stream of messages. Its file takes its name when it is finished.
pub struct BagSink {
    file: Option<MessageFile>,
    live: Option<LiveServer>,
    topics: &'static [Topic],
    /// Added to stamps, ns.
    epoch_ns: u64,
}

impl BagSink {
    /// Begins a stream, unless it goes nowhere; `epoch_ns` is added to the sweeps' stamps.
    ///
    /// # Errors
    /// If the file cannot be written or the address is not available, with the system's reason.
    pub fn create(
        streams: &StreamTargets,
        epoch_ns: u64,
        content: Content,
    ) -> Result<Option<BagSink>, Error> {
        let topics = topics(content);
        let file =
            streams.mcap.as_ref().map(|path| MessageFile::create(path, topics)).transpose()?;
        let live = streams.live;
        let live = live.map(|address| LiveServer::start(address, streams.pace, topics));
        let live = live.transpose()?;
        let is_wanted = file.is_some() || live.is_some();
        Ok(is_wanted.then_some(BagSink { file, live, topics, epoch_ns }))
    }

    /// Sets what is added to the sweeps' stamps from now on, ns.
    pub fn since(&mut self, epoch_ns: u64) {
        self.epoch_ns = epoch_ns;
    }

    /// Whether a viewer is watching; true if there is no server.
    pub fn has_viewer(&self) -> bool {
        self.live.as_ref().is_none_or(LiveServer::has_viewer)
    }

    /// Writes a sweep and the flow of the pair that it begins.
    pub fn pair(&mut self, first: &SweepData, flows: &PairFlows) -> Result<(), Error> {
        let (stamp_ns, pose) = (self.stamp_ns(first), &first.world_from_vehicle);
        self.write(&TF, stamp_ns, transform(stamp_ns, pose))?;
        self.write(&POINTS, stamp_ns, points::with_flow(stamp_ns, first, flows))?;
        let moving: Vec<MovingColumn> =
            flows.columns.iter().filter_map(|column| MovingColumn::of(pose, column)).collect();
        self.write(&MOTION, stamp_ns, markers::lines(stamp_ns, &moving))?;
        self.write(&SCENES, stamp_ns, scene::motion(stamp_ns, &moving))
    }

    /// Writes a sweep, the track number of each of its returns (-1: none) and the objects in it.
    pub fn objects(
        &mut self,
        sweep: &SweepData,
        tracks: &[i32],
        objects: &[TrackedObject],
    ) -> Result<(), Error> {
        let stamp_ns = self.stamp_ns(sweep);
        self.write(&TF, stamp_ns, transform(stamp_ns, &sweep.world_from_vehicle))?;
        self.write(&TRACKED_POINTS, stamp_ns, points::with_tracks(stamp_ns, sweep, tracks))?;
        self.boxes(sweep, objects)
    }

    /// Writes the objects in a sweep that was already written.
    pub fn boxes(&mut self, sweep: &SweepData, objects: &[TrackedObject]) -> Result<(), Error> {
        let stamp_ns = self.stamp_ns(sweep);
        for object in objects {
            self.write(&BOXES, stamp_ns, markers::cube(stamp_ns, object))?;
        }
        self.write(&SCENES, stamp_ns, scene::objects(stamp_ns, objects))?;
        self.write(&TRACKED, stamp_ns, tracked::objects(stamp_ns, objects))
    }

    /// Writes a sweep with only these returns.
    pub fn cloud(&mut self, sweep: &SweepData, returns: &[Point]) -> Result<(), Error> {
        let stamp_ns = self.stamp_ns(sweep);
        self.write(&TF, stamp_ns, transform(stamp_ns, &sweep.world_from_vehicle))?;
        self.write(&CLOUDS, stamp_ns, points::alone(stamp_ns, returns))
    }

    fn stamp_ns(&self, sweep: &SweepData) -> u64 {
        self.epoch_ns.saturating_add((sweep.stamp_s * 1e9).round() as u64)
    }

    fn write(&mut self, topic: &Topic, time_ns: u64, message: Vec<u8>) -> Result<(), Error> {
        let Some(channel) = self.topics.iter().position(|t| t.0 == topic.0) else { return Ok(()) };
        if let Some(live) = &mut self.live {
            live.write(channel, time_ns, &message);
        }
        self.file.as_mut().map_or(Ok(()), |file| file.write(channel, time_ns, &message))
    }

    /// Completes the file and closes the connections to viewers.
    pub fn finish(self) -> Result<(), Error> {
        self.live.into_iter().for_each(LiveServer::finish);
        self.file.map_or(Ok(()), MessageFile::finish)
    }

    /// Keeps what has been written to the file so far, without an index, under another name, which
    /// is returned if there is a file.
    pub fn keep_incomplete(self) -> Option<Result<PathBuf, Error>> {
        self.live.into_iter().for_each(LiveServer::finish);
        self.file.map(MessageFile::keep_incomplete)
    }
}

/// A moving column, in the vehicle's frame.
struct MovingColumn {
    /// m.
    at: [f32; 2],
    /// Over ground, m/s.
    velocity: [f32; 2],
}

impl MovingColumn {
    fn of(pose: &Pose, column: &ColumnFlow) -> Option<MovingColumn> {
        let moves = column.velocity_world_mps != [0.0; 2];
        let velocity = pose.along_axes(column.velocity_world_mps);
        moves.then_some(MovingColumn { at: column.position_vehicle_m, velocity })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layout_for_foxglove_names_the_topics() {
        let layout = include_str!("../../../../../examples/foxglove_layout.json");
        for content in [Content::FlowAndObjects, Content::Objects] {
            for (topic, _) in topics(content).iter().filter(|(topic, _)| *topic != TF.0) {
                assert!(layout.contains(&format!("\"{topic}\"")), "{topic}");
            }
        }
        assert!(
            [VEHICLE, WORLD].iter().all(|frame| layout.contains(&format!("\"frame:{frame}\"")))
        );
    }

    #[test]
    fn every_named_definition_exists() {
        for (topic, schema) in
            [Content::FlowAndObjects, Content::Objects].into_iter().flat_map(topics)
        {
            let text = schema.text();
            let kinds = text.lines().filter(|l| l.contains('/') && !l.starts_with("MSG"));
            for kind in kinds.filter_map(|line| line.split([' ', '[']).next()) {
                assert!(text.contains(&format!("MSG: {kind}\n")), "{kind} of {topic}");
            }
        }
    }
}
