//! The normal equations of a Gauss-Newton step (2.5.3), with the model points eliminated (Schur
//! complement, as in bundle adjustment: Triggs et al., 2000).
//!
//! A return couples one model point with five coefficients of each of four splines (position and
//! heading), so with the model points eliminated only small systems of spline coefficients remain.
//! The height is separate from the plane: no derivative couples them, so there are two systems. A
//! model point's own block is diagonal in the axes of its surface, so each axis is eliminated as a
//! row: the Schur complement is one rank-one update per axis of each point.

use super::cholesky::CholeskySystem;
use super::model_point::{Block, ModelPoint};
use super::observation::Observation;
use super::piece::{Piece, Planar, Vertical};
use super::samples::Sample;
use super::state::{ControlPoint, is_vertical, planar, vertical};
use crate::spline::{BASES_MAX, Basis, SUPPORT};

/// See [`CholeskySystem::solve`].
const PIVOT_MIN: f64 = 1e-10;
/// Precision of the second differences of the control points in a fit: it decides where the history
/// says nothing, and hardly matters elsewhere.
const BENDING: f64 = 1e-3;
/// Precision of every step of a control point in a fit: makes the system regular.
const RIDGE: f64 = 1e-9;

/// Both systems of a step.
pub(super) struct Equations {
    pub bases: usize,
    pub planar: Planar,
    pub vertical: Vertical,
}

impl Equations {
    pub const fn new() -> Equations {
        Equations { bases: 0, planar: CholeskySystem::new(), vertical: CholeskySystem::new() }
    }

    pub fn clear(&mut self, bases: usize) {
        self.bases = bases;
        self.planar.clear(5 * bases);
        self.vertical.clear(2 * bases);
    }

    /// Adds to the matrix at one element of two control points, and its mirror image.
    fn add(&mut self, element: usize, i: usize, j: usize, value: f64) {
        let n = self.bases;
        if is_vertical(element) {
            self.vertical.add(vertical(n, i, element), vertical(n, j, element), value);
        } else {
            self.planar.add(planar(n, i, element), planar(n, j, element), value);
        }
    }

    /// The right-hand side at an element of a control point.
    pub fn rhs(&mut self, basis: usize, element: usize) -> &mut f64 {
        if is_vertical(element) {
            &mut self.vertical.vector[vertical(self.bases, basis, element)]
        } else {
            &mut self.planar.vector[planar(self.bases, basis, element)]
        }
    }

    /// Adds an observation of the state, given its residual and precision by element.
    pub fn add_state(&mut self, basis: &Basis, residual: &ControlPoint, precision: &ControlPoint) {
        for (i, own) in basis.values.iter().enumerate() {
            for (element, (residual, precision)) in residual.iter().zip(precision).enumerate() {
                let factor = precision * own;
                for (j, other) in basis.values[..=i].iter().enumerate() {
                    self.add(element, basis.first + i, basis.first + j, factor * other);
                }
                *self.rhs(basis.first + i, element) += factor * residual;
            }
        }
    }

    /// Adds a small resistance to bending of the splines and to long steps.
    pub fn regularise(&mut self, control_points: &[ControlPoint]) {
        for k in 0..self.bases {
            (0..7).for_each(|element| self.add(element, k, k, RIDGE));
        }
        for (k, three) in control_points.windows(3).enumerate() {
            for (element, last) in three[2].iter().enumerate() {
                let bent = last - 2.0 * three[1][element] + three[0][element];
                let row = [1.0, -2.0, 1.0];
                for (i, a) in row.iter().enumerate() {
                    self.add(element, k + i, k + i, BENDING * a * a);
                    *self.rhs(k + i, element) += -BENDING * a * bent;
                    for (j, b) in row[..i].iter().enumerate() {
                        self.add(element, k + i, k + j, BENDING * a * b);
                    }
                }
            }
        }
    }

    /// Adds the returns, in order of time, as if the model were known.
    pub fn add_returns(&mut self, samples: &[Sample], observations: &[Observation]) {
        let mut piece = Piece::EMPTY;
        let mut first = 0;
        for (sample, observation) in samples.iter().zip(observations) {
            if sample.basis.first != first {
                piece.flush(first, &mut self.planar, &mut self.vertical);
                first = sample.basis.first;
            }
            let Observation { axes: [n, t], by_heading: [hn, ht], residual, .. } = *observation;
            let [a, b, up] = observation.precision;
            let (an, bt) = (a * hn, b * ht);
            let terms = [
                a * n[0] * n[0] + b * t[0] * t[0],
                a * n[0] * n[1] + b * t[0] * t[1],
                a * n[1] * n[1] + b * t[1] * t[1],
                -(an * n[0] + bt * t[0]),
                -(an * n[1] + bt * t[1]),
                an * hn + bt * ht,
                up,
            ];
            let (rhs_n, rhs_t) = (a * residual[0], b * residual[1]);
            let rhs = [
                rhs_n * n[0] + rhs_t * t[0],
                rhs_n * n[1] + rhs_t * t[1],
                -(rhs_n * hn + rhs_t * ht),
                up * residual[2],
            ];
            piece.add(&sample.basis.values, &terms, &rhs);
        }
        piece.flush(first, &mut self.planar, &mut self.vertical);
    }

