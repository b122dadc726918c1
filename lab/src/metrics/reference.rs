//! Reference estimates that need no estimator: the scores of no motion, and of the truth on a
//! lattice.

use super::Pair;
use glam::DVec3;

/// No motion over ground: the figures of the vehicle's motion alone, which metrics with the
/// vehicle's motion removed give away for free.
pub fn zero_motion(pair: &Pair) -> Vec<[f32; 3]> {
    vec![[0.0; 3]; pair.points.len()]
}

/// No motion relative to the vehicle, not even that caused by its own motion: all-zero flow if the
/// vehicle's motion is part of it, as in KITTI's scene flow. Returned over ground, like all
/// estimates here: everything moves with the vehicle.
pub fn carried(pair: &Pair) -> Vec<[f32; 3]> {
    let first_from_second = pair.second_from_first.inverse();
    let carried = |position: [f32; 3]| {
        let p = DVec3::from_array(position.map(f64::from));
        (first_from_second.transform(p) - p).as_vec3().to_array()
    };
    pair.points.iter().map(|p| carried(p.position_m)).collect()
}

/// The truth rounded to whole cells of `cell_m` along the first sweep's axes: perfect matching on a
/// grid without refinement (halves go to the even cell).
pub fn rounded(pair: &Pair, cell_m: f32) -> Vec<[f32; 3]> {
    let round = |v: f32| (v / cell_m).round_ties_even() * cell_m;
    pair.points.iter().map(|p| p.flow_m.map(round)).collect()
}
