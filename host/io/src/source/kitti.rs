//! KITTI drives and odometry sequences, and folders of clouds that look like them.
//!
//! The vehicle frame is that of the Velodyne HDL-64E, unless sidecars describe other sensors.

use std::path::{Path, PathBuf};

use raywake_core::pose::Pose;
use raywake_core::sweep::{Rig, Timing};
use raywake_registration::ground::ground_height;

use super::clouds::{Clouds, read_cloud};
use super::median::median;
use super::poses::{self, PoseTrack};
use super::recognise::{extensions, note_gaps, numbered};
use super::sidecars::Sidecars;
use super::{
    OpenOptions, Overview, PosesFrame, Unlocated, apply, first_sweep, folder_name, oxts,
    pose_files, viewpoints,
};
use crate::Error;

/// Duration of a revolution of KITTI's scanner if stamps do not give it, s: the median by the
/// scanner's own stamps in the raw drives.
const PERIOD_S: f64 = 0.1036;

/// Revolution times of an HDL-64E, s (20 to 5 Hz). Stamps outside are not those of single
/// revolutions.
const PERIOD_LIMITS_S: [f64; 2] = [0.05, 0.2];

/// Height of the ground under KITTI's Velodyne, m.
const GROUND_M: f64 = -1.73;

/// Extent of KITTI's recording vehicle around the Velodyne, m.
const OWN_VEHICLE: [[f32; 2]; 2] = [[-1.5, -1.75], [4.5, 1.75]];

/// Folder of clouds of a raw drive.
const RAW_CLOUDS: &str = "velodyne_points/data";

/// Opens a KITTI raw drive. `poses.txt` (or the option `poses`) takes precedence over `oxts`.
pub(super) fn open_raw(drive: &Path, options: &OpenOptions) -> Result<Clouds, Error> {
    let mut opening = Opening::new(drive, &drive.join(RAW_CLOUDS), "bin", "KITTI raw drive")?;
    opening.read_times(&["times.txt", "velodyne_points/timestamps.txt", "oxts/timestamps.txt"])?;
    let own = drive.join("poses.txt");
    match options.poses.as_ref().or(Some(&own).filter(|p| p.is_file())) {
        _ if options.unlocated == Unlocated::Always => {}
        Some(path) => opening.read_poses(path, options, PosesFrame::Vehicle)?,
        None if drive.join("oxts/data").is_dir() => opening.read_oxts()?,
        None => {
            options.proceed_without_poses(&opening.root, "neither `poses.txt` nor `oxts/data`")?
        }
    }
    opening.sidecars = Sidecars::open(&drive.join("velodyne_points"))?;
    Ok(opening.finish(options))
}

/// Opens a KITTI odometry sequence. Its poses are in `poses.txt` or, as distributed, in
/// `../../poses/NN.txt`.
pub(super) fn open_odometry(sequence: &Path, options: &OpenOptions) -> Result<Clouds, Error> {
    let mut opening = Opening::new(sequence, &sequence.join("velodyne"), "bin", "KITTI odometry")?;
    opening.read_times(&["times.txt"])?;
    let own = odometry_poses(sequence);
    match options.poses.as_ref().or(own.as_ref()) {
        _ if options.unlocated == Unlocated::Always => {}
        Some(path) => opening.read_poses(path, options, PosesFrame::Camera)?,
        None => options.proceed_without_poses(&opening.root, "no `poses.txt`")?,
    }
    Ok(opening.finish(options))
}

/// Where a drive's IMU is.
const CALIBRATION: &str = "calib_imu_to_velo.txt";

/// The calibration of a KITTI raw drive, its own or its day's, if there is one.
pub(super) fn calibration(drive: &Path) -> Result<Option<PathBuf>, Error> {
    // From the resolved path: a drive named `.` has a parent too.
    let full = drive.canonicalize().map_err(Error::reading(drive))?;
    let places = [Some(full.as_path()), full.parent()];
    Ok(places.into_iter().flatten().map(|p| p.join(CALIBRATION)).find(|p| p.is_file()))
}

/// The poses of a KITTI odometry sequence, if there are any.
pub(super) fn odometry_poses(sequence: &Path) -> Option<PathBuf> {
    let apart = format!("../../poses/{}.txt", folder_name(sequence));
    ["poses.txt", &apart].map(|name| sequence.join(name)).into_iter().find(|p| p.is_file())
}

