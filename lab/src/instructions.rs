//! `raywake-lab instructions`: instructions per sweep, stage by stage, as counted by Valgrind. The
//! counts do not depend on how busy the machine is.
//!
//! The command runs itself under Callgrind and there requests a count at the end of every stage.

use crate::report::{Cell, Report, Results, Table, TableRow};
use raywake::args::{BackendChoice, BackendKind, Learned, ProfileChoice};
use raywake::choose;
use raywake::config;
use raywake::error::RunError;
use raywake::weight_files::WeightFiles;
use raywake_core::perceive::StageTimer;
use raywake_core::sweep::Point;
use raywake_io::Error;
use raywake_io::sink::atomic;
use raywake_io::source::simulated::Simulated;
use raywake_io::source::{OpenOptions, Source, SweepData, open, whole};
use std::ffi::{CStr, OsString};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Options of `instructions`.
#[derive(clap::Args)]
pub struct Args {
    /// Recording with poses, in any format that `raywake run` reads [default: a simulated street]
    #[arg(value_name = "DATA")]
    data: Option<PathBuf>,
    /// Folder of results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Sweeps; one takes a second under Valgrind
    #[arg(short = 'n', value_name = "COUNT", default_value = "24")]
    #[arg(value_parser = clap::value_parser!(u16).range(2..=1000))]
    sweeps: u16,
    #[command(flatten)]
    profile: ProfileChoice,
    #[command(flatten)]
    learned: Learned,
}

/// Name given to what is counted between two sweeps.
const BETWEEN: &str = "between sweeps";
/// What Callgrind writes before a name, and before a count.
const NAMED: &str = "desc: Trigger: Client Request: ";
const COUNTED: &str = "totals: ";
/// Longest stage name kept; longer ones are cut.
const NAME_MAX: usize = 63;

/// Runs itself under Callgrind, writes and prints; under Callgrind, runs the sweeps.
///
/// # Errors
/// If Valgrind is missing or counts nothing; any error of a step; an output that cannot be written.
pub fn run(args: &Args) -> Result<(), RunError> {
    if raywake_callgrind::is_under_valgrind() {
        return step_by_step(args);
    }
    atomic::create_folder(&args.out)?;
    let file = args.out.join("callgrind.out");
    watched(&file)?;
    let counts = Counts::of(&whole::read_text(&file)?);
    if counts.stages.is_empty() {
        return Err(Error::input(&file, "", "no stage was counted").into());
    }
    report(args, &counts)?.print(&args.out);
    Ok(())
}

/// Runs this program under Callgrind with the same arguments.
fn watched(file: &Path) -> Result<(), Error> {
    let failed = |what: String| Error::Usage(format!("valgrind: {what}"));
    let own = std::env::current_exe().map_err(|e| failed(e.to_string()))?;
    let mut valgrind = Command::new("valgrind");
    valgrind.args(["--quiet", "--tool=callgrind", "--combine-dumps=yes", "--dump-line=no"]);
    let mut to = OsString::from("--callgrind-out-file=");
    to.push(file);
    valgrind.arg(to).arg(own);
    let done = valgrind.args(std::env::args_os().skip(1)).output();
    let done = done.map_err(|e| failed(format!("cannot be run: {e}")))?;
    match done.status.success() {
        true => Ok(()),
        false => Err(failed(String::from_utf8_lossy(&done.stderr).trim().to_owned())),
    }
}

/// Requests a count at the end of each stage.
struct Counter;

impl StageTimer for Counter {
    fn lap(&mut self, stage: &'static str) {
        // A step must not allocate.
        let mut name = [0; NAME_MAX + 1];
        let length = stage.len().min(NAME_MAX);
        name[..length].copy_from_slice(&stage.as_bytes()[..length]);
        if let Ok(name) = CStr::from_bytes_until_nul(&name) {
            raywake_callgrind::dump(name);
        }
    }

