//! `raywake-lab check-filter`: a filter against a recorded drive with labelled boxes.

use crate::grid::Grid;
use crate::labels::Footprint;
use crate::train::LEVELS;
use glam::DVec3;
use raywake::source::{OpenOptions, SweepData, open};
use raywake_core::background_filter::{TABLE_WORDS, load, score};
use raywake_core::params::Profile;
use raywake_core::pose::Pose;
use std::collections::{BTreeMap, HashMap};
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

/// Half of the camera's view in which KITTI has labels, degrees.
const VIEW_DEG: f64 = 40.0;

/// Options of `check-filter`.
#[derive(clap::Args)]
pub struct Args {
    /// Weights file.
    #[arg(long, value_name = "FILE")]
    filter: PathBuf,
    /// Recorded drive, with boxes.csv (frame, track_id, class, x, y, z, l, w, h, yaw, ...; vehicle
    /// frame, metres, radians).
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
    let boxes = read_boxes(&args.drive.join("boxes.csv"))?;
    let mut source = open(&args.drive, &OpenOptions::default())?;
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
            tally.column(grid.centre(&window, column), boxes, marked);
        }
    }
    tally.print();
    Ok(())
}

impl Tally {
    fn column(&mut self, at: DVec3, boxes: &[Labelled], marked: bool) {
        self.all.count(marked);
        if at.x <= 0.0 || at.y.atan2(at.x).abs().to_degrees() > VIEW_DEG {
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

fn read_boxes(path: &Path) -> Result<HashMap<u64, Vec<Labelled>>, Box<dyn Error>> {
    let text = fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut boxes: HashMap<u64, Vec<Labelled>> = HashMap::new();
    for (n, line) in text.lines().enumerate().skip(1) {
        let (frame, labelled) =
            read_box(line).ok_or_else(|| format!("{}: line {}: no box", path.display(), n + 1))?;
        boxes.entry(frame).or_default().push(labelled);
    }
    Ok(boxes)
}

fn read_box(line: &str) -> Option<(u64, Labelled)> {
    let fields: Vec<&str> = line.split(',').collect();
    let number = |n: usize| fields.get(n)?.parse::<f64>().ok().filter(|v| v.is_finite());
    let pose = Pose::planar(number(3)?, number(4)?, number(5)?, number(9)?);
    let footprint = Footprint::new(pose, number(6)?, number(7)?);
    Some((fields.first()?.parse().ok()?, Labelled { class: (*fields.get(2)?).into(), footprint }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_read_or_refused() {
        let (frame, b) = read_box("7,3,Van,10,2,-0.8,4,2,1.9,1.5707963,0,0,99").unwrap();
        assert_eq!((frame, b.class.as_str()), (7, "Van"));
        assert!(b.footprint.holds(DVec3::new(10.9, 3.9, 0.0), 0.0));
        assert!(!b.footprint.holds(DVec3::new(11.1, 2.0, 0.0), 0.0));
        assert!(read_box("7,3,Van,10,2,-0.8,4,2,1.9").is_none());
        assert!(read_box("7,3,Van,NaN,2,-0.8,4,2,1.9,0").is_none());
    }
}
