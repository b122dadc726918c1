//! The normal equations of a Gauss-Newton step (2.5.3), the model points eliminated.
//!
//! A return `z` at the time `t`, of the model point `m`, misses by `e = R(φ)'(z - p) - m`. Turned into
//! the world's axes, which leaves its length, its derivatives hold no sine: with `d = z - p`, `-1` for
//! the position, `(d_y, -d_x)` for the heading, `-R` for `m`. The height is apart from the plane: no
//! derivative couples them, so there are two systems.
//!
//! A model point's own block is diagonal in the axes of its surface, so each axis is eliminated as a
//! row: the Schur complement is one rank-one update for each axis of each point.

use super::process::Weights;
use super::returns::Kept;
use super::system::System;
use crate::objects::spline::{BASES_MAX, SUPPORT};

/// Splines of a state.
pub(super) const Z: usize = 2;
pub(super) const CLIMB: usize = 5;

const PLANAR: usize = 5 * BASES_MAX;
const VERTICAL: usize = 2 * BASES_MAX;

/// Both systems of a step.
pub(super) struct Equations {
    pub bases: usize,
    pub planar: System<PLANAR, { PLANAR * PLANAR }>,
    pub vertical: System<VERTICAL, { VERTICAL * VERTICAL }>,
}

/// Unknown of the plane: poses (x, y, heading) by basis function, then rates (speed, turn rate).
pub(super) fn planar(bases: usize, basis: usize, spline: usize) -> usize {
    match spline {
        0 | 1 => 3 * basis + spline,
        3 => 3 * basis + 2,
        4 => 3 * bases + 2 * basis,
        _ => 3 * bases + 2 * basis + 1,
    }
}

/// Unknown of the height: z by basis function, then climb.
pub(super) fn vertical(bases: usize, basis: usize, spline: usize) -> usize {
    if spline == Z { basis } else { bases + basis }
}

/// The piece of surface that a model point stands for.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    /// Unit vector across it, in the object's frame.
    pub normal: [f64; 2],
    /// Precision of a return across, along and up, 1/m².
    pub precision: [f64; 3],
    /// Where the model point is before any return, m, and how precisely, 1/m².
    pub mean: [f32; 3],
    pub held: f64,
    /// Returns before these, and how they lay about it.
    pub scatter: Scatter,
}

impl Surface {
    pub const NONE: Surface = Surface {
        normal: [1.0, 0.0],
        precision: [0.0; 3],
        mean: [0.0; 3],
        held: 0.0,
        scatter: Scatter::ONE,
    };
}

/// Returns about a model point: how many, and the sums of x x, x y, y y and z z, m².
#[derive(Clone, Copy)]
pub(super) struct Scatter {
    pub count: f32,
    pub sums: [f32; 4],
}

impl Scatter {
    /// As if one return lay 0.1 m off in every direction.
    pub const ONE: Scatter = Scatter { count: 1.0, sums: [0.01, 0.0, 0.01, 0.01] };

    pub fn add(&mut self, place: [f64; 3], model: [f32; 3]) {
        let [x, y, z]: [f32; 3] = core::array::from_fn(|d| place[d] as f32 - model[d]);
        self.count += 1.0;
        for (sum, value) in self.sums.iter_mut().zip([x * x, x * y, y * y, z * z]) {
            *sum += value;
        }
    }
}

/// A return as an iteration sees it. Its axes are those of its model point's surface: across, along
/// and up.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    /// From the object's origin, m, in the world's axes.
    arm: [f64; 3],
    cos: f64,
    sin: f64,
    /// Nearest model point.
    pub nearest: u16,
    /// The first two axes, in the world's plane.
    axes: [[f64; 2]; 2],
    /// How turning moves the return along them, m/rad.
    turning: [f64; 2],
    /// By how much it misses the model, m, and how precisely, 1/m², along every axis.
    miss: [f64; 3],
    precision: [f64; 3],
}

impl Seen {
    pub const NONE: Seen = Seen {
        arm: [0.0; 3],
        cos: 1.0,
        sin: 0.0,
        nearest: 0,
        axes: [[1.0, 0.0], [0.0, 1.0]],
        turning: [0.0; 2],
        miss: [0.0; 3],
        precision: [0.0; 3],
    };

    /// A return from the object's place and heading at its time.
    pub fn look(weights: &[Weights], kept: &Kept) -> Seen {
        let [x, y, z, heading] = pose(weights, kept);
        let (sin, cos) = libm::sincos(heading);
        let [u, v, w] = kept.position.map(f64::from);
        Seen { arm: [u - x, v - y, w - z], cos, sin, ..Seen::NONE }
    }

    /// The arm in the object's frame.
    pub fn place(&self) -> [f64; 3] {
        let [x, y, z] = self.arm;
        [self.cos * x + self.sin * y, self.cos * y - self.sin * x, z]
    }

    /// Squared distance from the object's origin, m².
    pub fn square_range(&self) -> f64 {
        self.arm.iter().map(|v| v * v).sum()
    }

