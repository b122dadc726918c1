//! One drive: its recipe, and its folder.

use super::calibration::{Camera, imu};
use super::gnss::Errors;
use super::layout::{drive_name, frame_name, spaced, timestamp};
use super::tracklets::Tracklets;
use super::{oxts, truth};
use raywake_core::pose::Pose;
use raywake_core::sweep::{Point, Rig, Timing};
use raywake_io::Error;
use raywake_io::sink::atomic::create_folder;
use raywake_sim::{Clutter, Drive, Ego, Options, Rng, Scenery, SensorRig, SimSweep};
use serde_json::json;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Height of KITTI's Velodyne, which readers of its layout assume, m.
const KITTI_HEIGHT_M: f64 = 1.73;

/// The last file of a drive to be written: what it was made from.
const MANIFEST: &str = "manifest.json";

/// What the vehicle does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Motion {
    /// One of the others, drawn for every drive.
    Any,
    /// Stands still.
    Standing,
    /// Drives straight on.
    Straight,
    /// Turns left or right at a crossing.
    Turn,
    /// Brakes to a stop and starts again.
    StopAndGo,
}

/// Poses in a drive's `oxts/`; `truth/` always has the exact ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Poses {
    /// The exact ones.
    Exact,
    /// With the errors of a GNSS-aided inertial unit: reports on a clock of 10 ms, about 4 cm of
    /// position and 0.2 degrees of heading that change slowly, and 1 cm on every sweep.
    Gnss,
}

/// What the drives of a run have in common.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// Seed that every drive's own seed is drawn from.
    pub seed: u64,
    /// Sweeps of a drive.
    pub sweeps: usize,
    /// One of [`SensorRig::NAMES`].
    pub sensor: String,
    /// Scene that is driven through.
    pub scenery: Scenery,
    /// What the vehicle does in a street.
    pub motion: Motion,
    /// Amount of traffic; 1 is a busy street.
    pub density: f64,
    /// What is in the air.
    pub clutter: Clutter,
    /// How good the poses are.
    pub poses: Poses,
}

impl Default for Recipe {
    fn default() -> Recipe {
        Recipe {
            seed: 1,
            sweeps: 100,
            sensor: "hdl64".to_owned(),
            scenery: Scenery::Street,
            motion: Motion::Any,
            density: 1.0,
            clutter: Clutter::None,
            poses: Poses::Exact,
        }
    }
}

impl Recipe {
    /// The simulator of drive `number`.
    pub fn drive(&self, number: usize, threads: usize) -> Result<Drive, Error> {
        let (seed, mut rng) = self.chance(number);
        let ego = match self.motion {
            Motion::Any => Ego::Any,
            Motion::Standing => Ego::Standing,
            Motion::Straight => Ego::straight(&mut rng),
            Motion::Turn => Ego::turn(&mut rng),
            Motion::StopAndGo => Ego::stop_and_go(&mut rng),
        };
        let options = Options {
            sweeps: self.sweeps,
            scenery: self.scenery,
            ego,
            density: self.density,
            clutter: self.clutter,
            rig: rig(&self.sensor)?,
            threads,
        };
        Ok(Drive::new(seed, options))
    }

    /// The seed of drive `number`, and the generator its motion is drawn from.
    fn chance(&self, number: usize) -> (u64, Rng) {
        let mut rng = Rng::split(self.seed, number as u64);
        (rng.bits(), rng)
    }

    /// Fails if the options do not fit together.
    pub fn check(&self) -> Result<(), Error> {
        if self.motion != Motion::Any && self.scenery.place(self.seed).is_some() {
            let name = self.scenery.name();
            let what = format!(
                "--ego applies to the street only: {name} determines what the vehicle does"
            );
            return Err(Error::Usage(what));
        }
        Ok(())
    }

    /// The rig as a reader of the drive sees it.
    pub fn rig(&self) -> Result<Rig, Error> {
        let nowhere =
            Options { sweeps: 0, density: 0.0, rig: rig(&self.sensor)?, ..Default::default() };
        Ok(Drive::new(0, nowhere).rig())
    }

