//! Options for creating an estimator, and why creation fails.

use core::fmt;

use raywake_core::params::{Profile, ProfileError};
use raywake_core::plausible::FRAME_MAX_M;
use raywake_core::sweep::{Point, Rig};
use raywake_core::weights::WeightsError;

use crate::place::is_pose;

/// Options for creating an estimator.
#[derive(Clone, Debug)]
pub struct EstimatorOptions {
    /// All parameters of the flow.
    pub profile: Profile,
    /// Where the sensors sit, and what their returns' times mean.
    pub rig: Rig,
    /// Maximum number of returns of a sweep. Of more than the profile's
    /// [`returns_max`](Profile::returns_max), that many are taken, evenly.
    pub points_max: usize,
    /// Whether poses are found by registration instead of being given.
    pub registers: bool,
    /// Whether objects are tracked too.
    pub objects: bool,
}

/// Why an estimator cannot be created.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CreateError {
    /// A parameter of the profile is invalid.
    Profile(ProfileError),
    /// The rig has no sensor, or one of its places, heights or times is invalid.
    Rig,
    /// The shipped weights do not fit the profile: its `levels` differ.
    Weights(WeightsError),
    /// It needs this many bytes.
    Memory(usize),
}

impl fmt::Display for CreateError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            CreateError::Profile(e) => {
                write!(f, "parameter `{}` must be {}", e.field, e.requirement)
            }
            CreateError::Rig => write!(f, "the rig needs a sensor, and finite positions and times"),
            CreateError::Weights(why) => {
                write!(f, "the shipped weights do not fit the profile: {why}")
            }
            CreateError::Memory(bytes) => write!(f, "{bytes} bytes of memory are needed"),
        }
    }
}

impl EstimatorOptions {
    /// Checks that such an estimator is possible.
    pub(crate) fn check(&self) -> Result<(), CreateError> {
        self.profile.check().map_err(CreateError::Profile)?;
        if !is_valid(&self.rig) {
            return Err(CreateError::Rig);
        }
        // No sweep has this many returns; and sums of bytes do not overflow.
        match self.points_max.checked_mul(4 * size_of::<Point>()) {
            Some(bytes) if bytes < isize::MAX as usize => Ok(()),
            _ => Err(CreateError::Memory(usize::MAX)),
        }
    }
}

fn is_valid(rig: &Rig) -> bool {
    let places =
        !rig.sensors.is_empty() && rig.sensors.iter().all(|pose| is_pose(pose, FRAME_MAX_M));
    places && rig.timing.is_valid() && rig.ground_m.abs() <= FRAME_MAX_M && is_box(rig)
}

fn is_box(rig: &Rig) -> bool {
    rig.own_vehicle.iter().flatten().flatten().all(|c| c.is_finite())
}