    /// Eliminates a model point.
    pub fn eliminate(&mut self, point: &ModelPoint) {
        let Some((low, high)) = point.bases() else { return };
        let mut rows = [[0.0; 3 * BASES_MAX]; 2];
        let mut row_up = [0.0; BASES_MAX];
        let Block { precision: own, rhs } = point.block();
        for (sample, observation) in point.returns() {
            let from = sample.basis.first - low;
            for (a, row) in rows.iter_mut().enumerate() {
                let (precision, axis) = (observation.precision[a], observation.axes[a]);
                let by_heading = observation.by_heading[a];
                let parts = [precision * axis[0], precision * axis[1], -precision * by_heading];
                let places = row[3 * from..3 * (from + SUPPORT)].chunks_exact_mut(3);
                for (place, value) in places.zip(sample.basis.values) {
                    for (sum, part) in place.iter_mut().zip(parts) {
                        *sum += part * value;
                    }
                }
            }
            let up = observation.precision[2];
            let places = &mut row_up[from..from + SUPPORT];
            for (sum, value) in places.iter_mut().zip(sample.basis.values) {
                *sum += up * value;
            }
        }
        for (axis, row) in rows.iter().enumerate() {
            let row = &row[..3 * (high - low)];
            self.planar.eliminate(3 * low, row, own[axis], rhs[axis]);
        }
        let row = &row_up[..high - low];
        self.vertical.eliminate(low, row, own[2], rhs[2]);
    }

    /// Solves for a step of the control points. None if there is no solution.
    pub fn solve(&mut self, step: &mut [ControlPoint]) -> Option<()> {
        let sound = self.planar.solve(PIVOT_MIN) & self.vertical.solve(PIVOT_MIN);
        for (k, step) in step.iter_mut().enumerate() {
            for (element, value) in step.iter_mut().enumerate() {
                *value = *self.rhs(k, element);
            }
        }
        sound.then_some(())
    }

