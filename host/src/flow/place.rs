//! The positions of the sensor and the ground of two clouds.

use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_core::sweep::{Point, Rig, Timing};
use raywake_io::source::{mounting, plausible};
use raywake_registration::ground::ground_height;

/// Why sensor and ground could not be placed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unplaced {
    /// No ground height was given, and the first cloud shows no ground.
    #[error("no ground found in this cloud")]
    NoGround,
    /// An implausible value was given.
    #[error("{0}")]
    Implausible(String),
}

/// Sensor and ground as given by the user or estimated from the first cloud, and lines about them.
/// Returns are treated as simultaneous and undistorted.
pub fn rig(
    first: &[Point],
    ground_m: Option<f64>,
    sensor: Option<[f64; 3]>,
) -> Result<(Rig, String), Unplaced> {
    let how = if ground_m.is_some() { "given" } else { "estimated" };
    let ground_m = ground_m.or_else(|| ground_height(first)).ok_or(Unplaced::NoGround)?;
    let (place, why) = match sensor {
        Some(place) => (DVec3::from_array(place), "given"),
        None => match mounting::above(ground_m) {
            None => (DVec3::ZERO, "assumed at the origin of the clouds"),
            Some(place) => (place, "assumed, as the origin is too close to the ground"),
        },
    };
    plausible::ground(ground_m).map_err(Unplaced::Implausible)?;
    let unlikely = |what| Unplaced::Implausible(format!("the sensor: {what}"));
    plausible::place(place).map_err(unlikely)?;
    let rig = Rig {
        sensors: [Pose { translation: place, ..Pose::IDENTITY }].into_iter().collect(),
        timing: Timing::AtStamp,
        distorted: false,
        ground_m,
        own_vehicle: None,
    };
    let DVec3 { x, y, z } = place;
    let text = format!(
        "ground     at {ground_m:.2} m ({how})\nsensor     at ({x:.2}, {y:.2}, {z:.2}) m ({why})\n"
    );
    Ok((rig, text))
}
