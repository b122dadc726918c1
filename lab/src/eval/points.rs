//! Current metrics for the flow of every return, on drives with labelled boxes or exact truth.

use super::collect::PairData;
use super::objects::Present;
use crate::labels::{View, kind};
use crate::metrics::{
    AccuracyTable, BucketedEpe, Category, Pair, Rules, ThreeWayEpe, TruePoint, reference,
};
use crate::simulate::truth::{self, PointTruth};
use glam::DVec3;
use raywake_core::sweep::Point;
use raywake_io::Error;
use raywake_io::sink::argoverse::displacement;
use raywake_sim::{Class, PERIOD_S};
use serde::{Deserialize, Serialize};

/// Without exact truth, returns without a label up to this height above the plane the vehicle
/// stands on count as ground, m; the graders leave ground out.
pub const GROUND_M: f64 = 0.3;

/// Returns this close outside a box are not scored, m: they may or may not belong to it.
pub const DOUBT_M: f64 = 0.3;

/// The estimates scored.
pub const ESTIMATES: [&str; 3] = ["raywake", "ego motion only", "truth rounded to cells"];

/// Scores of one estimate over some pairs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointScores {
    /// EPE3D, AccS, AccR, outliers.
    pub accuracy: AccuracyTable,
    /// Bucket-normalised error.
    pub bucketed: BucketedEpe,
    /// Three-way error.
    pub three_way: ThreeWayEpe,
}

impl PointScores {
    /// Whether the scores are complete; those read from a file need not be.
    pub fn are_complete(&self) -> bool {
        self.accuracy.is_complete() && self.bucketed.is_complete() && self.three_way.is_complete()
    }

    /// Adds what was counted elsewhere.
    pub fn merge(&mut self, other: &PointScores) {
        self.accuracy.merge(&other.accuracy);
        self.bucketed.merge(&other.bucketed);
        self.three_way.merge(&other.three_way);
    }
}

/// Scores the returns of one drive.
pub struct Points {
    view: View,
    ground_m: f64,
    margin_m: f64,
    cell_m: f64,
    /// In the order of [`ESTIMATES`].
    pub scores: [PointScores; 3],
}

impl Points {
    /// Nothing scored yet.
    pub fn new(view: View, ground_m: f64, margin_m: f64, cell_m: f64) -> Points {
        Points { view, ground_m, margin_m, cell_m, scores: Default::default() }
    }

    /// Scores the first sweep of a pair, against the exact truth of its returns if there is any.
    /// Fails where the graders would.
    pub fn pair(
        &mut self,
        seen: &PairData,
        present: &[Present],
        exact: Option<&[PointTruth]>,
    ) -> Result<(), Error> {
        let now = seen.now();
        let mut points: Vec<TruePoint> = match exact {
            Some(returns) => simulated(seen, returns),
            None => {
                seen.first.points.iter().map(|p| self.boxed(p.position, seen, present)).collect()
            }
        };
        // The pipeline has dropped what is beyond its capacity.
        points.truncate(seen.points.len());
        let pair = Pair { points, second_from_first: seen.then.inverse() * now };
        let ours = seen.points.iter().map(|f| displacement(f, &now, seen.dt_s)).collect();
        let estimates: [Vec<[f32; 3]>; 3] =
            [ours, reference::zero_motion(&pair), reference::rounded(&pair, self.cell_m as f32)];
        for (scores, estimate) in self.scores.iter_mut().zip(&estimates) {
            let scored = pair
                .score(estimate, &Rules::OFFICIAL)
                .map_err(|e| Error::Usage(format!("flow of frame {}: {e}", seen.first.frame)))?;
            scores.accuracy.add(&scored);
            scores.bucketed.add(&scored);
            scores.three_way.add(&scored);
        }
        Ok(())
    }

    /// Truth by the box around a return: without one it is static.
    fn boxed(&self, position_m: [f32; 3], seen: &PairData, present: &[Present]) -> TruePoint {
        let at = DVec3::from_array(position_m.map(f64::from));
        let mut point = TruePoint {
            position_m,
            flow_m: [0.0; 3],
            category: Category::BACKGROUND,
            valid: at.is_finite() && self.view.holds(at),
            ground: false,
        };
        if !point.valid {
            return point;
        }
        let Some(object) = present.iter().find(|p| p.holds(at, self.margin_m)) else {
            point.ground = at.z < self.ground_m + GROUND_M;
            // Noise and swinging limbs stick out of boxes; returns this close to one may belong to
            // it.
            point.valid = !present.iter().any(|p| p.holds(at, self.margin_m + DOUBT_M));
            return point;
        };
        match (object.step, Category::of_kind(object.kind)) {
            (Some(step), Some(category)) => {
                let world = seen.now().transform(at);
                let moved = step.raw.transform(world) - world;
                let flow = seen.now().rotation.conjugate() * moved;
                TruePoint { flow_m: flow.as_vec3().to_array(), category, ..point }
            }
            _ => TruePoint { valid: false, ..point },
        }
    }
}

/// Truth by the simulator.
fn simulated(seen: &PairData, returns: &[PointTruth]) -> Vec<TruePoint> {
    // Flow over one period; the time between a pair may be a little shorter or longer.
    let span = (seen.dt_s / PERIOD_S) as f32;
    let point = |(p, t): (&Point, &PointTruth)| TruePoint {
        position_m: p.position,
        flow_m: t.flow.map(|v| v * span),
        category: category(t.class),
        valid: p.position.iter().all(|v| v.is_finite()),
        ground: t.class == Class::Ground,
    };
    seen.first.points.iter().zip(returns).map(point).collect()
}

/// The category of a simulated class.
fn category(class: Class) -> Category {
    let kind = kind(truth::class_name(class)).filter(|_| class.is_foreground());
    kind.and_then(Category::of_kind).unwrap_or(Category::BACKGROUND)
}
