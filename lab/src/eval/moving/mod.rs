//! Moving or not: what is reported as moving against what moves, by columns and by returns.

mod classes;
mod columns;
mod false_motion;
mod first_sight;
mod reliability;
mod returns;

pub use classes::class_confusion;
pub use columns::ColumnVerdicts;
pub use first_sight::FirstSights;
pub use reliability::MovesReliability;
pub use returns::{ReturnCounts, ReturnVerdicts, Semantic, semantic_kitti};

use super::calibration::truth;
use super::facts::Facts;
use super::objects::CONTINUED_S;
use crate::labels::trajectory::MOVING_MPS;
use crate::report::{Cell, Table, TableRow};
use serde::{Deserialize, Serialize};

/// Up to this distance from a mover's box false motion is forgiven in one of the columns, m:
/// labels, swinging limbs and columns on the border are no more precise.
pub const TOLERANCE_M: f32 = 0.5;
/// Up to this distance false motion counts as near a mover, m: dragged along by its cluster.
pub const NEAR_M: f32 = 2.0;

/// Names of the zones around movers; see [`zone`].
const ZONES: [&str; 3] = ["within 0.5 m of a mover", "0.5 to 2 m", "farther"];

/// The zone at this distance from the nearest mover's box, m.
fn zone(mover_m: f32) -> usize {
    [TOLERANCE_M, NEAR_M].iter().filter(|end| mover_m > **end).count()
}

/// Verdicts on columns or returns whose motion is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MotionCounts {
    /// Moving, and reported so.
    pub found: u64,
    /// Moving, but not reported so.
    pub missed: u64,
    /// Static, but reported as moving, by zone.
    pub wrong: [u64; 3],
}

/// A share; NaN of nothing.
fn share(part: u64, whole: u64) -> f64 {
    if whole == 0 { f64::NAN } else { part as f64 / whole as f64 }
}

fn percent(part: u64, whole: u64) -> Cell {
    Cell::Number(100.0 * share(part, whole), 1)
}

fn per_sweep(count: u64, sweeps: u64) -> Cell {
    Cell::Number(if sweeps == 0 { f64::NAN } else { count as f64 / sweeps as f64 }, 2)
}

impl MotionCounts {
    /// Counts one at this distance from the nearest mover's box, m.
    pub fn add(&mut self, moves: bool, reported: bool, mover_m: f32) {
        match (moves, reported) {
            (true, true) => self.found += 1,
            (true, false) => self.missed += 1,
            (false, true) => self.wrong[zone(mover_m)] += 1,
            (false, false) => {}
        }
    }

    /// Adds what was counted elsewhere.
    pub fn merge(&mut self, other: &MotionCounts) {
        self.found += other.found;
        self.missed += other.missed;
        self.wrong.iter_mut().zip(other.wrong).for_each(|(a, b)| *a += b);
    }

    /// Share of what is reported as moving that does move.
    pub fn precision(&self) -> f64 {
        share(self.found, self.found + self.wrong.iter().sum::<u64>())
    }

    /// The same, ignoring whatever lies within [`TOLERANCE_M`] of a mover.
    pub fn tolerant_precision(&self) -> f64 {
        share(self.found, self.found + self.wrong[1] + self.wrong[2])
    }

    /// False motion farther from movers than [`NEAR_M`].
    pub fn far(&self) -> u64 {
        self.wrong[2]
    }

    /// Share of what moves that is reported so.
    pub fn recall(&self) -> f64 {
        share(self.found, self.found + self.missed)
    }

    /// The cells under [`COLUMNS`], from "True" on.
    fn cells(&self, sweeps: u64) -> Vec<Cell> {
        let MotionCounts { found, missed, wrong } = *self;
        let all_wrong: u64 = wrong.iter().sum();
        let counts = [found, all_wrong, missed].map(Cell::Count);
        let shares = [
            self.precision(),
            self.recall(),
            share(found, found + all_wrong + missed),
            self.tolerant_precision(),
        ];
        let shares = shares.map(|v| Cell::Number(100.0 * v, 1));
        counts.into_iter().chain(shares).chain(wrong.map(|n| per_sweep(n, sweeps))).collect()
    }
}

/// Columns of [`table`].
const COLUMNS: [&str; 12] = [
    "Counted",
    "Truth",
    "True",
    "False",
    "Missed",
    "Precision, %",
    "Recall, %",
    "IoU, %",
    "Precision, 0.5 m forgiven, %",
    "False per sweep within 0.5 m of a mover",
    "0.5 to 2 m",
    "Farther",
];

/// Moving against static, by columns and by returns.
pub fn table(columns: &ColumnVerdicts, drives: &[Facts]) -> Table {
    let mut rows = Vec::new();
    for exact in [true, false] {
        let sweeps = sweeps(drives, exact);
        let mut returns = MotionCounts::default();
        let of = |d: &&Facts| d.exact == exact;
        drives.iter().filter(of).for_each(|d| returns.merge(&d.returns.in_boxes));
        let [of_columns, by_boxes] = [columns.counts(exact), columns.counts_by_boxes(exact)];
        let mut counted = vec![("columns", of_columns), ("returns", returns)];
        if by_boxes != of_columns {
            counted.insert(1, ("columns, with the road below objects", by_boxes));
        }
        for (what, counts) in counted {
            if sweeps > 0 {
                let head = [what, truth(exact)].map(Cell::from).into_iter();
                rows.push(TableRow::new(head.chain(counts.cells(sweeps))));
            }
        }
    }
    let caption = format!(
        "Moving against static: solid columns and returns, true if they belong to an object of \
         {MOVING_MPS} m/s or more and are reported as moving, with a displacement and a velocity \
         of at least that."
    );
    let note = format!(
        "Parked objects and whatever is unlabelled are static; slow objects do not count. \
        IoU is that of SemanticKITTI's moving object segmentation, over all returns in view. False \
        motion is divided by its distance from the nearest box of a mover, seen from above; \
        recorded boxes of movers are continued for {CONTINUED_S} s before the first and after the \
        last. The \
        road below objects, which exact truth distinguishes and boxes do not, counts in a row of \
        its own."
    );
    Table::new("moving-or-not", caption, &COLUMNS, rows).note(&note)
}

/// Pairs of sweeps of drives with boxes.
fn sweeps(drives: &[Facts], exact: bool) -> u64 {
    drives.iter().filter(|d| d.exact == exact && d.has_boxes()).map(|d| d.pairs).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_by_hand() {
        let mut counts = MotionCounts::default();
        let cases = [(true, true, 0.0), (true, false, 0.0), (false, true, 0.5), (false, true, 1.9)];
        let more = [(true, true, 0.0), (false, true, f32::INFINITY), (false, false, 0.1)];
        for (moves, reported, mover_m) in cases.into_iter().chain(more) {
            counts.add(moves, reported, mover_m);
        }
        assert_eq!(counts, MotionCounts { found: 2, missed: 1, wrong: [1, 1, 1] });
        let mut twice = counts;
        twice.merge(&counts);
        let cells = twice.cells(4);
        let number = |n: usize| match cells[n] {
            Cell::Number(value, _) => value,
            _ => panic!("{:?}", cells[n]),
        };
        assert_eq!(cells[..3], [4, 6, 2].map(Cell::Count));
        assert_eq!([3, 5, 6, 7, 9].map(number), [40.0, 100.0 * (4.0 / 12.0), 50.0, 0.5, 0.5]);
    }
}
