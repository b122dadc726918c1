//! Where sweeps come from: folders of recorded clouds with the vehicle's poses.
//!
//! | format | clouds | poses |
//! |---|---|---|
//! | [`Format::KittiRaw`] | `velodyne_points/data/N.bin` | `poses.txt`, else `oxts/data/N.txt` |
//! | [`Format::KittiOdometry`] | `velodyne/N.bin` | `poses.txt` of the camera, with `calib.txt` |
//! | [`Format::Argoverse2`] | `sensors/lidar/NS.feather` | `city_SE3_egovehicle.feather` |
//! | [`Format::NuScenes`] | `LIDAR_TOP` of a scene in `sample_data.json` | `ego_pose.json` |
//! | [`Format::Waymo`] | images of ranges in `lidar/SEGMENT.parquet` | `vehicle_pose` beside it |
//! | [`Format::Clouds`] | `*.bin`, `*.npy`, `*.pcd` or `*.ply` | a named file, PCD's `VIEWPOINT` |
//! | [`Format::Mcap`] | `sensor_msgs/PointCloud2` in `*.mcap` | odometry or transforms in it |
//! | [`Format::Pcap`] | packets of an Ouster or Velodyne in `*.pcap`, `*.pcapng` | a named file |
//!
//! A `.bin` is little-endian float32 x, y, z, intensity per return, or as [`BinFields`] say. Poses
//! and times are read and checked when a source is opened, clouds one at a time. A KITTI raw drive
//! of several sensors has `velodyne_points/{sensors.txt, offset_s/N.bin, sensor/N.bin}` beside its
//! clouds.

#[cfg(feature = "arrow")]
mod argoverse;
#[cfg(feature = "mcap")]
mod bag;
mod bin;
#[cfg(feature = "pcap")]
mod capture;
mod clouds;
#[cfg(feature = "parquet")]
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
mod oxts;
mod pcd;
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

#[cfg(test)]
pub(crate) mod tests;

use std::path::{Path, PathBuf};

use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::{Point, Rig, Sweep};

use crate::Error;

pub use bin::BinFields;
pub use clouds::read_cloud;
pub use pose_files::read_pose;
pub use poses::{PoseTrack, pose_row};
pub use recognise::recognise;

/// One sweep in memory; keep it and read into it again, so that its memory is reused.
#[derive(Clone, Debug, Default)]
pub struct SweepData {
    /// Number of the sweep's file: frame number, or timestamp in ns for Argoverse 2.
    pub frame: u64,
    /// Time of the sweep's stamp, s; since the first sweep, or as the source's `times.txt` has it.
    pub stamp_s: f64,
    /// Returns in the order of the file, all of them: NaN and infinite ones too.
    pub points: Vec<Point>,
    /// Pose of the vehicle at the stamp.
    pub world_from_vehicle: Pose,
    /// Velocity of the vehicle, along the axes it has at the stamp.
    pub twist: Twist,
    /// What the source lacks at this sweep.
    pub dropped: SourceGaps,
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
    /// Sweeps that frame numbers say are missing between the one before and this one.
    pub sweeps_before: u64,
    /// Rows without a coordinate (null in a feather file); their points hold NaN.
    pub null_rows: u32,
}

/// What is known of a recording before a cloud of it is read.
pub struct Overview {
    /// Name of the log's or drive's folder.
    pub name: String,
    /// Sensors, timing and frame of the vehicle.
    pub rig: Rig,
    /// File number (or timestamp in ns) of every sweep; at least one.
    pub frames: Vec<u64>,
    /// Stamp of every sweep, and pose where poses are known.
    pub track: PoseTrack,
    /// Time of the first stamp since 1970, ns; 0 where the recording does not tell.
    pub epoch_ns: u64,
    /// Whether the poses are to be used without a check.
    pub trusted: bool,
    /// What the user should know: assumptions, gaps in frame numbers.
    pub notes: Vec<String>,
}

impl Overview {
    /// Puts into `sweep` what is known of the one with this index: all but its points and what the
    /// source lacks there.
    fn begin(&self, index: usize, sweep: &mut SweepData) {
        sweep.frame = self.frames[index];
        sweep.stamp_s = self.track.stamps_s[index];
        let known = self.track.poses.get(index);
        sweep.world_from_vehicle = known.copied().unwrap_or(Pose::IDENTITY);
        sweep.twist = known.map_or(Twist::ZERO, |_| self.track.twist(index));
    }

