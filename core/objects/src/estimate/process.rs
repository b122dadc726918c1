//! Process model (2.5.1.1): `J_u = 1/2 ∫ e_u' Q_u^-1 e_u`, with `e_u` the derivative of the splines
//! minus that of the unicycle.
//!
//! The integral over every piece of the splines is taken by Gauss-Legendre quadrature with six
//! nodes, which is exact for polynomials of degree 11. Everything except the unicycle's `v cos` and
//! `v sin` of the heading is a polynomial of degree 8 at most; those two are as smooth, and over a
//! piece, in which a heading turns by a fraction of a radian, six nodes leave an error of less than
//! a millionth of the integral (`the_integral_is_exact_enough`).
//!
//! Ours differs in the turn rate `ω`. Turns end: `dω/dt = -ω / turn_decay_s`. And motion is steady
//! except for a few hard turns, which a Gaussian does not describe: it lets the steady parts jitter
//! and smooths the turns. The noise is Student-t instead (as in Roth, Özkan and Gustafsson, ICASSP
//! 2013): the variance of each manoeuvre of `m` pieces is unknown, its reciprocal Gamma distributed
//! with `ν` degrees of freedom. Integrated out, with `S = ∫ e² / q²` over the manoeuvre, its cost
//! is `(ν + m) / 2 ln(1 + S / ν)` where a Gaussian's is `S / 2`. As it is unknown when manoeuvres
//! begin, the cost is the mean over all `m` ways to cut the track into them. Gauss-Newton treats it
//! as a Gaussian of precision `(ν + m) / (ν + S)` times `1 / q²` (iteratively reweighted least
//! squares), which has the same gradient. It has further minima, so trajectories are found with
//! Gaussian noise first.
//! noise first.

use super::cholesky::CholeskySystem;
use super::equations::Equations;
use super::params::EstimateParams;
use super::state::{ControlPoint, TURN_RATE, is_vertical, planar, vertical};
use crate::spline::{BASES_MAX, Knots, SUPPORT};

const NODES: usize = 6;
/// Half of the nodes on -1 to 1, and their weights; the others mirror them.
const GAUSS: [(f64, f64); NODES / 2] = [
    (0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_36),
];

/// A value and its derivatives with respect to the control points of up to three splines.
struct Row {
    value: f64,
    parts: [(usize, [f64; SUPPORT]); 3],
}

/// No derivative.
const NO_PART: (usize, [f64; SUPPORT]) = (0, [0.0; SUPPORT]);

/// The unicycle with its noise.
#[derive(Clone, Copy)]
pub(super) struct ProcessModel {
    /// `Q_u^-1`.
    precision: ControlPoint,
    /// Decay of a turn rate, 1/s.
    turn_decay: f64,
    /// Degrees of freedom of the turn rate's Student-t noise; 0: Gaussian noise.
    student_dof: f64,
    manoeuvre_s: f64,
}

impl ProcessModel {
    pub fn of(params: &EstimateParams) -> ProcessModel {
        let mut sigmas = params.noise.sigmas();
        if params.student_dof > 0.0 {
            sigmas[TURN_RATE] *= params.student_scale;
        }
        ProcessModel {
            precision: sigmas.map(|sigma| 1.0 / (sigma * sigma)),
            turn_decay: 1.0 / params.turn_decay_s,
            student_dof: params.student_dof,
            manoeuvre_s: params.manoeuvre_s,
        }
    }

    /// Cost of the turn rate's noise; replaces the squared noise of every piece by its weight.
    fn turn_rate_cost(&self, spacing_s: f64, pieces: &mut [f64]) -> f64 {
        let nu = self.student_dof;
        if nu <= 0.0 {
            let cost = 0.5 * pieces.iter().sum::<f64>();
            pieces.fill(1.0);
            return cost;
        }
        let long = (libm::round(self.manoeuvre_s / spacing_s) as usize).clamp(1, BASES_MAX);
        let mut cost = 0.0;
        let mut counts = [0.0; BASES_MAX];
        for end in 1..pieces.len() + long {
            let range = end.saturating_sub(long)..end.min(pieces.len());
            let square: f64 = pieces[range.clone()].iter().sum();
            let freedom = nu + range.len() as f64;
            cost += 0.5 * freedom * libm::log1p(square / nu);
            for count in &mut counts[range] {
                *count += freedom / (nu + square) / long as f64;
            }
        }
        pieces.copy_from_slice(&counts[..pieces.len()]);
        cost / long as f64
    }
}

