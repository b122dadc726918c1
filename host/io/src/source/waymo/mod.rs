//! Segments of the Waymo Open Dataset in its Parquet release (version 2).
//!
//! | file | read from it |
//! |---|---|
//! | `lidar/SEGMENT.parquet` | first returns of all lasers, as range images |
//! | `lidar_calibration/SEGMENT.parquet` | mounting poses of lasers, inclinations of their beams |
//! | `lidar_pose/SEGMENT.parquet` | pose of the vehicle at each pixel of the roof laser |
//! | `vehicle_pose/SEGMENT.parquet` | pose of the vehicle at each sweep |
//!
//! The vehicle frame is the dataset's: x forward, y left, z up, origin on the ground below the rear
//! axle; the world is the segment's. With the pixel poses, the returns of the roof laser are
//! compensated for the vehicle's motion; those of the other lasers, which reach 20 m, are used as
//! they are. Images are decoded row by row, so that memory does not grow with the segment.

mod format;
mod images;
mod table;
mod thrift;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use raywake_core::pose::Pose;
use raywake_core::sweep::{Rig, Timing};

use super::poses::{PoseTrack, pose_from};
use super::recognise::{WAYMO_LASERS, entries};
use super::{OpenOptions, Overview, Source, SourceGaps, SweepData, Unlocated, apply};
use crate::Error;
use images::RangeLaser;
use table::{ImageRows, ParquetTable};

/// Number of the roof laser.
const TOP: i64 = 1;
/// Maximum accepted number of lasers: there are five.
const LASERS_MAX: usize = 8;
/// Maximum number of segments named in an error.
const NAMED: usize = 6;

/// Extent of the vehicle around its rear axle, with mirrors, m: a Jaguar I-Pace of 4.68 m, or a
/// Chrysler Pacifica of 5.18 m.
const OWN_VEHICLE: [[f32; 2]; 2] = [[-1.2, -1.2], [4.2, 1.2]];

const TIME: &str = "key.frame_timestamp_micros";
const LASER: &str = "key.laser_name";
const VEHICLE_POSE: &str = "[VehiclePoseComponent].world_from_vehicle.transform";
const EXTRINSIC: &str = "[LiDARCalibrationComponent].extrinsic.transform";
const INCLINATION: &str = "[LiDARCalibrationComponent].beam_inclination.";
const IMAGE: &str = "[LiDARComponent].range_image_return1.";
const PIXEL_POSES: &str = "[LiDARPoseComponent].range_image_return1.";

/// The table rows of a sweep.
struct SweepRows {
    /// Rows of its images, with their lasers.
    images: Vec<(usize, i64)>,
    /// Row of its pixel poses.
    pixel_poses: Option<usize>,
}

/// An open segment.
pub(super) struct Waymo {
    overview: Overview,
    root: PathBuf,
    lasers: BTreeMap<i64, RangeLaser>,
    images: ImageRows,
    pixel_poses: ImageRows,
    sweeps: Vec<SweepRows>,
    /// Poses of the vehicle, to which those of pixels refer.
    poses: Vec<Pose>,
}

