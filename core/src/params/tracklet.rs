//! Parameters of the tracklet filter.

use super::{Kind, Value};

/// 99 % quantile of chi-square with two degrees of freedom: the gate of a position.
pub const CHI2_99_2DOF: f64 = 9.2103;

/// Where a tracklet is born.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Birth {
    /// At the target cell, in the vehicle's present.
    Target,
    /// At the source cell: one step behind its first prediction, as the author's program does.
    Source,
}

impl Kind for Birth {
    const REQUIREMENT: &'static str = "target or source";

    fn value(self) -> Value<'static> {
        Value::Word(if self == Birth::Target { "target" } else { "source" })
    }

    fn of(value: Value) -> Option<Birth> {
        match value {
            Value::Word("target") => Some(Birth::Target),
            Value::Word("source") => Some(Birth::Source),
            _ => None,
        }
    }
}

crate::params! {
    /// The tracklet filter's parameters (section 3.6.1).
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct TrackletParams {
        /// Standard deviation of a measured position if the flow is in whole cells.
        pub measurement_cells: f32 = 0.5, "cells", (above 0), "Half a cell, whatever its size.";
        /// Standard deviation of the error of the poses from one sweep to the next, added to the
        /// covariance of a displacement, which is relative to the poses.
        pub pose_noise_m: f32 = 0.005, "m", (0 to 1),
            "A guess, which `innovation_sweeps` corrects.";
        /// Process noise of the speed: standard deviation of its change in one second.
        pub speed_noise_mps2: f32 = 1.0, "m/s²", (above 0);
        /// Process noise of the turn rate: standard deviation of its change in one second.
        pub turn_noise_radps2: f32 = 0.6, "rad/s²", (above 0);
        /// Standard deviation of the turn rate at birth.
        pub turn_birth_radps: f32 = 0.2, "rad/s", (above 0);
        /// Limit on the squared Mahalanobis distance of an innovation (3.25).
        pub gate_d2: f32 = CHI2_99_2DOF as f32, "", (above 0),
            "99 % quantile of chi-square with two degrees of freedom.";
        /// Sweeps over which the normalised innovations squared of a tracklet, as an exponential
        /// mean, scale its noise; 0: noise as assumed.
        pub innovation_sweeps: f32 = 8.0, "sweeps", (0 or 1 to 1000);
        /// Minimum scale of the noise: a few innovations may happen to be small.
        pub scale_min: f32 = 0.1, "", (0.0001 to 1);
        /// Maximum scale of the noise: one outlier must not open the gate ever wider.
        pub scale_max: f32 = 10.0, "", (1 to 10000);
        /// Maximum time over which the first displacement of a tracklet at rest is taken to have
        /// happened; whole cells only, as finer displacements show at once.
        pub departure_s: f32 = 1.0, "s", (0.001 to 100);
        /// Where a tracklet is born.
        pub birth: Birth = Birth::Target, "", (any),
            "At the source, the state is one sweep late.";
        /// Whether a tracklet whose cell was not observed takes over an observed column beside it.
        pub takes_over: bool = true, "", (any);
        /// Sweeps a tracklet survives without an observation (5.2.2).
        pub coast_sweeps: u32 = 2, "sweeps", (0 to 20);
    }
}

impl TrackletParams {
    /// The author's choices.
    pub(super) const DISSERTATION: TrackletParams = TrackletParams {
        pose_noise_m: 0.0,
        speed_noise_mps2: 0.5,
        turn_noise_radps2: 0.3,
        // His gate compares the distance itself with the quantile 5.9915.
        gate_d2: 5.9915 * 5.9915,
        innovation_sweeps: 0.0,
        birth: Birth::Source,
        takes_over: false,
        coast_sweeps: 0,
        ..TrackletParams::DEFAULT
    };
}
