//! The patch of surface that a model point stands for (generalised ICP: Segal, Haehnel and Thrun,
//! RSS 2009, with the covariance of the model's side only).

use super::params::EstimateParams;

/// An upright planar patch around a model point: its normal lies in the plane of motion.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    /// Unit normal, in the object's frame.
    pub normal: [f64; 2],
    /// Precision of a return across, along and up, 1/m².
    pub precision: [f64; 3],
    /// Position of the model point expected before any return, m.
    pub prior_mean: [f32; 3],
    /// Precision of that position, 1/m².
    pub prior_precision: f64,
    /// Returns from before those of the equations, and their scatter around the point.
    pub scatter: Scatter,
}

impl Surface {
    pub const NONE: Surface = Surface {
        normal: [0.0; 2],
        precision: [0.0; 3],
        prior_mean: [0.0; 3],
        prior_precision: 0.0,
        scatter: Scatter { count: 0.0, sums: [0.0; 4] },
    };

    /// A surface with the same precision, 1/m², in every direction.
    pub const fn isotropic(precision: f64) -> Surface {
        Surface {
            normal: [1.0, 0.0],
            precision: [precision; 3],
            scatter: Scatter::ONE,
            ..Surface::NONE
        }
    }

    /// Fits normal and precision to the scatter of all returns: along the eigenvectors of its
    /// covariance in the plane.
    pub fn fit(&mut self, scatter: &Scatter, params: &EstimateParams) {
        let count = f64::from(scatter.count);
        let [xx, xy, yy, zz] = scatter.sums.map(|sum| f64::from(sum) / count);
        let half = 0.5 * (xx - yy);
        let spread = libm::sqrt(half * half + xy * xy);
        let middle = 0.5 * (xx + yy);
        // Eigenvector of the smaller eigenvalue.
        let (nx, ny) = if half < 0.0 { (spread - half, -xy) } else { (-xy, spread + half) };
        let length = libm::sqrt(nx * nx + ny * ny);
        self.normal = if length > 0.0 { [nx / length, ny / length] } else { [1.0, 0.0] };
        let small = (middle - spread).max(0.0);
        let tangential = params.tangential_sigma_m * params.tangential_sigma_m;
        let flat = small * small / (small * small + zz * zz);
        let variances = [
            small + tangential * flat,
            middle + spread + tangential,
            zz + tangential * (1.0 - flat),
        ];
        let least = params.return_sigma_m * params.return_sigma_m;
        self.precision = variances.map(|variance| 1.0 / (least + variance));
    }
}

/// Returns around a model point: their number, and the sums of x x, x y, y y and z z, m².
#[derive(Clone, Copy)]
pub(super) struct Scatter {
    pub count: f32,
    pub sums: [f32; 4],
}

impl Scatter {
    /// As if one return lay 0.1 m off in every direction, so that no patch is singular.
    pub const ONE: Scatter = Scatter { count: 1.0, sums: [0.01, 0.0, 0.01, 0.01] };

    /// Adds a return in the object's frame.
    pub fn add(&mut self, local: [f64; 3], model: [f32; 3]) {
        let [x, y, z]: [f32; 3] = core::array::from_fn(|d| local[d] as f32 - model[d]);
        self.count += 1.0;
        for (sum, value) in self.sums.iter_mut().zip([x * x, x * y, y * y, z * z]) {
            *sum += value;
        }
    }

    /// Limits the weight of the returns to that of `most`.
    pub fn limit(&mut self, most: f32) {
        if self.count > most {
            let share = most / self.count;
            self.count *= share;
            self.sums = self.sums.map(|sum| sum * share);
        }
    }
}
