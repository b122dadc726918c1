//! Free-space carving (Kutulakos and Seitz, 2000, on points): a ray that continues beyond a model
//! point shows that nothing is there.

use super::MODEL_MAX;
use super::params::FreeSpaceParams;
use super::problem::Problem;
use super::surface::Surface;

/// A ray in the object's frame: its origin, m, its direction, and the length that carves, m.
struct CarvingRay {
    from: [f64; 3],
    direction: [f64; 3],
    free_m: f64,
}

impl CarvingRay {
    /// None if it is too short to carve.
    fn new(from: [f64; 3], to: [f64; 3], clearance_m: f64) -> Option<CarvingRay> {
        let vector: [f64; 3] = core::array::from_fn(|d| to[d] - from[d]);
        let length = libm::sqrt(vector.iter().map(|v| v * v).sum());
        let direction = vector.map(|v| v / length);
        (length >= clearance_m).then_some(CarvingRay {
            from,
            direction,
            free_m: length - clearance_m,
        })
    }

    /// Whether it passes through a model point of a thin surface.
    fn crosses(
        &self,
        model: &[f32; 3],
        surface: &Surface,
        return_sigma_m: f64,
        params: &FreeSpaceParams,
    ) -> bool {
        let arm: [f64; 3] = core::array::from_fn(|d| f64::from(model[d]) - self.from[d]);
        let along: f64 = arm.iter().zip(self.direction).map(|(a, r)| a * r).sum();
        let square: f64 = arm.iter().map(|v| v * v).sum();
        let ([nx, ny], [rx, ry, _]) = (surface.normal, self.direction);
        let radius = params.carving_radius_m;
        square - along * along < radius * radius
            && libm::fabs(nx * rx + ny * ry) > params.carving_cosine
            && surface.precision[0] * return_sigma_m * return_sigma_m > params.carving_thinness
            && along < self.free_m
    }
}

impl Problem {
    /// Removes model points whose returns are outweighed by the rays through them, unless that
    /// would remove all. Returns how many.
    pub(super) fn carve(&mut self, return_sigma_m: f64, params: &FreeSpaceParams) -> usize {
        let samples = &self.samples.all()[self.active.clone()];
        let every = samples.len().div_ceil(params.carving_rays).max(1);
        let points = self.solution.points;
        let mut through = [0u16; MODEL_MAX];
        for (sample, observation) in samples.iter().zip(&self.observations).step_by(every) {
            let from = observation.local_beyond(sample.origin_from_return());
            let clearance_m = params.carving_clearance_m;
            let Some(ray) = CarvingRay::new(from, observation.local(), clearance_m) else {
                continue;
            };
            let model = self.solution.model[..points].iter().zip(&self.solution.surfaces);
            for ((model, surface), through) in model.zip(&mut through) {
                if ray.crosses(model, surface, return_sigma_m, params) {
                    *through = through.saturating_add(1);
                }
            }
        }
        let mut left = 0;
        for (number, &through) in through[..points].iter().enumerate() {
            let returns = self.members.of(number).len();
            if usize::from(through) * every * params.carving_rays_weight < returns.max(1) {
                self.solution.model[left] = self.solution.model[number];
                self.solution.surfaces[left] = self.solution.surfaces[number];
                left += 1;
            }
        }
        if left == 0 {
            return 0;
        }
        self.solution.points = left;
        points - left
    }
}
