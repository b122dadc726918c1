//! Bucket-normalised endpoint error: Khatri et al., "I Can't Believe It's Not Scene Flow!", ECCV
//! 2024, the ranking of the Argoverse 2 scene flow challenge since 2024.
//!
//! Returns are grouped by class and true speed. The first bucket, below 0.04 m per pair (0.4 m/s at
//! 10 Hz), is the class's static error, in metres. In every other the mean error is divided by the
//! mean speed, and the mean over the non-empty buckets is the class's dynamic error: 1 for an
//! estimate of no motion. Every class has equal weight, however few its returns.

use super::{Bucket, Category, Class, Range, Scored, SpeedTable};
use serde::{Deserialize, Serialize};

/// Speed from which on there is a single bucket, m per pair: 20 m/s at 10 Hz.
const MAX_SPEED_M: f64 = 2.0;

/// Buckets below [`MAX_SPEED_M`].
const BUCKETS: usize = 50;

/// Sums over pairs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BucketedEpe {
    table: SpeedTable,
}

/// A class's figures.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassError {
    /// The class.
    pub class: Class,
    /// Mean error of what moves less than 0.04 m, m; NaN if there is none.
    pub static_epe_m: f64,
    /// Mean of the other buckets' normalised errors; NaN if all are empty.
    pub dynamic: f64,
    /// All 51 buckets, the static one first.
    pub buckets: Vec<Bucket>,
}

/// The figures of all classes.
#[derive(Clone, Debug, PartialEq)]
pub struct BucketedErrors {
    /// In the order of [`Class::ALL`].
    pub classes: Vec<ClassError>,
    /// Mean over the classes that have one, m.
    pub mean_static_epe_m: f64,
    /// Mean over the classes that have one: the ranking figure.
    pub mean_dynamic: f64,
}

impl Default for BucketedEpe {
    fn default() -> BucketedEpe {
        let width = MAX_SPEED_M / BUCKETS as f64;
        let mut edges: Vec<f64> = (0..BUCKETS).map(|i| i as f64 * width).collect();
        edges.push(MAX_SPEED_M);
        BucketedEpe { table: SpeedTable::new(edges) }
    }
}

impl BucketedEpe {
    /// Counts the returns of a pair.
    pub fn add(&mut self, points: &[Scored]) {
        self.table.add(points);
    }

    /// Whether the sums are complete; those read from a file need not be.
    pub fn is_complete(&self) -> bool {
        self.table.fits(&BucketedEpe::default().table)
    }

    /// Adds what was counted elsewhere.
    pub fn merge(&mut self, other: &BucketedEpe) {
        self.table.merge(&other.table);
    }

    /// The buckets of one category, including categories that belong to no class.
    pub fn category(&self, category: Category, range: Range) -> Vec<Bucket> {
        self.buckets(|c| c == category, range)
    }

    /// The figures so far.
    pub fn errors(&self, range: Range) -> BucketedErrors {
        let classes = Class::ALL.map(|class| {
            let buckets = self.buckets(|c| c.class() == Some(class), range);
            let dynamic = mean(buckets[1..].iter().map(Bucket::normalised));
            ClassError { class, static_epe_m: buckets[0].epe_m, dynamic, buckets }
        });
        BucketedErrors {
            mean_static_epe_m: mean(classes.iter().map(|c| c.static_epe_m)),
            mean_dynamic: mean(classes.iter().map(|c| c.dynamic)),
            classes: classes.into(),
        }
    }

    fn buckets(&self, of: impl Fn(Category) -> bool, range: Range) -> Vec<Bucket> {
        (0..self.table.buckets()).map(|i| self.table.bucket(&of, range, i)).collect()
    }
}

/// Mean of the values that are not NaN; NaN if there are none.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) =
        values.filter(|v| !v.is_nan()).fold((0, 0.0), |(n, sum), v| (n + 1, sum + v));
    sum / f64::from(count)
}
