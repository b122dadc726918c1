//! nuScenes scenes: `samples` and `sweeps` of `LIDAR_TOP`, with ego poses.
//!
//! The vehicle frame is the dataset's: x forward, y left, z up, origin on the ground below the
//! middle of the rear axle. The world is the map's frame. Sweeps come at 20 Hz, are stamped at the
//! end of the revolution and compensated for the vehicle's motion (Caesar et al. 2020, section 3).
//! The tables, a gigabyte for all scenes, are read row by row; only what belongs to one scene is
//! kept.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io::BufReader;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_core::sweep::{Rig, Timing};
use serde::de::{DeserializeOwned, Deserializer, SeqAccess, Visitor};

use super::poses::{PoseTrack, check_rising, rigid};
use super::recognise::{SCENES as SWEEPS, entries};
use super::{
    OpenOptions, Overview, Source, SourceGaps, SweepData, Unlocated, apply, read_cloud, whole,
};
use crate::Error;

/// The channel whose sweeps are read.
const LIDAR: &str = "LIDAR_TOP";
/// Maximum number of scenes named in an error.
const NAMED: usize = 12;

/// Extent of the vehicle around its rear axle, with mirrors, m: a Renault Zoe of 4.08 m with a
/// wheelbase of 2.59 m and a front overhang of 0.84 m.
const OWN_VEHICLE: [[f32; 2]; 2] = [[-0.8, -1.0], [3.6, 1.0]];

#[derive(serde::Deserialize)]
struct SceneRow {
    token: String,
    name: String,
}

#[derive(serde::Deserialize)]
struct SampleRow {
    token: String,
    scene_token: String,
}

#[derive(serde::Deserialize)]
struct SensorRow {
    token: String,
    channel: String,
}

#[derive(serde::Deserialize)]
struct CalibrationRow {
    token: String,
    sensor_token: String,
}

/// The placement of a vehicle or a sensor.
#[derive(serde::Deserialize)]
struct PlacedRow {
    token: String,
    translation: [f64; 3],
    /// w, x, y, z.
    rotation: [f64; 4],
}

#[derive(serde::Deserialize)]
struct SweepRow {
    sample_token: String,
    ego_pose_token: String,
    calibrated_sensor_token: String,
    /// µs since 1970.
    timestamp: u64,
    filename: String,
}

/// An open scene.
pub(super) struct NuScenes {
    overview: Overview,
    root: PathBuf,
    files: Vec<PathBuf>,
    /// For every sweep.
    vehicle_from_lidar: Vec<Pose>,
}

impl NuScenes {
    /// Opens a scene: the one named as topic, or the only one. `root` holds the tables, or the
    /// folder of them.
    pub fn open(root: &Path, options: &OpenOptions) -> Result<NuScenes, Error> {
        if options.poses.is_some() || options.poses_frame.is_some() {
            let what = "nuScenes scenes contain their own poses; --poses does not apply";
            return Err(Error::Usage(what.into()));
        }
        let tables = tables(root)?;
        let data = tables.parent().unwrap_or(root).to_path_buf();
        let scene = scene(&tables, &options.topics)?;
        let mut sweeps = sweeps(&tables, &scene.token)?;
        sweeps.sort_by_key(|sweep| sweep.timestamp);
        if sweeps.is_empty() {
            let what = format!("{} has no sweeps of {LIDAR}", scene.name);
            return Err(Error::input(&tables, SWEEPS, what));
        }
        let vehicle_from_lidar = poses(&tables.join("calibrated_sensor.json"), &sweeps, |sweep| {
            &sweep.calibrated_sensor_token
        })?;
        let poses = poses(&tables.join("ego_pose.json"), &sweeps, |sweep| &sweep.ego_pose_token)?;
        let (frames, first): (Vec<u64>, _) =
            (sweeps.iter().map(|sweep| sweep.timestamp).collect(), sweeps[0].timestamp);
        let stamps_s = frames.iter().map(|us| (us - first) as f64 * 1e-6).collect();
        let mut track = PoseTrack { stamps_s, poses };
        check_rising(&track.stamps_s, &tables.join(SWEEPS), |i| format!("sweep {i}"))?;
        if options.unlocated == Unlocated::Always {
            track.poses.clear();
        }
        let mut rig = Rig {
            sensors: vehicle_from_lidar.first().copied().into_iter().collect(),
            timing: Timing::AtStamp,
            distorted: false,
            ground_m: 0.0,
            own_vehicle: Some(OWN_VEHICLE),
        };
        apply(options, &mut rig);
        let (name, trusted, notes) = (scene.name, options.trusted, Vec::new());
        let epoch_ns = first.saturating_mul(1000);
        let overview = Overview { name, rig, frames, track, epoch_ns, trusted, notes };
        let files = sweeps.iter().map(|sweep| data.join(&sweep.filename)).collect();
        Ok(NuScenes { overview, root: data, files, vehicle_from_lidar })
    }
}

impl Source for NuScenes {
    fn overview(&self) -> &Overview {
        &self.overview
    }