    fn measured(&mut self, _: &mut dyn Iterator<Item = (&'static str, f64)>, rest: &'static str) {
        self.lap(rest);
    }
}

/// Runs the sweeps on one thread.
fn step_by_step(args: &Args) -> Result<(), RunError> {
    let sweeps = usize::from(args.sweeps);
    let mut source: Box<dyn Source> = match &args.data {
        Some(data) => open(data, &OpenOptions { trusted: true, ..OpenOptions::default() })?,
        None => Box::new(Simulated::new(1, sweeps)),
    };
    let profile = config::profile(&args.profile)?;
    let weights = WeightFiles::read(&args.learned, &profile)?;
    let backend = BackendChoice { backend: BackendKind::Scalar, ..BackendChoice::default() };
    let mut drive = choose::drive(&backend, &weights, &profile, source.rig())?.drive;
    let (mut before, mut sweep) = (Vec::<Point>::new(), SweepData::default());
    for index in 0..source.len().min(sweeps) {
        before.clone_from(&sweep.points);
        source.read(index, &mut sweep)?;
        Counter.lap(BETWEEN);
        drive.step_timed(&sweep.sweep(), &before, &mut Counter)?;
    }
    Ok(())
}

/// The counts, without the first sweep, which has no pair.
#[derive(Default)]
struct Counts {
    sweeps: u64,
    /// Instructions of all sweeps by stage, in the order they run in a sweep.
    stages: Vec<(String, u64)>,
}

impl Counts {
    /// Reads Callgrind's output.
    fn of(text: &str) -> Counts {
        let (mut counts, mut name, mut first) = (Counts::default(), None, true);
        for line in text.lines() {
            if let Some(of) = line.strip_prefix(NAMED) {
                name = Some(of);
            }
            let count = line.strip_prefix(COUNTED).and_then(|count| count.trim().parse().ok());
            match count.and_then(|count| name.take().map(|name| (name, count))) {
                Some((BETWEEN, _)) => counts.sweeps += u64::from(!std::mem::take(&mut first)),
                Some((name, count)) if counts.sweeps > 0 => counts.add(name, count),
                _ => {}
            }
        }
        counts
    }

    fn add(&mut self, name: &str, count: u64) {
        match self.stages.iter_mut().find(|(known, _)| known == name) {
            Some((_, sum)) => *sum += count,
            None => self.stages.push((name.to_owned(), count)),
        }
    }

    /// A row for each stage, and one for the total.
    fn rows(&self) -> Vec<TableRow> {
        let all: u64 = self.stages.iter().map(|(_, count)| count).sum();
        let row = |(name, count): (&str, u64)| {
            let millions = count as f64 / self.sweeps.max(1) as f64 / 1e6;
            let share = 100.0 * count as f64 / all.max(1) as f64;
            TableRow::new([Cell::from(name), Cell::Number(millions, 2), Cell::Number(share, 1)])
        };
        let stages = self.stages.iter().map(|(name, count)| (name.as_str(), *count));
        stages.chain([("all", all)]).map(row).collect()
    }
}

fn report(args: &Args, counts: &Counts) -> Result<Results, Error> {
    let subject = args.data.as_ref().map(|data| data.display().to_string());
    let subject = subject.unwrap_or_else(|| "A simulated street".into());
    let mut report = Report::new("Instructions of a sweep", &subject);
    report.fact("Backend", "scalar, one thread");
    let caption = format!("mean of {} sweeps", counts.sweeps);
    let columns = ["stage", "millions a sweep", "%"];
    let table = Table::new("instructions", &caption, &columns, counts.rows());
    report.section("Instructions").table(table);
    report.write(&args.out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Callgrind's output, without the costs of functions.
    fn part(name: &str, count: u64) -> String {
        format!("part: 1\n\ndesc: Trigger: Client Request: {name}\n\ntotals: {count}\n")
    }

    #[test]
    fn the_first_sweep_and_what_is_between_are_left_out() {
        let parts = [
            (BETWEEN, 900),
            ("rays", 50),
            (BETWEEN, 800),
            ("rays", 1_000_000),
            ("refine", 2_000_000),
            (BETWEEN, 700),
            ("rays", 1_000_000),
            ("refine", 4_000_000),
        ];
        let end = "desc: Trigger: Program termination\n\ntotals: 77\n";
        let text = parts.map(|(name, count)| part(name, count)).concat() + end;
        let counts = Counts::of(&text);
        assert_eq!(counts.sweeps, 2);
        let table = Table::new("instructions", "", &["a"; 3], counts.rows()).text();
        let rows: Vec<Vec<&str>> = table.lines().map(|l| l.split_whitespace().collect()).collect();
        for expected in
            [["rays", "1.00", "25.0"], ["refine", "3.00", "75.0"], ["all", "4.00", "100.0"]]
        {
            let row = |row: &Vec<&str>| row.iter().filter(|w| **w != "|").eq(expected.iter());
            assert!(rows.iter().any(row), "{table}");
        }
    }
}
