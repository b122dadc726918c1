//! The metrics that scene flow on KITTI is reported in (Liu et al., "FlowNet3D", CVPR 2019), and
//! the angle in space and time of Argoverse 2's own tools (av2-api), whose strict and relaxed
//! accuracies are the same two.
//!
//! An error is accepted below a length or below a share of the true motion, and an outlier above
//! either. Where the vehicle's motion is removed, what stands has no motion at all, so that every
//! error there, however small, is an outlier: give them flow with the vehicle's motion in it
//! ([`Scored::with_ego_motion`]), or look at what moves only.

use super::{Category, Scored};
use glam::{DVec3, DVec4};
use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// Error below which an estimate is accurate, in metres and as a share of the true motion.
const STRICT: f64 = 0.05;

/// The same, relaxed.
const RELAXED: f64 = 0.1;

/// Error above which it is an outlier, m, and as a share of the true motion.
const OUTLIER: [f64; 2] = [0.3, 0.1];

/// Kept away from division by zero, m.
const EPSILON_M: f64 = 1e-10;

/// Fourth component of flow in space and time: time between sweeps, s.
const PAIR_S: f64 = 0.1;

/// Whether things truly move over ground ([`Scored::moving`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointMotion {
    /// At least [`super::MOVING_M`].
    Moving,
    /// Less: parked where they are objects.
    Standing,
    /// Either.
    Any,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Sums {
    count: u64,
    strict: u64,
    relaxed: u64,
    outliers: u64,
    error_m: f64,
    angle_rad: f64,
}

impl AddAssign for Sums {
    fn add_assign(&mut self, other: Sums) {
        self.count += other.count;
        self.strict += other.strict;
        self.relaxed += other.relaxed;
        self.outliers += other.outliers;
        self.error_m += other.error_m;
        self.angle_rad += other.angle_rad;
    }
}

/// Sums over pairs, by category and motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AccuracyTable {
    /// Standing and moving.
    cells: Vec<[Sums; 2]>,
}

/// The figures; all but the count are NaN where there is nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accuracy {
    /// Number of returns.
    pub count: u64,
    /// Mean endpoint error (EPE3D), m.
    pub epe_m: f64,
    /// Share with an error below 0.05 m or 5 % (AccS, Acc3DS).
    pub strict: f64,
    /// Share with an error below 0.1 m or 10 % (AccR, Acc3DR).
    pub relaxed: f64,
    /// Share with an error above 0.3 m or 10 % (Outliers3D).
    pub outliers: f64,
    /// Mean angle between (flow, 0.1 s) as estimated and as it is, rad.
    pub angle_rad: f64,
}

impl Default for AccuracyTable {
    fn default() -> AccuracyTable {
        AccuracyTable { cells: vec![[Sums::default(); 2]; Category::COUNT] }
    }
}

impl AccuracyTable {
    /// Counts the returns of a pair, near and far.
    pub fn add(&mut self, points: &[Scored]) {
        for p in points {
            self.cells[p.category.index()][usize::from(p.moving())] += measure(p);
        }
    }

    /// Whether it is whole; one read from a file need not be.
    pub fn is_whole(&self) -> bool {
        self.cells.len() == Category::COUNT
    }

    /// Adds what was counted elsewhere.
    pub fn merge(&mut self, other: &AccuracyTable) {
        for (mine, theirs) in self.cells.iter_mut().zip(&other.cells) {
            mine[0] += theirs[0];
            mine[1] += theirs[1];
        }
    }

    /// Over the categories that `of` names.
    pub fn accuracy(&self, of: impl Fn(Category) -> bool, motion: PointMotion) -> Accuracy {
        let mut sums = Sums::default();
        for category in Category::all().filter(|&c| of(c)) {
            let [standing, moving] = self.cells[category.index()];
            if motion != PointMotion::Moving {
                sums += standing;
            }
            if motion != PointMotion::Standing {
                sums += moving;
            }
        }
        let mean = |sum: f64| sum / sums.count as f64;
        Accuracy {
            count: sums.count,
            epe_m: mean(sums.error_m),
            strict: mean(sums.strict as f64),
            relaxed: mean(sums.relaxed as f64),
            outliers: mean(sums.outliers as f64),
            angle_rad: mean(sums.angle_rad),
        }
    }
}

fn measure(point: &Scored) -> Sums {
    let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let (truth, estimate) = (vector(point.truth_m), vector(point.estimate_m));
    let error_m = (estimate - truth).length();
    let share = error_m / (truth.length() + EPSILON_M);
    let below = |limit: f64| u64::from(error_m < limit || share < limit);
    Sums {
        count: 1,
        strict: below(STRICT),
        relaxed: below(RELAXED),
        outliers: u64::from(error_m > OUTLIER[0] || share > OUTLIER[1]),
        error_m,
        angle_rad: angle(truth, estimate),
    }
}

/// Angle between two motions in space and time, rad.
fn angle(a: DVec3, b: DVec3) -> f64 {
    let unit = |v: DVec3| {
        let v: DVec4 = v.extend(PAIR_S);
        v / v.length()
    };
    unit(a).dot(unit(b)).clamp(-1.0, 1.0).acos()
}
