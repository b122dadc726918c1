//! All parameters of this crate, by group.

use crate::estimate::EstimateParams;
use crate::front_end::FrontEndParams;
use crate::object_box::BoxParams;
use raywake_core::params::{Parameters, ProfileError};

/// Parameters of tracking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackingParams {
    /// From sweeps to tracks.
    pub front_end: FrontEndParams,
    /// From tracks to trajectories and shapes.
    pub estimate: EstimateParams,
    /// From shapes to boxes.
    pub boxes: BoxParams,
}

impl TrackingParams {
    /// The defaults.
    pub const DEFAULT: TrackingParams = TrackingParams {
        front_end: FrontEndParams::DEFAULT,
        estimate: EstimateParams::DEFAULT,
        boxes: BoxParams::DEFAULT,
    };

    /// Visits every group of parameters, with its name.
    pub fn each(&mut self, visit: &mut dyn FnMut(&'static str, &mut dyn Parameters)) {
        let TrackingParams { front_end, estimate, boxes } = self;
        visit("front_end", front_end);
        visit("passing", &mut front_end.passing);
        visit("filter", &mut front_end.centroid);
        visit("filter_noise", &mut front_end.centroid.noise);
        visit("estimate", estimate);
        visit("estimate_noise", &mut estimate.noise);
        visit("endpoints", &mut estimate.endpoints);
        visit("free_space", &mut estimate.free_space);
        visit("growth", &mut estimate.growth);
        visit("smoothing", &mut estimate.smoothing);
        visit("search", &mut estimate.search);
        visit("fixed_lag", &mut estimate.fixed_lag);
        visit("boxes", boxes);
    }

    /// Checks that every parameter is within its bounds.
    pub fn check(mut self) -> Result<(), ProfileError> {
        let mut result = Ok(());
        self.each(&mut |_, group| result = result.and(group.within_bounds()));
        result
    }
}
