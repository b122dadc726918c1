//! ROS recordings in MCAP files: a single file, or the folder in which `ros2 bag` writes several.
//!
//! Sweeps are the clouds of a topic (`sensor_msgs/PointCloud2` or Livox's `CustomMsg`, of ROS 1 or
//! 2), or of several topics from lidars of one vehicle. The vehicle frame is the one that
//! `/tf_static` ultimately fixes the lidar to, or the cloud's own. Poses are those of the only
//! odometry or transform that gives them.
//!
//! Opening walks through every file once and records where each cloud is; a cloud is read on
//! demand. Memory grows with the file only by a few words per message.

mod contents;
mod extrinsics;
mod file;
mod frames;
mod messages;
#[cfg(test)]
pub(crate) mod tests;
mod wire;

use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec3;
use raywake_core::params::SENSORS_MAX;
use raywake_core::pose::Pose;
use raywake_core::sweep::Point;

use super::median::median;
use super::recognise::{MCAP, entries};
use super::{
    OpenOptions, Overview, PosesFrame, Source, SourceGaps, SweepData, Unlocated, first_sweep,
    folder_name, pose_files,
};
use crate::Error;
use contents::{CloudMessage, Contents};
use file::BagFile;
use messages::CloudForm;
use wire::Wire;

/// Topics whose numbers of clouds differ by more than this factor are not lidars of one rig.
const COUNT_RATIO_MAX: usize = 2;

/// A lidar.
struct Lidar {
    topic: String,
    encoding: String,
    form: CloudForm,
    vehicle_from_lidar: Pose,
}

/// An open recording.
pub(super) struct Bag {
    overview: Overview,
    root: PathBuf,
    files: Vec<BagFile>,
    lidars: Vec<Lidar>,
    /// For every sweep, the cloud of each lidar; the first lidar's is always there and gives the
    /// stamp.
    sweeps: Vec<Vec<Option<CloudMessage>>>,
    poses_from: String,
    /// The cloud that was last read.
    cloud: Vec<Point>,
}

impl Bag {
    /// Opens a file, or a folder of files.
    pub fn open(root: &Path, options: &OpenOptions) -> Result<Bag, Error> {
        let mut files = files(root)?;
        let mut contents = Contents::read(&mut files)?;
        if let Some(path) = &options.extrinsics {
            extrinsics::add(path, &mut contents)?;
        }
        let topics = choose(root, &contents, &options.topics)?;
        let (base, lidars) = lidars(root, &contents, &topics)?;
        let sensors = lidars.iter().map(|l| l.vehicle_from_lidar).collect();
        let notes = std::mem::take(&mut contents.notes);
        let mut bag = Bag {
            overview: first_sweep::before(name(root), sensors, notes, options),
            root: root.to_path_buf(),
            files,
            lidars,
            sweeps: together(&contents, &topics),
            poses_from: "registration".into(),
            cloud: Vec::new(),
        };
        bag.locate(&contents, &base, options)?;
        bag.set_stamps();
        bag.inspect_returns(options)?;
        Ok(bag)
    }

    fn stamps_ns(&self) -> Vec<i64> {
        let stamp = |sweep: &Vec<Option<CloudMessage>>| sweep[0].map_or(0, |cloud| cloud.stamp_ns);
        self.sweeps.iter().map(stamp).collect()
    }

    fn set_stamps(&mut self) {
        let stamps_ns = self.stamps_ns();
        let seconds = |ns: &i64| (ns - stamps_ns[0]) as f64 * 1e-9;
        self.overview.track.stamps_s = stamps_ns.iter().map(seconds).collect();
        self.overview.frames = stamps_ns.iter().map(|ns| ns.unsigned_abs()).collect();
        self.overview.epoch_ns = self.overview.frames[0];
    }

    /// Finds the poses of the sweeps.
    fn locate(
        &mut self,
        contents: &Contents,
        base: &str,
        options: &OpenOptions,
    ) -> Result<(), Error> {
        if options.unlocated == Unlocated::Always {
            return Ok(());
        }
        if let Some(path) = &options.poses {
            if options.poses_frame == Some(PosesFrame::Camera) {
                return Err(Error::Usage("an MCAP file has no camera frame".into()));
            }
            let poses = pose_files::read(path, &self.stamps_ns())?;
            self.take_poses(&folder_name(path), poses);
            return Ok(());
        }
        let mut tracks = contents.tracks(base, &self.stamps_ns());
        let names: Vec<String> = tracks.iter().map(|track| track.0.to_string()).collect();
        if let [name] = &names[..] {
            self.take_poses(name, tracks.remove(0).1);
            return Ok(());
        }
        let found = match names.len() {
            0 => format!("nothing gives the pose of `{base}`"),
            n => format!("{n} sources give the pose of `{base}` ({})", names.join(", ")),
        };
        options.proceed_without_poses(&self.root, &found)?;
        self.overview.notes.push(format!("{found}: using registration"));
        Ok(())
    }

