//! Sources of sweeps: recorded clouds with the vehicle's poses.
//!
//! | format | clouds | poses |
//! |---|---|---|
//! | [`Format::KittiRaw`] | `velodyne_points/data/N.bin` | `poses.txt` or `oxts/data/N.txt` |
//! | [`Format::KittiOdometry`] | `velodyne/N.bin` | `poses.txt` of the camera, with `calib.txt` |
//! | [`Format::Argoverse2`] | `sensors/lidar/NS.feather` | `city_SE3_egovehicle.feather` |
//! | [`Format::NuScenes`] | `LIDAR_TOP` of a scene in `sample_data.json` | `ego_pose.json` |
//! | [`Format::Waymo`] | range images in `lidar/SEGMENT.parquet` | `vehicle_pose` next to it |
//! | [`Format::Clouds`] | `*.bin`, `*.npy`, `*.pcd` or `*.ply` | a named file, PCD's `VIEWPOINT` |
//! | [`Format::Mcap`] | `sensor_msgs/PointCloud2` in `*.mcap` | odometry or transforms in it |
//! | [`Format::Pcap`] | packets of an Ouster or Velodyne in `*.pcap`, `*.pcapng` | a named file |
//!
//! A `.bin` is little-endian float32 x, y, z, intensity per return, or as [`BinFields`] say. Poses
//! and times are read and checked when a source is opened, clouds one at a time. A KITTI raw drive
//! of several sensors has `velodyne_points/{sensors.txt, offset_s/N.bin, sensor/N.bin}` next to its
//! clouds.

#[cfg(feature = "arrow")]
mod argoverse;
#[cfg(feature = "mcap")]
mod bag;
mod beside;
mod bin;
#[cfg(feature = "xml")]
pub mod boost;
#[cfg(feature = "pcap")]
pub mod capture;
mod clouds;
#[cfg(any(feature = "arrow", feature = "mcap"))]
pub mod decoder;
#[cfg(feature = "arrow")]
pub mod feather;
#[cfg(feature = "arrow")]
mod feather_check;
mod first_sweep;
mod kitti;
mod lzf;
mod median;
pub mod mounting;
pub mod npy;
#[cfg(feature = "nuscenes")]
mod nuscenes;
mod options;
mod oxts;
mod pcd;
pub mod plausible;
mod ply;
mod pose_files;
mod poses;
mod recognise;
mod returns;
mod sidecars;
#[cfg(feature = "simulated")]
pub mod simulated;
pub mod text;
mod trajectory;
mod viewpoints;
#[cfg(feature = "parquet")]
mod waymo;
pub mod whole;

#[cfg(test)]
pub(crate) mod tests;

use std::path::Path;

use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::{Point, Rig, Sweep};

use crate::Error;

pub use beside::beside;
pub use bin::BinFields;
use clap::ValueEnum;
pub use clouds::read_cloud;
use options::apply;
pub use options::{OpenOptions, PosesFrame, Unlocated};
pub use pose_files::{pose_rows, read_pose};
pub use poses::{PoseTrack, pose_row, rigid};
pub use recognise::recognise;

/// One sweep in memory; keep it and read into it again to reuse its memory.
#[derive(Debug, Default)]
pub struct SweepData {
    /// Number of the sweep's file: frame number, or timestamp in ns for Argoverse 2.
    pub frame: u64,
    /// Time of the sweep's stamp, s; since the first sweep, or as given by the source's
    /// `times.txt`.
    pub stamp_s: f64,
    /// Returns in the order of the file, all of them, including NaN and infinite ones.
    pub points: Vec<Point>,
    /// Pose of the vehicle at the stamp.
    pub world_from_vehicle: Pose,
    /// Velocity of the vehicle, along its axes at the stamp.
    pub twist: Twist,
    /// What the source lacks at this sweep.
    pub dropped: SourceGaps,
}

impl Clone for SweepData {
    fn clone(&self) -> SweepData {
        let mut copy = SweepData::default();
        copy.clone_from(self);
        copy
    }

    /// Reuses the memory of the returns, unlike a derived one.
    fn clone_from(&mut self, from: &SweepData) {
        let mut points = std::mem::take(&mut self.points);
        points.clone_from(&from.points);
        *self = SweepData { points, ..*from };
    }
}

impl SweepData {
    /// The sweep as the core takes it.
    pub fn sweep(&self) -> Sweep<'_> {
        Sweep {
            stamp_s: self.stamp_s,
            points: &self.points,
            world_from_vehicle: self.world_from_vehicle,
            twist: self.twist,
        }
    }
}

/// What a source lacks at a sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SourceGaps {
    /// Sweeps missing between the previous one and this one, according to the frame numbers.
    pub sweeps_before: u64,
    /// Rows without a coordinate (null in a feather file); their points hold NaN.
    pub null_rows: u32,
}

