//! Data that only the clouds of a pair's two sweeps have.

use super::surface::LazyWeight;
use super::sweep_returns::SweepReturns;
use crate::frame::central;
use crate::ground::{GroundEstimator, GroundHeights};
use crate::params::{ANCHOR_ABOVE_GROUND_M, CLOUD_MAX, COLUMNS_MAX};
use crate::record::NONE;

/// What is additionally kept for the two sweeps of a pair.
pub struct CloudDetail {
    pub ground: GroundHeights,
    /// Levels above the ground in which something was hit, one bit each, by column.
    pub levels: [u32; COLUMNS_MAX],
    pub weights: [LazyWeight; CLOUD_MAX],
}

impl CloudDetail {
    pub(super) const fn new() -> CloudDetail {
        CloudDetail {
            ground: GroundHeights::new(),
            levels: [0; COLUMNS_MAX],
            weights: [const { LazyWeight::unknown() }; CLOUD_MAX],
        }
    }

    /// Estimates the ground below the returns.
    pub fn find_ground(&mut self, returns: SweepReturns, estimator: &mut GroundEstimator) {
        let profile = returns.profile;
        let middle = central(profile).map(|c| c as f32 + 0.5);
        let level = middle[2] - (ANCHOR_ABOVE_GROUND_M / profile.voxel_m) as f32;
        let found = returns.columns.iter().zip(returns.placed);
        let found = found.filter(|(column, _)| **column != NONE);
        let found = found.map(|(column, placed)| (*column as usize, placed.at));
        let under = [middle[0], middle[1], level];
        let (params, side) = (&profile.ground, profile.side as usize);
        estimator.estimate(params, profile.voxel_m, side, under, found, &mut self.ground);
    }
}
