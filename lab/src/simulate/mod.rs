//! `raywake-lab sim`: simulated drives in the layout of KITTI's raw recordings, with exact truth.
//! Evaluation, training and the program read them like any other recording.
//!
//! A drive is `OUT/DATE/DATE_drive_NNNN_sync/`, its calibration `OUT/DATE/calib_*.txt`. In addition
//! to what a recording has, it has `truth/`: see [`truth`]. Its vehicle frame ("Velodyne" in
//! KITTI's files) is that of [`raywake_sim::Drive::rig`].

mod calibration;
mod drive;
mod gnss;
mod layout;
mod oxts;
pub mod packets;
mod tracklets;
pub mod truth;

#[cfg(test)]
mod tests;

pub use drive::{Motion, Poses, Recipe, rig};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use drive::State;
use raywake::progress::Progress;
use raywake_io::Error;
use raywake_io::sink::atomic;
use raywake_sim::{Clutter, Scenery, SensorRig};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

/// Maximum number of sweeps of a drive: about a quarter of an hour.
const SWEEPS_MAX: u64 = 10_000;

/// Largest density of traffic: beyond it there is no room in the street.
const DENSITY_MAX: f64 = 10.0;

/// Options of `sim`.
#[derive(clap::Args)]
pub struct Args {
    /// Folder the drives are written to; finished ones in it are left as they are.
    out: PathBuf,
    /// Number of drives.
    #[arg(long, default_value_t = 1)]
    drives: usize,
    /// Sweeps of each drive, 10 a second.
    #[arg(long, default_value_t = 100)]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=SWEEPS_MAX))]
    sweeps: u64,
    /// Seed; drive k of a seed is the same whatever the number of drives.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Sensors on the vehicle.
    #[arg(long, default_value = "hdl64")]
    #[arg(value_parser = PossibleValuesParser::new(SensorRig::NAMES))]
    sensor: String,
    /// Scene that is driven through: a street; or `outskirts`, which nothing is trained on:
    /// one of the places listed after it, drawn for every drive.
    #[arg(long, default_value = "street", value_parser = sceneries())]
    scenery: Scenery,
    /// What the vehicle does in a street; elsewhere the place determines it.
    #[arg(long, value_enum, default_value = "any")]
    ego: Motion,
    /// Amount of traffic: 1 is a busy street, 0 an empty one.
    #[arg(long, default_value_t = 1.0, value_parser = density)]
    density: f64,
    /// What hangs in the air and returns rays without being an object.
    #[arg(long, default_value = "none", value_parser = clutters())]
    clutter: Clutter,
    /// Poses that the drives report; their truth always has the exact ones.
    #[arg(long, value_enum, default_value = "exact")]
    poses: Poses,
    /// Threads; unless given, as many as the machine can run at once.
    #[arg(long)]
    jobs: Option<usize>,
}

/// Parses the name of a scenery.
fn sceneries() -> impl TypedValueParser<Value = Scenery> {
    PossibleValuesParser::new(Scenery::all().map(Scenery::name))
        .try_map(|name| name.parse::<Scenery>())
}

/// Parses the name of a clutter.
fn clutters() -> impl TypedValueParser<Value = Clutter> {
    PossibleValuesParser::new(Clutter::ALL.map(Clutter::name))
        .try_map(|name| name.parse::<Clutter>())
}

/// Parses a density.
fn density(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    let fits = (0.0..=DENSITY_MAX).contains(&value);
    fits.then_some(value).ok_or_else(|| format!("not between 0 and {DENSITY_MAX}"))
}

/// What a run did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Written {
    /// Drives written.
    pub drives: usize,
    /// Drives that were already there.
    pub skipped: usize,
}

/// Writes what the command line asks for, and prints how fast that was.
pub fn run(args: &Args) -> Result<(), Box<dyn std::error::Error>> {
    let recipe = Recipe {
        seed: args.seed,
        sweeps: args.sweeps as usize,
        sensor: args.sensor.clone(),
        scenery: args.scenery,
        motion: args.ego,
        density: args.density,
        clutter: args.clutter,
        poses: args.poses,
    };
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    let start = Instant::now();
    let done = write(&args.out, &recipe, args.drives, args.jobs.unwrap_or_else(cores), false)?;
    let (sweeps, elapsed_s) = (done.drives * recipe.sweeps, start.elapsed().as_secs_f64());
    println!(
        "{}: {} drives written, {} already there; {sweeps} sweeps in {elapsed_s:.1} s, {:.2}/s",
        args.out.display(),
        done.drives,
        done.skipped,
        sweeps as f64 / elapsed_s
    );
    Ok(())
}

/// Writes drives 0 to `drives` of a recipe on `jobs` threads, whose number does not affect the
/// output.
///
/// Existing drives are kept; a drive that an earlier run left unfinished is started again. Two runs
/// must not write to one folder at once. Fails before anything is written if a folder holds
/// something other than the drive meant to be there or if the recipe is inconsistent; also fails if
/// a file cannot be written.
pub fn write(
    out: &Path,
    recipe: &Recipe,
    drives: usize,
    jobs: usize,
    quiet: bool,
) -> Result<Written, Error> {
    recipe.check()?;
    let rig = recipe.rig()?;
    let day = out.join(layout::DATE);
    let mut missing = Vec::new();
    for number in 0..drives {
        if drive::state(&day, recipe, number)? == State::Missing {
            missing.push(number);
        }
    }
    atomic::create_folder(&day)?;
    calibration::write(&day, &rig)?;
    // Threads left without a drive of their own help with casting.
    let workers = jobs.clamp(1, missing.len().max(1));
    let threads = (jobs / workers).max(1);
    let progress = Mutex::new(Progress::new("sweep", missing.len() * recipe.sweeps, quiet));
    let (next, swept, stop) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicBool::new(false));
    let tell = || {
        let done = swept.fetch_add(1, Ordering::Relaxed) + 1;
        progress.lock().expect("no thread panics while it shows progress").update(done);
        !stop.load(Ordering::Relaxed)
    };
    let work = || {
        while let Some(&number) = missing.get(next.fetch_add(1, Ordering::Relaxed)) {
            let result = drive::write(&day, recipe, number, threads, &tell);
            // The others can stop.
            result.inspect_err(|_| stop.store(true, Ordering::Relaxed))?;
            if stop.load(Ordering::Relaxed) {
                break;
            }
        }
        Ok(())
    };
    let results: Vec<Result<(), Error>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        threads.into_iter().map(|t| t.join().expect("a simulating thread panicked")).collect()
    });
    progress.lock().expect("no thread panics while it shows progress").finish();
    results.into_iter().collect::<Result<(), Error>>()?;
    Ok(Written { drives: missing.len(), skipped: drives - missing.len() })
}
