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
