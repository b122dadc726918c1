//! Argoverse 2 sensor logs.
//!
//! The vehicle frame is the dataset's: x forward, y left, z up, origin at the rear axle's centre.
//! The world is the city frame. Sweeps are stamped at their start and already compensated for the
//! vehicle's motion, though their returns have times.

use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use raywake_core::pose::Pose;
use raywake_core::sweep::{Point, Rig, Timing};

use super::feather::FeatherTable;
use super::poses::{PoseTrack, check_rising};
use super::recognise::numbered;
use super::{OpenOptions, Overview, Source, SourceGaps, SweepData, Unlocated};
use super::{apply, folder_name};
use crate::Error;

/// Returns' times after the stamp: 2.6 to 106.1 ms in the logs, as the two scanners take 100 ms per
/// revolution but do not start together.
const TIMING: Timing = Timing::Offset { from_s: 0.0, span_s: 0.11 };

/// Height of the ground under the vehicle, m: the radius of the loaded wheels. A plane fitted to
/// the returns of a real sweep within 7 m passes 0.34 m below the rear axle.
const GROUND_M: f64 = -0.33;

/// Extent of the vehicle around its rear axle, with mirrors, m. The logs hold no returns from it.
const OWN_VEHICLE: [[f32; 2]; 2] = [[-1.2, -1.1], [4.1, 1.1]];

/// Names of the scanners in the calibration, in the order of [`Rig::sensors`].
const SCANNERS: [&str; 2] = ["up_lidar", "down_lidar"];

/// Lasers per scanner: numbers from 0 are one scanner's, numbers from here on the other's.
const LASERS: i64 = 32;

/// Largest time between a pose and a sweep's stamp, ns: 3 cm at 30 m/s. Logs have poses at the
/// stamps.
const POSE_WITHIN_NS: u64 = 1_000_000;

/// Columns of a sweep.
const COLUMNS: [&str; 6] = ["x", "y", "z", "intensity", "laser_number", "offset_ns"];

/// Columns of a pose table after its key.
const POSE_COLUMNS: [&str; 7] = ["qw", "qx", "qy", "qz", "tx_m", "ty_m", "tz_m"];

/// An open log.
pub(super) struct Argoverse {
    overview: Overview,
    root: PathBuf,
    files: Vec<PathBuf>,
    /// Index in [`SCANNERS`] of lasers 0 to 31.
    low_lasers: u32,
}

impl Argoverse {
    /// Opens the log in this folder.
    pub fn open(root: &Path, options: &OpenOptions) -> Result<Argoverse, Error> {
        if options.poses.is_some() || options.poses_frame.is_some() {
            let what = "Argoverse 2 logs contain their own poses; --poses does not apply";
            return Err(Error::Usage(what.into()));
        }
        let clouds = root.join("sensors/lidar");
        let (files, by_number) = numbered(&clouds, "feather")?;
        if !by_number {
            return Err(Error::input(&clouds, "", "the name of a sweep is not a timestamp"));
        }
        let mut notes = Vec::new();
        let path = root.join("city_SE3_egovehicle.feather");
        let mut track = read_track(&path, &files, &mut notes)?;
        if options.unlocated == Unlocated::Always {
            track.poses.clear();
        }
        check_rising(&track.stamps_s, &clouds, |i| format!("sweep {i}"))?;
        let scanners = read_scanners(&root.join("calibration/egovehicle_SE3_sensor.feather"))?;
        let mut rig = Rig {
            sensors: scanners.into_iter().collect(),
            timing: TIMING,
            distorted: false,
            ground_m: GROUND_M,
            own_vehicle: Some(OWN_VEHICLE),
        };
        apply(options, &mut rig);
        let (frames, files): (Vec<u64>, _) = files.into_iter().unzip();
        let epoch_ns = frames[0];
        let (name, trusted) = (folder_name(root), options.trusted);
        let overview = Overview { name, rig, frames, track, epoch_ns, trusted, notes };
        let mut log = Argoverse { overview, root: root.to_path_buf(), files, low_lasers: 0 };
        log.assign_lasers(&scanners)?;
        Ok(log)
    }