/// Adds the process term to `equations` and returns it.
pub(super) fn add(
    knots: &Knots,
    control_points: &[ControlPoint],
    process: &ProcessModel,
    equations: &mut Equations,
) -> f64 {
    let mut turns = [0.0; BASES_MAX];
    let turns = &mut turns[..knots.spans()];
    nodes(knots, |values, slopes, length| {
        let weight = process.precision[TURN_RATE] * length;
        for (turn, control_points) in turns.iter_mut().zip(control_points.windows(SUPPORT)) {
            let noise =
                residuals(control_points, values, slopes, process.turn_decay)[TURN_RATE].value;
            *turn += weight * noise * noise;
        }
    });
    let mut cost = process.turn_rate_cost(knots.spacing(), turns);
    nodes(knots, |values, slopes, length| {
        for (piece, turn) in turns.iter().enumerate() {
            let control_points = &control_points[piece..piece + SUPPORT];
            let rows = residuals(control_points, values, slopes, process.turn_decay);
            for (d, (row, precision)) in rows.iter().zip(process.precision).enumerate() {
                let mut weight = precision * length;
                if d == TURN_RATE {
                    weight *= turn;
                } else {
                    cost += 0.5 * weight * row.value * row.value;
                }
                let bases = equations.bases;
                if is_vertical(d) {
                    let index = |i, d| vertical(bases, piece + i, d);
                    accumulate(&mut equations.vertical, index, row, weight);
                } else {
                    let index = |i, d| planar(bases, piece + i, d);
                    accumulate(&mut equations.planar, index, row, weight);
                }
            }
        }
    });
    cost
}

/// Calls `visit` with the basis functions' values and slopes at every node of a piece, and the
/// node's share of its length, s.
fn nodes(knots: &Knots, mut visit: impl FnMut(&[f64; SUPPORT], &[f64; SUPPORT], f64)) {
    for (place, share) in GAUSS {
        for u in [0.5 - 0.5 * place, 0.5 + 0.5 * place] {
            let (values, slopes) = knots.shape(u);
            visit(&values, &slopes, 0.5 * share * knots.spacing());
        }
    }
}

/// The seven elements of `e_u` (2.8), given `values` and `slopes` of the basis functions.
fn residuals(
    control_points: &[ControlPoint],
    values: &[f64; SUPPORT],
    slopes: &[f64; SUPPORT],
    turn_decay: f64,
) -> [Row; 7] {
    let mut state = [0.0; 7];
    let mut rate = [0.0; 7];
    for ((weight, value), slope) in control_points.iter().zip(values).zip(slopes) {
        for d in 0..7 {
            state[d] += weight[d] * value;
            rate[d] += weight[d] * slope;
        }
    }
    let (sin, cos) = libm::sincos(state[3]);
    let v = state[4];
    let times = |factor: f64| values.map(|value| factor * value);
    let row = |d: usize, predicted: f64, second, third| Row {
        value: rate[d] - predicted,
        parts: [(d, *slopes), second, third],
    };
    let decayed = core::array::from_fn(|i| slopes[i] + turn_decay * values[i]);
    [
        row(0, v * cos, (3, times(v * sin)), (4, times(-cos))),
        row(1, v * sin, (3, times(-v * cos)), (4, times(-sin))),
        row(2, state[5], (5, times(-1.0)), NO_PART),
        row(3, state[6], (6, times(-1.0)), NO_PART),
        row(4, 0.0, NO_PART, NO_PART),
        row(5, 0.0, NO_PART, NO_PART),
        Row { value: rate[6] + turn_decay * state[6], parts: [(6, decayed), NO_PART, NO_PART] },
    ]
}

/// Parts of a row that are not [`NO_PART`]: only the first may be of spline 0.
fn parts(row: &Row) -> &[(usize, [f64; SUPPORT])] {
    let count = 1 + row.parts[1..].iter().take_while(|part| part.0 != 0).count();
    &row.parts[..count]
}