    fn describe(&self) -> String {
        let (name, root) = (&self.overview.name, self.root.display());
        format!("nuScenes {name} in {root}: {}", self.overview.length())
    }

    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error> {
        self.overview.begin(index, into);
        into.dropped = SourceGaps::default();
        read_cloud(&self.files[index], None, &mut into.points)?;
        let pose = &self.vehicle_from_lidar[index];
        for point in &mut into.points {
            let at = pose.transform(DVec3::from_array(point.position.map(f64::from)));
            point.position = at.as_vec3().to_array();
        }
        Ok(())
    }
}

/// The folder that holds the tables.
fn tables(root: &Path) -> Result<PathBuf, Error> {
    let has = |folder: &PathBuf| folder.join(SWEEPS).is_file();
    let mut found: Vec<PathBuf> = Some(root.to_path_buf()).filter(has).into_iter().collect();
    if found.is_empty() {
        found = entries(root)?.into_iter().filter(has).collect();
    }
    match found.len() {
        1 => Ok(found.remove(0)),
        0 => Err(Error::input(root, "", format!("no folder with {SWEEPS}"))),
        n => {
            let some: Vec<_> = found.iter().map(|f| f.display().to_string()).collect();
            let what = format!("contains {n} folders of tables, choose one: {}", some.join(", "));
            Err(Error::input(root, "", what))
        }
    }
}

/// The requested scene, or the only one.
fn scene(tables: &Path, topics: &[String]) -> Result<SceneRow, Error> {
    let path = tables.join("scene.json");
    let mut scenes: Vec<SceneRow> = Vec::new();
    each(&path, |row| scenes.push(row))?;
    let names = |scenes: &[SceneRow]| {
        let more = if scenes.len() > NAMED { ", ..." } else { "" };
        let names: Vec<&str> = scenes.iter().take(NAMED).map(|s| s.name.as_str()).collect();
        format!("{}{more}", names.join(", "))
    };
    let what = match topics {
        [] if scenes.len() == 1 => return Ok(scenes.remove(0)),
        [] => format!("{} scenes, choose with --topic: {}", scenes.len(), names(&scenes)),
        [asked] => match scenes.iter().position(|scene| scene.name == *asked) {
            Some(n) => return Ok(scenes.remove(n)),
            None => format!("no scene {asked}; available: {}", names(&scenes)),
        },
        _ => return Err(Error::Usage("only one scene at a time (--topic)".into())),
    };
    Err(Error::input(&path, "", what))
}

/// The rows of a scene's sweeps.
fn sweeps(tables: &Path, scene: &str) -> Result<Vec<SweepRow>, Error> {
    let (mut samples, mut sensors, mut calibrations) =
        (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    each(&tables.join("sample.json"), |row: SampleRow| {
        if row.scene_token == scene {
            samples.insert(row.token);
        }
    })?;
    each(&tables.join("sensor.json"), |row: SensorRow| {
        if row.channel == LIDAR {
            sensors.insert(row.token);
        }
    })?;
    each(&tables.join("calibrated_sensor.json"), |row: CalibrationRow| {
        if sensors.contains(&row.sensor_token) {
            calibrations.insert(row.token);
        }
    })?;
    let mut sweeps = Vec::new();
    each(&tables.join(SWEEPS), |row: SweepRow| {
        if samples.contains(&row.sample_token)
            && calibrations.contains(&row.calibrated_sensor_token)
        {
            sweeps.push(row);
        }
    })?;
    Ok(sweeps)
}

/// For every sweep, the pose in a table that its token refers to.
fn poses(
    path: &Path,
    sweeps: &[SweepRow],
    token: impl Fn(&SweepRow) -> &str,
) -> Result<Vec<Pose>, Error> {
    let wanted: BTreeSet<&str> = sweeps.iter().map(&token).collect();
    let mut found = BTreeMap::new();
    each(path, |row: PlacedRow| {
        if wanted.contains(row.token.as_str()) {
            let [w, x, y, z] = row.rotation;
            found.insert(row.token, rigid(row.translation, [x, y, z, w]));
        }
    })?;
    let pose = |token: &str| match found.get(token) {
        Some(Ok(pose)) => Ok(*pose),
        Some(Err(what)) => Err(Error::input(path, format!("token {token}"), *what)),
        None => Err(Error::input(path, "", format!("has no token {token}"))),
    };
    sweeps.iter().map(|sweep| pose(token(sweep))).collect()
}

/// Passes the rows of a table to `see`, one after another.
fn each<T: DeserializeOwned>(path: &Path, see: impl FnMut(T)) -> Result<(), Error> {
    let (file, _) = whole::open(path)?;
    let mut table = serde_json::Deserializer::from_reader(BufReader::new(file));
    let read = table.deserialize_seq(EachRow { see, of: PhantomData }).and_then(|()| table.end());
    read.map_err(|e| Error::input(path, "", e.to_string()))
}

/// Passes each row of a table to a function.
struct EachRow<T, F> {
    see: F,
    of: PhantomData<T>,
}

impl<'de, T: DeserializeOwned, F: FnMut(T)> Visitor<'de> for EachRow<T, F> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a list of rows")
    }

    fn visit_seq<A: SeqAccess<'de>>(mut self, mut rows: A) -> Result<(), A::Error> {
        while let Some(row) = rows.next_element()? {
            (self.see)(row);
        }
        Ok(())
    }
}
