//! Limits beyond which numbers are finite but impossible for a vehicle: arithmetic would overflow,
//! and returns would end up in the wrong places.

use glam::DVec3;

/// Largest distance of a pose from the origin of the world along an axis, m: map grids have origins
/// some thousands of kilometres away.
pub const WORLD_MAX_M: f64 = 1e8;
/// Largest distance of a sensor or the ground from the origin of the returns along an axis, m:
/// there, neighbouring coordinates of a return are 1 mm apart.
pub const FRAME_MAX_M: f64 = 1e4;
/// Largest accepted time, s: 1970 is 1.8e9 s ago.
pub const TIME_MAX_S: f64 = 1e10;

/// Whether a position is no further than `most_m` from the origin along any axis; false for NaN.
pub fn is_within(position: DVec3, most_m: f64) -> bool {
    position.is_finite() && position.abs().max_element() <= most_m
}

/// Whether a time is possible; false for NaN.
pub fn is_time(time_s: f64) -> bool {
    time_s.abs() <= TIME_MAX_S
}
