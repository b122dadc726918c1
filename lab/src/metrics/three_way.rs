//! Three-way endpoint error: the Argoverse 2 scene flow challenge of 2023 (Chodosh et al.,
//! "Re-Evaluating LiDAR Scene Flow", WACV 2024).
//!
//! Mean errors, in metres, of what moves at least 0.05 m per pair (0.5 m/s at 10 Hz) among the
//! labelled objects, of the rest of them, and of the background.

use super::{Bucket, Category, Class, MOVING_M, Range, Scored, SpeedTable};
use serde::{Deserialize, Serialize};

/// Sums over pairs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ThreeWayEpe {
    table: SpeedTable,
}

/// The figures: a bucket each, of which the mean error counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThreeWayErrors {
    /// Objects of all graded classes that move.
    pub foreground_dynamic: Bucket,
    /// The same objects where they stand.
    pub foreground_static: Bucket,
    /// What moves without a label, of which truth made from boxes has none.
    pub background_dynamic: Bucket,
    /// Everything else without a label.
    pub background_static: Bucket,
}

impl Default for ThreeWayEpe {
    fn default() -> ThreeWayEpe {
        ThreeWayEpe { table: SpeedTable::new(vec![0.0, MOVING_M]) }
    }
}

impl ThreeWayEpe {
    /// Counts the returns of a pair.
    pub fn add(&mut self, points: &[Scored]) {
        self.table.add(points);
    }

    /// Whether it is whole; one read from a file need not be.
    pub fn is_whole(&self) -> bool {
        self.table.fits(&ThreeWayEpe::default().table)
    }

    /// Adds what was counted elsewhere.
    pub fn merge(&mut self, other: &ThreeWayEpe) {
        self.table.merge(&other.table);
    }

    /// One category, standing and moving, also of those that no class holds.
    pub fn category(&self, category: Category, range: Range) -> [Bucket; 2] {
        [0, 1].map(|i| self.table.bucket(|c| c == category, range, i))
    }

    /// The figures so far.
    pub fn errors(&self, range: Range) -> ThreeWayErrors {
        let background = |c: Category| c.class() == Some(Class::Background);
        let foreground = |c: Category| c.class().is_some_and(|class| class != Class::Background);
        ThreeWayErrors {
            foreground_dynamic: self.table.bucket(foreground, range, 1),
            foreground_static: self.table.bucket(foreground, range, 0),
            background_dynamic: self.table.bucket(background, range, 1),
            background_static: self.table.bucket(background, range, 0),
        }
    }
}

impl ThreeWayErrors {
    /// The mean that ranks, m: of objects that move, objects that stand and the background that
    /// stands. NaN where one of them is empty.
    pub fn mean_epe_m(&self) -> f64 {
        let three = [self.foreground_dynamic, self.foreground_static, self.background_static];
        three.iter().map(|b| b.epe_m).sum::<f64>() / 3.0
    }
}