    /// Lays the return over its model point; its share of the cost. `robust` is the squared number of
    /// deviations from which on it counts for less, if not zero.
    pub fn lay(&mut self, model: &[f32; 3], surface: &Surface, robust: f64) -> f64 {
        let [nx, ny] = surface.normal;
        let [x, y, z] = self.place();
        let off = [x - f64::from(model[0]), y - f64::from(model[1]), z - f64::from(model[2])];
        let across = [self.cos * nx - self.sin * ny, self.sin * nx + self.cos * ny];
        let along = [-across[1], across[0]];
        let turn = [self.arm[1], -self.arm[0]];
        self.axes = [across, along];
        self.turning =
            [across[0] * turn[0] + across[1] * turn[1], along[0] * turn[0] + along[1] * turn[1]];
        let miss = [nx * off[0] + ny * off[1], nx * off[1] - ny * off[0], off[2]];
        self.miss = miss;
        self.precision = surface.precision;
        let mut square = 0.0;
        for (miss, precision) in miss.iter().zip(surface.precision) {
            square += precision * miss * miss;
        }
        if robust > 0.0 {
            let share = 1.0 / (1.0 + square / robust);
            for precision in &mut self.precision {
                *precision *= share * share;
            }
            square *= share;
        }
        0.5 * square
    }
}

/// What a return adds for a pair of basis functions, before their values.
const TERMS: usize = 7;
const PAIRS: usize = SUPPORT * (SUPPORT + 1) / 2;

/// Sums over the returns of one piece of the splines.
struct Piece {
    matrix: [[f64; PAIRS]; TERMS],
    vector: [[f64; SUPPORT]; 4],
}

impl Piece {
    const EMPTY: Piece = Piece { matrix: [[0.0; PAIRS]; TERMS], vector: [[0.0; SUPPORT]; 4] };

    fn add(&mut self, values: &[f64; SUPPORT], terms: &[f64; TERMS], pull: &[f64; 4]) {
        let mut products = [0.0; PAIRS];
        let mut at = 0;
        for i in 0..SUPPORT {
            for j in 0..=i {
                products[at] = values[i] * values[j];
                at += 1;
            }
        }
        for (sums, term) in self.matrix.iter_mut().zip(terms) {
            for (sum, product) in sums.iter_mut().zip(&products) {
                *sum += term * product;
            }
        }
        for (sums, pull) in self.vector.iter_mut().zip(pull) {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += pull * value;
            }
        }
    }

    fn flush(&mut self, first: usize, equations: &mut Equations) {
        let mut at = 0;
        for i in 0..SUPPORT {
            for j in 0..=i {
                let [xx, xy, yy, xh, yh, hh, zz] = core::array::from_fn(|t| self.matrix[t][at]);
                let block = [[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]];
                for (a, row) in block.iter().enumerate() {
                    for (b, &value) in row.iter().enumerate() {
                        if i > j || a >= b {
                            equations.planar.add(3 * (first + i) + a, 3 * (first + j) + b, value);
                        }
                    }
                }
                equations.vertical.add(first + i, first + j, zz);
                at += 1;
            }
            for d in 0..3 {
                equations.planar.vector[3 * (first + i) + d] += self.vector[d][i];
            }
            equations.vertical.vector[first + i] += self.vector[3][i];
        }
        *self = Piece::EMPTY;
    }
}

impl Equations {
    pub const fn new() -> Equations {
        Equations { bases: 0, planar: System::new(), vertical: System::new() }
    }

    pub fn clear(&mut self, bases: usize) {
        self.bases = bases;
        self.planar.clear(5 * bases);
        self.vertical.clear(2 * bases);
    }

    /// Adds the returns, in the order of time, as if the model were known.
    pub fn add_returns(&mut self, kept: &[Kept], seen: &[Seen]) {
        let mut piece = Piece::EMPTY;
        let mut first = 0;
        for (kept, seen) in kept.iter().zip(seen) {
            if kept.basis.first != first {
                piece.flush(first, self);
                first = kept.basis.first;
            }
            let Seen { axes: [n, t], turning, miss, precision: [a, b, up], .. } = *seen;
            let (an, bt) = (a * turning[0], b * turning[1]);
            let terms = [
                a * n[0] * n[0] + b * t[0] * t[0],
                a * n[0] * n[1] + b * t[0] * t[1],
                a * n[1] * n[1] + b * t[1] * t[1],
                -(an * n[0] + bt * t[0]),
                -(an * n[1] + bt * t[1]),
                an * turning[0] + bt * turning[1],
                up,
            ];
            let (pull_n, pull_t) = (a * miss[0], b * miss[1]);
            let pull = [
                pull_n * n[0] + pull_t * t[0],
                pull_n * n[1] + pull_t * t[1],
                -(pull_n * turning[0] + pull_t * turning[1]),
                up * miss[2],
            ];
            piece.add(&kept.basis.values, &terms, &pull);
        }
        piece.flush(first, self);
    }

