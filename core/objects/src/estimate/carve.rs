//! Free space: model points that rays went through.

use super::{Estimator, MODEL_MAX};

/// Rounds of carving, rays that carve, how far beside a model point and how far before their ends
/// they may pass it, m, how steeply through its surface (cosine), how thin that is at least
/// (precision by that of a return), and by what a point outweighs its rays.
pub(super) const CARVINGS: usize = 3;
const RAYS: usize = 1000;
const BESIDE_M: f64 = 0.12;
const BEFORE_M: f64 = 0.25;
const CROSSES: f64 = 0.2;
const THIN: f64 = 0.05;
const SHARE: usize = 8;

impl Estimator {
    /// Takes away model points that rays went through: points of a surface, seen from the side that it
    /// shows, with less returns than rays. How many.
    pub(super) fn carve(&mut self, deviation: f64) -> usize {
        let kept = &self.returns.all()[self.active.clone()];
        let every = kept.len().div_ceil(RAYS).max(1);
        let mut through = [0u16; MODEL_MAX];
        for (kept, seen) in kept.iter().zip(&self.seen).step_by(every) {
            let (from, to) = (seen.frame(kept.origin_from_return()), seen.place());
            let ray: [f64; 3] = core::array::from_fn(|d| to[d] - from[d]);
            let length = libm::sqrt(ray.iter().map(|v| v * v).sum());
            if length < BEFORE_M {
                continue;
            }
            let ray = ray.map(|v| v / length);
            let points = self.now.model[..self.now.points].iter().zip(&self.now.surfaces);
            for ((model, surface), through) in points.zip(&mut through) {
                let arm: [f64; 3] = core::array::from_fn(|d| f64::from(model[d]) - from[d]);
                let along: f64 = arm.iter().zip(ray).map(|(a, r)| a * r).sum();
                let square: f64 = arm.iter().map(|v| v * v).sum();
                let [nx, ny] = surface.normal;
                let crosses = libm::fabs(nx * ray[0] + ny * ray[1]) > CROSSES;
                let thin = surface.precision[0] * deviation * deviation > THIN;
                let near = square - along * along < BESIDE_M * BESIDE_M;
                if near && crosses && thin && along < length - BEFORE_M {
                    *through = through.saturating_add(1);
                }
            }
        }
        let mut left = 0;
        for (number, &through) in through[..self.now.points].iter().enumerate() {
            let returns = usize::from(self.starts[number + 1] - self.starts[number]);
            if usize::from(through) * every * SHARE < returns.max(1) {
                self.now.model[left] = self.now.model[number];
                self.now.surfaces[left] = self.now.surfaces[number];
                left += 1;
            }
        }
        let carved = self.now.points - left;
        if left == 0 {
            return 0;
        }
        self.now.points = left;
        carved
    }
}
