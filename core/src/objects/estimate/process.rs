//! Process model (2.5.1.1): `J_u = 1/2 ∫ e_u' Q_u^-1 e_u`, with `e_u` the splines' derivative less the
//! unicycle's.
//!
//! The integral is taken over every piece of the splines by Gauss and Legendre's rule with six nodes,
//! which is exact for polynomials of degree 11. All but the unicycle's `v cos` and `v sin` of the
//! heading are polynomials of degree 8 at most; those two are as smooth, and over a piece, in which a
//! heading turns by a fraction of a radian, six nodes leave less than a millionth of the integral
//! (`the_integral_is_exact_enough`).

use super::normal::{CLIMB, Equations, Z, planar, vertical};
use super::system::System;
use crate::objects::spline::{Knots, SUPPORT};

/// Weights of a state's seven splines: x, y, z, heading, speed, climb, turn rate.
pub(super) type Weights = [f64; 7];

const NODES: usize = 6;
/// Half of the nodes on -1 to 1, and their weights; the others mirror them.
const GAUSS: [(f64, f64); NODES / 2] = [
    (0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_36),
];

/// A value and its derivative with respect to the weights of up to three splines.
struct Row {
    value: f64,
    parts: [(usize, [f64; SUPPORT]); 3],
}

/// Nothing of a spline.
const NO_PART: (usize, [f64; SUPPORT]) = (0, [0.0; SUPPORT]);

/// Adds the process term to `equations` and returns it. `precision` is `Q_u^-1`.
pub(super) fn add(
    knots: &Knots,
    weights: &[Weights],
    precision: &[f64; 7],
    equations: &mut Equations,
) -> f64 {
    let mut cost = 0.0;
    for (place, share) in GAUSS {
        for u in [0.5 - 0.5 * place, 0.5 + 0.5 * place] {
            let (values, slopes) = knots.shape(u);
            let length = 0.5 * share * knots.spacing();
            for piece in 0..knots.spans() {
                let rows = residuals(&weights[piece..piece + SUPPORT], &values, &slopes);
                for (d, (row, precision)) in rows.iter().zip(precision).enumerate() {
                    let weight = precision * length;
                    cost += 0.5 * weight * row.value * row.value;
                    let bases = equations.bases;
                    if d == Z || d == CLIMB {
                        let index = |i, d| vertical(bases, piece + i, d);
                        accumulate(&mut equations.vertical, index, row, weight);
                    } else {
                        let index = |i, d| planar(bases, piece + i, d);
                        accumulate(&mut equations.planar, index, row, weight);
                    }
                }
            }
        }
    }
    cost
}

/// The seven elements of `e_u` (2.8), where the basis functions have `values` and `slopes`.
fn residuals(weights: &[Weights], values: &[f64; SUPPORT], slopes: &[f64; SUPPORT]) -> [Row; 7] {
    let mut state = [0.0; 7];
    let mut rate = [0.0; 7];
    for ((weight, value), slope) in weights.iter().zip(values).zip(slopes) {
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
    [
        row(0, v * cos, (3, times(v * sin)), (4, times(-cos))),
        row(1, v * sin, (3, times(-v * cos)), (4, times(-sin))),
        row(2, state[5], (5, times(-1.0)), NO_PART),
        row(3, state[6], (6, times(-1.0)), NO_PART),
        row(4, 0.0, NO_PART, NO_PART),
        row(5, 0.0, NO_PART, NO_PART),
        row(6, 0.0, NO_PART, NO_PART),
    ]
}

/// Parts of a row that are not [`NO_PART`]: only the first may be of spline 0.
fn parts(row: &Row) -> &[(usize, [f64; SUPPORT])] {
    let count = 1 + row.parts[1..].iter().take_while(|part| part.0 != 0).count();
    &row.parts[..count]
}

/// Adds a row to the system whose unknowns `index` numbers by basis function and spline.
fn accumulate<const N: usize, const L: usize>(
    system: &mut System<N, L>,
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
    use crate::objects::estimate::EstimateParams;
    use crate::objects::estimate::precision;
    use crate::random::Random;
    use std::boxed::Box;

    fn weights<const N: usize>() -> [Weights; N] {
        let mut random = Random(7);
        core::array::from_fn(|k| {
            let mut weight: Weights = core::array::from_fn(|_| 0.3 * random.normal());
            weight[0] += 5.0 * k as f64;
            weight[3] += 0.1 * k as f64;
            weight[4] += 10.0;
            weight
        })
    }

    #[test]
    fn derivatives_are_differences() {
        let (knots, _) = Knots::over(0.0, 1.0, 0.5);
        let (values, slopes) = knots.shape(0.3);
        let weights = weights::<SUPPORT>();
        let rows = residuals(&weights, &values, &slopes);
        let step = 1e-5;
        for (d, row) in rows.iter().enumerate() {
            for spline in 0..7 {
                for k in 0..SUPPORT {
                    let at = |step: f64| {
                        let mut weights = weights;
                        weights[k][spline] += step;
                        residuals(&weights, &values, &slopes)[d].value
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
        let (knots, _) = Knots::over(0.0, 4.0, 0.5);
        let mut equations = Box::new(Equations::new());
        let mut weights = weights::<8>();
        let precision = precision(&EstimateParams::dissertation(), 0.0);
        let mut cost = |weights: &[Weights]| {
            equations.clear(8);
            let cost = add(&knots, weights, &precision, &mut equations);
            (cost, equations.planar.vector, equations.vertical.vector)
        };
        let (_, plane, height) = cost(&weights);
        let step = 1e-6;
        for k in 0..8 {
            for d in 0..7 {
                let before = weights[k][d];
                weights[k][d] = before + step;
                let (more, ..) = cost(&weights);
                weights[k][d] = before - step;
                let (less, ..) = cost(&weights);
                weights[k][d] = before;
                let pull = if d == Z || d == CLIMB {
                    height[vertical(8, k, d)]
                } else {
                    plane[planar(8, k, d)]
                };
                let known = (less - more) / (2.0 * step);
                assert!((pull - known).abs() < 1e-5 * known.abs() + 0.3, "{k} {d} {pull} {known}");
            }
        }
    }

    #[test]
    fn the_integral_is_exact_enough() {
        let (knots, _) = Knots::over(0.0, 6.0, 0.5);
        let weights = weights::<12>();
        let precision = precision(&EstimateParams::dissertation(), 0.0);
        let mut equations = Box::new(Equations::new());
        equations.clear(12);
        let ours = add(&knots, &weights, &precision, &mut equations);
        let mut fine = 0.0;
        let steps = 4000;
        for i in 0..steps {
            let (values, slopes) = knots.shape((f64::from(i) + 0.5) / f64::from(steps));
            for piece in 0..knots.spans() {
                let rows = residuals(&weights[piece..piece + SUPPORT], &values, &slopes);
                for (row, precision) in rows.iter().zip(precision) {
                    fine += 0.5 * precision * row.value * row.value;
                }
            }
        }
        fine *= knots.spacing() / f64::from(steps);
        assert!((ours / fine - 1.0).abs() < 1e-6, "{ours} {fine}");
    }
}