/// Adds a row to the system; `index` numbers its unknowns by basis function and spline.
fn accumulate<const N: usize, const L: usize>(
    system: &mut CholeskySystem<N, L>,
    index: impl Fn(usize, usize) -> usize,
    row: &Row,
    weight: f64,
) {
    let parts = parts(row);
    for (p, (d, own)) in parts.iter().enumerate() {
        for (i, value) in own.iter().enumerate() {
            let at = index(i, *d);
            let factor = weight * value;
            system.vector[at] -= factor * row.value;
            for (j, other) in own[..=i].iter().enumerate() {
                system.add(at, index(j, *d), factor * other);
            }
            for (e, others) in &parts[..p] {
                for (j, other) in others.iter().enumerate() {
                    system.add(at, index(j, *e), factor * other);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::random::Random;

    fn control_points<const N: usize>() -> [ControlPoint; N] {
        let mut random = Random(7);
        core::array::from_fn(|k| {
            let mut weight: ControlPoint = core::array::from_fn(|_| 0.3 * random.normal());
            weight[0] += 5.0 * k as f64;
            weight[3] += 0.1 * k as f64;
            weight[4] += 10.0;
            weight
        })
    }

    #[test]
    fn derivatives_are_differences() {
        let knots = Knots::over(0.0, 1.0, 0.5);
        let (values, slopes) = knots.shape(0.3);
        let control_points = control_points::<SUPPORT>();
        let rows = residuals(&control_points, &values, &slopes, 0.8);
        let step = 1e-5;
        for (d, row) in rows.iter().enumerate() {
            for spline in 0..7 {
                for k in 0..SUPPORT {
                    let at = |step: f64| {
                        let mut control_points = control_points;
                        control_points[k][spline] += step;
                        residuals(&control_points, &values, &slopes, 0.8)[d].value
                    };
                    let slope = (at(step) - at(-step)) / (2.0 * step);
                    let part = parts(row).iter().find(|part| part.0 == spline);
                    let known = part.map_or(0.0, |part| part.1[k]);
                    assert!((slope - known).abs() < 1e-6, "row {d} spline {spline} basis {k}");
                }
            }
        }
    }

    #[test]
    fn gradient_is_that_of_the_cost() {
        for params in [EstimateParams::DISSERTATION, EstimateParams::DEFAULT] {
            // Noise that is neither all steady nor all turning.
            let process = ProcessModel::of(&EstimateParams {
                student_scale: 1.0,
                manoeuvre_s: 1.0,
                ..params
            });
            let knots = Knots::over(0.0, 4.0, 0.5);
            let mut equations = raywake_alloc_guard::boxed!(Equations, Equations::new());
            let mut control_points = control_points::<8>();
            let mut cost = |control_points: &[ControlPoint]| {
                equations.clear(8);
                let cost = add(&knots, control_points, &process, &mut equations);
                (cost, equations.planar.vector, equations.vertical.vector)
            };
            let (_, plane, height) = cost(&control_points);
            let step = 1e-6;
            for k in 0..8 {
                for d in 0..7 {
                    let before = control_points[k][d];
                    control_points[k][d] = before + step;
                    let (more, ..) = cost(&control_points);
                    control_points[k][d] = before - step;
                    let (less, ..) = cost(&control_points);
                    control_points[k][d] = before;
                    let rhs = if is_vertical(d) {
                        height[vertical(8, k, d)]
                    } else {
                        plane[planar(8, k, d)]
                    };
                    let known = (less - more) / (2.0 * step);
                    assert!(
                        (rhs - known).abs() < 1e-5 * known.abs() + 0.3,
                        "{k} {d} {rhs} {known}"
                    );
                }
            }
        }
    }

    #[test]
    fn turn_cost_is_the_log_of_its_noise() {
        let process = ProcessModel::of(&EstimateParams {
            student_dof: 1.0,
            manoeuvre_s: 1.0,
            ..EstimateParams::DEFAULT
        });
        let turning = |mut pieces: [f64; 6]| (process.turn_rate_cost(0.5, &mut pieces), pieces);
        // As manoeuvres of two pieces, and of one at either end.
        let (cost, counts) = turning([0.0, 0.0, 7.0, 0.0, 0.0, 0.0]);
        assert!((cost - 0.5 * (3.0 * 8f64.ln())).abs() < 1e-12, "{cost}");
        assert_eq!(counts, [2.5, 1.6875, 0.375, 1.6875, 3.0, 2.5]);
        // A second one next to it costs less than one elsewhere.
        let [beside, apart] = [[0.0, 0.0, 7.0, 7.0, 0.0, 0.0], [0.0, 7.0, 0.0, 0.0, 7.0, 0.0]];
        assert!(turning(beside).0 < 0.9 * turning(apart).0);
        let step = 1e-6;
        for piece in 0..6 {
            let at = |by: f64| {
                let mut pieces = [0.3, 2.0, 7.0, 1.0, 0.0, 0.5];
                pieces[piece] += by;
                turning(pieces)
            };
            let slope = (at(step).0 - at(-step).0) / (2.0 * step);
            assert!((slope - 0.5 * at(0.0).1[piece]).abs() < 1e-8, "piece {piece}: {slope}");
        }
        let plain = ProcessModel::of(&EstimateParams::DISSERTATION);
        let mut pieces = [1.0, 4.0, 9.0];
        assert_eq!((plain.turn_rate_cost(0.5, &mut pieces), pieces), (7.0, [1.0; 3]));
    }

    #[test]
    fn the_integral_is_exact_enough() {
        let knots = Knots::over(0.0, 6.0, 0.5);
        let control_points = control_points::<12>();
        let process = ProcessModel::of(&EstimateParams::DISSERTATION);
        let mut equations = raywake_alloc_guard::boxed!(Equations, Equations::new());
        equations.clear(12);
        let ours = add(&knots, &control_points, &process, &mut equations);
        let mut fine = 0.0;
        let steps = 4000;
        for i in 0..steps {
            let (values, slopes) = knots.shape((f64::from(i) + 0.5) / f64::from(steps));
            for piece in 0..knots.spans() {
                let rows =
                    residuals(&control_points[piece..piece + SUPPORT], &values, &slopes, 0.0);
                for (row, precision) in rows.iter().zip(process.precision) {
                    fine += 0.5 * precision * row.value * row.value;
                }
            }
        }
        fine *= knots.spacing() / f64::from(steps);
        assert!((ours / fine - 1.0).abs() < 1e-6, "{ours} {fine}");
    }
}