    /// Sweeps that frame numbers say are missing before one.
    fn missing_before(&self, index: usize) -> u64 {
        index.checked_sub(1).map_or(0, |before| self.frames[index] - self.frames[before] - 1)
    }

    /// Number of sweeps and time from the first to the last, for people.
    fn length(&self) -> String {
        format!("{} sweeps, {:.1} s", self.frames.len(), self.track.duration_s())
    }
}

/// A recording. Indices of sweeps are below [`Source::len`].
pub trait Source {
    /// What is known before a cloud is read.
    fn overview(&self) -> &Overview;

    /// One line for people: format, folder, number of sweeps, duration, where the poses are from.
    fn describe(&self) -> String;

    /// Reads a sweep; the content of `into` is replaced and its memory reused.
    ///
    /// Fails where the file is unreadable or damaged; `into` then holds no points.
    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error>;

    /// Extension of files of clouds like its own; none where they come as messages or packets.
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

    /// `world_from_vehicle` at the stamp of a sweep of a source that is located.
    fn pose(&self, index: usize) -> Pose {
        self.overview().track.poses[index]
    }

    /// See [`Overview::notes`].
    fn notes(&self) -> &[String] {
        &self.overview().notes
    }
}

/// Kinds of recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// A KITTI raw drive.
    #[value(name = "kitti")]
    KittiRaw,
    /// A sequence of KITTI's odometry benchmark (or SemanticKITTI).
    KittiOdometry,
    /// An Argoverse 2 sensor log.
    #[value(name = "argoverse")]
    Argoverse2,
    /// Scenes of nuScenes.
    #[value(name = "nuscenes")]
    NuScenes,
    /// Segments of Waymo's Open Dataset in Parquet.
    Waymo,
    /// A folder of `.bin`, `.npy`, `.pcd` or `.ply` clouds.
    #[value(alias = "bin")]
    Clouds,
    /// A recording of ROS: an `.mcap` file, or a folder of them.
    Mcap,
    /// Packets of an Ouster or Velodyne sensor in a `.pcap` or `.pcapng` file.
    Pcap,
}

/// Frame whose motion a file of poses tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum PosesFrame {
    /// The left camera of KITTI; `calib.txt` tells where it sits.
    Camera,
    /// The frame of the clouds.
    Vehicle,
}

/// Whether a recording may be opened without poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unlocated {
    /// It fails to open.
    #[default]
    Refuse,
    /// Where it has none.
    Accept,
    /// Those that it has are left out.
    Always,
}

/// What the user says about a recording instead of what its folder tells.
#[derive(Clone, Debug, Default)]
pub struct OpenOptions {
    /// Kind of recording.
    pub format: Option<Format>,
    /// Topics whose clouds are the sweeps, for [`Format::Mcap`]; where there are none, the only one
    /// or those of all lidars. For [`Format::Pcap`] a sensor, as `ADDRESS:PORT`; for
    /// [`Format::NuScenes`] and [`Format::Waymo`] a scene or segment.
    pub topics: Vec<String>,
    /// File of poses: 3x4 numbers or a `.npy` of 4x4, one row per sweep of the first, or of TUM.
    pub poses: Option<PathBuf>,
    /// Whether poses are needed at all.
    pub unlocated: Unlocated,
    /// See [`Overview::trusted`].
    pub trusted: bool,
    /// Frame of the poses; the camera for [`Format::KittiOdometry`], otherwise the vehicle.
    pub poses_frame: Option<PosesFrame>,
    /// Where lidars sit, for [`Format::Mcap`].
    pub extrinsics: Option<PathBuf>,
    /// What the numbers of a return are, for `.bin` and `.npy` files.
    pub bin_fields: Option<BinFields>,
    /// Overrides [`Rig::distorted`].
    pub deskew: Option<bool>,
    /// Overrides [`Rig::ground_m`], m.
    pub ground_m: Option<f64>,
    /// Overrides [`Rig::own_vehicle`].
    pub own_vehicle: Option<[[f32; 2]; 2]>,
}

