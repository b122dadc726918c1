//! `raywake-lab grade`: the official figures for estimates on an Argoverse 2 log.

use super::argoverse::{Log, read_estimate};
use super::grades::Grades;
use super::{Pair, Range, Rules, ScoreError, print, reference};
use raywake_io::Error;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Cell size to which the truth is rounded for comparison, m: the profiles' voxels.
const CELL_M: f32 = 0.30;

/// Options of `grade`.
#[derive(clap::Args)]
pub struct Args {
    /// Argoverse 2 log, with its map.
    log: PathBuf,
    /// Folder with an estimate, LOG/NUMBER.feather, as `raywake run --export argoverse` writes it
    /// to OUT/argoverse; several are graded side by side.
    #[arg(long, value_name = "FOLDER")]
    estimate: Vec<PathBuf>,
    /// Folder with the truth, LOG/NUMBER.feather [default: SPLIT_sceneflow_feather beside the
    /// folder SPLIT of the log].
    #[arg(long, value_name = "FOLDER")]
    truth: Option<PathBuf>,
    /// Also count returns from the ground; the challenge does not.
    #[arg(long)]
    with_ground: bool,
    /// Grade only every Nth pair of the log; the challenge's own script takes every fifth.
    #[arg(long, value_name = "N", default_value = "1")]
    every: NonZeroUsize,
}

/// An estimate being graded, or a reference to compare it with.
struct Graded {
    name: String,
    from: From,
    grades: Grades,
    /// Returns that count but that the estimate does not vouch for.
    marked_invalid: u64,
}

/// Source of a row's flow.
enum From {
    /// Files by the index of the pair's first sweep.
    Files(BTreeMap<usize, PathBuf>),
    /// The truth itself.
    Reference(Reference),
}

/// Makes an estimate of a pair from its truth.
type Reference = fn(&Pair) -> Vec<[f32; 3]>;

/// Grades and prints.
pub fn run(args: &Args) -> Result<(), Box<dyn std::error::Error>> {
    let mut log = Log::open(&args.log, args.truth.as_deref(), !args.with_ground)?;
    let rules = Rules { ground: args.with_ground, ..Rules::OFFICIAL };
    let mut rows = references();
    for folder in &args.estimate {
        let files = From::Files(log.estimates(folder)?);
        rows.push(Graded::new(&folder.display().to_string(), files));
    }
    let pairs: Vec<(usize, PathBuf)> = log
        .pairs()
        .filter(|(sweep, _)| sweep.is_multiple_of(args.every.get()))
        .map(|(sweep, truth)| (sweep, truth.to_path_buf()))
        .collect();
    for (sweep, truth) in &pairs {
        let pair = log.pair(*sweep)?;
        for row in &mut rows {
            row.add(*sweep, truth, &pair, &rules)?;
        }
    }
    let ground = if args.with_ground { "with ground" } else { "without ground" };
    println!("log {}: {} pairs graded, {ground}", log.name(), pairs.len());
    for row in &rows {
        println!("\n{}", row.name);
        if row.marked_invalid > 0 {
            println!(
                "  {} returns that count are marked invalid in it: graded anyway",
                row.marked_invalid
            );
        }
        print::figures(&row.grades);
        if let From::Files(_) = row.from {
            print::buckets(&row.grades.bucketed.errors(Range::Near));
        }
    }
    Ok(())
}

fn references() -> Vec<Graded> {
    let rows: [(&str, Reference); 3] = [
        ("reference: zero flow, the vehicle's motion known", reference::zero_motion),
        ("reference: zero flow, the vehicle's motion unknown", reference::carried),
        ("reference: truth rounded to 0.30 m", |pair| reference::rounded(pair, CELL_M)),
    ];
    rows.map(|(name, estimate)| Graded::new(name, From::Reference(estimate))).into()
}

impl Graded {
    fn new(name: &str, from: From) -> Graded {
        Graded { name: name.into(), from, grades: Grades::default(), marked_invalid: 0 }
    }

    /// Counts a pair, whose truth is from the file `truth`.
    fn add(&mut self, sweep: usize, truth: &Path, pair: &Pair, rules: &Rules) -> Result<(), Error> {
        let (path, flow_m) = match &self.from {
            From::Reference(estimate) => (truth, estimate(pair)),
            From::Files(files) => {
                let path = files[&sweep].as_path();
                let estimate = read_estimate(path, pair)?;
                self.marked_invalid += estimate.marked_invalid(pair, rules);
                (path, estimate.flow_m)
            }
        };
        self.grades.add(pair, &flow_m, rules).map_err(|e| {
            let path = if matches!(e, ScoreError::Truth { .. }) { truth } else { path };
            Error::input(path, "", e.to_string())
        })
    }
}