/// What is known of a recording before any of its clouds is read.
#[derive(Clone)]
pub struct Overview {
    /// Name of the log's or drive's folder.
    pub name: String,
    /// Sensors, timing and vehicle frame.
    pub rig: Rig,
    /// File number (or timestamp in ns) of every sweep; at least one.
    pub frames: Vec<u64>,
    /// Stamp of every sweep, and its pose if poses are known.
    pub track: PoseTrack,
    /// Time of the first stamp since 1970, ns; 0 if the recording does not contain it.
    pub epoch_ns: u64,
    /// Whether to use the poses without checking them.
    pub trusted: bool,
    /// Notes for the user: assumptions, gaps in frame numbers.
    pub notes: Vec<String>,
}

impl Overview {
    /// Fills in what is known of the sweep with this index: everything but its points and what the
    /// source lacks there.
    fn begin(&self, index: usize, sweep: &mut SweepData) {
        sweep.frame = self.frames[index];
        sweep.stamp_s = self.track.stamps_s[index];
        let known = self.track.poses.get(index);
        sweep.world_from_vehicle = known.copied().unwrap_or(Pose::IDENTITY);
        sweep.twist = known.map_or(Twist::ZERO, |_| self.track.twist(index));
    }

    /// Number of sweeps missing before one, according to the frame numbers.
    fn missing_before(&self, index: usize) -> u64 {
        index.checked_sub(1).map_or(0, |before| self.frames[index] - self.frames[before] - 1)
    }

    /// Number of sweeps and time from the first to the last, for messages.
    fn length(&self) -> String {
        format!("{} sweeps, {:.1} s", self.frames.len(), self.track.duration_s())
    }
}

/// A recording. Indices of sweeps are below [`Source::len`].
pub trait Source: Send {
    /// What is known before a cloud is read.
    fn overview(&self) -> &Overview;

    /// One line for users: format, folder, number of sweeps, duration, where the poses are from.
    fn describe(&self) -> String;

    /// Reads a sweep; the contents of `into` are replaced and its memory reused.
    ///
    /// Fails if the file is unreadable or damaged; `into` then holds no points.
    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error>;

    /// Extension of cloud files like its own; `None` if clouds come as messages or packets.
    fn extension(&self) -> Option<&str> {
        Some("bin")
    }

    /// See [`Overview::name`].
    fn name(&self) -> &str {
        &self.overview().name
    }

    /// See [`Overview::rig`].
    fn rig(&self) -> &Rig {
        &self.overview().rig
    }

    /// Number of sweeps, at least 1.
    fn len(&self) -> usize {
        self.overview().frames.len()
    }

    /// Never true: a source without sweeps does not open.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// See [`Overview::frames`].
    fn frame(&self, index: usize) -> u64 {
        self.overview().frames[index]
    }

    /// [`SweepData::stamp_s`] of a sweep.
    fn stamp_s(&self, index: usize) -> f64 {
        self.overview().track.stamps_s[index]
    }

    /// Whether poses are known. Otherwise sweeps are read with the identity.
    fn is_located(&self) -> bool {
        !self.overview().track.poses.is_empty()
    }

    /// `world_from_vehicle` at the stamp of a sweep, if the source is located.
    fn pose(&self, index: usize) -> Pose {
        self.overview().track.poses[index]
    }

    /// See [`Overview::notes`].
    fn notes(&self) -> &[String] {
        &self.overview().notes
    }
}

/// How a format is recognised and opened.
struct FormatRow {
    kind: Format,
    /// What a folder of it contains, for messages.
    marks: &'static [&'static str],
    /// Whether a folder has this format.
    holds: fn(&Path) -> Result<bool, Error>,
    /// Extensions of files that have this format.
    files: &'static [&'static str],
    /// Whether [`OpenOptions::topics`] select within it.
    topics: bool,
    open: fn(&Path, &OpenOptions) -> Opened,
}

type Opened = Result<Box<dyn Source>, Error>;