impl OpenOptions {
    /// Leaves the poses of a recording unknown, in which this was found instead, or fails where
    /// they are needed.
    fn go_without_poses(&self, root: &Path, found: &str) -> Result<(), Error> {
        match self.unlocated {
            Unlocated::Refuse => {
                let what = format!("{found}: poses are needed, give a file with --poses");
                Err(Error::input(root, "", what))
            }
            Unlocated::Accept | Unlocated::Always => Ok(()),
        }
    }
}

/// Opens the recording at `path`, or the only one in a folder below it.
///
/// Fails where no known format is recognised, where poses (unless it may come without), times or
/// calibration are missing, do not fit the sweeps or make no sense, and where this build cannot
/// read the format.
pub fn open(path: &Path, options: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    if options.ground_m.is_some_and(|g| !g.is_finite()) {
        return Err(Error::Usage("the height of the ground is not finite".into()));
    }
    let (format, root) = match options.format {
        Some(format) => (format, path.to_path_buf()),
        None => recognise(path)?,
    };
    let has_topics =
        matches!(format, Format::Mcap | Format::NuScenes | Format::Pcap | Format::Waymo);
    if !has_topics && !options.topics.is_empty() {
        let what = "only recordings in MCAP and pcap, nuScenes and Waymo have topics (--topic)";
        return Err(Error::Usage(what.into()));
    }
    if format != Format::Mcap && options.extrinsics.is_some() {
        return Err(Error::Usage("--extrinsics is for recordings in MCAP".into()));
    }
    match format {
        Format::KittiRaw => Ok(Box::new(kitti::open_raw(&root, options)?)),
        Format::KittiOdometry => Ok(Box::new(kitti::open_odometry(&root, options)?)),
        Format::Clouds => Ok(Box::new(kitti::open_folder(&root, options)?)),
        Format::Argoverse2 => open_argoverse(&root, options),
        Format::NuScenes => open_nuscenes(&root, options),
        Format::Waymo => open_waymo(&root, options),
        Format::Mcap => open_mcap(&root, options),
        Format::Pcap => open_pcap(&root, options),
    }
}

#[cfg(feature = "arrow")]
fn open_argoverse(root: &Path, options: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    Ok(Box::new(argoverse::Argoverse::open(root, options)?))
}

#[cfg(not(feature = "arrow"))]
fn open_argoverse(root: &Path, _: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    Err(Error::lacking(format!("{}, an Argoverse 2 log,", root.display()), "arrow"))
}

#[cfg(feature = "nuscenes")]
fn open_nuscenes(root: &Path, options: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    Ok(Box::new(nuscenes::NuScenes::open(root, options)?))
}

#[cfg(not(feature = "nuscenes"))]
fn open_nuscenes(root: &Path, _: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    Err(Error::lacking(format!("{}, nuScenes,", root.display()), "nuscenes"))
}

#[cfg(feature = "parquet")]
fn open_waymo(root: &Path, options: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    Ok(Box::new(waymo::Waymo::open(root, options)?))
}

#[cfg(not(feature = "parquet"))]
fn open_waymo(root: &Path, _: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    Err(Error::lacking(format!("{}, Waymo's segments,", root.display()), "parquet"))
}

#[cfg(feature = "mcap")]
fn open_mcap(root: &Path, options: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    Ok(Box::new(bag::Bag::open(root, options)?))
}

#[cfg(not(feature = "mcap"))]
fn open_mcap(root: &Path, _: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    Err(Error::lacking(format!("{}, an MCAP recording,", root.display()), "mcap"))
}

#[cfg(feature = "pcap")]
fn open_pcap(root: &Path, options: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    Ok(Box::new(capture::Capture::open(root, options)?))
}

#[cfg(not(feature = "pcap"))]
fn open_pcap(root: &Path, _: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    Err(Error::lacking(format!("{}, a capture of packets,", root.display()), "pcap"))
}

/// What the user's options change in a rig.
fn apply(options: &OpenOptions, rig: &mut Rig) {
    rig.distorted = options.deskew.unwrap_or(rig.distorted);
    rig.ground_m = options.ground_m.unwrap_or(rig.ground_m);
    rig.own_vehicle = options.own_vehicle.or(rig.own_vehicle);
}

/// Last part of a path, resolved so that `.` has a name too.
fn folder_name(path: &Path) -> String {
    let full = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    full.file_name().map_or_else(|| "recording".into(), |n| n.to_string_lossy().into_owned())
}