    /// Eliminates one model point: `order` are the numbers of its returns.
    pub fn eliminate(
        &mut self,
        order: &[u16],
        kept: &[Kept],
        seen: &[Seen],
        model: &[f32; 3],
        surface: &Surface,
    ) {
        let Some((low, high)) = reach(order, kept) else { return };
        let mut rows = [[0.0; 3 * BASES_MAX]; 2];
        let mut row_up = [0.0; BASES_MAX];
        let own = own(order, seen, model, surface);
        for &i in order {
            let (kept, seen) = (&kept[usize::from(i)], &seen[usize::from(i)]);
            let from = kept.basis.first - low;
            for (a, row) in rows.iter_mut().enumerate() {
                let (precision, axis, turning) = (seen.precision[a], seen.axes[a], seen.turning[a]);
                let parts = [precision * axis[0], precision * axis[1], -precision * turning];
                let places = row[3 * from..3 * (from + SUPPORT)].chunks_exact_mut(3);
                for (place, value) in places.zip(kept.basis.values) {
                    for (sum, part) in place.iter_mut().zip(parts) {
                        *sum += part * value;
                    }
                }
            }
            let up = seen.precision[2];
            for (sum, value) in row_up[from..from + SUPPORT].iter_mut().zip(kept.basis.values) {
                *sum += up * value;
            }
        }
        for (axis, row) in rows.iter().enumerate() {
            let row = &row[..3 * (high - low)];
            self.planar.eliminate(3 * low, row, own.precision[axis]);
            let share = own.pull[axis] / own.precision[axis];
            for (sum, value) in self.planar.vector[3 * low..].iter_mut().zip(row) {
                *sum -= share * value;
            }
        }
        let row = &row_up[..high - low];
        self.vertical.eliminate(low, row, own.precision[2]);
        let share = own.pull[2] / own.precision[2];
        for (sum, value) in self.vertical.vector[low..].iter_mut().zip(row) {
            *sum -= share * value;
        }
    }

    /// The solution as a step of the splines' weights. None where there is none.
    pub fn solve(&mut self, least: f64, step: &mut [Weights]) -> Option<()> {
        let sound = self.planar.solve(least) & self.vertical.solve(least);
        for (k, step) in step.iter_mut().enumerate() {
            for (d, value) in step.iter_mut().enumerate() {
                *value = if d == Z || d == CLIMB {
                    self.vertical.vector[vertical(self.bases, k, d)]
                } else {
                    self.planar.vector[planar(self.bases, k, d)]
                };
            }
        }
        sound.then_some(())
    }
}

/// The step of a model point that goes with a step of the splines.
pub(super) fn follow(
    order: &[u16],
    kept: &[Kept],
    seen: &[Seen],
    model: &[f32; 3],
    surface: &Surface,
    step: &[Weights],
) -> [f64; 3] {
    let mut own = own(order, seen, model, surface);
    for &i in order {
        let (kept, seen) = (&kept[usize::from(i)], &seen[usize::from(i)]);
        let mut moved = [0.0; 4];
        for (weights, value) in step[kept.basis.first..].iter().zip(kept.basis.values) {
            for (sum, weight) in moved.iter_mut().zip(weights) {
                *sum += weight * value;
            }
        }
        for a in 0..2 {
            let axis = seen.axes[a];
            let back = axis[0] * moved[0] + axis[1] * moved[1] - seen.turning[a] * moved[3];
            own.pull[a] -= seen.precision[a] * back;
        }
        own.pull[2] -= seen.precision[2] * moved[2];
    }
    let [across, along, up] = core::array::from_fn(|a| own.pull[a] / own.precision[a]);
    let [nx, ny] = surface.normal;
    [nx * across - ny * along, ny * across + nx * along, up]
}

/// A model point's own block and right-hand side, in the axes of its surface.
struct Own {
    precision: [f64; 3],
    pull: [f64; 3],
}

fn own(order: &[u16], seen: &[Seen], model: &[f32; 3], surface: &Surface) -> Own {
    let back: [f64; 3] =
        core::array::from_fn(|d| surface.held * (f64::from(surface.mean[d]) - f64::from(model[d])));
    let [nx, ny] = surface.normal;
    let pull = [nx * back[0] + ny * back[1], nx * back[1] - ny * back[0], back[2]];
    let mut own = Own { precision: [surface.held; 3], pull };
    for &i in order {
        let seen = &seen[usize::from(i)];
        for a in 0..3 {
            own.precision[a] += seen.precision[a];
            own.pull[a] += seen.precision[a] * seen.miss[a];
        }
    }
    own
}

/// Basis functions that some returns touch.
fn reach(order: &[u16], kept: &[Kept]) -> Option<(usize, usize)> {
    let firsts = || order.iter().map(|&i| kept[usize::from(i)].basis.first);
    Some((firsts().min()?, firsts().max()? + SUPPORT))
}

/// Pose part of a state at a return: position and heading.
fn pose(weights: &[Weights], kept: &Kept) -> [f64; 4] {
    let mut pose = [0.0; 4];
    for (weights, value) in weights[kept.basis.first..].iter().zip(kept.basis.values) {
        for (sum, weight) in pose.iter_mut().zip(weights) {
            *sum += weight * value;
        }
    }
    pose
}