    /// Takes the poses of a source. Sweeps without one are left out.
    fn take_poses(&mut self, name: &str, poses: Vec<Option<Pose>>) {
        self.poses_from = name.to_owned();
        pose_files::keep(&mut self.sweeps, &poses);
        pose_files::note_missing(&poses, name, &mut self.overview.notes);
        self.overview.track.poses = poses.into_iter().flatten().collect();
    }

    /// Learns the rest about the rig from the first sweep that has all lidars.
    fn inspect_returns(&mut self, options: &OpenOptions) -> Result<(), Error> {
        let whole = self.sweeps.iter().position(|sweep| sweep.iter().all(Option::is_some));
        let mut first = SweepData::default();
        let timed = self.read_points(whole.unwrap_or(0), &mut first)?;
        let names: Vec<&str> = self.lidars.iter().map(|lidar| lidar.topic.as_str()).collect();
        first_sweep::learn(&mut self.overview, (&first.points, timed), &names, options)
            .map_err(|what| Error::input(&self.root, "", what))
    }

    /// Replaces the points with those of a sweep; returns whether all lidars give their times.
    fn read_points(&mut self, index: usize, into: &mut SweepData) -> Result<bool, Error> {
        into.points.clear();
        let mut timed = true;
        let stamp_ns = self.sweeps[index][0].map_or(0, |cloud| cloud.stamp_ns);
        for (n, message) in self.sweeps[index].iter().enumerate() {
            let Some(message) = message else { continue };
            let (lidar, file) = (&self.lidars[n], &mut self.files[message.file]);
            let bytes = file.message(message.place)?;
            let cloud = Wire::new(&lidar.encoding, &bytes)
                .and_then(|wire| messages::cloud(lidar.form, wire, &mut self.cloud));
            timed &= cloud.map_err(|what| {
                let at = format!("byte {}, topic {}", message.place.record, lidar.topic);
                into.points.clear();
                Error::input(&file.path, at, what)
            })?;
            let later_s = ((message.stamp_ns - stamp_ns) as f64 * 1e-9) as f32;
            let pose = &lidar.vehicle_from_lidar;
            into.points.extend(self.cloud.iter().map(|point| {
                let at = pose.transform(DVec3::from_array(point.position.map(f64::from)));
                let offset_s = point.offset_s + later_s;
                Point { position: at.as_vec3().to_array(), offset_s, sensor: n as u32, ..*point }
            }));
        }
        Ok(timed)
    }
}

impl Source for Bag {
    fn overview(&self) -> &Overview {
        &self.overview
    }

    fn describe(&self) -> String {
        let topics: Vec<&str> = self.lidars.iter().map(|l| l.topic.as_str()).collect();
        format!(
            "MCAP {}: {} of {}, poses from {}",
            self.root.display(),
            self.overview.length(),
            topics.join(" and "),
            self.poses_from
        )
    }

    fn extension(&self) -> Option<&str> {
        None
    }

    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error> {
        self.overview.begin(index, into);
        into.dropped = SourceGaps::default();
        self.read_points(index, into).map(|_| ())
    }
}

/// The MCAP files at a path, ordered by name (`..._2` before `..._10`).
fn files(root: &Path) -> Result<Vec<BagFile>, Error> {
    let is_folder = fs::metadata(root).map_err(Error::reading(root))?.is_dir();
    let mut paths = if is_folder { entries(root)? } else { vec![root.to_path_buf()] };
    paths.retain(|path| !is_folder || path.extension().is_some_and(|e| e == MCAP));
    if paths.is_empty() {
        return Err(Error::input(root, "", "no `.mcap` file"));
    }
    paths.sort_by_cached_key(|path| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let digits = stem.len() - stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        let (name, number) = stem.split_at(stem.len() - digits);
        (name.to_owned(), number.parse::<u64>().ok(), stem)
    });
    paths.iter().map(|path| BagFile::open(path)).collect()
}

fn name(root: &Path) -> String {
    let name = folder_name(root);
    name.strip_suffix(&format!(".{MCAP}")).unwrap_or(&name).to_owned()
}

