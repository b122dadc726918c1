//! `raywake-lab check-filter`: a filter against a recorded drive with labelled boxes.

use crate::grid::Grid;
use crate::labels::{self, Footprint, Kind};
use crate::train::LEVELS;
use crate::train::curve::{Curve, Operating};
use raywake::error::Error;
use raywake::source::{OpenOptions, SweepData, open};
use raywake_core::background_filter::{TABLE_WORDS, load, score};
use raywake_core::params::Profile;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The recall the dissertation's threshold is chosen for (section 3.4.2).
const RECALL: f64 = 0.95;

/// Options of `check-filter`.
#[derive(clap::Args)]
pub struct Args {
    /// Weights file.
    #[arg(long, value_name = "FILE")]
    filter: PathBuf,
    /// Recorded drive with labels.
    #[arg(long, value_name = "FOLDER")]
    drive: PathBuf,
}

/// A solid column where the drive is labelled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// The filter's, times the scale of its weights; marked if above 0.
    pub score: i32,
    /// What it belongs to: its centre lies in the box of an object of this kind. `None`: background.
    pub kind: Option<Kind>,
}

/// What a filter makes of a drive.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scored {
    /// Sweeps.
    pub sweeps: usize,
    /// Solid columns, labelled or not.
    pub solid: usize,
    /// Those the filter marks.
    pub marked: usize,
    /// Solid columns where the drive is labelled, those in boxes of [`Kind::Other`] left out:
    /// nobody knows whether they could move.
    pub rows: Vec<Row>,
}

/// Scores all solid columns of a labelled drive in the window of [`Profile::hdl64`]; `filter` is
/// the path of a weights file. Fails where one of them cannot be read.
pub fn scored(filter: &Path, drive: &Path) -> Result<Scored, Error> {
    let mut table = vec![0; TABLE_WORDS];
    let text = fs::read_to_string(filter).map_err(Error::reading(filter))?;
    load(&text, LEVELS, &mut table).map_err(|e| Error::input(filter, "", e.to_string()))?;
    let mut source = open(drive, &OpenOptions::default())?;
    let labels = labels::open(drive, source.as_ref())?;
    labels.notes.iter().for_each(|note| eprintln!("note: {note}"));
    let mut grid = Grid::new(Profile::hdl64());
    let mut sweep = SweepData::default();
    let mut scored = Scored { sweeps: source.len(), ..Scored::default() };
    for n in 0..source.len() {
        source.read(n, &mut sweep)?;
        let window = grid.sweep(source.rig(), &sweep.sweep());
        let boxes: Vec<(Kind, Footprint)> = labels
            .tracks
            .iter()
            .filter_map(|t| Some((t, *t.boxes.get(&sweep.frame)?)))
            .map(|(t, pose)| (t.kind, Footprint::new(pose, t.size[0], t.size[1])))
            .collect();
        for column in grid.solid() {
            let score = score(&grid.step, &table, &grid.columns, column);
            scored.solid += 1;
            scored.marked += (score > 0) as usize;
            let at = grid.centre(&window, column);
            let kind = boxes.iter().find(|b| b.1.holds(at, 0.0)).map(|b| b.0);
            if labels.view.holds(at) && kind != Some(Kind::Other) {
                scored.rows.push(Row { score, kind });
            }
        }
    }
    Ok(scored)
}

/// Measures and prints.
pub fn run(args: &Args) -> Result<(), Error> {
    let scored = scored(&args.filter, &args.drive)?;
    let rows = scored.rows.iter().map(|r| (f64::from(r.score), r.kind.is_some(), 1.0));
    let curve = Curve::of(rows).ok_or_else(|| {
        Error::input(&args.drive, "", "its labels leave no column of an object or none beside")
    })?;
    print(&scored, &curve);
    Ok(())
}

fn print(scored: &Scored, curve: &Curve) {
    let mut by_kind: BTreeMap<Kind, [usize; 2]> = BTreeMap::new();
    for row in &scored.rows {
        if let Some(kind) = row.kind {
            by_kind.entry(kind).or_default()[(row.score > 0) as usize] += 1;
        }
    }
    let labelled = by_kind.values().flatten().sum::<usize>();
    let percent = |share: f64| 100.0 * share;
    let line = |name: &str, at: Operating| {
        println!(
            "{name:<18} recall {:.2} %, background accuracy {:.2} %, precision {:.2} %",
            percent(at.recall),
            percent(at.background_accuracy),
            percent(at.precision)
        );
    };
    let per_sweep = |count: usize| count as f64 / scored.sweeps.max(1) as f64;
    println!("sweeps             {}", scored.sweeps);
    println!("labelled columns   {labelled}, {} others in view", scored.rows.len() - labelled);
    line("as shipped", curve.above(0.0));
    line("at 95 % recall", curve.at_recall(RECALL));
    println!("area under curve   {:.4}", curve.auc());
    for (kind, [missed, kept]) in by_kind {
        let share = kept as f64 / (kept + missed) as f64;
        println!(
            "  {:<16} {:>8} columns, {:.2} % kept",
            format!("{kind:?}"),
            kept + missed,
            percent(share)
        );
    }
    println!(
        "solid per sweep    {:.0}, {:.0} of them marked",
        per_sweep(scored.solid),
        per_sweep(scored.marked)
    );
}
