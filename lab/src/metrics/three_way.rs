//! Three-way endpoint error: the Argoverse 2 scene flow challenge of 2023 (Chodosh et al.,
//! "Re-Evaluating LiDAR Scene Flow", WACV 2024).
//!
//! Mean errors, in metres, of labelled objects that move at least 0.05 m per pair (0.5 m/s at 10
//! Hz), of labelled objects that do not, and of the background.

use super::{Bucket, Category, Class, MOVING_M, Range, Scored, SpeedTable};
use serde::{Deserialize, Serialize};

/// Sums over pairs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ThreeWayEpe {
    table: SpeedTable,
}

/// The figures: one bucket each, whose mean error counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThreeWayErrors {
    /// Objects of all graded classes that move.
    pub foreground_dynamic: Bucket,
    /// The same objects while static.
    pub foreground_static: Bucket,
    /// Unlabelled returns that move; there are none if the truth is made from boxes.
    pub background_dynamic: Bucket,
    /// All other unlabelled returns.
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

    /// Whether the sums are complete; those read from a file need not be.
    pub fn is_complete(&self) -> bool {
        self.table.fits(&ThreeWayEpe::default().table)
    }

    /// Adds what was counted elsewhere.
    pub fn merge(&mut self, other: &ThreeWayEpe) {
        self.table.merge(&other.table);
    }

    /// One category, static and moving, including categories that belong to no class.
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
    /// The ranking mean, m: of moving objects, static objects and static background. NaN if one of
    /// them is empty.
    pub fn mean_epe_m(&self) -> f64 {
        let three = [self.foreground_dynamic, self.foreground_static, self.background_static];
        three.iter().map(|b| b.epe_m).sum::<f64>() / 3.0
    }
}
