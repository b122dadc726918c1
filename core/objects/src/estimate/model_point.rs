//! What the returns of a model point say about it.

use super::observation::Observation;
use super::samples::Sample;
use super::state::ControlPoint;
use super::surface::Surface;
use crate::spline::SUPPORT;

/// A model point and its returns.
pub(super) struct ModelPoint<'a> {
    /// Indices of the returns.
    pub members: &'a [u16],
    pub samples: &'a [Sample],
    pub observations: &'a [Observation],
    /// m.
    pub model: [f32; 3],
    pub surface: &'a Surface,
}

/// A model point's own block, which is diagonal, and its right-hand side, in the axes of its
/// surface.
pub(super) struct Block {
    pub precision: [f64; 3],
    pub rhs: [f64; 3],
}

impl<'a> ModelPoint<'a> {
    pub fn returns(&self) -> impl Iterator<Item = (&'a Sample, &'a Observation)> {
        let (samples, observations) = (self.samples, self.observations);
        self.members.iter().map(|&i| (&samples[usize::from(i)], &observations[usize::from(i)]))
    }

    pub fn block(&self) -> Block {
        let Surface { normal: [nx, ny], prior_mean, prior_precision, .. } = *self.surface;
        let back: [f64; 3] = core::array::from_fn(|d| {
            prior_precision * (f64::from(prior_mean[d]) - f64::from(self.model[d]))
        });
        let rhs = [nx * back[0] + ny * back[1], nx * back[1] - ny * back[0], back[2]];
        let mut block = Block { precision: [prior_precision; 3], rhs };
        for (_, observation) in self.returns() {
            for a in 0..3 {
                block.precision[a] += observation.precision[a];
                block.rhs[a] += observation.precision[a] * observation.residual[a];
            }
        }
        block
    }

    /// Range of the basis functions that its returns touch.
    pub fn bases(&self) -> Option<(usize, usize)> {
        let firsts = || self.returns().map(|(sample, _)| sample.basis.first);
        Some((firsts().min()?, firsts().max()? + SUPPORT))
    }

    /// The point's step, m, that follows from a step of the control points.
    pub fn back_substitute(&self, step: &[ControlPoint]) -> [f64; 3] {
        let mut block = self.block();
        for (sample, observation) in self.returns() {
            let [x, y, z, heading] = sample.basis.pose(step);
            for a in 0..2 {
                let axis = observation.axes[a];
                let moved = axis[0] * x + axis[1] * y - observation.by_heading[a] * heading;
                block.rhs[a] -= observation.precision[a] * moved;
            }
            block.rhs[2] -= observation.precision[2] * z;
        }
        let [across, along, up] = core::array::from_fn(|a| block.rhs[a] / block.precision[a]);
        let [nx, ny] = self.surface.normal;
        [nx * across - ny * along, ny * across + nx * along, up]
    }
}
