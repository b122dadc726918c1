//! `raywake-lab eval tracks`: chapter 2's tables and figures on objects whose trajectories are
//! known.
//!
//! Segmentation and association are perfect here, as in the dissertation, which discards failures
//! by hand. Every object goes through the baseline and the proposed tracker; errors, the entropy of
//! the cloud and its extent are compared with the truth.

mod entropy;
mod errors;
mod evaluate;
mod extent;
mod figures;
mod front_ends;
mod kept;
mod object;
mod recorded;
mod simulated;
mod tables;
#[cfg(test)]
mod tests;
mod tracker;

use crate::labels::Kind;
use crate::report::{Report, Results, Table};
use crate::simulate::rig;
use errors::Errors;
use evaluate::{OURS, Outcome, PRINTED, evaluate, histories};
use front_ends::Found;
use object::Object;
use raywake::args::{FlowChoice, FrontEndKind};
use raywake::error::RunError;
use raywake_io::Error;
use raywake_objects::estimate::Estimator;
use recorded::Recorded;
use simulated::{Drives, Wanted};
use std::path::PathBuf;
use std::time::Instant;
use tables::Set;

/// `raywake-lab eval tracks`: report.html, tables, charts and pictures.
#[derive(clap::Args)]
pub struct Args {
    /// Labelled drives, recorded or simulated, in addition to the simulated sets; the front ends
    /// run on these
    #[arg(value_name = "DRIVE")]
    drives: Vec<PathBuf>,
    /// Folder of results; the simulated objects are kept there for the next run
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Seed of the simulated sets: 1 to 6 are for choosing parameters
    #[arg(long, default_value_t = 7)]
    seed: u64,
    /// Rig of the simulated sets, as for `sim`: `hdl32x4-full` is the dissertation's at the
    /// devices' full rate
    #[arg(long, value_name = "RIG", default_value = "hdl32x4")]
    sensor: String,
    /// Objects at a time [default: the number of threads the machine runs at once]
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Front ends to run on the drives
    #[arg(long, value_enum, value_name = "KIND,...", value_delimiter = ',')]
    #[arg(default_value = "variance,flow")]
    front_ends: Vec<FrontEndKind>,
    #[command(flatten)]
    flow: FlowChoice,
}

struct Objects {
    id: &'static str,
    name: &'static str,
    objects: Vec<Object>,
}

/// Evaluates, writes and prints.
///
/// Fails if a drive cannot be read or the report cannot be written.
pub fn run(args: &Args) -> Result<(), RunError> {
    let jobs = args.jobs.unwrap_or_else(cores);
    let simulated_drives = Drives { seed: args.seed, rig: rig(&args.sensor)? };
    let begin = Instant::now();
    let mut drives = Vec::new();
    for path in &args.drives {
        let drive = recorded::read(path)?;
        println!(
            "{}: {} parked, {} moving, {} left out",
            path.display(),
            drive.stationary.len(),
            drive.moving.len(),
            drive.left_out
        );
        drives.push(drive);
    }
    let simulated = kept::sets(&args.out, &simulated_drives, &Wanted::full())?;
    eprintln!("objects: {:.1} s", begin.elapsed().as_secs_f64());
    let found = found(args, &drives, jobs)?;
    let mut labels = Errors::default();
    let mut real = [Vec::new(), Vec::new()];
    for drive in drives {
        drive.labels.iter().for_each(|track| labels.merge(&Errors::stationary(track)));
        real[0].extend(drive.stationary);
        real[1].extend(drive.moving);
    }
    let [parked, moving] = real;
    let all = [
        Objects { id: "stationary", name: "simulated, stationary", objects: simulated.stationary },
        Objects { id: "moving", name: "simulated, moving", objects: simulated.moving },
        Objects { id: DRIVES[0], name: "labelled drives, stationary", objects: parked },
        Objects { id: DRIVES[1], name: "labelled drives, moving", objects: moving },
    ];
    let sets: Vec<Set> = all
        .iter()
        .filter(|set| !set.objects.is_empty())
        .map(|set| {
            let begin = Instant::now();
            let outcomes = evaluate(&set.objects, &histories(&set.objects), jobs);
            eprintln!("{}: {:.1} s", set.name, begin.elapsed().as_secs_f64());
            Set { id: set.id.into(), name: set.name.into(), outcomes }
        })
        .collect();
    conclude(args, &all, &sets, &labels, &found)?.print(&args.out);
    Ok(())
}

/// Names of the sets of labelled drives.
const DRIVES: [&str; 2] = ["drives-stationary", "drives-moving"];

