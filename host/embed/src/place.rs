//! When and where a sweep was recorded, and what is refused.

use core::fmt;

use raywake_core::plausible::{WORLD_MAX_M, is_time, is_within};
use raywake_core::pose::{Pose, Twist};

/// When and where a sweep was recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SweepPlace {
    /// Time of the stamp, s.
    pub stamp_s: f64,
    /// `world_from_vehicle` at the stamp; none if it is to be found.
    pub pose: Option<Pose>,
    /// Velocity of the vehicle at the stamp; if none, that between the previous pose and this one.
    pub twist: Option<Twist>,
}

/// Why a sweep was refused. Nothing has changed: the next one may be given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SweepError {
    /// It has more returns than [`points_max`](crate::EstimatorOptions::points_max).
    Points(usize),
    /// Its stamp, pose or twist is not finite or impossible for a vehicle (see
    /// [`plausible`](raywake_core::plausible)), or its rotation is not a unit quaternion.
    Implausible,
    /// A pose is missing although none is to be found, or given although it is to be found.
    Pose,
}

impl fmt::Display for SweepError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            SweepError::Points(most) => write!(f, "a sweep may have at most {most} returns"),
            SweepError::Implausible => write!(
                f,
                "stamp, pose and twist must be finite and possible, the rotation a unit quaternion"
            ),
            SweepError::Pose => {
                write!(f, "poses must be given with every sweep, or found for every sweep")
            }
        }
    }
}

impl SweepPlace {
    /// Whether its numbers are valid.
    pub(crate) fn is_valid(&self) -> bool {
        let moves = self.twist.unwrap_or(Twist::ZERO);
        is_time(self.stamp_s)
            && self.pose.iter().all(|pose| is_pose(pose, WORLD_MAX_M))
            && moves.linear.is_finite()
            && moves.angular.is_finite()
    }
}

/// Whether a pose is no further than `most_m` away along any axis, with a quaternion of unit length
/// to within a thousandth.
pub(crate) fn is_pose(pose: &Pose, most_m: f64) -> bool {
    is_within(pose.translation, most_m) && (pose.rotation.length() - 1.0).abs() < 1e-3
}

/// Normalises the rotation; one that is of unit length but for rounding keeps its bits.
pub(crate) fn normalised(pose: Pose) -> Pose {
    let off = (pose.rotation.length_squared() - 1.0).abs();
    if off <= 4.0 * f64::EPSILON { pose } else { Pose::new(pose.rotation, pose.translation) }
}
