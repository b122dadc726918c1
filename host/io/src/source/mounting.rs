//! Where a sensor is mounted if only its clouds are known.

use glam::DVec3;
use raywake_core::params::ANCHOR_ABOVE_GROUND_M;

/// A sensor is not mounted this close to the ground, m: such clouds are in a vehicle's frame, with
/// its origin at an axle or below.
const MOUNTED_MIN_M: f64 = 0.6;

/// The assumed position of the sensor, m, if the origin of its clouds is too close to the ground to
/// be it; `ground_m` is the height of the ground in their frame.
pub fn above(ground_m: f64) -> Option<DVec3> {
    let place = DVec3::new(0.0, 0.0, ground_m + ANCHOR_ABOVE_GROUND_M);
    (ground_m >= -MOUNTED_MIN_M).then_some(place)
}
