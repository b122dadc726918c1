//! `raywake-lab bench`: two builds of the program side by side on one machine.
//!
//! Each runs in turn on the same sweeps, so that what else the machine does meets both. What
//! travels is the ratio, pair by pair; times are those of this machine at that hour.

use crate::report::{Cell, Report, Results, Table, TableRow};
use raywake::error::RunError;
use raywake::order_statistics::Spread;
use raywake_io::Error;
use raywake_io::sink::atomic;
use raywake_io::source::whole;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// `raywake-lab bench`: report.html and a table of ratios.
#[derive(clap::Args)]
pub struct Args {
    /// Recording that both builds run on
    #[arg(value_name = "DATA")]
    data: PathBuf,
    /// The other build of `raywake`
    #[arg(long, value_name = "PROGRAM")]
    against: PathBuf,
    /// This build [default: `raywake` beside this program]
    #[arg(long, value_name = "PROGRAM")]
    program: Option<PathBuf>,
    /// Folder of results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Runs of each, after one that does not count
    #[arg(long, value_name = "COUNT", default_value = "5")]
    #[arg(value_parser = clap::value_parser!(u16).range(1..=1000))]
    runs: u16,
    /// Sweeps of a run
    #[arg(short = 'n', value_name = "COUNT", default_value = "40")]
    sweeps: u32,
    /// Settings to compare, each with a name: `one core`, `all cores`, `filter off`, `wide`,
    /// `vulkan` [default: the first four]
    #[arg(long, value_name = "NAME")]
    setting: Vec<String>,
}

