//! `raywake-lab eval`: chapter 3's tables and figures, and current metrics, on labelled drives.
//!
//! Two steps. Every drive goes through the pipeline once and leaves its rows (Parquet, one per
//! solid column of every pair) and facts (JSON) in the folder of results: several drives at a time,
//! and only those not there yet, so that an interrupted evaluation resumes. Then all rows are read
//! again for tables, figures and the report; any engine that reads Parquet can do the same over
//! more drives than one machine holds.

pub mod ablate;
mod calibration;
pub mod clean;
mod collect;
mod conclude;
mod drive;
mod exact;
mod facts;
mod figures;
mod flow_tables;
mod groups;
mod moving;
mod objects;
mod pair_by_pair;
mod panels;
mod points;
mod return_tables;
mod row;
mod rows_file;
mod statistics;
mod tables;
mod tally;
#[cfg(test)]
mod tests;

use conclude::conclude;
use drive::{Files, Settings};
use facts::Facts;
use raywake::args::{BackendChoice, Learned, ProfileChoice, Recording, Shard};
use raywake::batch::{self, ListedRecording};
use raywake::config;
use raywake::console::interrupted;
use raywake::error::RunError;
use raywake::weight_files::WeightFiles;
use raywake_io::Error;
use raywake_io::sink::atomic;
pub use row::Row;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// How drives are evaluated.
#[derive(clap::Args)]
struct Inputs {
    #[command(flatten)]
    profile: ProfileChoice,
    #[command(flatten)]
    learned: Learned,
    #[command(flatten)]
    backend: BackendChoice,
    #[command(flatten)]
    recording: Recording,
    /// How far boxes are extended beyond their sides, m, where no exact truth says what is in them:
    /// the dissertation's programs use 0 (chapter 3) and 0.3 (chapter 4)
    #[arg(long, value_name = "M", default_value_t = 0.0)]
    margin: f64,
    /// Stop after this many sweeps of every drive
    #[arg(short = 'n', value_name = "COUNT")]
    count: Option<usize>,
}

impl Inputs {
    /// Reads the profile and learned parameters.
    fn settings(&self) -> Result<Settings, Error> {
        if !(0.0..=2.0).contains(&self.margin) {
            return Err(Error::Usage("--margin must be 0 to 2 m".into()));
        }
        let profile = config::profile(&self.profile)?;
        let weights = WeightFiles::read(&self.learned, &profile)?;
        Ok(Settings {
            weights_digest: weights.digest(),
            weights,
            profile,
            backend: self.backend.clone(),
            open: self.recording.options(),
            margin_m: self.margin,
            sweeps: self.count.unwrap_or(usize::MAX),
            all_columns: false,
            history: true,
        })
    }
}

/// Subfolder of the results for pairs on their own: a folder of results, too.
const PAIRS: &str = "pairs";

/// `raywake-lab eval`: report.html, rows/DRIVE.parquet, drives/DRIVE.json and charts.
#[derive(clap::Args)]
pub struct Args {
    /// Labelled drives: simulated, KITTI or Argoverse 2
    #[arg(required_unless_present = "list", value_name = "DRIVE")]
    drives: Vec<PathBuf>,
    /// Drives from a list, one path per line; results are named after the full paths. With --shard
    /// only rows and facts are written: run the list without --shard for the report, once all parts
    /// are done
    #[arg(long, value_name = "FILE", conflicts_with = "drives")]
    list: Option<PathBuf>,
    /// Only every N-th drive of the list, as in `raywake run`
    #[arg(long, value_name = "I/N", requires = "list", value_parser = Shard::parse)]
    shard: Option<Shard>,
    /// Folder of results
    #[arg(long, required = true, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    inputs: Inputs,
    /// Drives at a time; each keeps two cores busy
    #[arg(long, value_name = "N", default_value_t = 1)]
    jobs: usize,
    /// Run every drive once more without the filter, to time all columns
    #[arg(long)]
    all_columns: bool,
    /// Run every drive once more, pair by pair: all history is discarded before each pair. Its raw
    /// flow is listed beside the other
    #[arg(long)]
    pairs: bool,
    /// Write rows and facts only: for many processes that share a folder, with the report written
    /// last
    #[arg(long)]
    rows_only: bool,
}

/// Evaluates, writes and prints. Drives that fail are named at the end; the others are evaluated.
pub fn run(args: &Args) -> Result<(), Error> {
    let settings = Settings { all_columns: args.all_columns, ..args.inputs.settings()? };
    let out = args.out.as_deref().ok_or_else(|| Error::Usage("--out is missing".into()))?;
    let (names, whole) = match &args.list {
        None => (names(&args.drives)?, true),
        Some(list) => names_of_list(list, args.shard)?,
    };
    let (done, mut failed) = all(&names, &settings, out, args.jobs.max(1))?;
    let mut pairs = Vec::new();
    if args.pairs {
        let alone = Settings { history: false, all_columns: false, ..settings.clone() };
        let (done, more) = all(&names, &alone, &out.join(PAIRS), args.jobs.max(1))?;
        pairs = done;
        failed.extend(more.into_iter().map(|(name, e)| (format!("{name}, pair by pair"), e)));
    }
    if !done.is_empty() && !args.rows_only && whole {
        conclude(&done, &pairs, &settings, out)?.print(out);
    }
    failures("drives", &failed)
}

