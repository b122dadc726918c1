//! The metrics on cases worked by hand, on synthetic files, and against the official graders.

mod files;
mod hand;
mod official;

use super::*;
use raywake_core::pose::Pose;

/// A return of a class, ten metres ahead.
fn point(category: &str, flow_m: [f32; 3]) -> TruePoint {
    TruePoint {
        position_m: [10.0, 0.0, 0.0],
        flow_m,
        category: Category::from_name(category).unwrap(),
        valid: true,
        ground: false,
    }
}

/// Returns seen by a stationary vehicle.
fn still(points: Vec<TruePoint>) -> Pair {
    Pair { points, second_from_first: Pose::IDENTITY }
}

fn score(pair: &Pair, estimates: &[[f32; 3]]) -> Vec<Scored> {
    pair.score(estimates, &Rules::OFFICIAL).unwrap()
}