    /// Solves and applies the step. False, without a step, if there is no solution.
    pub fn step(&mut self, control_points: &mut [ControlPoint], step: &mut [ControlPoint]) -> bool {
        let step = &mut step[..control_points.len()];
        let solved = self.solve(step).is_some();
        if solved {
            let values = control_points.as_flattened_mut().iter_mut();
            values.zip(step.as_flattened()).for_each(|(value, step)| *value += *step);
        }
        solved
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::super::cholesky::tests::gauss;
    use super::super::surface::Surface;
    use super::*;
    use crate::random::Random;
    use crate::spline::Knots;
    use std::vec;
    use std::vec::Vec;

    const BASES: usize = 7;
    const POINTS: usize = 4;

    struct Scene {
        control_points: [ControlPoint; BASES],
        samples: Vec<Sample>,
        model: [[f32; 3]; POINTS],
        surfaces: [Surface; POINTS],
    }

    fn scene() -> Scene {
        let mut random = Random(17);
        let knots = Knots::over(0.0, 3.5, 0.5);
        assert_eq!(knots.bases(), BASES);
        let control_points = core::array::from_fn(|k| {
            let mut point: ControlPoint = core::array::from_fn(|_| 0.2 * random.normal());
            point[0] += k as f64;
            point
        });
        let samples = (0..90)
            .map(|i| {
                let time = 3.5 * f64::from(i) / 90.0;
                Sample {
                    position: [0, 1, 2].map(|_| random.between(-3.0, 3.0)),
                    time_s: time as f32,
                    basis: knots.basis(time),
                    ..Sample::NONE
                }
            })
            .collect();
        let model = [(); POINTS].map(|()| [0, 1, 2].map(|_| random.between(-2.0, 2.0)));
        let surfaces = model.map(|mean| {
            let (sin, cos) = libm::sincos(3.0 * random.normal());
            Surface {
                normal: [cos, sin],
                precision: [100.0, 4.0, 30.0],
                prior_mean: mean.map(|v| v + 0.3),
                prior_precision: 0.7,
                ..Surface::NONE
            }
        });
        Scene { control_points, samples, model, surfaces }
    }

    impl Scene {
        fn observations(&self) -> Vec<Observation> {
            let observe = |(i, sample)| {
                let mut observation = Observation::of(&self.control_points, sample);
                observation.evaluate(&self.model[i % POINTS], &self.surfaces[i % POINTS]);
                observation
            };
            self.samples.iter().enumerate().map(observe).collect()
        }

        /// All unknowns: x, y, z and heading by basis function, then the model points.
        fn unknowns(&self) -> Vec<f64> {
            let poses = self.control_points.iter().flat_map(|w| w[..4].to_vec());
            poses.chain(self.model.as_flattened().iter().map(|&v| f64::from(v))).collect()
        }

        /// Residuals of the returns and of the model's prior, in standard deviations, computed
        /// independently.
        fn residuals(&self, unknowns: &[f64]) -> Vec<f64> {
            let mut all = Vec::new();
            let model = &unknowns[4 * BASES..];
            for (i, sample) in self.samples.iter().enumerate() {
                let mut pose = [0.0; 4];
                for (k, value) in sample.basis.values.iter().enumerate() {
                    for (d, sum) in pose.iter_mut().enumerate() {
                        *sum += value * unknowns[4 * (sample.basis.first + k) + d];
                    }
                }
                let m = &model[3 * (i % POINTS)..][..3];
                let offset: Vec<f64> =
                    (0..3).map(|d| f64::from(sample.position[d]) - pose[d]).collect();
                let (sin, cos) = pose[3].sin_cos();
                let off = [
                    cos * offset[0] + sin * offset[1] - m[0],
                    cos * offset[1] - sin * offset[0] - m[1],
                    offset[2] - m[2],
                ];
                let surface = &self.surfaces[i % POINTS];
                let [nx, ny] = surface.normal;
                let [a, b, c] = surface.precision.map(f64::sqrt);
                all.push(a * (nx * off[0] + ny * off[1]));
                all.push(b * (nx * off[1] - ny * off[0]));
                all.push(c * off[2]);
            }
            for (m, surface) in model.chunks(3).zip(&self.surfaces) {
                for (m, mean) in m.iter().zip(surface.prior_mean) {
                    all.push(surface.prior_precision.sqrt() * (m - f64::from(mean)));
                }
            }
            all
        }
    }

    /// Checks both the derivatives, taken here by central differences, and the elimination.
    #[test]
    fn elimination_solves_the_dense_problem() {
        let scene = scene();
        let at = scene.unknowns();
        let n = at.len();
        let residuals = scene.residuals(&at);
        let step = 1e-6;
        let columns: Vec<Vec<f64>> = (0..n)
            .map(|i| {
                let moved = |by: f64| {
                    let mut at = at.clone();
                    at[i] += by;
                    scene.residuals(&at)
                };
                moved(step).iter().zip(moved(-step)).map(|(a, b)| (a - b) / (2.0 * step)).collect()
            })
            .collect();
        let product = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let mut rows = vec![vec![0.0; n + 1]; n];
        for i in 0..n {
            for j in 0..n {
                rows[i][j] = product(&columns[i], &columns[j]);
            }
            rows[i][n] = -product(&columns[i], &residuals);
        }
        // Both hold the poses with this: returns alone need not determine them.
        for (i, row) in rows.iter_mut().enumerate().take(4 * BASES) {
            row[i] += 1.0;
        }
        let dense = gauss(rows);

        let observations = scene.observations();
        let mut equations = raywake_alloc_guard::boxed!(Equations, Equations::new());
        equations.clear(BASES);
        for k in 0..BASES {
            for d in 0..7 {
                equations.add(d, k, k, 1.0);
            }
        }
        equations.add_returns(&scene.samples, &observations);
        let members: Vec<Vec<u16>> = (0..POINTS)
            .map(|n| {
                let of = |i: &u16| usize::from(*i) % POINTS == n;
                (0..scene.samples.len() as u16).filter(of).collect()
            })
            .collect();
        let point = |n: usize| ModelPoint {
            members: &members[n],
            samples: &scene.samples,
            observations: &observations,
            model: scene.model[n],
            surface: &scene.surfaces[n],
        };
        (0..POINTS).for_each(|n| equations.eliminate(&point(n)));
        let mut steps = [[0.0; 7]; BASES];
        equations.solve(&mut steps).unwrap();
        for (k, step) in steps.iter().enumerate() {
            for d in 0..4 {
                assert!((step[d] - dense[4 * k + d]).abs() < 1e-6, "basis {k} spline {d}");
            }
        }
        for number in 0..POINTS {
            let by = point(number).back_substitute(&steps);
            for d in 0..3 {
                assert!((by[d] - dense[4 * BASES + 3 * number + d]).abs() < 1e-6, "point {number}");
            }
        }
    }
}
