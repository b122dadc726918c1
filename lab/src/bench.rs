//! `raywake-lab bench`: compares two builds of the program side by side on one machine.
//!
//! They take turns on the same sweeps, so that other load on the machine affects both. Only the
//! ratio, pair by pair, carries over to other machines; the times hold for this machine at that
//! moment.

use crate::program::{ProgramBuild, sibling_program};
use crate::report::{Cell, Report, Results, Table, TableRow};
use raywake::error::RunError;
use raywake::order_statistics::Spread;
use raywake_io::Error;
use raywake_io::sink::atomic;
use std::path::{Path, PathBuf};

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
    /// Runs of each, after one that is not counted
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

/// Name, words before the program on the command line, and arguments.
type Setting = (&'static str, &'static [&'static str], &'static [&'static str]);

/// The settings that can be compared.
const SETTINGS: [Setting; 5] = [
    ("one core", &["taskset", "-c", "0"], &["--backend", "scalar"]),
    ("all cores", &[], &["--backend", "scalar"]),
    ("filter off", &[], &["--backend", "scalar", "--filter", "none"]),
    ("wide", &[], &["--backend", "scalar", "--profile", "wide"]),
    ("vulkan", &[], &["--backend", "vulkan"]),
];

/// Figures measured in a run: name, decimals.
const FIGURES: [(&str, usize); 4] =
    [("sweep, median, ms", 2), ("sweep, mean, ms", 2), ("CPU, s", 2), ("wall, s", 2)];

/// The figures of a run.
type Figures = [f64; FIGURES.len()];

/// Runs both builds in turn, writes the report and prints it.
pub fn run(args: &Args) -> Result<(), RunError> {
    let settings = settings(&args.setting)?;
    atomic::create_folder(&args.out)?;
    let program = args.program.clone().unwrap_or_else(sibling_program);
    let mut rows = Vec::new();
    for (name, before, arguments) in settings {
        let of = |program: &Path| measure(args, program, before, arguments);
        let mut pairs = Vec::new();
        for turn in 0..=args.runs {
            let pair = [of(&program)?, of(&args.against)?];
            // The first run only fills the caches.
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
        found.ok_or_else(|| Error::Usage(format!("--setting `{name}` is not one of {}", known())))
    };
    names.iter().map(find).collect()
}

fn measure(
    args: &Args,
    program: &Path,
    before: &[&str],
    arguments: &[&str],
) -> Result<Figures, Error> {
    let program =
        ProgramBuild { path: program, data: &args.data, sweeps: args.sweeps, out: &args.out };
    let ran = program.run(before, arguments)?;
    let [median, mean] = ["median", "mean"].map(|of| ran.total_ms(of));
    Ok([median?, mean?, ran.cpu_s, ran.wall_s])
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
    fn settings_have_names() {
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
