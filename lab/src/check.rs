//! `raywake-lab check-filter`: a filter against a recorded drive with labelled boxes.

use crate::grid::Grid;
use crate::labels::{self, Footprint, Labels, View};
use crate::train::LEVELS;
use glam::DVec3;
use raywake::source::{OpenOptions, SweepData, open};
use raywake_core::background_filter::{TABLE_WORDS, load, score};
use raywake_core::params::Profile;
use std::collections::{BTreeMap, HashMap};
use std::error::Error;
use std::fs;
use std::path::PathBuf;

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

/// A labelled box from above.
struct Labelled {
    class: String,
    footprint: Footprint,
}

/// How many there are, and how many of them the filter marks.
#[derive(Clone, Copy, Default)]
struct Share {
    all: usize,
    marked: usize,
}

impl Share {
    fn count(&mut self, marked: bool) {
        self.all += 1;
        self.marked += marked as usize;
    }

    fn percent(&self) -> f64 {
        100.0 * self.marked as f64 / self.all.max(1) as f64
    }
}

/// What the check counts.
#[derive(Default)]
struct Tally {
    sweeps: usize,
    labelled: Share,
    by_class: BTreeMap<String, Share>,
    unlabelled: Share,
    all: Share,
}

/// Measures and prints.
pub fn run(args: &Args) -> Result<(), Box<dyn Error>> {
    let mut table = vec![0; TABLE_WORDS];
    load(&fs::read_to_string(&args.filter)?, LEVELS, &mut table)
        .map_err(|e| format!("{}: {e}", args.filter.display()))?;
    let mut source = open(&args.drive, &OpenOptions::default())?;
    let labels = labels::open(&args.drive, source.as_ref())?;
    labels.notes.iter().for_each(|note| eprintln!("note: {note}"));
    let boxes = by_frame(&labels);
    let mut grid = Grid::new(Profile::hdl64());
    let mut sweep = SweepData::default();
    let mut tally = Tally::default();
    for n in 0..source.len() {
        source.read(n, &mut sweep)?;
        let window = grid.sweep(source.rig(), &sweep.sweep());
        tally.sweeps += 1;
        let boxes = boxes.get(&sweep.frame).map_or(&[][..], Vec::as_slice);
        for column in grid.solid() {
            let marked = score(&grid.step, &table, &grid.columns, column) > 0;
            tally.column(grid.centre(&window, column), labels.view, boxes, marked);
        }
    }
    tally.print();
    Ok(())
}

impl Tally {
    fn column(&mut self, at: DVec3, view: View, boxes: &[Labelled], marked: bool) {
        self.all.count(marked);
        if !view.holds(at) {
            return;
        }
        match boxes.iter().find(|b| b.footprint.holds(at, 0.0)) {
            Some(b) => {
                self.labelled.count(marked);
                self.by_class.entry(b.class.clone()).or_default().count(marked);
            }
            None => self.unlabelled.count(marked),
        }
    }

    fn print(&self) {
        let sweeps = self.sweeps.max(1) as f64;
        println!("sweeps                         {}", self.sweeps);
        println!("labelled solid columns         {}", self.labelled.all);
        println!("  kept (recall)                {:.2} %", self.labelled.percent());
        for (class, share) in &self.by_class {
            println!("    {class:<16} {:>8}   {:.2} %", share.all, share.percent());
        }
        println!("other solid columns in view    {}", self.unlabelled.all);
        println!("  rejected                     {:.2} %", 100.0 - self.unlabelled.percent());
        println!("solid columns per sweep        {:.0}", self.all.all as f64 / sweeps);
        println!("  foreground                   {:.0}", self.all.marked as f64 / sweeps);
    }
}

/// The boxes of every frame.
fn by_frame(labels: &Labels) -> HashMap<u64, Vec<Labelled>> {
    let mut frames: HashMap<u64, Vec<Labelled>> = HashMap::new();
    for track in &labels.tracks {
        for (&frame, &pose) in &track.boxes {
            let footprint = Footprint::new(pose, track.size[0], track.size[1]);
            frames
                .entry(frame)
                .or_default()
                .push(Labelled { class: track.class.clone(), footprint });
        }
    }
    frames
}