    /// Determines which lasers belong to which scanner. Lasers 0 to 31 are the upper one's in the
    /// log that was examined, but nothing in a log says so: seen from its own scanner, a laser
    /// keeps its elevation as it turns, seen from the other it does not.
    fn assign_lasers(&mut self, scanners: &[Pose; 2]) -> Result<(), Error> {
        let mut first = SweepData::default();
        let lasers = self.read_points(0, &mut first)?;
        let spread = |low: usize| elevation_spread(&first.points, &lasers, scanners, low);
        let (usual, swapped) = (spread(0), spread(1));
        if swapped < SWAP_BELOW * usual {
            self.low_lasers = 1;
            self.overview.notes.push("lasers 0 to 31 are the lower scanner's in this log".into());
        }
        Ok(())
    }

    /// Reads the points of a sweep, and returns their laser numbers.
    fn read_points(&self, index: usize, into: &mut SweepData) -> Result<Vec<i64>, Error> {
        let path = &self.files[index];
        into.points.clear();
        let table = FeatherTable::read(path, &COLUMNS)?;
        let positions = table.vectors(["x", "y", "z"])?;
        let intensity = table.integers("intensity")?;
        let offsets = table.integers("offset_ns")?;
        let lasers = table.integers("laser_number")?;
        if let Some(row) = lasers.iter().position(|l| !(0..2 * LASERS).contains(l)) {
            let what = format!("laser_number {} is not in 0 to {}", lasers[row], 2 * LASERS - 1);
            return Err(Error::input(path, format!("row {row}"), what));
        }
        into.points.extend((0..table.rows()).map(|i| Point {
            position: positions[i],
            intensity: intensity[i] as f32 / 255.0,
            offset_s: (offsets[i] as f64 * 1e-9) as f32,
            sensor: u32::from(lasers[i] >= LASERS) ^ self.low_lasers,
        }));
        Ok(lasers)
    }
}

/// The assignment of lasers is swapped if that reduces the spread of elevations to less than this
/// share.
const SWAP_BELOW: f64 = 0.7;

impl Source for Argoverse {
    fn overview(&self) -> &Overview {
        &self.overview
    }

    fn describe(&self) -> String {
        format!("Argoverse 2 log {}: {}", self.root.display(), self.overview.length())
    }

    fn extension(&self) -> Option<&str> {
        Some("feather")
    }

    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error> {
        self.read_points(index, into)?;
        self.overview.begin(index, into);
        let null = into.points.iter().filter(|p| p.position.iter().any(|v| v.is_nan())).count();
        into.dropped = SourceGaps { sweeps_before: 0, null_rows: null as u32 };
        Ok(())
    }
}

/// Mean deviation (rad) of the lasers' elevations, each seen from its scanner if lasers 0 to 31
/// belong to `scanners[low]`; 0 without usable returns.
fn elevation_spread(points: &[Point], lasers: &[i64], scanners: &[Pose; 2], low: usize) -> f64 {
    let inverse = [scanners[low].inverse(), scanners[1 - low].inverse()];
    // Near returns are rounded too coarsely, to 16 bits, to give an elevation.
    let elevation = |(p, &laser): (&Point, &i64)| {
        let p = DVec3::from_array(p.position.map(f64::from));
        let q = inverse[usize::from(laser >= LASERS)].transform(p);
        let distance = q.length();
        let usable = distance.is_finite() && distance > 5.0;
        usable.then(|| (laser as usize, libm::asin(q.z / distance)))
    };
    let seen: Vec<(usize, f64)> = points.iter().zip(lasers).filter_map(elevation).collect();
    let mut sums = [(0.0, 0u32); 2 * LASERS as usize];
    for &(laser, e) in &seen {
        sums[laser].0 += e;
        sums[laser].1 += 1;
    }
    let deviation = |&(l, e): &(usize, f64)| (e - sums[l].0 / f64::from(sums[l].1)).abs();
    seen.iter().map(deviation).sum::<f64>() / seen.len().max(1) as f64
}

