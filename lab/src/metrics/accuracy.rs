//! The usual scene flow metrics on KITTI (Liu et al., "FlowNet3D", CVPR 2019), and the space-time
//! angle of Argoverse 2's own tools (av2-api), whose strict and relaxed accuracies are the same
//! two.
//!
//! An error is accepted below a length or below a share of the true motion, and is an outlier above
//! either. With the vehicle's motion removed, static structure has no motion at all, so that every
//! error there, however small, is an outlier: use flow that includes the vehicle's motion
//! ([`Scored::with_ego_motion`]), or consider only what moves.

use super::{Category, Scored};
use glam::{DVec3, DVec4};
use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// Error below which an estimate is accurate, both in metres and as a share of the true motion.
const STRICT: f64 = 0.05;

/// The same, relaxed.
const RELAXED: f64 = 0.1;

/// Error above which it is an outlier: in m, and as a share of the true motion.
const OUTLIER: [f64; 2] = [0.3, 0.1];

/// Prevents division by zero, m.
const EPSILON_M: f64 = 1e-10;

/// Fourth component of flow in space-time: time between sweeps, s.
const PAIR_S: f64 = 0.1;

/// Whether returns truly move over ground ([`Scored::moving`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointMotion {
    /// At least [`super::MOVING_M`].
    Moving,
    /// Less: parked, in the case of objects.
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
    /// Static and moving.
    cells: Vec<[Sums; 2]>,
}

/// The figures; all but the count are NaN if there are no returns.
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
    /// Mean angle between the estimated and the true (flow, 0.1 s), rad.
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

    /// Whether the table is complete; one read from a file need not be.
    pub fn is_complete(&self) -> bool {
        self.cells.len() == Category::COUNT
    }

    /// Adds what was counted elsewhere.
    pub fn merge(&mut self, other: &AccuracyTable) {
        for (mine, theirs) in self.cells.iter_mut().zip(&other.cells) {
            mine[0] += theirs[0];
            mine[1] += theirs[1];
        }
    }

    /// The figures over the categories selected by `of`.
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

/// Angle between two motions in space-time, rad.
fn angle(a: DVec3, b: DVec3) -> f64 {
    let unit = |v: DVec3| {
        let v: DVec4 = v.extend(PAIR_S);
        v / v.length()
    };
    unit(a).dot(unit(b)).clamp(-1.0, 1.0).acos()
}