/// An error that lists what failed, if anything did.
fn failures(what: &str, failed: &[(String, impl std::fmt::Display)]) -> Result<(), Error> {
    if failed.is_empty() {
        return Ok(());
    }
    let list = failed.iter().map(|(name, e)| format!("{name}: {e}"));
    let list = list.collect::<Vec<_>>().join("\n  ");
    Err(Error::Usage(format!("{} {what} failed:\n  {list}", failed.len())))
}

/// Passes the rows of all drives in a folder of results to `each`.
fn read_rows(
    drives: &[Facts],
    out: &Path,
    mut each: impl FnMut(&Facts, &Row),
) -> Result<(), Error> {
    for facts in drives {
        let file = Files::of(out, &facts.drive).rows;
        rows_file::read(&file, |rows| rows.iter().for_each(|row| each(facts, row)))?;
    }
    Ok(())
}

/// Passes the rows of a folder of results to `each`, with the number of their drive. Returns the
/// number of drives.
pub fn rows_of(out: &Path, mut each: impl FnMut(usize, &Row)) -> Result<usize, Error> {
    let folder = out.join("rows");
    let entries = std::fs::read_dir(&folder).map_err(Error::reading(&folder))?;
    let mut files: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    files.sort();
    for (drive, file) in files.iter().enumerate() {
        rows_file::read(file, |rows| rows.iter().for_each(|row| each(drive, row)))?;
    }
    Ok(files.len())
}

/// A name for every drive: that of its folder.
fn names(drives: &[PathBuf]) -> Result<BTreeMap<String, PathBuf>, Error> {
    let (mut names, mut folded) = (BTreeMap::new(), BTreeMap::new());
    for path in drives {
        let full = path.canonicalize().map_err(Error::reading(path))?;
        let name = full.file_name().unwrap_or_default().to_string_lossy().into_owned();
        names.insert(name.clone(), path.clone());
        // Some file systems ignore case.
        if let Some(other) = folded.insert(name.to_lowercase(), path) {
            let what = format!("has the same name as {}", other.display());
            return Err(Error::input(path, "", what));
        }
    }
    Ok(names)
}

/// A name for every drive of a part of a list: its path, in one piece. Also returns whether the
/// part is the whole list.
fn names_of_list(
    list: &Path,
    shard: Option<Shard>,
) -> Result<(BTreeMap<String, PathBuf>, bool), Error> {
    let shard = shard.map_or_else(Shard::of_environment, Ok)?;
    let mut names = BTreeMap::new();
    for ListedRecording { data, place } in batch::part(list, shard)?.0 {
        names.insert(name_of(&place), data);
    }
    Ok((names, shard.of == 1))
}

/// A path in one piece, unique across all parts of a list.
fn name_of(place: &Path) -> String {
    let parts = place.iter().map(|part| part.to_string_lossy());
    let parts = parts.map(|part| part.replace('%', "%25").replace('+', "%2B"));
    parts.collect::<Vec<_>>().join("+")
}

/// Drives that were evaluated, and those that failed.
type Outcome = (Vec<Facts>, Vec<(String, RunError)>);

/// Evaluates all drives into the folder `out`, `jobs` at a time. Fails if the folder cannot be
/// created, and after a signal: finished drives are kept.
fn all(
    names: &BTreeMap<String, PathBuf>,
    settings: &Settings,
    out: &Path,
    jobs: usize,
) -> Result<Outcome, Error> {
    for folder in ["rows", "drives", "panels"] {
        atomic::create_folder(&out.join(folder))?;
    }
    raywake::console::listen();
    let list: Vec<_> = names.iter().collect();
    let (next, done) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    let work = || {
        while let Some((name, path)) = list.get(next.fetch_add(1, Ordering::Relaxed)) {
            if interrupted() {
                return;
            }
            let result = drive::evaluate(path, name, settings, out);
            let mut done = done.lock().expect("no thread panics with it");
            done.insert(name.to_string(), result);
            say(&done[*name], name, done.len(), list.len());
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..jobs.min(list.len()) {
            scope.spawn(work);
        }
    });
    if interrupted() {
        return Err(Error::Usage("interrupted; finished drives are kept".into()));
    }
    let (mut good, mut bad) = (Vec::new(), Vec::new());
    for (name, result) in done.into_inner().expect("no thread panicked with it") {
        match result {
            Ok((facts, _)) => good.push(facts),
            Err(e) => bad.push((name, e)),
        }
    }
    Ok((good, bad))
}

fn say(result: &Result<(Facts, bool), RunError>, name: &str, n: usize, of: usize) {
    match result {
        Ok((_, true)) => eprintln!("[{n}/{of}] {name}: already done"),
        Ok((f, false)) => {
            let rate = f.sweeps as f64 / f.seconds;
            eprintln!(
                "[{n}/{of}] {name}: {} sweeps, {:.1} s, {rate:.1} sweeps/s",
                f.sweeps, f.seconds
            );
        }
        Err(e) => eprintln!("[{n}/{of}] {name}: failed: {e}"),
    }
}
