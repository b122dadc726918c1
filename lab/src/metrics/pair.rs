//! The returns of a pair of sweeps, which of them count, and the errors of an estimate there.

use super::Category;
use glam::DVec3;
use raywake_core::pose::Pose;

/// Chebyshev distance (larger of |x| and |y|) below which a return is near, m.
pub const NEAR_M: f64 = 35.0;

/// Motion over a pair from which on a return moves, m: 0.5 m/s at 10 Hz.
pub const MOVING_M: f64 = 0.05;

/// A return of a pair's first sweep and its true motion to the second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruePoint {
    /// Position in the first sweep's vehicle frame, m.
    pub position_m: [f32; 3],
    /// Motion to the second sweep along the axes of the same frame, m, the vehicle's own removed:
    /// zero for static structure.
    pub flow_m: [f32; 3],
    /// What it belongs to.
    pub category: Category,
    /// Whether the truth is known.
    pub valid: bool,
    /// Whether it belongs to the ground.
    pub ground: bool,
}

/// A pair of sweeps with its truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// All returns of the first sweep.
    pub points: Vec<TruePoint>,
    /// The vehicle's frame at the second sweep from that at the first.
    pub second_from_first: Pose,
}

/// Which returns count; those without truth never do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
    /// Corner of the box in which they count, bounds excluded, in the second sweep's vehicle frame
    /// (positions as at the first sweep), m.
    pub low_m: [f64; 3],
    /// The opposite corner, m.
    pub high_m: [f64; 3],
    /// Whether returns from the ground count.
    pub ground: bool,
}

impl Rules {
    /// The Argoverse 2 challenge's.
    pub const OFFICIAL: Rules =
        Rules { low_m: [-48.0, -48.0, -2.5], high_m: [48.0, 48.0, 2.5], ground: false };
}

/// A return that counts, with its estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scored {
    /// What it belongs to.
    pub category: Category,
    /// Whether it is within [`NEAR_M`] of the vehicle at the second sweep (positions as at the
    /// first).
    pub near: bool,
    /// Length of the true motion over ground, m per pair, rounded to f32 as the grader does.
    pub speed_m: f32,
    /// Length of the difference to the truth, m, rounded likewise.
    pub error_m: f32,
    /// [`TruePoint::position_m`].
    pub position_m: [f32; 3],
    /// True motion, m.
    pub truth_m: [f32; 3],
    /// Estimated motion in the same terms, m.
    pub estimate_m: [f32; 3],
}

/// Why an estimate cannot be scored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ScoreError {
    /// The number of estimates differs from that of returns.
    #[error("{estimates} rows, but the sweep has {points} returns")]
    Rows {
        /// Returns of the sweep.
        points: usize,
        /// Rows of the estimate.
        estimates: usize,
    },
    /// The truth is NaN or infinite (or its square is) for a return that counts.
    #[error("row {row}: the true flow is not finite")]
    Truth {
        /// Row, from 0.
        row: usize,
    },
    /// The same of the estimate.
    #[error("row {row}: the estimated flow is not finite")]
    Estimate {
        /// Row, from 0.
        row: usize,
    },
}

impl Pair {
    /// The returns that count, in the order of the sweep, with `estimates` (m, as in
    /// [`TruePoint::flow_m`], one per return of the sweep).
    pub fn score(&self, estimates: &[[f32; 3]], rules: &Rules) -> Result<Vec<Scored>, ScoreError> {
        if estimates.len() != self.points.len() {
            let (points, estimates) = (self.points.len(), estimates.len());
            return Err(ScoreError::Rows { points, estimates });
        }
        let mut scored = Vec::with_capacity(self.points.len());
        for (row, (point, &estimate)) in self.points.iter().zip(estimates).enumerate() {
            if let Some(near) = self.counts(point, rules) {
                scored.push(compare(row, point, estimate, near)?);
            }
        }
        Ok(scored)
    }

    /// Whether a return counts, and if so whether it is near.
    pub fn counts(&self, point: &TruePoint, rules: &Rules) -> Option<bool> {
        if !point.valid || point.ground && !rules.ground {
            return None;
        }
        let p = DVec3::from_array(point.position_m.map(f64::from));
        let p = self.second_from_first.transform(p).to_array();
        let inside = (0..3).all(|axis| rules.low_m[axis] < p[axis] && p[axis] < rules.high_m[axis]);
        inside.then(|| p[0].abs().max(p[1].abs()) < NEAR_M)
    }
}

fn compare(
    row: usize,
    point: &TruePoint,
    estimate: [f32; 3],
    near: bool,
) -> Result<Scored, ScoreError> {
    let truth = point.flow_m;
    let speed_m = length(truth);
    let error_m = length([0, 1, 2].map(|axis| truth[axis] - estimate[axis]));
    if !speed_m.is_finite() {
        return Err(ScoreError::Truth { row });
    }
    if !error_m.is_finite() {
        return Err(ScoreError::Estimate { row });
    }
    let (category, position_m) = (point.category, point.position_m);
    let (truth_m, estimate_m) = (truth, estimate);
    Ok(Scored { category, near, speed_m, error_m, position_m, truth_m, estimate_m })
}

/// Computed in f32 throughout, as in the grader: a speed on the edge of two buckets must fall into
/// the same one.
fn length([x, y, z]: [f32; 3]) -> f32 {
    (x * x + y * y + z * z).sqrt()
}

impl Scored {
    /// Whether it truly moves over ground.
    pub fn moving(&self) -> bool {
        f64::from(self.speed_m) >= MOVING_M
    }

    /// The same with the vehicle's motion in the flow, as in KITTI's scene flow: a point at `p`
    /// that moves by `f` over ground is found at `second_from_first * (p + f)`. The speed remains
    /// that over ground, and so does the error, up to rounding.
    pub fn with_ego_motion(self, second_from_first: &Pose) -> Scored {
        let p = DVec3::from_array(self.position_m.map(f64::from));
        let seen = |flow: [f32; 3]| {
            let there = p + DVec3::from_array(flow.map(f64::from));
            (second_from_first.transform(there) - p).as_vec3().to_array()
        };
        Scored { truth_m: seen(self.truth_m), estimate_m: seen(self.estimate_m), ..self }
    }
}