/// The topics whose clouds are the sweeps: those requested, the only one, or those of several
/// lidars of a vehicle.
fn choose(root: &Path, contents: &Contents, asked: &[String]) -> Result<Vec<String>, Error> {
    let wrong = |what: String| Err(Error::input(root, "", what));
    let listed: Vec<String> = contents
        .topics
        .iter()
        .map(|(name, t)| format!("{name} ({} clouds in `{}`)", t.clouds.len(), t.frame))
        .collect();
    let listed = listed.join(", ");
    if contents.topics.is_empty() {
        let others: Vec<&str> = contents.others.iter().take(8).map(String::as_str).collect();
        let others = if others.is_empty() { "nothing".into() } else { others.join(", ") };
        return wrong(format!(
            "no clouds (sensor_msgs/PointCloud2, livox CustomMsg); available: {others}"
        ));
    }
    if let Some(missing) = asked.iter().find(|name| !contents.topics.contains_key(*name)) {
        return wrong(format!("no clouds on {missing}; available: {listed}"));
    }
    if asked.len() > SENSORS_MAX {
        return wrong(format!("{} topics, at most {SENSORS_MAX}", asked.len()));
    }
    if let Some(twice) = (1..asked.len()).find(|&n| asked[..n].contains(&asked[n])) {
        return wrong(format!("--topic {} is given twice", asked[twice]));
    }
    if !asked.is_empty() {
        return Ok(asked.to_vec());
    }
    let names: Vec<String> = contents.topics.keys().cloned().collect();
    match names.len() == 1 || is_rig(contents) {
        true => Ok(names),
        false => wrong(format!("several topics have clouds, choose with --topic: {listed}")),
    }
}

/// Whether all topics of clouds are lidars of one vehicle: in separate frames that are fixed to one
/// base, with similar numbers of clouds.
fn is_rig(contents: &Contents) -> bool {
    let topics = || contents.topics.values();
    let mut frames: Vec<&str> = topics().map(|t| t.frame.as_str()).collect();
    frames.sort_unstable();
    let different = frames.windows(2).all(|pair| pair[0] != pair[1]);
    let base = |frame: &&str| contents.fixed.base(frame).map(|base| base.0);
    let mut bases = frames.iter().map(base);
    let first = bases.next().flatten();
    let counts = || topics().map(|t| t.clouds.len());
    let alike = counts().max() <= counts().min().map(|least| COUNT_RATIO_MAX * least);
    let few = contents.topics.len() <= SENSORS_MAX;
    few && different && alike && first.is_some() && bases.all(|base| base == first)
}

/// The vehicle frame, and the lidars in it.
fn lidars(
    root: &Path,
    contents: &Contents,
    topics: &[String],
) -> Result<(String, Vec<Lidar>), Error> {
    let mut lidars = Vec::new();
    let mut base: Option<String> = None;
    for name in topics {
        let topic = &contents.topics[name];
        let (own, vehicle_from_lidar) = contents.fixed.base(&topic.frame).ok_or_else(|| {
            let what = format!("the links of /tf_static form a circle from `{}`", topic.frame);
            Error::input(root, "", what)
        })?;
        if let Some(base) = base.as_ref().filter(|base| **base != own) {
            let what = format!(
                "{name} and {} are not connected: /tf_static fixes them to `{own}` and `{base}`",
                topics[0]
            );
            return Err(Error::input(root, "", what));
        }
        base = Some(own);
        let (encoding, form) = (topic.encoding.clone(), topic.form);
        lidars.push(Lidar { topic: name.clone(), encoding, form, vehicle_from_lidar });
    }
    Ok((base.unwrap_or_default(), lidars))
}

/// The sweeps of all lidars: with each cloud of the first topic, the nearest in time of every other
/// topic, if it is within half the median time between clouds.
fn together(contents: &Contents, topics: &[String]) -> Vec<Vec<Option<CloudMessage>>> {
    let clouds = |topic: &String| &contents.topics[topic].clouds;
    let first = clouds(&topics[0]);
    let steps_ns = first.windows(2).map(|pair| pair[1].stamp_ns - pair[0].stamp_ns).collect();
    let half_ns = median(steps_ns, i64::cmp).map_or(0, |step| step / 2);
    let nearest = |topic: &String, stamp_ns: i64| {
        let all = clouds(topic);
        let after = all.partition_point(|cloud| cloud.stamp_ns < stamp_ns);
        let around = &all[after.saturating_sub(1)..all.len().min(after + 1)];
        let away = |cloud: &&CloudMessage| cloud.stamp_ns.abs_diff(stamp_ns);
        around.iter().min_by_key(away).filter(|c| away(c) <= half_ns.unsigned_abs()).copied()
    };
    let of_sweep = |cloud: &CloudMessage| {
        let others = topics[1..].iter().map(|topic| nearest(topic, cloud.stamp_ns));
        std::iter::once(Some(*cloud)).chain(others).collect()
    };
    first.iter().map(of_sweep).collect()
}