/// Opens a folder of clouds of one format; poses come from the option `poses` or the headers of PCD
/// files.
pub(super) fn open_folder(folder: &Path, options: &OpenOptions) -> Result<Clouds, Error> {
    let mut kinds = extensions(folder)?;
    let kind = kinds.next().unwrap_or("bin");
    if let Some(other) = kinds.next() {
        let what = format!("contains both `.{kind}` and `.{other}` files, expected one format");
        return Err(Error::input(folder, "", what));
    }
    let mut opening = Opening::new(folder, folder, kind, "folder of clouds")?;
    opening.read_times(&["times.txt"])?;
    let viewpoints = if kind == "pcd" { viewpoints::read(&opening.files)? } else { None };
    match &options.poses {
        Some(path) if options.unlocated != Unlocated::Always => {
            opening.read_poses(path, options, PosesFrame::Vehicle)?;
        }
        _ if viewpoints.is_some() => opening.take_viewpoints(viewpoints, options),
        _ if options.unlocated == Unlocated::Always => {}
        _ => options.proceed_without_poses(&opening.root, "point clouds only")?,
    }
    opening.inspect_returns(options)?;
    Ok(opening.finish(options))
}

/// A recording that is being opened.
struct Opening {
    root: PathBuf,
    kind: &'static str,
    poses_from: String,
    files: Vec<(u64, PathBuf)>,
    track: PoseTrack,
    /// Whether the stamps were read rather than assumed.
    timed: bool,
    sidecars: Option<Sidecars>,
    /// Earliest time after the stamp and duration of a sweep, s, if clouds have times.
    span: Option<[f64; 2]>,
    /// Height of the ground in the vehicle frame, m.
    ground_m: f64,
    /// Poses of the clouds, if their points are in the world and not in the vehicle's frame.
    world_from_cloud: Vec<Pose>,
    notes: Vec<String>,
}

impl Opening {
    fn new(
        root: &Path,
        clouds: &Path,
        extension: &str,
        kind: &'static str,
    ) -> Result<Opening, Error> {
        let (files, by_number) = numbered(clouds, extension)?;
        let mut notes = Vec::new();
        if !by_number {
            notes.push("sweep file names are not numbers: numbered from 0 in order".into());
        }
        let frames: Vec<u64> = files.iter().map(|f| f.0).collect();
        note_gaps(&frames, &mut notes);
        let (root, track) = (root.to_path_buf(), PoseTrack::default());
        Ok(Opening {
            root,
            kind,
            poses_from: "registration".into(),
            files,
            track,
            timed: false,
            sidecars: None,
            span: None,
            ground_m: GROUND_M,
            world_from_cloud: Vec::new(),
            notes,
        })
    }

    fn frames(&self) -> Vec<u64> {
        self.files.iter().map(|f| f.0).collect()
    }

    fn read_times(&mut self, candidates: &[&str]) -> Result<(), Error> {
        let paths: Vec<_> = candidates.iter().map(|c| self.root.join(c)).collect();
        let times = poses::read_times(&paths, &self.frames())?;
        self.timed = times.path.is_some();
        if !self.timed {
            self.notes.push(format!("no {}: 10 Hz assumed", candidates[0]));
        }
        self.track.stamps_s = times.stamps_s;
        Ok(())
    }

    fn read_poses(
        &mut self,
        path: &Path,
        options: &OpenOptions,
        usual: PosesFrame,
    ) -> Result<(), Error> {
        let stamps_ns = self.track.stamps_s.iter().map(|s| (s * 1e9).round() as i64);
        let poses = pose_files::read(path, &stamps_ns.collect::<Vec<_>>())?;
        pose_files::note_missing(&poses, &folder_name(path), &mut self.notes);
        pose_files::keep(&mut self.files, &poses);
        pose_files::keep(&mut self.track.stamps_s, &poses);
        let mut rows: Vec<Pose> = poses.into_iter().flatten().collect();
        if options.poses_frame.unwrap_or(usual) == PosesFrame::Camera {
            let calib = self.root.join("calib.txt");
            if !calib.is_file() {
                let what = "camera poses need `calib.txt` next to the clouds; \
                            or, if they are of the clouds' frame, --poses-frame vehicle";
                return Err(Error::input(path, "", what));
            }
            poses::from_camera(&mut rows, poses::read_camera(&calib)?);
        }
        self.track.poses = rows;
        self.poses_from = folder_name(path);
        Ok(())
    }

    /// Reads poses from `oxts/data`, by frame number; sweeps without a packet are left out. The
    /// world is the Velodyne frame of the first sweep that has one.
    fn read_oxts(&mut self) -> Result<(), Error> {
        let imu_from_velo = self.velo_from_imu()?.inverse();
        let folder = self.root.join("oxts/data");
        let (packets, _) = numbered(&folder, "txt")?;
        let (mut files, mut track, mut first) = (Vec::new(), PoseTrack::default(), None);
        for (sweep, &stamp_s) in self.files.iter().zip(&self.track.stamps_s) {
            let Ok(i) = packets.binary_search_by_key(&sweep.0, |p| p.0) else { continue };
            let packet = oxts::read_packet(&packets[i].1)?;
            let (scale, first_from_earth) = *first.get_or_insert_with(|| {
                let scale = oxts::scale(packet[0]);
                (scale, (oxts::pose(&packet, scale) * imu_from_velo).inverse())
            });
            files.push(sweep.clone());
            track.stamps_s.push(stamp_s);
            track.poses.push(first_from_earth * oxts::pose(&packet, scale) * imu_from_velo);
        }
        let left_out = self.files.len() - files.len();
        if files.is_empty() {
            return Err(Error::input(&folder, "", "no packet has the number of a sweep"));
        }
        if left_out > 0 {
            self.notes.push(format!("{left_out} sweeps skipped: no packet in oxts/data"));
        }
        (self.files, self.track, self.poses_from) = (files, track, "oxts".into());
        Ok(())
    }

