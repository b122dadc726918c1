//! `raywake-lab device`: the program on a Vulkan device and on the CPU alone, with every built-in
//! profile: the same results, and what each takes.

use crate::program::{ProgramBuild, Ran, beside_this};
use crate::report::{Cell, Report, Results, Table, TableRow};
use raywake::backend::device::MEANWHILE;
use raywake::error::RunError;
use raywake_io::Error;
use raywake_io::sink::atomic;
use std::collections::BTreeSet;
use std::num::NonZero;
use std::path::PathBuf;
use std::thread::available_parallelism;

/// `raywake-lab device`: report.html, and tables of times.
#[derive(clap::Args)]
pub struct Args {
    /// Recording
    #[arg(value_name = "DATA")]
    data: PathBuf,
    /// The program [default: `raywake` beside this program]
    #[arg(long, value_name = "PROGRAM")]
    program: Option<PathBuf>,
    /// Folder of results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Sweeps of a run
    #[arg(short = 'n', value_name = "COUNT", default_value = "40")]
    sweeps: u32,
    /// Device index, see `raywake devices` [default: the fastest]
    #[arg(long, value_name = "N")]
    device: Option<usize>,
}

/// Built-in profiles.
const PROFILES: [&str; 4] = ["hdl64", "wide", "far", "dissertation"];
/// Stages of a sweep that the CPU does, whoever does the others.
const ON_CPU: [&str; 4] = ["rays", "refine", "track", "out"];
/// Numbers of CPU cores that are tried, as far as there are so many.
const CORES: [usize; 5] = [1, 2, 4, 8, 16];

/// A run on the device, and one without it.
struct Both {
    name: String,
    device: Ran,
    scalar: Ran,
}

/// Runs, compares, writes and prints.
///
/// # Errors
/// A run fails, or results differ; an output that cannot be written.
pub fn run(args: &Args) -> Result<(), RunError> {
    atomic::create_folder(&args.out)?;
    let path = args.program.clone().unwrap_or_else(beside_this);
    let program =
        ProgramBuild { path: &path, data: &args.data, sweeps: args.sweeps, out: &args.out };
    let index = args.device.map(|index| index.to_string());
    let both = |name: &str, before: &[&str], profile: &str| {
        let common = ["--profile", profile, "--backend"];
        let mut vulkan = [&common[..], &["vulkan"]].concat();
        vulkan.extend(index.as_ref().into_iter().flat_map(|index| ["--device", index]));
        let device = program.run(before, &vulkan)?;
        let scalar = program.run(before, &[&common[..], &["scalar"]].concat())?;
        if device.text("digest") != scalar.text("digest") {
            let what = format!("{name}: other results on {}", device.text("device"));
            return Err(Error::Usage(what));
        }
        Ok(Both { name: name.to_owned(), device, scalar })
    };
    let profiles = PROFILES.iter().map(|name| both(name, &[], name));
    let profiles = profiles.collect::<Result<Vec<_>, _>>()?;
    let on = |cores: usize| {
        let these = format!("0-{}", cores - 1);
        both(&cores.to_string(), &["taskset", "-c", &these], PROFILES[0])
    };
    let available = available_parallelism().map_or(1, NonZero::get);
    let threads = CORES.into_iter().filter(|cores| *cores <= available).map(on);
    let threads = threads.collect::<Result<Vec<_>, _>>()?;
    conclude(args, &profiles, &threads)?.print(&args.out);
    Ok(())
}

/// Median times of what a device does in a sweep, ms.
fn dispatches(run: &Ran) -> impl Iterator<Item = (&str, f64)> {
    run.stages_ms().filter(|(name, _)| !ON_CPU.contains(name) && *name != MEANWHILE)
}

fn conclude(args: &Args, profiles: &[Both], threads: &[Both]) -> Result<Results, Error> {
    let name = profiles.first().map_or("", |both| both.device.text("device"));
    let mut report = Report::new("A Vulkan device and the CPU alone", "Side by side, one digest");
    report.fact("Device", name);
    report.fact("Sweeps of a run", &args.sweeps.to_string());
    let tables = [totals("profiles", "profile", profiles)?, totals("threads", "cores", threads)?];
    let section = report.section("A sweep");
    for table in tables {
        section.table(table);
    }
    report.section("Stages on the device").table(stages(profiles));
    report.write(&args.out)
}

/// Whole sweeps, and their parts beside the device.
fn totals(id: &str, what: &str, runs: &[Both]) -> Result<Table, Error> {
    let parts = [MEANWHILE, ON_CPU[0], ON_CPU[1], ON_CPU[2], ON_CPU[3]];
    let columns = [what, "threads", "CPU alone", "p99", "with the device", "p99", "on the device"];
    let columns: Vec<&str> = columns.into_iter().chain(parts).collect();
    let row = |both: &Both| {
        let total = |run: &Ran| Ok::<_, Error>([run.total_ms("median")?, run.total_ms("p99")?]);
        let [scalar, device] = [total(&both.scalar)?, total(&both.device)?];
        let of = |part: &str| both.device.stages_ms().find(|(name, _)| *name == part);
        let used = both.device.summary["threads"].as_f64().unwrap_or_default();
        let cells = [Cell::from(both.name.as_str()), Cell::Number(used, 0)];
        let times = scalar.into_iter().chain(device).map(|ms| Cell::Number(ms, 1));
        let dispatched = Cell::Number(dispatches(&both.device).map(|(_, ms)| ms).sum(), 2);
        let parts = parts.map(|part| Cell::Number(of(part).map_or(0.0, |(_, ms)| ms), 1));
        Ok(TableRow::new(cells.into_iter().chain(times).chain([dispatched]).chain(parts)))
    };
    let rows = runs.iter().map(row).collect::<Result<Vec<_>, Error>>()?;
    Ok(Table::new(id, "Medians, ms; the last columns with the device", &columns, rows))
}

/// Each stage of each profile.
fn stages(profiles: &[Both]) -> Table {
    let names: BTreeSet<&str> =
        profiles.iter().flat_map(|b| dispatches(&b.device)).map(|s| s.0).collect();
    let row = |name: &str| {
        let of = |both: &Both| dispatches(&both.device).find(|s| s.0 == name).map_or(0.0, |s| s.1);
        let times = profiles.iter().map(|both| Cell::Number(of(both), 3));
        TableRow::new([Cell::from(name)].into_iter().chain(times))
    };
    let columns: Vec<&str> =
        ["stage"].into_iter().chain(profiles.iter().map(|both| both.name.as_str())).collect();
    Table::new("stages", "Medians, ms a sweep", &columns, names.into_iter().map(row).collect())
}
