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
use crate::spline::{BASES_MAX, SUPPORT};

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
        normal: [0.0; 2],
        precision: [0.0; 3],
        mean: [0.0; 3],
        held: 0.0,
        scatter: Scatter { count: 0.0, sums: [0.0; 4] },
    };

    /// Alike in every direction.
    pub const fn round(precision: f64) -> Surface {
        Surface {
            normal: [1.0, 0.0],
            precision: [precision; 3],
            scatter: Scatter::ONE,
            ..Surface::NONE
        }
    }
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
    pub precision: [f64; 3],
}

impl Seen {
    pub const NONE: Seen = Seen {
        arm: [0.0; 3],
        cos: 0.0,
        sin: 0.0,
        nearest: 0,
        axes: [[0.0; 2]; 2],
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
        self.frame([0.0; 3])
    }

    /// What lies by `beyond` (m, along the world's axes) beyond the return, in the object's frame.
    pub fn frame(&self, beyond: [f64; 3]) -> [f64; 3] {
        let [x, y, z]: [f64; 3] = core::array::from_fn(|d| self.arm[d] + beyond[d]);
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

#[cfg(test)]
mod tests {
    extern crate std;
    use super::super::system::tests::gauss;
    use super::*;
    use crate::random::Random;
    use crate::spline::Knots;
    use std::boxed::Box;
    use std::vec;
    use std::vec::Vec;

    const BASES: usize = 7;
    const POINTS: usize = 4;

    struct Scene {
        weights: [Weights; BASES],
        kept: Vec<Kept>,
        model: [[f32; 3]; POINTS],
        surfaces: [Surface; POINTS],
    }

    fn scene() -> Scene {
        let mut random = Random(17);
        let (knots, _) = Knots::over(0.0, 3.5, 0.5);
        assert_eq!(knots.bases(), BASES);
        let weights = core::array::from_fn(|k| {
            let mut weight: Weights = core::array::from_fn(|_| 0.2 * random.normal());
            weight[0] += k as f64;
            weight
        });
        let kept = (0..90)
            .map(|i| {
                let time = 3.5 * f64::from(i) / 90.0;
                Kept {
                    position: [0, 1, 2].map(|_| random.between(-3.0, 3.0)),
                    time_s: time as f32,
                    basis: knots.basis(time),
                    ..Kept::NONE
                }
            })
            .collect();
        let model = [(); POINTS].map(|()| [0, 1, 2].map(|_| random.between(-2.0, 2.0)));
        let surfaces = model.map(|mean| {
            let (sin, cos) = libm::sincos(3.0 * random.normal());
            Surface {
                normal: [cos, sin],
                precision: [100.0, 4.0, 30.0],
                mean: mean.map(|v| v + 0.3),
                held: 0.7,
                ..Surface::NONE
            }
        });
        Scene { weights, kept, model, surfaces }
    }

    impl Scene {
        fn seen(&self) -> Vec<Seen> {
            let lay = |(i, kept)| {
                let mut seen =
                    Seen { nearest: (i % POINTS) as u16, ..Seen::look(&self.weights, kept) };
                seen.lay(&self.model[i % POINTS], &self.surfaces[i % POINTS], 0.0);
                seen
            };
            self.kept.iter().enumerate().map(lay).collect()
        }

        /// Everything at once: x, y, z and heading by basis function, then the model points.
        fn unknowns(&self) -> Vec<f64> {
            let poses = self.weights.iter().flat_map(|w| w[..4].to_vec());
            poses.chain(self.model.as_flattened().iter().map(|&v| f64::from(v))).collect()
        }

        /// Residuals of the returns and of the model's prior, in deviations, written once more.
        fn residuals(&self, unknowns: &[f64]) -> Vec<f64> {
            let mut all = Vec::new();
            let model = &unknowns[4 * BASES..];
            for (i, kept) in self.kept.iter().enumerate() {
                let mut pose = [0.0; 4];
                for (k, value) in kept.basis.values.iter().enumerate() {
                    for (d, sum) in pose.iter_mut().enumerate() {
                        *sum += value * unknowns[4 * (kept.basis.first + k) + d];
                    }
                }
                let m = &model[3 * (i % POINTS)..][..3];
                let arm: Vec<f64> = (0..3).map(|d| f64::from(kept.position[d]) - pose[d]).collect();
                let (sin, cos) = pose[3].sin_cos();
                let off = [
                    cos * arm[0] + sin * arm[1] - m[0],
                    cos * arm[1] - sin * arm[0] - m[1],
                    arm[2] - m[2],
                ];
                let surface = &self.surfaces[i % POINTS];
                let [nx, ny] = surface.normal;
                let [a, b, c] = surface.precision.map(f64::sqrt);
                all.push(a * (nx * off[0] + ny * off[1]));
                all.push(b * (nx * off[1] - ny * off[0]));
                all.push(c * off[2]);
            }
            for (m, surface) in model.chunks(3).zip(&self.surfaces) {
                for (m, mean) in m.iter().zip(surface.mean) {
                    all.push(surface.held.sqrt() * (m - f64::from(mean)));
                }
            }
            all
        }
    }

    /// Both the derivatives, taken here by central differences, and the elimination.
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
        // What both hold the poses with: returns alone need not determine them.
        for (i, row) in rows.iter_mut().enumerate().take(4 * BASES) {
            row[i] += 1.0;
        }
        let dense = gauss(rows);

        let seen = scene.seen();
        let mut equations = Box::new(Equations::new());
        equations.clear(BASES);
        for k in 0..BASES {
            for d in 0..7 {
                if d == Z || d == CLIMB {
                    let i = vertical(BASES, k, d);
                    equations.vertical.add(i, i, 1.0);
                } else {
                    let i = planar(BASES, k, d);
                    equations.planar.add(i, i, 1.0);
                }
            }
        }
        equations.add_returns(&scene.kept, &seen);
        let order = |number: usize| -> Vec<u16> {
            (0..scene.kept.len() as u16).filter(|i| usize::from(*i) % POINTS == number).collect()
        };
        for number in 0..POINTS {
            let (model, surface) = (&scene.model[number], &scene.surfaces[number]);
            equations.eliminate(&order(number), &scene.kept, &seen, model, surface);
        }
        let mut steps = [[0.0; 7]; BASES];
        equations.solve(1e-12, &mut steps).unwrap();
        for (k, step) in steps.iter().enumerate() {
            for d in 0..4 {
                assert!((step[d] - dense[4 * k + d]).abs() < 1e-6, "basis {k} spline {d}");
            }
        }
        for number in 0..POINTS {
            let (model, surface) = (&scene.model[number], &scene.surfaces[number]);
            let by = follow(&order(number), &scene.kept, &seen, model, surface, &steps);
            for d in 0..3 {
                assert!((by[d] - dense[4 * BASES + 3 * number + d]).abs() < 1e-6, "point {number}");
            }
        }
    }

    #[test]
    fn a_robust_loss_keeps_what_is_near_and_bounds_what_is_far() {
        let surface = Surface::round(100.0);
        let cost = |off: f64, robust: f64| {
            let mut seen = Seen { arm: [off, 0.0, 0.0], cos: 1.0, ..Seen::NONE };
            (seen.lay(&[0.0; 3], &surface, robust), seen.precision[0])
        };
        assert_eq!(cost(0.5, 0.0), (12.5, 100.0));
        let (near, kept) = cost(0.01, 9.0);
        assert!((near - 0.005).abs() < 1e-5 && kept > 99.0);
        let (far, left) = cost(100.0, 9.0);
        assert!(far < 4.5 && left < 1e-4);
        // The pull is the slope of the loss.
        let step = 1e-6;
        let slope = (cost(0.2 + step, 9.0).0 - cost(0.2 - step, 9.0).0) / (2.0 * step);
        assert!((slope - cost(0.2, 9.0).1 * 0.2).abs() < 1e-5);
    }
}