    /// The drive's calibration, its day's, or KITTI's usual one with a note.
    fn velo_from_imu(&mut self) -> Result<Pose, Error> {
        if let Some(path) = calibration(&self.root)? {
            return oxts::read_calibration(&path);
        }
        self.notes.push(format!(
            "no {CALIBRATION} in the drive or above it: IMU assumed 0.81 m behind, 0.32 m beside \
             and 0.80 m below the Velodyne, axes parallel"
        ));
        Ok(oxts::default_velo_from_imu())
    }

    /// Takes poses from the headers of PCD files.
    fn take_viewpoints(&mut self, found: Option<(Vec<Pose>, bool)>, options: &OpenOptions) {
        let Some((poses, in_world)) = found else { return };
        let frame = if in_world { "the world" } else { "the frame of the sensor" };
        self.notes.push(format!("VIEWPOINT: points are in {frame}"));
        if in_world {
            self.world_from_cloud.clone_from(&poses);
        }
        if options.unlocated != Unlocated::Always {
            (self.track.poses, self.poses_from) = (poses, "VIEWPOINT".into());
        }
    }

    /// Learns from the first cloud when its returns were measured, and where the ground is.
    fn inspect_returns(&mut self, options: &OpenOptions) -> Result<(), Error> {
        let (path, mut points) = (&self.files[0].1, Vec::new());
        let timed = read_cloud(path, options.bin_fields.as_ref(), &mut points)?;
        if let Some(pose) = self.world_from_cloud.first() {
            viewpoints::transform_from_world(&mut points, pose);
        }
        if timed {
            self.span = first_sweep::span(&points).map_err(|what| Error::input(path, "", what))?;
        }
        if self.span.is_none() {
            self.notes.push("assuming that the sensor spins like KITTI's HDL-64E".into());
        }
        let found = ground_height(&points).filter(|_| options.ground_m.is_none());
        self.ground_m = found.unwrap_or(GROUND_M);
        match found {
            Some(ground_m) => self.notes.push(format!("ground estimated at {ground_m:.2} m")),
            None if options.ground_m.is_some() => {}
            None => self.notes.push(format!("no ground found: assumed at {GROUND_M} m")),
        }
        Ok(())
    }

    fn finish(self, options: &OpenOptions) -> Clouds {
        let frames = self.frames();
        let mut rig = match &self.sidecars {
            Some(sidecars) => sidecars.rig.clone(),
            None => self.velodyne(&frames),
        };
        apply(options, &mut rig);
        let name = folder_name(&self.root);
        Clouds {
            overview: Overview {
                name,
                rig,
                frames,
                track: self.track,
                epoch_ns: 0,
                trusted: options.trusted,
                notes: self.notes,
            },
            kind: format!("{} {}", self.kind, self.root.display()),
            poses_from: self.poses_from,
            files: self.files.into_iter().map(|f| f.1).collect(),
            fields: options.bin_fields.clone(),
            world_from_cloud: self.world_from_cloud,
            sidecars: self.sidecars,
        }
    }

    /// A rig like KITTI's HDL-64E on its vehicle.
    fn velodyne(&self, frames: &[u64]) -> Rig {
        Rig {
            sensors: core::iter::once(Pose::IDENTITY).collect(),
            timing: match self.span {
                Some([from_s, span_s]) => Timing::Offset { from_s, span_s },
                None => Timing::Azimuth { span_s: self.period_s(frames) },
            },
            distorted: true,
            ground_m: self.ground_m,
            own_vehicle: Some(OWN_VEHICLE),
        }
    }

    /// Duration of one revolution: the scanner is stamped once per revolution, so it is the mean
    /// time between sweeps of consecutive numbers, without those far from the median, where a
    /// revolution is missing. The mean, because with a coarse clock the median is a whole number of
    /// its steps.
    fn period_s(&self, frames: &[u64]) -> f64 {
        let stamps = self.track.stamps_s.windows(2);
        let mut steps: Vec<f64> = frames
            .windows(2)
            .zip(stamps)
            .filter(|(f, _)| f[1] == f[0] + 1)
            .map(|(_, s)| s[1] - s[0])
            .collect();
        if !self.timed {
            return PERIOD_S;
        }
        let Some(median) = median(steps.clone(), f64::total_cmp) else { return PERIOD_S };
        steps.retain(|s| (0.6 * median..1.6 * median).contains(s));
        let mean = steps.iter().sum::<f64>() / steps.len() as f64;
        mean.clamp(PERIOD_LIMITS_S[0], PERIOD_LIMITS_S[1])
    }
}