impl Waymo {
    /// Opens a segment: the one named as topic, or the only one.
    pub fn open(root: &Path, options: &OpenOptions) -> Result<Waymo, Error> {
        if options.poses.is_some() || options.poses_frame.is_some() {
            let what = "Waymo segments contain their own poses; --poses does not apply";
            return Err(Error::Usage(what.into()));
        }
        let segment = segment(root, &options.topics)?;
        let file = |folder: &str| root.join(folder).join(format!("{segment}.parquet"));
        let lasers = lasers(&file("lidar_calibration"))?;
        let (path, of_pixels) = (file(WAYMO_LASERS), file("lidar_pose"));
        let (table, pose_table) = (ParquetTable::open(&path)?, ParquetTable::open(&of_pixels)?);
        let (images, pixels) = (keys(&table)?, keys(&pose_table)?);
        let pixels: BTreeMap<i64, usize> =
            (0..).zip(pixels).filter(|(_, key)| key.1 == TOP).map(|(n, key)| (key.0, n)).collect();
        let mut by_time: BTreeMap<i64, Vec<(usize, i64)>> = BTreeMap::new();
        for (row, (time, laser)) in images.into_iter().enumerate() {
            if !lasers.contains_key(&laser) {
                let what = format!("laser {laser} is not in the calibration");
                return Err(Error::input(&path, format!("row {row}"), what));
            }
            by_time.entry(time).or_default().push((row, laser));
        }
        let Some(first) = by_time.keys().next().copied() else {
            return Err(Error::input(&path, "", "has no sweeps"));
        };
        let poses = vehicle_poses(&file("vehicle_pose"), by_time.keys())?;
        let stamps_s = by_time.keys().map(|us| (us - first) as f64 * 1e-6).collect();
        let mut track = PoseTrack { stamps_s, poses: poses.clone() };
        if options.unlocated == Unlocated::Always {
            track.poses.clear();
        }
        let mut rig = Rig {
            sensors: lasers.values().map(|laser| laser.vehicle_from_laser).collect(),
            timing: Timing::AtStamp,
            distorted: false,
            ground_m: 0.0,
            own_vehicle: Some(OWN_VEHICLE),
        };
        apply(options, &mut rig);
        let overview = Overview {
            name: segment,
            rig,
            frames: by_time.keys().map(|us| *us as u64).collect(),
            track,
            epoch_ns: (first as u64).saturating_mul(1000),
            trusted: options.trusted,
            notes: Vec::new(),
        };
        let rows = |(us, images)| SweepRows { images, pixel_poses: pixels.get(&us).copied() };
        let sweeps = by_time.into_iter().map(rows).collect();
        let images = table.rows(&[&of(IMAGE, "values"), &of(IMAGE, "shape")])?;
        let pixel_poses =
            pose_table.rows(&[&of(PIXEL_POSES, "values"), &of(PIXEL_POSES, "shape")])?;
        let root = root.to_path_buf();
        Ok(Waymo { overview, root, lasers, images, pixel_poses, sweeps, poses })
    }
}

impl Source for Waymo {
    fn overview(&self) -> &Overview {
        &self.overview
    }

    fn describe(&self) -> String {
        let (name, root) = (&self.overview.name, self.root.display());
        format!("Waymo segment {name} in {root}: {}", self.overview.length())
    }

    fn extension(&self) -> Option<&str> {
        Some("feather")
    }

    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error> {
        into.points.clear();
        let mut read = Vec::new();
        let SweepRows { images, pixel_poses } = &self.sweeps[index];
        for &(row, laser) in images {
            let image = self.images.image(row, &of(IMAGE, "values"), &of(IMAGE, "shape"))?;
            let poses = pixel_poses.filter(|_| laser == TOP).map(|row| {
                let names = [of(PIXEL_POSES, "values"), of(PIXEL_POSES, "shape")];
                self.pixel_poses.image(row, &names[0], &names[1])
            });
            let poses = poses.transpose()?;
            let number = self.lasers.keys().position(|n| *n == laser).unwrap_or(0) as u32;
            let vehicle_from_world = self.poses[index].inverse();
            let pixels = poses.as_ref().map(|poses| (poses, &vehicle_from_world));
            let points = self.lasers[&laser].points(&image, pixels, number);
            let at = || format!("row {row}, laser {laser}");
            read.extend(points.map_err(|e| Error::input(self.images.path(), at(), e))?);
        }
        self.overview.begin(index, into);
        into.points.extend(read);
        into.dropped = SourceGaps::default();
        Ok(())
    }
}

/// The name of a column in a group of columns.
fn of(group: &str, name: &str) -> String {
    format!("{group}{name}")
}

