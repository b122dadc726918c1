//! Errors grouped by category, distance and true speed, over any number of pairs.

use super::{Category, Scored};
use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// A selection of returns by distance, as in both of the grader's tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Range {
    /// Chebyshev distance below [`super::NEAR_M`]: the ranked figures.
    Near,
    /// Everything that counts.
    All,
}

/// The sums of one cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Sums {
    count: u64,
    error_m: f64,
    speed_m: f64,
}

impl AddAssign for Sums {
    fn add_assign(&mut self, other: Sums) {
        self.count += other.count;
        self.error_m += other.error_m;
        self.speed_m += other.speed_m;
    }
}

/// A speed bucket and its returns; means over nothing are NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bucket {
    /// Smallest speed, m per pair.
    pub from_m: f64,
    /// Upper bound of its speeds, excluded, m per pair; infinite for the last.
    pub to_m: f64,
    /// Number of returns.
    pub count: u64,
    /// Mean error (endpoint error, EPE), m.
    pub epe_m: f64,
    /// Mean true speed, m per pair.
    pub mean_speed_m: f64,
}

impl Bucket {
    /// Error relative to speed; 1 for an estimate of no motion.
    pub fn normalised(&self) -> f64 {
        self.epe_m / self.mean_speed_m
    }
}

/// Sums by category, speed bucket and distance.
///
/// The grader averages every pair separately, then the pairs weighted by their counts, which equals
/// the mean over all returns, computed here.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpeedTable {
    /// Lower edges of the buckets, ascending from 0; the last bucket is open.
    edges_m: Vec<f64>,
    /// By category, then bucket; near returns and the others separately.
    cells: Vec<[Sums; 2]>,
}

impl SpeedTable {
    /// An empty table with buckets from each of `edges_m`, which ascend from 0, to the next.
    pub fn new(edges_m: Vec<f64>) -> SpeedTable {
        let cells = vec![[Sums::default(); 2]; Category::COUNT * edges_m.len()];
        SpeedTable { edges_m, cells }
    }

    /// Number of buckets.
    pub fn buckets(&self) -> usize {
        self.edges_m.len()
    }

    /// Counts the returns of a pair.
    pub fn add(&mut self, points: &[Scored]) {
        for p in points {
            let speed = f64::from(p.speed_m);
            // The first edge is 0 and the last bucket open, so that every speed falls into one.
            let bucket = self.edges_m[1..].partition_point(|&edge| edge <= speed);
            let cell = p.category.index() * self.buckets() + bucket;
            self.cells[cell][usize::from(!p.near)] +=
                Sums { count: 1, error_m: p.error_m.into(), speed_m: speed };
        }
    }

    /// Whether another table has the same buckets; one read from a file need not.
    pub fn fits(&self, other: &SpeedTable) -> bool {
        self.edges_m == other.edges_m && self.cells.len() == other.cells.len()
    }

    /// Adds the counts of another table with the same buckets.
    pub fn merge(&mut self, other: &SpeedTable) {
        assert!(self.fits(other), "tables of different metrics");
        for (mine, theirs) in self.cells.iter_mut().zip(&other.cells) {
            mine[0] += theirs[0];
            mine[1] += theirs[1];
        }
    }

    /// Bucket number `bucket` over the categories selected by `of`.
    pub fn bucket(&self, of: impl Fn(Category) -> bool, range: Range, bucket: usize) -> Bucket {
        let mut sums = Sums::default();
        for category in Category::all().filter(|&c| of(c)) {
            let [near, far] = self.cells[category.index() * self.buckets() + bucket];
            sums += near;
            if range == Range::All {
                sums += far;
            }
        }
        let count = sums.count as f64;
        Bucket {
            from_m: self.edges_m[bucket],
            to_m: self.edges_m.get(bucket + 1).copied().unwrap_or(f64::INFINITY),
            count: sums.count,
            epe_m: sums.error_m / count,
            mean_speed_m: sums.speed_m / count,
        }
    }
}