/// Name, what goes before the program, and arguments.
type Setting = (&'static str, &'static [&'static str], &'static [&'static str]);

/// What is compared.
const SETTINGS: [Setting; 5] = [
    ("one core", &["taskset", "-c", "0"], &["--backend", "scalar"]),
    ("all cores", &[], &["--backend", "scalar"]),
    ("filter off", &[], &["--backend", "scalar", "--filter", "none"]),
    ("wide", &[], &["--backend", "scalar", "--profile", "wide"]),
    ("vulkan", &[], &["--backend", "vulkan"]),
];

/// What is measured of a run: name, decimals.
const FIGURES: [(&str, usize); 4] =
    [("sweep, median, ms", 2), ("sweep, mean, ms", 2), ("CPU, s", 2), ("wall, s", 2)];

/// The figures of a run.
type Figures = [f64; FIGURES.len()];

/// Runs both in turn, writes and prints.
pub fn run(args: &Args) -> Result<(), RunError> {
    let settings = settings(&args.setting)?;
    atomic::create_folder(&args.out)?;
    let own = || Some(std::env::current_exe().ok()?.with_file_name("raywake"));
    let program = args.program.clone().or_else(own).unwrap_or_default();
    let mut rows = Vec::new();
    for (name, before, arguments) in settings {
        let of = |program: &Path| measure(args, program, before, arguments);
        let mut pairs = Vec::new();
        for turn in 0..=args.runs {
            let pair = [of(&program)?, of(&args.against)?];
            // The first one fills the caches.
            pairs.extend((turn > 0).then_some(pair));
        }
        rows.extend(compared(name, &pairs));
    }
    conclude(args, &program, rows)?.print(&args.out);
    Ok(())
}

fn settings(names: &[String]) -> Result<Vec<Setting>, Error> {
    if names.is_empty() {
        return Ok(SETTINGS[..4].to_vec());
    }
    let known = || SETTINGS.map(|(name, ..)| name).join(", ");
    let find = |name: &String| {
        let found = SETTINGS.iter().find(|(known, ..)| known == name).copied();
        found.ok_or_else(|| Error::Usage(format!("--setting `{name}` is none of {}", known())))
    };
    names.iter().map(find).collect()
}

/// Runs a program once. A shell between tells the CPU time, as POSIX has it.
fn measure(
    args: &Args,
    program: &Path,
    before: &[&str],
    arguments: &[&str],
) -> Result<Figures, Error> {
    let failed = |what: String| Error::Usage(format!("{}: {what}", program.display()));
    let summary = args.out.join("summary.json");
    let begin = Instant::now();
    let mut shell = Command::new("sh");
    shell
        .args(["-c", "\"$@\" && times", "sh"])
        .args(before)
        .arg(program)
        .arg("run")
        .arg(&args.data);
    shell.args(["--quiet", "-n", &args.sweeps.to_string(), "--summary"]).arg(&summary);
    let done = shell.args(arguments).output();
    let done = done.map_err(|e| failed(format!("cannot be run: {e}")))?;
    let wall_s = begin.elapsed().as_secs_f64();
    if !done.status.success() {
        return Err(failed(String::from_utf8_lossy(&done.stderr).trim().to_owned()));
    }
    let [median, mean] = sweep_ms(&summary)?;
    let times = String::from_utf8_lossy(&done.stdout).into_owned();
    let cpu_s = cpu_s(&times).ok_or_else(|| failed(format!("`times` says {times}")))?;
    Ok([median, mean, cpu_s, wall_s])
}

/// Median and mean time of a sweep, ms, of the summary of a run.
fn sweep_ms(summary: &Path) -> Result<[f64; 2], Error> {
    let text = whole::read_text(summary)?;
    let read: Value = serde_json::from_str(&text)
        .map_err(|e| Error::input(summary, format!("line {}", e.line()), e.to_string()))?;
    let total = |name: &str| read["total_ms"][name].as_f64();
    let both = total("median").zip(total("mean"));
    let none = || Error::input(summary, "", "no pair of sweeps, no time");
    both.map(|(median, mean)| [median, mean]).ok_or_else(none)
}

/// CPU time of a shell's children, s: the second line of `times`, user and system, as `0m1.25s`.
fn cpu_s(times: &str) -> Option<f64> {
    let seconds = |word: &str| {
        let (minutes, seconds) = word.strip_suffix('s')?.split_once('m')?;
        Some(60.0 * minutes.parse::<f64>().ok()? + seconds.parse::<f64>().ok()?)
    };
    let children = times.lines().last()?;
    children.split_whitespace().map(seconds).sum()
}

/// A row for each figure: both medians, and the ratios of pairs.
fn compared(setting: &str, pairs: &[[Figures; 2]]) -> Vec<TableRow> {
    let row = |(n, (figure, decimals)): (usize, &(&str, usize))| {
        let of = |get: &dyn Fn(&[Figures; 2]) -> f64| {
            let mut all: Vec<f64> = pairs.iter().map(get).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let [ours, theirs] = [0, 1].map(|side| of(&|pair| pair[side][n]));
        let ratios = of(&|pair| pair[0][n] / pair[1][n]);
        let middle = |all: &[f64]| Spread::of(all).map_or(f64::NAN, |spread| spread.median);
        let name = [Cell::from(setting), Cell::from(*figure)];
        let times = [middle(&ours), middle(&theirs)].map(|v| Cell::Number(v, *decimals));
        let ratios = [middle(&ratios), ratios[0], ratios[ratios.len() - 1]];
        TableRow::new(name.into_iter().chain(times).chain(ratios.map(|v| Cell::Number(v, 2))))
    };
    FIGURES.iter().enumerate().map(row).collect()
}

fn conclude(args: &Args, program: &Path, rows: Vec<TableRow>) -> Result<Results, Error> {
    let mut report = Report::new("Two builds side by side", "In turn, on the same sweeps");
    report.fact("Builds", &format!("{} against {}", program.display(), args.against.display()));
    let columns =
        ["setting", "figure", "this", "other", "ratio, median", "ratio, least", "ratio, largest"];
    let caption = format!("{} runs each, {} sweeps a run", args.runs, args.sweeps);
    report.section("Ratios").table(Table::new("bench", &caption, &columns, rows));
    report.write(&args.out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_a_shell() {
        assert_eq!(cpu_s("0m0.00s 0m0.01s\n1m2.50s 0m0.25s\n"), Some(62.75));
        assert_eq!(cpu_s("nothing"), None);
        assert!(
            settings(&["wide".into()]).unwrap().len() == 1 && settings(&[]).unwrap().len() == 4
        );
        assert!(settings(&["fast".into()]).unwrap_err().to_string().contains("one core"));
    }

    #[test]
    fn ratios_are_those_of_pairs() {
        let pairs = [[[2.0; 4], [4.0; 4]], [[9.0; 4], [10.0; 4]], [[3.0; 4], [4.0; 4]]];
        let rows = compared("wide", &pairs);
        let table = Table::new("bench", "", &["a"; 7], rows);
        let text = table.text();
        let row = text.lines().find(|line| line.contains("CPU")).unwrap();
        let words: Vec<&str> = row.split_whitespace().filter(|word| *word != "|").collect();
        assert_eq!(words[words.len() - 5..], ["3.00", "4.00", "0.75", "0.50", "0.90"], "{text}");
    }
}