/// Name of the requested segment, or of the only one.
fn segment(root: &Path, topics: &[String]) -> Result<String, Error> {
    let folder = root.join(WAYMO_LASERS);
    let mut names: Vec<String> = entries(&folder)?
        .iter()
        .filter(|path| path.extension().is_some_and(|e| e == "parquet"))
        .filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()))
        .collect();
    let more = if names.len() > NAMED { ", ..." } else { "" };
    let some = names.iter().take(NAMED).map(String::as_str).collect::<Vec<_>>().join(", ");
    let what = match topics {
        [] if names.len() == 1 => return Ok(names.remove(0)),
        [] => format!("{} segments, choose with --topic: {some}{more}", names.len()),
        [asked] => match names.contains(asked) {
            true => return Ok(asked.clone()),
            false => format!("no segment {asked}; available: {some}{more}"),
        },
        _ => return Err(Error::Usage("only one segment at a time (--topic)".into())),
    };
    Err(Error::input(&folder, "", what))
}

/// Times (µs) and lasers of a table's rows.
fn keys(table: &ParquetTable) -> Result<Vec<(i64, i64)>, Error> {
    let mut keys = Vec::new();
    table.each(&[TIME, LASER], |row| {
        keys.push((row.integer(TIME)?, row.integer(LASER)?));
        Ok(())
    })?;
    if let Some(row) = keys.iter().position(|key| key.0 < 0) {
        return Err(Error::input(table.path(), format!("row {row}"), "a time before 1970"));
    }
    Ok(keys)
}

/// The lasers by number.
fn lasers(path: &Path) -> Result<BTreeMap<i64, RangeLaser>, Error> {
    let mut lasers = BTreeMap::new();
    let names = ["min", "max", "values"].map(|name| of(INCLINATION, name));
    let columns = [LASER, EXTRINSIC, &names[0], &names[1], &names[2]];
    ParquetTable::open(path)?.each(&columns, |row| {
        let values = row.numbers(&names[2])?;
        let range = [row.number(&names[0])?, row.number(&names[1])?];
        if values.iter().chain(range.iter().filter(|_| values.is_empty())).any(|v| !v.is_finite()) {
            let what = "neither beam inclinations nor their range, or not finite ones";
            return Err(Error::input(path, "", what));
        }
        let vehicle_from_laser = pose(&row.numbers(EXTRINSIC)?, path)?;
        let laser = RangeLaser { vehicle_from_laser, inclinations: values, range };
        lasers.insert(row.integer(LASER)?, laser);
        Ok(())
    })?;
    if lasers.len() > LASERS_MAX {
        let what = format!("{} lasers, at most {LASERS_MAX}", lasers.len());
        return Err(Error::input(path, "", what));
    }
    Ok(lasers)
}

/// `world_from_vehicle` at these times, µs.
fn vehicle_poses<'a>(
    path: &Path,
    times: impl Iterator<Item = &'a i64>,
) -> Result<Vec<Pose>, Error> {
    let mut poses = BTreeMap::new();
    ParquetTable::open(path)?.each(&[TIME, VEHICLE_POSE], |row| {
        poses.insert(row.integer(TIME)?, pose(&row.numbers(VEHICLE_POSE)?, path)?);
        Ok(())
    })?;
    let at = |us: &i64| {
        let found = poses.get(us).copied();
        found.ok_or_else(|| Error::input(path, "", format!("has no pose for the sweep at {us} µs")))
    };
    times.map(at).collect()
}

/// A pose from 16 numbers, row by row.
fn pose(numbers: &[f64], path: &Path) -> Result<Pose, Error> {
    let Some(rows) = numbers.first_chunk::<12>().filter(|_| numbers.len() == 16) else {
        let what = format!("a pose of {} numbers, 16 expected", numbers.len());
        return Err(Error::input(path, "", what));
    };
    pose_from(rows, path, String::new())
}
