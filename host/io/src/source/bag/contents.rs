//! What the files of a recording contain: clouds, frames, poses. One pass through each file.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use mcap::records::{MessageHeader, Record};
use raywake_core::pose::Pose;

use super::file::{BagFile, FileEnd, Place};
use super::frames::FixedFrames;
use super::messages::{self, CloudForm, CloudHeader, MessageKind, Transform};
use super::wire::Wire;
use crate::Error;
use crate::source::trajectory::Trajectory;

/// The topic of frames that never move.
const FIXED_TOPIC: &str = "tf_static";

/// A cloud that can be read.
#[derive(Clone, Copy, Debug)]
pub(super) struct CloudMessage {
    /// Index of its file.
    pub file: usize,
    pub place: Place,
    pub stamp_ns: i64,
}

/// The clouds of a topic, in the order of their times.
#[derive(Default)]
pub(super) struct CloudTopic {
    /// Of its messages: see [`Wire::new`].
    pub encoding: String,
    pub form: CloudForm,
    pub frame: String,
    pub clouds: Vec<CloudMessage>,
    /// Messages without points.
    empty: u64,
    /// Messages that are not later than the one before.
    late: u64,
    /// Messages in a different frame from the first.
    foreign: u64,
}

/// Where poses of a frame come from: a topic of odometry or of transforms.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct PoseSource {
    pub topic: String,
    pub parent: String,
    pub child: String,
}

impl fmt::Display for PoseSource {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} ({} in {})", self.topic, self.child, self.parent)
    }
}

/// What is in the files.
#[derive(Default)]
pub(super) struct Contents {
    pub topics: BTreeMap<String, CloudTopic>,
    pub fixed: FixedFrames,
    pub poses: BTreeMap<PoseSource, Trajectory>,
    /// Other topics with the names of their schemas, for errors.
    pub others: BTreeSet<String>,
    pub notes: Vec<String>,
    /// Number of transforms that are not rigid.
    wrong: u64,
}

/// A channel whose messages are used.
struct Channel {
    topic: String,
    encoding: String,
    kind: MessageKind,
}

impl Contents {
    /// Reads all files, in their order.
    pub fn read(files: &mut [BagFile]) -> Result<Contents, Error> {
        let mut contents = Contents::default();
        for (n, file) in files.iter_mut().enumerate() {
            contents.add(n, file)?;
        }
        for (topic, CloudTopic { empty, late, foreign, .. }) in &contents.topics {
            let notes = [
                (*empty, "messages without points"),
                (*late, "messages that are not later than the one before"),
                (*foreign, "messages in a different frame than the first"),
            ];
            let notes = notes.into_iter().filter(|(count, _)| *count > 0);
            contents.notes.extend(notes.map(|(n, what)| format!("{topic}: skipped {n} {what}")));
        }
        if contents.wrong > 0 {
            let note = format!("skipped {} transforms that are not rigid", contents.wrong);
            contents.notes.push(note);
        }
        contents.topics.retain(|_, topic| !topic.clouds.is_empty());
        contents.poses.values_mut().for_each(Trajectory::sort);
        Ok(contents)
    }

    fn add(&mut self, number: usize, file: &mut BagFile) -> Result<(), Error> {
        let path = file.path.clone();
        let (mut schemas, mut channels) = (BTreeMap::new(), BTreeMap::new());
        let end = file.walk(|place, record| {
            match record {
                Record::Schema { header, .. } => {
                    schemas.insert(header.id, header.name);
                }
                Record::Channel(channel) => {
                    let schema = schemas.get(&channel.schema_id).map_or("", String::as_str);
                    let id = channel.id;
                    self.channel(channel, schema).map(|channel| channels.insert(id, channel));
                }
                Record::Message { header, data } => {
                    let Some(channel) = channels.get(&header.channel_id) else { return Ok(()) };
                    let at = CloudMessage { file: number, place, stamp_ns: 0 };
                    self.message(channel, &header, at, &data).map_err(|what| {
                        let at = format!("byte {}, topic {}", place.record, channel.topic);
                        Error::input(&path, at, what)
                    })?;
                }
                _ => {}
            }
            Ok(())
        })?;
        if let FileEnd::Cut(at) = end {
            let name = path.file_name().unwrap_or_default().display();
            self.notes.push(format!("{name} is cut off: read up to byte {at}"));
        }
        Ok(())
    }

