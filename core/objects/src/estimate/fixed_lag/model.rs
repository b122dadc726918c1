//! The model of a window: points that keep what left the window as a prior.

use super::RETURNS;
use super::WindowReturn;
use crate::estimate::nearest::square_distance;
use crate::estimate::observation::Observation;
use crate::estimate::params::FixedLagParams;
use crate::estimate::surface::{Scatter, Surface};
use heapless::Vec;

/// Minimum prior of a model point, in returns: makes its elimination regular.
const PRIOR_RETURNS_MIN: f32 = 0.1;
/// Maximum number of model points.
const MODEL: usize = 128;

#[derive(Clone, Copy)]
pub(super) struct WindowPoint {
    pub at: [f32; 3],
    /// Mean of the returns that left the window.
    pub prior_mean: [f32; 3],
    /// Number of returns that left the window, at most [`FixedLagParams::lag_prior_returns`].
    prior_returns: f32,
    scatter: Scatter,
}

impl WindowPoint {
    /// Converts it to a model point of the equations; `precision` is that of a return, 1/m².
    pub fn surface(&self, precision: f64) -> Surface {
        Surface {
            prior_mean: self.prior_mean,
            prior_precision: precision * f64::from(self.prior_returns.max(PRIOR_RETURNS_MIN)),
            scatter: self.scatter,
            ..Surface::isotropic(precision)
        }
    }
}

/// Model points about `spacing_m` apart.
pub(super) struct WindowModel {
    pub points: Vec<WindowPoint, MODEL>,
    spacing_m: f32,
}

impl WindowModel {
    pub const fn new() -> WindowModel {
        WindowModel { points: Vec::new(), spacing_m: 0.0 }
    }

    pub fn clear(&mut self, params: &FixedLagParams) {
        self.points.clear();
        self.spacing_m = params.lag_point_spacing_m;
    }

    /// Adds a return that leaves the window to its model point.
    pub fn absorb(&mut self, point: u16, local: [f64; 3], params: &FixedLagParams) {
        let Some(point) = self.points.get_mut(usize::from(point)) else { return };
        point.prior_returns = (point.prior_returns + 1.0).min(params.lag_prior_returns);
        for (mean, local) in point.prior_mean.iter_mut().zip(local) {
            *mean += (local as f32 - *mean) / point.prior_returns;
        }
        point.scatter.limit(params.lag_prior_returns);
        point.scatter.add(local, point.at);
    }

    /// Makes model points of those of the last `fresh` returns that have none near, and records the
    /// model point of each return.
    pub fn extend(
        &mut self,
        returns: &mut Vec<WindowReturn, RETURNS>,
        observations: &[Observation],
        fresh: usize,
        params: &FixedLagParams,
    ) {
        let old = returns.len() - fresh;
        for (i, (one, observation)) in returns.iter_mut().zip(observations).enumerate() {
            one.nearest = observation.nearest;
            if i >= old {
                self.add(observation.local_f32(), params);
            }
        }
        if old == 0 {
            self.assign(returns, observations);
        }
    }

    fn add(&mut self, at: [f32; 3], params: &FixedLagParams) {
        if self.has_near(self.points.len(), &at) {
            return;
        }
        while self.points.is_full() {
            self.spacing_m *= params.lag_spacing_growth;
            self.thin();
        }
        let point = WindowPoint { at, prior_mean: at, prior_returns: 0.0, scatter: Scatter::ONE };
        _ = self.points.push(point);
    }

    /// Whether one of the first `count` points is near.
    fn has_near(&self, count: usize, at: &[f32; 3]) -> bool {
        let square = self.spacing_m * self.spacing_m;
        self.points[..count].iter().any(|point| square_distance(&point.at, at) < square)
    }

    /// Removes points closer to an earlier one than the spacing.
    fn thin(&mut self) {
        let mut left = 0;
        for i in 0..self.points.len() {
            let point = self.points[i];
            if !self.has_near(left, &point.at) {
                self.points[left] = point;
                left += 1;
            }
        }
        self.points.truncate(left);
    }

    /// Finds the nearest model points by brute force, for a new model.
    fn assign(&self, returns: &mut [WindowReturn], observations: &[Observation]) {
        for (one, observation) in returns.iter_mut().zip(observations) {
            let local = observation.local_f32();
            let mut best = f32::MAX;
            for (number, point) in self.points.iter().enumerate() {
                let square = square_distance(&point.at, &local);
                if square < best {
                    (best, one.nearest) = (square, number as u16);
                }
            }
        }
    }
}