/// `vehicle_from_sensor` of the [`SCANNERS`].
fn read_scanners(path: &Path) -> Result<[Pose; 2], Error> {
    let table = FeatherTable::read(path, &[&["sensor_name"][..], &POSE_COLUMNS].concat())?;
    let names = table.strings("sensor_name")?;
    let poses = PoseTable::read(&table, path)?;
    let find = |scanner: &str| match names.iter().position(|n| n == scanner) {
        Some(row) => poses.pose(row),
        None => Err(Error::input(path, "", format!("has no row `{scanner}`"))),
    };
    Ok([find(SCANNERS[0])?, find(SCANNERS[1])?])
}

/// The pose at every sweep's timestamp, with stamps in seconds since the first sweep.
fn read_track(
    path: &Path,
    files: &[(u64, PathBuf)],
    notes: &mut Vec<String>,
) -> Result<PoseTrack, Error> {
    let table = FeatherTable::read(path, &[&["timestamp_ns"][..], &POSE_COLUMNS].concat())?;
    let stamps = table.integers("timestamp_ns")?;
    let poses = PoseTable::read(&table, path)?;
    let mut by_time: Vec<(u64, usize)> =
        stamps.iter().enumerate().filter_map(|(row, &t)| Some((t.try_into().ok()?, row))).collect();
    by_time.sort_unstable();
    let (mut track, mut inexact) = (PoseTrack::default(), 0);
    let first = files.first().map_or(0, |f| f.0);
    for &(stamp, _) in files {
        let (distance, row) = nearest(&by_time, stamp)
            .filter(|&(distance, _)| distance <= POSE_WITHIN_NS)
            .ok_or_else(|| Error::input(path, "", format!("no pose for sweep {stamp}")))?;
        inexact += u32::from(distance > 0);
        track.stamps_s.push((stamp - first) as f64 * 1e-9);
        track.poses.push(poses.pose(row)?);
    }
    if inexact > 0 {
        notes.push(format!(
            "{inexact} sweeps without a pose at their stamp; the nearest within 1 ms is used"
        ));
    }
    Ok(track)
}

/// Distance (ns) and row of the pose nearest in time.
fn nearest(by_time: &[(u64, usize)], stamp: u64) -> Option<(u64, usize)> {
    let after = by_time.partition_point(|&(t, _)| t < stamp);
    let around = &by_time[after.saturating_sub(1)..by_time.len().min(after + 1)];
    around.iter().map(|&(t, row)| (t.abs_diff(stamp), row)).min()
}

/// The columns of a pose table.
struct PoseTable<'a> {
    path: &'a Path,
    columns: Vec<Vec<f64>>,
}

impl<'a> PoseTable<'a> {
    fn read(table: &FeatherTable, path: &'a Path) -> Result<PoseTable<'a>, Error> {
        let columns = POSE_COLUMNS.iter().map(|c| table.floats(c)).collect::<Result<_, _>>()?;
        Ok(PoseTable { path, columns })
    }

    /// The pose of a row; an error if its numbers are not a pose.
    fn pose(&self, row: usize) -> Result<Pose, Error> {
        let value = |column: usize| self.columns[column][row];
        let q = DQuat::from_xyzw(value(1), value(2), value(3), value(0));
        let t = DVec3::new(value(4), value(5), value(6));
        let place = || format!("row {row}");
        if !q.is_finite() || !t.is_finite() {
            return Err(Error::input(self.path, place(), "a pose with a NaN or infinite number"));
        }
        if (q.length() - 1.0).abs() > 1e-3 {
            return Err(Error::input(self.path, place(), "the quaternion does not have length 1"));
        }
        Ok(Pose::new(q, t))
    }
}