    /// What distinguishes a drive from any other.
    fn manifest(&self, number: usize) -> String {
        let motion = clap::ValueEnum::to_possible_value(&self.motion);
        let mut manifest = json!({
            "raywake": env!("CARGO_PKG_VERSION"),
            "seed": self.seed,
            "drive": number,
            "sweeps": self.sweeps,
            "sensor": self.sensor,
            "ego": motion.map_or_else(String::new, |m| m.get_name().to_owned()),
            "density": self.density,
        });
        // Defaults older than the other choices are left out, so that existing manifests still
        // match.
        if self.scenery != Scenery::Street {
            manifest["scenery"] = self.scenery.name().into();
        }
        if self.clutter != Clutter::None {
            manifest["clutter"] = self.clutter.name().into();
        }
        if self.poses == Poses::Gnss {
            manifest["poses"] = "gnss".into();
        }
        if let Some(place) = self.scenery.place(self.chance(number).0) {
            manifest["place"] = place.name().into();
        }
        format!("{manifest}\n")
    }
}

/// What exists of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Nothing, or only part of it.
    Missing,
    /// All of it.
    Finished,
}

/// Returns whether drive `number` is there. Fails if its name is taken by something else.
pub fn state(day: &Path, recipe: &Recipe, number: usize) -> Result<State, Error> {
    let folder = day.join(drive_name(number));
    match fs::symlink_metadata(&folder) {
        Err(e) if matches!(e.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
            return Ok(State::Missing);
        }
        Err(e) => return Err(Error::reading(&folder)(e)),
        Ok(_) => {}
    }
    let wanted = recipe.manifest(number);
    match fs::read_to_string(folder.join(MANIFEST)) {
        Ok(found) if found == wanted => Ok(State::Finished),
        Ok(found) => {
            let what = format!(
                "holds another drive, {}, not {}; choose another folder",
                found.trim(),
                wanted.trim()
            );
            Err(Error::input(&folder, "", what))
        }
        Err(_) => {
            let what = "exists and is not a drive of this program; choose another folder";
            Err(Error::input(&folder, "", what))
        }
    }
}

/// Writes drive `number` under a temporary name and renames it when it is complete.
///
/// `tell` is called after each sweep and returns whether to go on; if it returns false, the drive
/// stays unfinished. Fails if a file cannot be written.
pub fn write(
    day: &Path,
    recipe: &Recipe,
    number: usize,
    threads: usize,
    tell: &dyn Fn() -> bool,
) -> Result<(), Error> {
    let folder = day.join(drive_name(number));
    let partial = day.join(format!(".{}.partial", drive_name(number)));
    if partial.exists() {
        fs::remove_dir_all(&partial).map_err(Error::writing(&partial))?;
    }
    let drive = recipe.drive(number, threads)?;
    let errors = (recipe.poses == Poses::Gnss).then(|| Errors::new(recipe.chance(number).0));
    let mut writer = Writer::new(&partial, &drive, errors, recipe.clutter)?;
    for frame in 0..recipe.sweeps {
        writer.sweep(frame)?;
        if !tell() {
            return Ok(());
        }
    }
    writer.finish()?;
    save(&partial, MANIFEST, recipe.manifest(number))?;
    fs::rename(&partial, &folder).map_err(Error::writing(&folder))
}

/// Writes a file in a folder.
fn save(folder: &Path, name: &str, content: impl AsRef<[u8]>) -> Result<(), Error> {
    let path = folder.join(name);
    fs::write(&path, content).map_err(Error::writing(&path))
}

/// A drive while it is being written.
struct Writer<'a> {
    root: PathBuf,
    drive: &'a Drive,
    vehicle_from_imu: Pose,
    unit: oxts::Unit,
    /// Errors of the poses; `None` if they are exact.
    errors: Option<Errors>,
    sidecars: bool,
    tracklets: Tracklets,
    objects: Vec<truth::ObjectTruth>,
    poses: String,
    frames: usize,
}