/// Results of each front end on the drives; empty without drives.
fn found(
    args: &Args,
    drives: &[Recorded],
    jobs: usize,
) -> Result<Vec<(&'static str, Found)>, RunError> {
    let mut all = Vec::new();
    for &kind in args.front_ends.iter().filter(|_| !drives.is_empty()) {
        let (begin, mut found) = (Instant::now(), Found::default());
        for (path, labelled) in args.drives.iter().zip(drives) {
            found.add(path, kind, labelled, &args.flow, jobs)?;
        }
        let name = match kind {
            FrontEndKind::Variance => "variance of height",
            FrontEndKind::Flow => "scene flow",
        };
        eprintln!("front end, {name}: {:.1} s", begin.elapsed().as_secs_f64());
        all.push((name, found));
    }
    Ok(all)
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Writes the report and returns its tables.
fn conclude(
    args: &Args,
    objects: &[Objects],
    sets: &[Set],
    labels: &Errors,
    found: &[(&'static str, Found)],
) -> Result<Results, Error> {
    let mut report = Report::new("Tracks with shape", "chapter 2, perfect segmentation");
    headlines(&mut report, sets);
    report.fact("Seed", &args.seed.to_string());
    report.fact("Rig of the simulated sets", &args.sensor);
    for set in sets {
        report.fact("Set", &set.about());
    }
    for set in sets {
        let mut all = vec![tables::errors(set), tables::better(set), tables::worst(set)];
        if set.outcomes.iter().any(|o| o.kind != Kind::Car) {
            all.insert(2, tables::kinds(set));
        }
        if set.id == "stationary" {
            all.push(tables::by_distance(set));
        }
        if set.id == DRIVES[0] {
            all[0].rows.push(tables::wandering(labels));
        }
        let section = report.section(&set.name);
        all.into_iter().for_each(|table| _ = section.table(table));
    }
    if !found.is_empty() {
        let section = report.section("Front ends");
        section.text(FRONT_ENDS);
        front_ends(found).into_iter().for_each(|table| _ = section.table(table));
    }
    report.section("Crispness").table(tables::entropies(sets)).table(tables::extents(sets));
    report.section("Convergence").chart(figures::convergence(sets));
    pictures(&mut report, objects, sets)?;
    report.section("What is counted").text(&choices());
    report.write(&args.out)
}

const FRONT_ENDS: &str = "Above, segmentation and association are perfect. Here the labelled \
    objects are followed as found by the front ends; each object counts by its longest track.";

/// What the front ends find, and the errors of the resulting tracks.
fn front_ends(found: &[(&'static str, Found)]) -> Vec<Table> {
    let mut all = vec![tables::front_ends(found)];
    for (n, (name, found)) in found.iter().enumerate() {
        for (stationary, what) in [(true, "stationary"), (false, "moving")] {
            let outcomes: Vec<_> =
                found.outcomes.iter().filter(|o| o.stationary == stationary).cloned().collect();
            if !outcomes.is_empty() {
                let (id, name) = (format!("front-end-{n}-{what}"), format!("{name}, {what}"));
                all.push(tables::errors(&Set { id, name, outcomes }));
            }
        }
    }
    all
}

fn headlines(report: &mut Report, sets: &[Set]) {
    for set in sets {
        let (r, theirs) = (set.rmse(OURS), set.rmse(0));
        report.headline(
            &format!("{:.3} m", r.position),
            &format!("position, {}", set.name),
            &format!("the baseline: {:.3} m", theirs.position),
        );
    }
}

/// Clouds and profiles of a parked car, a cyclist and a bus: for each the one with most returns.
/// Then the parked object on which the estimate as printed is worst.
fn pictures(report: &mut Report, all: &[Objects], sets: &[Set]) -> Result<(), Error> {
    let find = |id: &str, kind: Kind| {
        let set = all.iter().find(|set| set.id == id)?;
        set.objects.iter().filter(|o| o.kind == kind).max_by_key(|o| o.returns.len())
    };
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    let section = report.section("Clouds");
    section.text("Returns in the object's frame, coloured by time from blue to yellow.");
    let shown = [
        ("figure-2-1", find("stationary", Kind::Car)),
        ("figure-2-6", find("moving", Kind::Cyclist)),
        ("figure-2-8", find("moving", Kind::Bus)),
        ("figure-2-9", fault_case(all, sets)),
    ];
    for (id, object) in shown {
        if let Some(object) = object {
            section.picture(figures::cloud(id, object, &mut estimator)?);
        }
    }
    if let Some(bus) = find("moving", Kind::Bus) {
        report.section("Profiles").chart(figures::profile(bus, &mut estimator));
    }
    Ok(())
}

/// The parked object on which the estimate as printed is worst: where it fails, it has seen the
/// same face twice (figure 2.9).
fn fault_case<'a>(all: &'a [Objects], sets: &[Set]) -> Option<&'a Object> {
    let objects = &all.iter().find(|o| o.id == "stationary")?.objects;
    let outcomes = &sets.iter().find(|s| s.id == "stationary")?.outcomes;
    let off = |o: &Outcome| o.scores[PRINTED].errors.rmse().position;
    let pairs = objects.iter().zip(outcomes);
    pairs.max_by(|a, b| off(a.1).total_cmp(&off(b.1))).map(|(object, _)| object)
}

/// Every convention that decides what is counted.
fn choices() -> String {
    format!(
        "Simulated objects are seen from a moving vehicle with exact poses: {}\n\n\
         Recorded ones are the returns in labelled boxes above the ground, each at its own time; \
         the truth of moving ones is their smoothed labels, whose own errors count as ours.\n\n\
         The baseline's states before it has found out which way an object faces are revised, as \
         they are where the proposed tracker starts from them. Its poses between two batches are \
         interpolated linearly. All are compared at the mean time of every batch.\n\n\
         A heading flips if it jumps by more than a right angle relative to the truth, or is \
         farther than that from it over the whole track.",
        simulated::rule()
    )
}