    /// Returns the channel if its messages are used; otherwise notes its topic.
    fn channel(&mut self, channel: mcap::records::Channel, schema: &str) -> Option<Channel> {
        let mcap::records::Channel { topic, message_encoding: encoding, .. } = channel;
        let known = ["cdr", "ros1"].contains(&encoding.as_str());
        let kind = MessageKind::of(schema).filter(|_| known);
        if kind.is_none() {
            self.others.insert(format!("{topic} ({schema})"));
        }
        Some(Channel { topic, encoding, kind: kind? })
    }

    fn message(
        &mut self,
        channel: &Channel,
        header: &MessageHeader,
        at: CloudMessage,
        data: &[u8],
    ) -> Result<(), String> {
        let mut wire = Wire::new(&channel.encoding, data)?;
        match channel.kind {
            MessageKind::Cloud(form) => {
                let cloud = CloudHeader::read(form, &mut wire)?;
                self.cloud(channel, header, at, cloud, form);
            }
            MessageKind::Odometry => match messages::odometry(wire)? {
                Some(transform) => self.pose(&channel.topic, transform),
                None => self.wrong += 1,
            },
            MessageKind::Transforms => {
                let (found, wrong) = messages::transforms(wire)?;
                self.wrong += wrong;
                let fixed = channel.topic.ends_with(FIXED_TOPIC);
                found.into_iter().for_each(|transform| match fixed {
                    true => self.fixed.add(transform),
                    false => self.pose(&channel.topic, transform),
                });
            }
        }
        Ok(())
    }

    fn cloud(
        &mut self,
        channel: &Channel,
        message: &MessageHeader,
        at: CloudMessage,
        cloud: CloudHeader,
        form: CloudForm,
    ) {
        let topic = self.topics.entry(channel.topic.clone()).or_default();
        if cloud.size.contains(&0) {
            topic.empty += 1;
            return;
        }
        // A driver without a clock leaves the stamp at zero. Dates are limited to 63 bits.
        let logged_ns = || i64::try_from(message.log_time).unwrap_or(i64::MAX);
        let stamp_ns = if cloud.stamp_ns == 0 { logged_ns() } else { cloud.stamp_ns };
        match topic.clouds.last() {
            Some(last) if last.stamp_ns >= stamp_ns => topic.late += 1,
            Some(_) if topic.frame != cloud.frame => topic.foreign += 1,
            last => {
                if last.is_none() {
                    topic.frame = cloud.frame.to_owned();
                    (topic.encoding, topic.form) = (channel.encoding.clone(), form);
                }
                topic.clouds.push(CloudMessage { stamp_ns, ..at });
            }
        }
    }

    fn pose(&mut self, topic: &str, transform: Transform) {
        let Transform { stamp_ns, parent, child, parent_from_child } = transform;
        let source = PoseSource { topic: topic.to_owned(), parent, child };
        self.poses.entry(source).or_default().add(stamp_ns, parent_from_child);
    }

    /// Poses of a base at some times, from each source that has it, or a frame fixed to it, at half
    /// of the times or more.
    pub fn tracks(&self, base: &str, stamps_ns: &[i64]) -> Vec<(&PoseSource, Vec<Option<Pose>>)> {
        let tells = |(source, trajectory): (&'_ PoseSource, &Trajectory)| {
            // An odometry that names no frame describes the vehicle.
            let child = if source.child.is_empty() { base } else { &source.child };
            let (of, base_from_child) = self.fixed.base(child)?;
            let child_from_base = base_from_child.inverse();
            let pose = |ns: &i64| trajectory.at(*ns).map(|pose| pose * child_from_base);
            (of == base).then(|| stamps_ns.iter().map(pose).collect::<Vec<_>>())
        };
        let all = self.poses.iter().filter_map(|pair| Some((pair.0, tells(pair)?)));
        let enough = |poses: &[Option<Pose>]| 2 * poses.iter().flatten().count() >= poses.len();
        all.filter(|(_, poses)| enough(poses)).collect()
    }
}
