//! Registration of a cluster: Gauss-Newton on point-to-plane residuals under a Geman-McClure
//! kernel.
//!
//! As in generalised ICP (Segal, Haehnel and Thrun, RSS 2009) each pair of nearest returns is
//! weighted by the surface it lies on; the robust kernel (Geman and McClure, 1985) is wide at
//! first, then narrow. Correspondences run both ways, from the cluster to the other sweeps and from
//! the second sweep back, so that an end coming into view or leaving it does not bias the result.
//!
//! Returns are only paired with returns of the same sensor. Two scanners see a dynamic object at
//! different times; between two sweeps of one scanner it has moved for about one period.

use super::cluster::{CloudPoints, Cluster};
use super::motion::{Motion, TARGETS_MAX};
use super::sample::{Mean, SurfaceWeight, minus, squared_distance};
use super::scaled::Scaled;
use super::scans::Target;
use crate::column_set::ColumnSet;
use nalgebra::{Matrix3, Vector3};

/// A cluster is registered with at most this many of the sweeps it is compared with: over a longer
/// time its speed changes. With the third one, from 0.3 s before, the median error of the movers of
/// KITTI drive 0005 is 3.1 cm instead of 2.2.
const REGISTERED: usize = 2;

/// Normal equations of a step: x, y and the rotation about the centre.
struct NormalEquations<'a> {
    scaled: &'a Scaled,
    centre: [f32; 2],
    kernel: f32,
    /// Upper triangle of the information matrix.
    h: [f32; 6],
    g: [f32; 3],
    /// How much later the returns of each target are than their counterparts, s.
    delay: [Mean; TARGETS_MAX],
}

impl<'a> NormalEquations<'a> {
    /// Equations with only the priors: a weak one on the displacement, in case every return is
    /// missed, and one on how large a rotation is likely.
    fn new(scaled: &'a Scaled, motion: &Motion, kernel: f32) -> NormalEquations<'a> {
        let (hold, turn) = (scaled.hold_information, scaled.params.turn_sigma_rad);
        NormalEquations {
            scaled,
            centre: motion.centre,
            kernel,
            h: [hold, 0.0, 0.0, hold, 0.0, 1.0 / (turn * turn)],
            g: [0.0, 0.0, -motion.delta.z / (turn * turn)],
            delay: Default::default(),
        }
    }

    /// Adds a pair of returns `off` apart; the one at `source` moves by `share` of the motion.
    fn add(&mut self, weight: &SurfaceWeight, source: [f32; 3], off: [f32; 3], share: f32) {
        let (kernel, noise) = (self.kernel, self.scaled.return_sigma);
        let ratio = self.scaled.params.information_ratio;
        let fall = 1.0 / (1.0 + squared_distance(weight, off) / (kernel * kernel));
        let w = fall * fall * share * ratio / (noise * noise);
        let [xx, xy, xz, yy, yz, _] = weight.map(|v| v * w);
        // Rows of the transposed Jacobian: x, y and the rotation about the centre.
        let [a, b] = [self.centre[1] - source[1], source[0] - self.centre[0]];
        let (tx, ty) = (xx * a + xy * b, xy * a + yy * b);
        let (h, g) = (&mut self.h, &mut self.g);
        h[0] += share * xx;
        h[1] += share * xy;
        h[2] += share * tx;
        h[3] += share * yy;
        h[4] += share * ty;
        h[5] += share * (a * tx + b * ty);
        let fx = xx * off[0] + xy * off[1] + xz * off[2];
        let fy = xy * off[0] + yy * off[1] + yz * off[2];
        g[0] += fx;
        g[1] += fy;
        g[2] += a * fx + b * fy;
    }

    /// The step and its covariance, unless the equations are singular.
    fn solve(&self) -> Option<(Vector3<f32>, Matrix3<f32>)> {
        let [xx, xy, xt, yy, yt, tt] = self.h;
        let h = Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt);
        let inverse = h.try_inverse()?;
        Some((inverse * Vector3::from(self.g), inverse))
    }
}

impl Cluster<'_> {
    /// Registers every `stride`-th return of the cluster, starting at `motion`.
    pub fn align(&self, mut motion: Motion, stride: usize, visited: &mut ColumnSet) -> Motion {
        let (scaled, targets) = (self.scans.scaled, self.scans.targets);
        let (targets, others) = targets.split_at(targets.len().min(REGISTERED));
        let mut seen = self.target_samples(&motion, visited);
        let mut wide = scaled.params.iterations_wide;
        for _ in 0..scaled.params.iterations {
            // Earlier sweeps help once the motion is nearly right.
            let (kernel, targets) = match wide {
                0 => (scaled.kernel, targets),
                _ => (scaled.kernel_wide, &targets[..1]),
            };
            let mut equations = NormalEquations::new(scaled, &motion, kernel);
            targets.iter().for_each(|t| self.add_pairs(&mut equations, &motion, t, stride));
            self.add_reverse_pairs(&mut equations, &motion, &seen, stride);
            let Some((step, covariance)) = equations.solve() else { break };
            motion.delta += step;
            motion.covariance = covariance;
            motion.delay = equations.delay.map(|mean| mean.value() / self.scans.span_s as f32);
            // For a sweep that is not registered with: in proportion to its share of the motion.
            for other in others {
                motion.delay[other.index] = other.share * motion.delay[0];
            }
            let small = step.norm_squared() < scaled.converged * scaled.converged;
            if wide == 0 && small {
                break;
            }
            if wide > 0 {
                wide = if small { 0 } else { wide - 1 };
                if wide == 0 {
                    seen = self.target_samples(&motion, visited);
                }
            }
        }
        motion
    }

    /// Pairs the cluster's returns with their nearest ones in a target sweep.
    fn add_pairs(&self, to: &mut NormalEquations, motion: &Motion, target: &Target, stride: usize) {
        let share = target.share(motion);
        for s in self.samples.iter().step_by(stride) {
            let at = target.predict(s, motion);
            if let Some((_, q)) = target.cloud.nearest(at, s.sensor, self.scans.reach_exact()) {
                let weight = self.scans.first.weight(self.scans.scaled, s.index);
                to.add(&weight, s.at, minus(q.at, at), share);
                to.delay[target.index].add(q.offset_s - s.offset_s);
            }
        }
    }

    /// Pairs returns of the second sweep with their nearest ones in the first.
    fn add_reverse_pairs(
        &self,
        to: &mut NormalEquations,
        motion: &Motion,
        seen: &CloudPoints,
        stride: usize,
    ) {
        let target = &self.scans.targets[0];
        let share = target.share(motion);
        for q in seen.iter().step_by(stride) {
            let at = target.retrace(q, motion);
            if let Some((_, p)) = self.scans.first.nearest(at, q.sensor, self.scans.reach_exact()) {
                let weight = self.scans.second().weight(self.scans.scaled, q.index);
                to.add(&weight, p.at, minus(at, p.at), share);
                to.delay[0].add(q.offset_s - p.offset_s);
            }
        }
    }
}
