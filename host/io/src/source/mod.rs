//! Where sweeps come from: folders of recorded clouds with the vehicle's poses.
//!
//! | format | clouds | poses |
//! |---|---|---|
//! | [`Format::KittiRaw`] | `velodyne_points/data/N.bin` | `poses.txt`, else `oxts/data/N.txt` |
//! | [`Format::KittiOdometry`] | `velodyne/N.bin` | `poses.txt` of the camera, with `calib.txt` |
//! | [`Format::Argoverse2`] | `sensors/lidar/NS.feather` | `city_SE3_egovehicle.feather` |
//! | [`Format::Clouds`] | `*.bin`, `*.pcd` or `*.ply` | a file named on the command line |
//!
//! A `.bin` is little-endian float32 x, y, z, intensity per return. Poses and times are read and
//! checked when a source is opened, clouds one at a time. A KITTI raw drive of several sensors has
//! `velodyne_points/{sensors.txt, offset_s/N.bin, sensor/N.bin}` beside its clouds.

#[cfg(feature = "arrow")]
mod argoverse;
mod bin;
mod clouds;
#[cfg(feature = "arrow")]
pub mod feather;
#[cfg(feature = "arrow")]
mod feather_check;
mod kitti;
mod lzf;
mod oxts;
mod pcd;
mod ply;
mod poses;
mod recognise;
mod returns;
mod sidecars;
#[cfg(feature = "simulated")]
pub mod simulated;
pub mod text;

#[cfg(test)]
pub(crate) mod tests;

use std::path::{Path, PathBuf};

use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::{Point, Rig, Sweep};

use crate::Error;

pub use clouds::read_cloud;
pub use poses::{pose_row, read_pose};
pub use recognise::recognise;

/// One sweep in memory; keep it and read into it again, so that its memory is reused.
#[derive(Clone, Debug)]
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

impl Default for SweepData {
    fn default() -> SweepData {
        SweepData {
            frame: 0,
            stamp_s: 0.0,
            points: Vec::new(),
            world_from_vehicle: Pose::IDENTITY,
            twist: Twist::ZERO,
            dropped: SourceGaps::default(),
        }
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
    /// Sweeps that frame numbers say are missing between the one before and this one.
    pub sweeps_before: u64,
    /// Rows without a coordinate (null in a feather file); their points hold NaN.
    pub null_rows: u32,
}

/// A recording.
pub trait Source {
    /// Name of the recording: the log's or drive's folder.
    fn name(&self) -> &str;

    /// Sensors, timing and frame of the vehicle.
    fn rig(&self) -> &Rig;

    /// Number of sweeps, at least 1.
    fn len(&self) -> usize;

    /// Never true: a source without sweeps does not open.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One line for people: format, folder, number of sweeps, duration, where the poses are from.
    fn describe(&self) -> String;

    /// File number (or timestamp in ns) of sweep `index < len`.
    fn frame(&self, index: usize) -> u64;

    /// Stamp of sweep `index < len`, s: [`SweepData::stamp_s`] without reading the cloud.
    fn stamp_s(&self, index: usize) -> f64;

    /// `world_from_vehicle` at the stamp of sweep `index < len`, without reading the cloud.
    fn pose(&self, index: usize) -> Pose;

    /// Reads sweep `index < len`; the content of `into` is replaced and its memory reused.
    ///
    /// Fails where the file is unreadable or damaged; `into` then holds no points.
    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error>;

    /// What the user should know: assumptions, gaps in frame numbers.
    fn notes(&self) -> &[String];
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
    /// A folder of `.bin`, `.pcd` or `.ply` clouds.
    #[value(alias = "bin")]
    Clouds,
}

/// Frame whose motion a file of poses tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum PosesFrame {
    /// The left camera of KITTI; `calib.txt` tells where it sits.
    Camera,
    /// The frame of the clouds.
    Vehicle,
}

/// What the user says about a recording instead of what its folder tells.
#[derive(Clone, Debug, Default)]
pub struct OpenOptions {
    /// Kind of recording.
    pub format: Option<Format>,
    /// File of 3x4 poses, one row per sweep.
    pub poses: Option<PathBuf>,
    /// Frame of the poses; the camera for [`Format::KittiOdometry`], otherwise the vehicle.
    pub poses_frame: Option<PosesFrame>,
    /// Overrides [`Rig::distorted`].
    pub deskew: Option<bool>,
    /// Overrides [`Rig::ground_m`], m.
    pub ground_m: Option<f64>,
}

/// Opens the recording at `path`, or the only one in a folder below it.
///
/// Fails where no known format is recognised, where poses, times or calibration are missing, do
/// not fit the sweeps or make no sense, and where this build cannot read the format.
pub fn open(path: &Path, options: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    if options.ground_m.is_some_and(|g| !g.is_finite()) {
        return Err(Error::Usage("the height of the ground is not finite".into()));
    }
    let (format, root) = match options.format {
        Some(format) => (format, path.to_path_buf()),
        None => recognise(path)?,
    };
    match format {
        Format::KittiRaw => Ok(Box::new(kitti::open_raw(&root, options)?)),
        Format::KittiOdometry => Ok(Box::new(kitti::open_odometry(&root, options)?)),
        Format::Clouds => Ok(Box::new(kitti::open_folder(&root, options)?)),
        Format::Argoverse2 => open_argoverse(&root, options),
    }
}

#[cfg(feature = "arrow")]
fn open_argoverse(root: &Path, options: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    Ok(Box::new(argoverse::Argoverse::open(root, options)?))
}

#[cfg(not(feature = "arrow"))]
fn open_argoverse(root: &Path, _: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    let what = "is an Argoverse 2 log: the feature `arrow` is not compiled in";
    Err(Error::Unsupported(format!("{} {what}", root.display())))
}

/// What the user's options change in a rig.
fn apply(options: &OpenOptions, rig: &mut Rig) {
    rig.distorted = options.deskew.unwrap_or(rig.distorted);
    rig.ground_m = options.ground_m.unwrap_or(rig.ground_m);
}

/// Last part of a path, resolved so that `.` has a name too.
fn folder_name(path: &Path) -> String {
    let full = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    full.file_name().map_or_else(|| "recording".into(), |n| n.to_string_lossy().into_owned())
}
