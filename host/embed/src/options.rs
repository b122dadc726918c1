//! What an estimator is told when it is made.

use core::fmt;

use raywake_core::params::{Profile, ProfileError};
use raywake_core::sweep::{Point, Rig};
use raywake_core::weights::WeightsError;

use crate::place::is_pose;

/// What an estimator is to be made for.
#[derive(Clone, Debug)]
pub struct EstimatorOptions {
    /// Every number of the flow.
    pub profile: Profile,
    /// Where the sensors sit, and what their returns' times mean.
    pub rig: Rig,
    /// Returns that a sweep has at most. Of more than the profile's
    /// [`returns_max`](Profile::returns_max), so many are taken, evenly.
    pub points_max: usize,
    /// Whether poses are found by registration, as none are given.
    pub registers: bool,
    /// Whether objects are followed, too.
    pub objects: bool,
}

/// Why there is no estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CreateError {
    /// A parameter of the profile is not what it must be.
    Profile(ProfileError),
    /// The rig has no sensor, or a place, a height or a time of it is none.
    Rig,
    /// The shipped weights do not fit the profile: its `levels` are others.
    Weights(WeightsError),
    /// It needs so many bytes.
    Memory(usize),
}

impl fmt::Display for CreateError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            CreateError::Profile(e) => write!(f, "parameter `{}` must be {}", e.field, e.must),
            CreateError::Rig => write!(f, "the rig needs a sensor, and finite places and times"),
            CreateError::Weights(why) => {
                write!(f, "the shipped weights do not fit the profile: {why}")
            }
            CreateError::Memory(bytes) => write!(f, "{bytes} bytes of memory are needed"),
        }
    }
}

impl EstimatorOptions {
    /// Whether there can be such an estimator.
    pub(crate) fn check(&self) -> Result<(), CreateError> {
        self.profile.check().map_err(CreateError::Profile)?;
        if !is_sound(&self.rig) {
            return Err(CreateError::Rig);
        }
        // What has so many returns is no sweep; and sums of bytes stay sums.
        match self.points_max.checked_mul(4 * size_of::<Point>()) {
            Some(bytes) if bytes < isize::MAX as usize => Ok(()),
            _ => Err(CreateError::Memory(usize::MAX)),
        }
    }
}

fn is_sound(rig: &Rig) -> bool {
    let places = !rig.sensors.is_empty() && rig.sensors.iter().all(is_pose);
    places && rig.timing.is_sound() && rig.ground_m.is_finite() && is_box(rig)
}

fn is_box(rig: &Rig) -> bool {
    rig.own_vehicle.iter().flatten().flatten().all(|c| c.is_finite())
}