impl<'a> Writer<'a> {
    fn new(
        root: &Path,
        drive: &'a Drive,
        errors: Option<Errors>,
        clutter: Clutter,
    ) -> Result<Writer<'a>, Error> {
        let rig = drive.rig();
        let sidecars = rig.sensors.iter().any(|pose| *pose != Pose::IDENTITY)
            || rig.sensors.len() != 1
            || rig.ground_m != -KITTI_HEIGHT_M;
        let always = ["velodyne_points/data", "oxts/data", "truth/points"];
        let beside = ["velodyne_points/offset_s", "velodyne_points/sensor"];
        for name in always.iter().chain(beside.iter().filter(|_| sidecars)) {
            create_folder(&root.join(name))?;
        }
        if sidecars {
            save(root, "velodyne_points/sensors.txt", sensors(&rig))?;
        }
        save(root, "oxts/dataformat.txt", oxts::FORMAT)?;
        save(root, "truth/classes.txt", truth::classes(clutter))?;
        let vehicle_from_imu = imu(&rig);
        let unit = oxts::Unit::new(drive.world_from_vehicle(0.0) * vehicle_from_imu);
        let tracklets = Tracklets::new(Camera::new(&rig));
        let (objects, poses, frames) = (Vec::new(), String::new(), 0);
        let root = root.to_path_buf();
        Ok(Writer {
            root,
            drive,
            vehicle_from_imu,
            unit,
            errors,
            sidecars,
            tracklets,
            objects,
            poses,
            frames,
        })
    }

    /// Casts a sweep and writes everything that concerns it alone.
    fn sweep(&mut self, frame: usize) -> Result<(), Error> {
        let sweep = self.drive.sweep(frame);
        let bin = frame_name(frame, "bin");
        save(&self.root, &format!("velodyne_points/data/{bin}"), cloud(&sweep.points))?;
        if self.sidecars {
            self.beside(&bin, &sweep)?;
        }
        let packet = self.packet(sweep.stamp_s);
        save(&self.root, &format!("oxts/data/{}", frame_name(frame, "txt")), packet)?;
        let path = truth::points_path(&self.root, frame as u64);
        truth::write_points(&path, &truth::of_points(&sweep))?;
        let objects = self.drive.objects(sweep.stamp_s);
        self.objects.extend(truth::of_objects(frame as u64, self.drive, &sweep, &objects));
        self.tracklets.add(frame, &sweep, &objects);
        self.poses += &truth::pose_row(&sweep.world_from_vehicle);
        self.frames = frame + 1;
        Ok(())
    }

    /// What the inertial unit reports for a stamp.
    fn packet(&mut self, stamp_s: f64) -> String {
        let world_from_imu = |t: f64| self.drive.world_from_vehicle(t) * self.vehicle_from_imu;
        match self.errors.as_mut().map(Errors::next) {
            None => self.unit.packet(&world_from_imu, stamp_s),
            Some(error) => {
                let reported = |t: f64| error.of(world_from_imu(t + error.late_s));
                self.unit.packet(&reported, stamp_s)
            }
        }
    }

    /// Writes times and sensors of the returns.
    fn beside(&self, bin: &str, sweep: &SimSweep) -> Result<(), Error> {
        let times: Vec<u8> = sweep.points.iter().flat_map(|p| p.offset_s.to_le_bytes()).collect();
        let sensors: Vec<u8> = sweep.points.iter().map(|p| p.sensor as u8).collect();
        save(&self.root, &format!("velodyne_points/offset_s/{bin}"), times)?;
        save(&self.root, &format!("velodyne_points/sensor/{bin}"), sensors)
    }

    /// Writes everything that concerns the whole drive.
    fn finish(self) -> Result<(), Error> {
        let [from_s, span_s] = span(&self.drive.rig());
        let times =
            |offset_s| -> String { (0..self.frames).map(|n| timestamp(n, offset_s)).collect() };
        for (name, offset_s) in [("", 0.0), ("_start", from_s), ("_end", from_s + span_s)] {
            let name = format!("velodyne_points/timestamps{name}.txt");
            save(&self.root, &name, times(offset_s))?;
        }
        save(&self.root, "oxts/timestamps.txt", times(0.0))?;
        save(&self.root, "truth/poses.txt", &self.poses)?;
        truth::write_objects(&truth::objects_path(&self.root), &self.objects)?;
        save(&self.root, "tracklet_labels.xml", self.tracklets.xml())
    }
}

/// Earliest offset and duration of a sweep, s.
fn span(rig: &Rig) -> [f64; 2] {
    match rig.timing {
        Timing::Offset { from_s, span_s } => [from_s, span_s],
        Timing::Azimuth { span_s } => [-0.5 * span_s, span_s],
        Timing::AtStamp => [0.0, 0.0],
    }
}

/// The rig of this name.
pub fn rig(name: &str) -> Result<SensorRig, Error> {
    name.parse().map_err(|e: raywake_sim::UnknownRig| Error::Usage(e.to_string()))
}

/// `sensors.txt`, as `raywake_io::source` reads it.
fn sensors(rig: &Rig) -> String {
    let mut text = format!("span: {}\nground: {}\n", spaced(span(rig)), rig.ground_m);
    for pose in &rig.sensors {
        text += &format!("sensor: {}\n", spaced(super::layout::rows(pose)));
    }
    text
}

/// A `.bin`: little-endian float32 x, y, z, intensity.
fn cloud(points: &[Point]) -> Vec<u8> {
    let values = points.iter().flat_map(|p| {
        let [x, y, z] = p.position;
        [x, y, z, p.intensity]
    });
    values.flat_map(f32::to_le_bytes).collect()
}
