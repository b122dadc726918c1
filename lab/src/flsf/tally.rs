//! Errors of several methods on the same cells, by class and motion.

use crate::labels::Kind;
use std::collections::BTreeMap;

/// The methods compared.
pub const METHODS: [&str; 5] =
    ["zero flow", "ego motion only", "rounded truth", "occupancy constancy", "learned features"];

/// Errors of a cell by each method, m; `None` if a method has no flow there.
pub type Errors = [Option<f64>; METHODS.len()];

/// Speed over ground from which on an object counts as moving, m/s.
const MOVING_MPS: f64 = 0.5;
/// Largest error that counts as correct, m: one cell (section 3.8.1).
const RIGHT_M: f64 = 0.3;

/// Sums of one method over some cells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorSums {
    /// Cells.
    pub count: usize,
    /// Sum of errors, m.
    pub sum_m: f64,
    /// Cells with an error of at most one cell.
    pub right: usize,
}

impl ErrorSums {
    fn add(&mut self, other: &ErrorSums) {
        self.count += other.count;
        self.sum_m += other.sum_m;
        self.right += other.right;
    }

    /// Mean error, cm.
    pub fn mean_cm(&self) -> f64 {
        100.0 * self.sum_m / self.count as f64
    }

    /// Share of errors within one cell, per cent.
    pub fn within(&self) -> f64 {
        100.0 * self.right as f64 / self.count as f64
    }
}

/// Sums by kind and by whether it moves.
#[derive(Clone, Debug, Default)]
pub struct Tally(BTreeMap<(Kind, bool), [ErrorSums; METHODS.len()]>);

impl Tally {
    /// Counts a cell.
    pub fn add(&mut self, kind: Kind, speed_mps: f64, errors: Errors) {
        let sums = self.0.entry((kind, speed_mps >= MOVING_MPS)).or_default();
        for (sums, error) in sums.iter_mut().zip(errors) {
            if let Some(error) = error {
                sums.add(&ErrorSums {
                    count: 1,
                    sum_m: error,
                    right: usize::from(error <= RIGHT_M),
                });
            }
        }
    }

    /// Kinds seen.
    pub fn kinds(&self) -> Vec<Kind> {
        let mut kinds: Vec<Kind> = self.0.keys().map(|(kind, _)| *kind).collect();
        kinds.dedup();
        kinds
    }

    /// Sums over the wanted kinds and motions.
    pub fn of(&self, wanted: impl Fn(Kind, bool) -> bool) -> [ErrorSums; METHODS.len()] {
        let mut all = [ErrorSums::default(); METHODS.len()];
        for (_, sums) in self.0.iter().filter(|((kind, moves), _)| wanted(*kind, *moves)) {
            all.iter_mut().zip(sums).for_each(|(all, own)| all.add(own));
        }
        all
    }
}