/// [`Format`] and the properties of every format.
macro_rules! formats {
    ($($(#[$meta:meta])* $kind:ident {
        marks: $marks:expr, holds: $holds:expr, files: $files:expr, topics: $topics:literal,
        open: $open:path $(, if $feature:tt: $is:literal)?
    })*) => {
        /// Kinds of recordings.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
        pub enum Format {
            $($(#[$meta])* $kind,)*
        }

        /// In the order in which they are tried on a folder.
        const FORMATS: &[FormatRow] = &[$(FormatRow {
            kind: Format::$kind,
            marks: &$marks,
            holds: $holds,
            files: &$files,
            topics: $topics,
            open: opened!($open $(, $feature, $is)?),
        }),*];
    };
}

/// The function that opens a format, or reports which feature it needs.
macro_rules! opened {
    ($open:path) => {
        |root, options| Ok(Box::new($open(root, options)?))
    };
    ($open:path, $feature:tt, $is:literal) => {{
        #[cfg(feature = $feature)]
        fn open(root: &Path, options: &OpenOptions) -> Opened {
            Ok(Box::new($open(root, options)?))
        }
        #[cfg(not(feature = $feature))]
        fn open(root: &Path, _: &OpenOptions) -> Opened {
            Err(Error::missing_feature(
                format!(concat!("{}, ", $is, ","), root.display()),
                $feature,
            ))
        }
        open
    }};
}

formats! {
    /// A KITTI raw drive.
    #[value(name = "kitti")]
    KittiRaw {
        marks: ["velodyne_points/data"], holds: |p| Ok(p.join("velodyne_points/data").is_dir()),
        files: [], topics: false, open: kitti::open_raw
    }
    /// An Argoverse 2 sensor log.
    #[value(name = "argoverse")]
    Argoverse2 {
        marks: ["sensors/lidar"], holds: |p| Ok(p.join("sensors/lidar").is_dir()),
        files: [], topics: false,
        open: argoverse::Argoverse::open, if "arrow": "an Argoverse 2 log"
    }
    /// A sequence of KITTI's odometry benchmark (or SemanticKITTI).
    KittiOdometry {
        marks: ["velodyne"], holds: |p| Ok(p.join("velodyne").is_dir()),
        files: [], topics: false, open: kitti::open_odometry
    }
    /// Waymo Open Dataset segments in Parquet.
    Waymo {
        marks: ["lidar_calibration"], holds: recognise::is_waymo,
        files: [], topics: true, open: waymo::Waymo::open, if "parquet": "a Waymo dataset"
    }
    /// nuScenes scenes.
    #[value(name = "nuscenes")]
    NuScenes {
        marks: [recognise::SCENES], holds: recognise::is_nuscenes,
        files: [], topics: true, open: nuscenes::NuScenes::open, if "nuscenes": "a nuScenes dataset"
    }
    /// A ROS recording: an `.mcap` file, or a folder of them.
    Mcap {
        marks: ["*.mcap"], holds: |p| recognise::has_extension(p, recognise::MCAP),
        files: [recognise::MCAP], topics: true,
        open: bag::Bag::open, if "mcap": "an MCAP recording"
    }
    /// Packets of an Ouster or Velodyne sensor in a `.pcap` or `.pcapng` file.
    Pcap {
        marks: [], holds: |_| Ok(false), files: ["pcap", "pcapng"], topics: true,
        open: capture::Capture::open, if "pcap": "a packet capture"
    }
    /// A folder of `.bin`, `.npy`, `.pcd` or `.ply` clouds.
    #[value(alias = "bin")]
    Clouds {
        marks: ["*.bin", "*.npy", "*.pcd", "*.ply"],
        holds: |p| Ok(recognise::extensions(p)?.next().is_some()),
        files: [], topics: false, open: kitti::open_folder
    }
}

impl Format {
    fn row(self) -> &'static FormatRow {
        FORMATS.iter().find(|row| row.kind == self).expect("every format has a row")
    }
}

/// Opens the recording at `path`, or the only one in a folder below it.
///
/// Fails if no known format is recognised, if poses (unless it may come without), times or
/// calibration are missing, do not match the sweeps or make no sense, and if this build cannot read
/// the format.
pub fn open(path: &Path, options: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    if let Some(ground_m) = options.ground_m {
        plausible::ground(ground_m).map_err(Error::Usage)?;
    }
    let (format, root) = match options.format {
        Some(format) => (format, path.to_path_buf()),
        None => recognise(path)?,
    };
    if !format.row().topics && !options.topics.is_empty() {
        let names = FORMATS.iter().filter(|r| r.topics).filter_map(|r| r.kind.to_possible_value());
        let names: Vec<_> = names.map(|n| n.get_name().to_string()).collect();
        let what = format!("--topic applies only to recordings in {}", names.join(", "));
        return Err(Error::Usage(what));
    }
    if format != Format::Mcap && options.extrinsics.is_some() {
        return Err(Error::Usage("--extrinsics applies only to MCAP recordings".into()));
    }
    let source = (format.row().open)(&root, options)?;
    plausible::check(source.overview()).map_err(|what| Error::input(&root, "", what))?;
    Ok(source)
}

/// Last component of a path, resolved so that `.` has a name too.
fn folder_name(path: &Path) -> String {
    let full = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    full.file_name().map_or_else(|| "recording".into(), |n| n.to_string_lossy().into_owned())
}
