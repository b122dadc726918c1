//! `raywake-lab device`: runs the program on a Vulkan device and on the CPU alone, with every
//! built-in profile: the results must be the same, and the times are compared.

use crate::program::{ProgramBuild, ProgramRun, sibling_program};
use crate::report::{Cell, Report, Results, Table, TableRow};
use raywake::error::RunError;
use raywake_core::params::Profile;
use raywake_core::stages::FLOW_PROGRAMS;
use raywake_io::Error;
use raywake_io::sink::atomic;
use raywake_kernels::schedule::Schedule;
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

/// Numbers of CPU cores tried, as far as the machine has that many.
const CORES: [usize; 5] = [1, 2, 4, 8, 16];

/// A run on the device, and one without it.
struct RunPair {
    name: String,
    device: ProgramRun,
    scalar: ProgramRun,
}

/// Runs, compares, writes and prints.
///
/// # Errors
/// If a run fails, results differ or an output cannot be written.
pub fn run(args: &Args) -> Result<(), RunError> {
    atomic::create_folder(&args.out)?;
    let path = args.program.clone().unwrap_or_else(sibling_program);
    let program =
        ProgramBuild { path: &path, data: &args.data, sweeps: args.sweeps, out: &args.out };
    let index = args.device.map(|index| index.to_string());
    let both = |name: &str, before: &[&str], profile: &str| {
        let common = ["--profile", profile, "--backend"];
        let mut vulkan = [&common[..], &["vulkan"]].concat();
        vulkan.extend(index.as_ref().into_iter().flat_map(|index| ["--device", index]));
        let device = program.run(before, &vulkan)?;
        let scalar = program.run(before, &[&common[..], &["scalar"]].concat())?;
        let other = device.text("digest") != scalar.text("digest");
        let failure = other.then_some("different results").or(device.get("device_failure"));
        if let Some(what) = failure {
            return Err(Error::Usage(format!("{name}, {}: {what}", device.text("device"))));
        }
        Ok(RunPair { name: name.to_owned(), device, scalar })
    };
    let shipped = Profile::shipped();
    let profiles = shipped.iter().map(|profile| both(&profile.name, &[], &profile.name));
    let profiles = profiles.collect::<Result<Vec<_>, _>>()?;
    let on = |cores: usize| {
        let these = format!("0-{}", cores - 1);
        both(&cores.to_string(), &["taskset", "-c", &these], &shipped[0].name)
    };
    let available = available_parallelism().map_or(1, NonZero::get);
    let threads = CORES.into_iter().filter(|cores| *cores <= available).map(on);
    let threads = threads.collect::<Result<Vec<_>, _>>()?;
    conclude(args, &profiles, &threads)?.print(&args.out);
    Ok(())
}

/// Stages that run on a device, in order.
fn on_device() -> Vec<&'static str> {
    let programs = Schedule::new(FLOW_PROGRAMS, &Profile::hdl64()).programs;
    let mut names = Vec::new();
    for name in programs.iter().flat_map(|p| &p.ops).map(|op| op.name()) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

fn conclude(args: &Args, profiles: &[RunPair], threads: &[RunPair]) -> Result<Results, Error> {
    let name = profiles.first().map_or("", |both| both.device.text("device"));
    let mut report = Report::new("A Vulkan device and the CPU alone", "Side by side, same digest");
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

/// Whole sweeps, and the part of them that the CPU does alongside the device.
fn totals(id: &str, what: &str, runs: &[RunPair]) -> Result<Table, Error> {
    let on_device = on_device();
    let beside = |run: &ProgramRun| -> Vec<(String, f64)> {
        let stages = run.stages_ms().filter(|(name, _)| !on_device.contains(name));
        stages.map(|(name, ms)| (name.to_owned(), ms)).collect()
    };
    let parts = runs.first().map_or(Vec::new(), |both| beside(&both.device));
    let columns = [what, "threads", "CPU alone", "p99", "with the device", "p99", "on the device"];
    let columns: Vec<&str> =
        columns.into_iter().chain(parts.iter().map(|(name, _)| name.as_str())).collect();
    let row = |both: &RunPair| {
        let total =
            |run: &ProgramRun| Ok::<_, Error>([run.total_ms("median")?, run.total_ms("p99")?]);
        let [scalar, device] = [total(&both.scalar)?, total(&both.device)?];
        let used = both.device.summary["threads"].as_f64().unwrap_or_default();
        let cells = [Cell::from(both.name.as_str()), Cell::Number(used, 0)];
        let times = scalar.into_iter().chain(device).map(|ms| Cell::Number(ms, 1));
        let dispatched = on_device.iter().map(|name| both.device.stage_ms(name)).sum();
        let parts = parts.iter().map(|(name, _)| Cell::Number(both.device.stage_ms(name), 1));
        let cells = cells.into_iter().chain(times).chain([Cell::Number(dispatched, 2)]);
        Ok(TableRow::new(cells.chain(parts)))
    };
    let rows = runs.iter().map(row).collect::<Result<Vec<_>, Error>>()?;
    Ok(Table::new(id, "Medians, ms; the last columns with the device", &columns, rows))
}

/// Times of each stage in each profile.
fn stages(profiles: &[RunPair]) -> Table {
    let row = |name: &str| {
        let times = profiles.iter().map(|both| Cell::Number(both.device.stage_ms(name), 3));
        TableRow::new([Cell::from(name)].into_iter().chain(times))
    };
    let columns: Vec<&str> =
        ["stage"].into_iter().chain(profiles.iter().map(|both| both.name.as_str())).collect();
    let rows = on_device().into_iter().map(row).collect();
    Table::new("stages", "Medians, ms a sweep", &columns, rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_core::perceive::MEANWHILE;

    #[test]
    fn stages_of_a_device_are_those_of_its_programs() {
        let stages = on_device();
        assert!(stages.contains(&"copy") && stages.contains(&"expectation"), "{stages:?}");
        assert!(!stages.contains(&"refine") && !stages.contains(&MEANWHILE), "{stages:?}");
    }
}
