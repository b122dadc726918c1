//! `raywake-lab growth`: how the time of a sweep grows with its returns, the window and the
//! traffic.
//!
//! Every row is a simulated drive through one street; each group of rows varies one quantity.

use crate::report::{Cell, Report, Results, Table, TableRow};
use raywake::args::FlowChoice;
use raywake::choose;
use raywake::config;
use raywake::error::RunError;
use raywake::order_statistics::Spread;
use raywake::team;
use raywake::weight_files::WeightFiles;
use raywake_core::params::Profile;
use raywake_core::sweep::Sweep;
use raywake_sim::{Drive, Options, Sensor, SensorRig, SimSweep};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Options of `growth`.
#[derive(clap::Args)]
pub struct Args {
    /// Folder of results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Sweeps of each drive
    #[arg(short = 'n', value_name = "COUNT", default_value = "24")]
    #[arg(value_parser = clap::value_parser!(u16).range(5..=1000))]
    sweeps: u16,
    /// Seed of all drives
    #[arg(long, value_name = "SEED", default_value = "1")]
    seed: u64,
    #[command(flatten)]
    flow: FlowChoice,
}

/// Columns of an OS1-128 at ten revolutions a second: its own settings, plus one below and one
/// above.
const COLUMNS: [usize; 5] = [256, 512, 1024, 2048, 2720];
/// Amounts of traffic; 1 is a busy street.
const DENSITIES: [f64; 4] = [0.0, 0.5, 1.0, 2.0];
/// Height of the sensor, m.
const HEIGHT_M: f64 = 1.9;
/// Sweeps not counted, while memory is touched for the first time and tracks begin.
const UNCOUNTED: usize = 3;
/// Stages that have their own column of times; the others appear only in the sum.
const STAGES: [&str; 4] = ["ray_trace", "occupancy_constancy", "refine", "track"];

/// One row.
struct Case {
    changed: &'static str,
    profile: Profile,
    columns: usize,
    density: f64,
}

/// Measurements of a drive.
#[derive(Default)]
struct Measured {
    returns: f64,
    foreground: f64,
    total_ms: Vec<f64>,
    stages_ms: BTreeMap<&'static str, Vec<f64>>,
    /// The backend and device that did the work.
    backend: String,
}

/// Drives, measures, writes and prints.
///
/// # Errors
/// Any error of a step; an output that cannot be written.
pub fn run(args: &Args) -> Result<(), RunError> {
    team::lead(team::available(), || {
        let profile = config::profile(&args.flow.profile)?;
        let measured = |case: Case| measure(args, &case).map(|measured| (case, measured));
        let all = cases(&profile).into_iter().map(measured).collect::<Result<Vec<_>, _>>()?;
        report(args, &all)?.print(&args.out);
        Ok(())
    })
}

fn cases(profile: &Profile) -> Vec<Case> {
    let case = |changed, profile: &Profile, columns, density| Case {
        changed,
        profile: profile.clone(),
        columns,
        density,
    };
    let returns = COLUMNS.map(|columns| case("returns", profile, columns, 1.0));
    // The shipped windows, and half the smallest.
    let shipped = [Profile::hdl64(), Profile::wide(), Profile::far()].map(|shipped| shipped.side);
    let windows = [shipped[0] / 2, shipped[0], shipped[1], shipped[2]].map(|side| {
        let other = Profile { side, ..profile.clone() };
        case("window", &other, 1024, 1.0)
    });
    let traffic = DENSITIES.map(|density| case("traffic", profile, 1024, density));
    returns.into_iter().chain(windows).chain(traffic).collect()
}

fn measure(args: &Args, case: &Case) -> Result<Measured, RunError> {
    let sensor = Sensor { columns: case.columns, ..Sensor::os1_128() };
    let rig = SensorRig::single(sensor, HEIGHT_M);
    let (sweeps, density) = (usize::from(args.sweeps), case.density);
    let drive = Drive::new(args.seed, Options { sweeps, rig, density, ..Options::default() });
    let rig = drive.rig();
    let sweeps: Vec<SimSweep> = drive.collect();
    let weights = WeightFiles::read(&args.flow.learned, &case.profile)?;
    let mut drive = choose::drive(&args.flow.backend, &weights, &case.profile, &rig)?.drive;
    let (on, simd) = (drive.backend(), drive.simd().name());
    let backend = format!("{}, {}; {simd} on the CPU", on.name(), on.device());
    let mut measured = Measured { backend, ..Measured::default() };
    for (n, seen) in sweeps.iter().enumerate() {
        let before = n.checked_sub(1).map_or(&[][..], |n| &sweeps[n].points);
        let (world_from_vehicle, twist) = (seen.world_from_vehicle, seen.twist);
        let sweep =
            Sweep { stamp_s: seen.stamp_s, points: &seen.points, world_from_vehicle, twist };
        let stepped = drive.step(&sweep, before)?;
        if n < UNCOUNTED {
            continue;
        }
        measured.returns += seen.points.len() as f64;
        measured.foreground += stepped.output.foreground as f64;
        measured.total_ms.push(stepped.laps.stages().map(|(_, ms)| ms).sum());
        for (stage, ms) in stepped.laps.stages() {
            measured.stages_ms.entry(stage).or_default().push(ms);
        }
    }
    Ok(measured)
}

fn row(case: &Case, measured: &Measured) -> TableRow {
    let counted = measured.total_ms.len().max(1) as f64;
    let median = |ms: &Vec<f64>| Spread::of(ms).map_or(f64::NAN, |spread| spread.median);
    let stage = |name| measured.stages_ms.get(name).map_or(f64::NAN, median);
    let edge_m = f64::from(case.profile.side) * case.profile.voxel_m;
    let first = [
        Cell::from(case.changed),
        Cell::Number(measured.returns / counted, 0),
        Cell::Number(edge_m, 1),
        Cell::Number(measured.foreground / counted, 0),
        Cell::Number(median(&measured.total_ms), 1),
    ];
    let stages = STAGES.map(|name| Cell::Number(stage(name), 1));
    TableRow::new(first.into_iter().chain(stages))
}

fn report(args: &Args, all: &[(Case, Measured)]) -> Result<Results, RunError> {
    let subject = format!("An OS1-128 in a simulated street, seed {}", args.seed);
    let mut report = Report::new("How a sweep's time grows", &subject);
    report.fact("Backend", &all[0].1.backend);
    let rows = all.iter().map(|(case, measured)| row(case, measured)).collect();
    let columns = ["changed", "returns a sweep", "window, m", "foreground columns", "sweep, ms"];
    let columns = columns.into_iter().chain(STAGES).collect::<Vec<_>>();
    let counted = usize::from(args.sweeps) - UNCOUNTED;
    let caption = format!("medians of {counted} sweeps, {} threads", team::threads());
    report.section("Growth").table(Table::new("growth", &caption, &columns, rows));
    Ok(report.write(&args.out)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_thing_changes_at_a_time() {
        let usual = Profile::hdl64();
        let all = cases(&usual);
        for case in &all {
            let changes =
                [case.columns != 1024, case.profile.side != usual.side, case.density != 1.0];
            let name = ["returns", "window", "traffic"].iter().position(|n| *n == case.changed);
            let others = changes.iter().enumerate().filter(|(n, _)| Some(*n) != name);
            assert!(others.clone().all(|(_, changed)| !changed), "{}", case.changed);
            case.profile.check().unwrap();
        }
        assert_eq!(all.len(), COLUMNS.len() + 4 + DENSITIES.len());
    }
}
