//! First guess of the trajectory (2.5.3): splines fitted to the history of another tracker, grown from
//! its middle, or a steady motion.

use super::normal::{CLIMB, Equations, Z, planar, vertical};
use super::process::{self, Process, Weights};
use super::steady::Steady;
use super::{EstimateParams, Estimator, steady};
use crate::ObjectState;
use crate::spline::{Basis, Knots};

/// Growth from the middle of a track: how far it reaches with every step (at first twice as far), s,
/// and how many steps may lead over a track; deviation of returns and model points meanwhile. A
/// sparse model lets a trajectory slide into place where a dense one holds it.
const GROWTH_S: f64 = 0.2;
const GROWTHS_MAX: f64 = 64.0;
const GROWTH_M: f64 = 0.15;
const GROWTH_POINTS: usize = 75;
/// Models that are made of what is seen by then, and iterations with each.
const GROWTH_FIRST_ROUNDS: usize = 6;
const GROWTH_FIRST_ITERATIONS: usize = 6;
const GROWTH_ROUNDS: usize = 2;
const GROWTH_ITERATIONS: usize = 2;

/// Motion is steady for about so long, s; so many parts of a track at most.
const UNSTEADY_S: f64 = 1.0;
const UNSTEADY_MAX: usize = 16;

/// What no state reaches, in any of its units.
const FAR: f64 = 1e5;
/// Precision of the bending of the splines (second differences of their weights) in a fit: it decides
/// where the history says nothing, and hardly elsewhere.
const BENDING: f64 = 1e-3;
/// Precision of every weight about zero, after subtracting the first state.
const LEAST: f64 = 1e-9;

/// The sound states of a history, their heading unwrapped.
pub(super) fn unwrapped(history: &[ObjectState]) -> impl Iterator<Item = ObjectState> {
    let mut last: Option<f64> = None;
    history.iter().filter(|state| sound(state)).map(move |state| {
        let heading = match last {
            Some(last) => last + turn(state.heading - last),
            None => turn(state.heading),
        };
        last = Some(heading);
        ObjectState { heading, ..*state }
    })
}

/// Whether a state is of numbers, and of such as a track can have.
pub(super) fn sound(state: &ObjectState) -> bool {
    let rest = [state.time_s, state.heading, state.speed, state.climb, state.turn_rate];
    state.position.iter().chain(&rest).all(|value| value.abs() <= FAR)
}

/// An angle within half a turn of zero.
pub(super) fn turn(angle: f64) -> f64 {
    angle - core::f64::consts::TAU * libm::round(angle / core::f64::consts::TAU)
}

fn elements(state: &ObjectState) -> Weights {
    let [x, y, z] = state.position;
    [x, y, z, state.heading, state.speed, state.climb, state.turn_rate]
}

/// Adds the observation that splines are off by `miss` at a time.
pub(super) fn observe(
    equations: &mut Equations,
    basis: &Basis,
    miss: &Weights,
    precision: &Weights,
) {
    let n = equations.bases;
    for (i, own) in basis.values.iter().enumerate() {
        for (d, (miss, precision)) in miss.iter().zip(precision).enumerate() {
            let factor = precision * own;
            let at = basis.first + i;
            for (j, other) in basis.values[..=i].iter().enumerate() {
                let before = basis.first + j;
                if d == Z || d == CLIMB {
                    let (i, j) = (vertical(n, at, d), vertical(n, before, d));
                    equations.vertical.add(i, j, factor * other);
                } else {
                    equations.planar.add(planar(n, at, d), planar(n, before, d), factor * other);
                }
            }
            if d == Z || d == CLIMB {
                equations.vertical.vector[vertical(n, at, d)] += factor * miss;
            } else {
                equations.planar.vector[planar(n, at, d)] += factor * miss;
            }
        }
    }
}

/// Adds a resistance to bending and to growing of the weights.
fn hold(equations: &mut Equations, weights: &[Weights]) {
    let n = equations.bases;
    let mut add = |i: usize, j: usize, d: usize, value: f64, pull: f64| {
        if d == Z || d == CLIMB {
            equations.vertical.add(vertical(n, i, d), vertical(n, j, d), value);
            equations.vertical.vector[vertical(n, i, d)] += pull;
        } else {
            equations.planar.add(planar(n, i, d), planar(n, j, d), value);
            equations.planar.vector[planar(n, i, d)] += pull;
        }
    };
    for k in 0..n {
        (0..7).for_each(|d| add(k, k, d, LEAST, 0.0));
    }
    for (k, three) in weights.windows(3).enumerate() {
        for (d, last) in three[2].iter().enumerate() {
            let bent = last - 2.0 * three[1][d] + three[0][d];
            let row = [1.0, -2.0, 1.0];
            for (i, a) in row.iter().enumerate() {
                add(k + i, k + i, d, BENDING * a * a, -BENDING * a * bent);
                for (j, b) in row[..i].iter().enumerate() {
                    add(k + i, k + j, d, BENDING * a * b, 0.0);
                }
            }
        }
    }
}

/// Least-squares fit of the splines to every state's elements. False where there is no history.
pub(super) fn fit(
    knots: &Knots,
    history: &[ObjectState],
    equations: &mut Equations,
    weights: &mut [Weights],
    step: &mut [Weights],
) -> bool {
    let Some(first) = unwrapped(history).next() else { return false };
    weights.fill(elements(&first));
    equations.clear(knots.bases());
    for state in unwrapped(history) {
        let mut miss = elements(&state);
        for (own, start) in miss.iter_mut().zip(elements(&first)) {
            *own -= start;
        }
        observe(equations, &knots.basis(state.time_s), &miss, &[1.0; 7]);
    }
    hold(equations, weights);
    apply(equations, weights, step)
}

/// Deviations with which [`smooth`] believes a history: m, m/s.
const POSITION_M: f64 = 0.3;
const HEADING: f64 = 0.1;
/// Turning is about so slow, rad/s.
const TURNING: f64 = 0.3;
/// Speed from which on it believes a heading, m/s.
const HEADS_MPS: f64 = 2.0;
const SMOOTHINGS: usize = 6;
/// Steps after which a position further off than this, m, counts ever less.
const ROUGH: usize = 2;
const OFF_M: f64 = 1.0;

/// Trajectory that a history of positions and the process model make together. What moves slowly has no
/// heading in it but noise.
pub(super) fn smooth(
    knots: &Knots,
    history: &[ObjectState],
    process: &Process,
    equations: &mut Equations,
    weights: &mut [Weights],
    step: &mut [Weights],
) {
    for n in 0..SMOOTHINGS {
        equations.clear(knots.bases());
        process::add(knots, weights, process, equations);
        for state in unwrapped(history) {
            let now = knots.value(weights, state.time_s);
            let mut miss = elements(&state);
            for (own, now) in miss.iter_mut().zip(now) {
                *own -= now;
            }
            let moves = state.speed * state.speed;
            let believed = moves / (moves + HEADS_MPS * HEADS_MPS);
            let heads = believed * believed / (HEADING * HEADING);
            miss[6] = -now[6];
            let square = (miss[0] * miss[0] + miss[1] * miss[1]) / (OFF_M * OFF_M);
            let fall = 1.0 / (1.0 + square);
            let counts = if n < ROUGH { 1.0 } else { fall * fall };
            let place = counts / (POSITION_M * POSITION_M);
            observe(
                equations,
                &knots.basis(state.time_s),
                &miss,
                &[place, place, place, heads, 0.0, 0.0, 1.0 / (TURNING * TURNING)],
            );
        }
        hold(equations, weights);
        if !apply(equations, weights, step) {
            return;
        }
    }
}

/// Everything at rest where the history is on average.
pub(super) fn stand(history: &[ObjectState], weights: &mut [Weights]) -> bool {
    let mut sum = [0.0; 4];
    let mut count = 0.0;
    for state in unwrapped(history) {
        let [x, y, z, heading, ..] = elements(&state);
        for (sum, value) in sum.iter_mut().zip([x, y, z, heading]) {
            *sum += value;
        }
        count += 1.0;
    }
    if count == 0.0 {
        return false;
    }
    let [x, y, z, heading] = sum.map(|sum| sum / count);
    weights.fill([x, y, z, heading, 0.0, 0.0, 0.0]);
    true
}

fn apply(equations: &mut Equations, weights: &mut [Weights], step: &mut [Weights]) -> bool {
    let step = &mut step[..weights.len()];
    if equations.solve(super::LEAST_PIVOT, step).is_none() {
        return false;
    }
    for (weights, step) in weights.iter_mut().zip(step) {
        for (weight, step) in weights.iter_mut().zip(step) {
            *weight += *step;
        }
    }
    true
}

impl Estimator {
    /// First trajectory of a solve. False where there is no history.
    pub(super) fn start(&mut self, params: &EstimateParams, history: &[ObjectState]) -> bool {
        let n = self.knots.bases();
        let weights = &mut self.now.weights[..n];
        if !fit(&self.knots, history, &mut self.equations, weights, &mut self.step) {
            self.stand_at_mean();
            return false;
        }
        if params.starts {
            smooth(
                &self.knots,
                history,
                &Process::of(&params.plain()),
                &mut self.equations,
                weights,
                &mut self.step,
            );
        }
        true
    }

    /// The steady motion of all returns. False where they have none.
    pub(super) fn start_steady(&mut self) -> bool {
        let length_m = self.returns.length_m();
        let Some(steady) = self.search.find(self.returns.all(), length_m) else { return false };
        let ([x, y, z], [vx, vy]) = (steady.position, steady.velocity);
        let (heading, speed) = (libm::atan2(vy, vx), libm::hypot(vx, vy));
        for (k, weights) in self.now.weights[..self.knots.bases()].iter_mut().enumerate() {
            let after = self.knots.centre(k) - steady.time_s;
            *weights = [x + after * vx, y + after * vy, z, heading, speed, 0.0, 0.0];
        }
        true
    }

    /// Motion that is steady about each of some times: what brakes or bends has no one velocity. False
    /// where there are not two such.
    pub(super) fn start_unsteady(&mut self) -> bool {
        let (first, last) = (self.knots.start(), self.knots.end());
        let count = (((last - first) / UNSTEADY_S) as usize).min(UNSTEADY_MAX);
        let mut found = heapless::Vec::<Steady, UNSTEADY_MAX>::new();
        for n in 0..count {
            let middle = first + (last - first) * (n as f64 + 0.5) / count as f64;
            let part = steady::within(self.returns.all(), middle as f32, UNSTEADY_S as f32);
            found.extend(self.search.find(part, self.returns.length_m()));
        }
        let [begin, .., end] = &found[..] else { return false };
        // Linear between them, and as at the nearest beyond.
        let velocity = |time: f64| {
            let next = found.partition_point(|steady| steady.time_s <= time);
            let (a, b) = match next {
                0 => (begin, begin),
                next if next == found.len() => (end, end),
                next => (&found[next - 1], &found[next]),
            };
            let share = (time - a.time_s) / (b.time_s - a.time_s).max(1e-3);
            [0, 1].map(|d| a.velocity[d] + share * (b.velocity[d] - a.velocity[d]))
        };
        let anchor = found[found.len() / 2];
        let spacing = self.knots.spacing();
        let weights = &mut self.now.weights[..self.knots.bases()];
        let (mut heading, [mut x, mut y]) = (0.0, [0.0; 2]);
        let mut anchored = [0.0; 2];
        for (k, weights) in weights.iter_mut().enumerate() {
            let time = self.knots.centre(k);
            let [vx, vy] = velocity(time);
            if k == 0 || libm::hypot(vx, vy) > HEADS_MPS {
                heading += turn(libm::atan2(vy, vx) - heading);
            }
            let (sin, cos) = libm::sincos(heading);
            *weights = [x, y, anchor.position[2], heading, cos * vx + sin * vy, 0.0, 0.0];
            let half = velocity(time + 0.5 * spacing);
            let after = (anchor.time_s - time).clamp(0.0, spacing);
            anchored = [0, 1].map(|d| anchored[d] + after * half[d]);
            (x, y) = (x + spacing * half[0], y + spacing * half[1]);
        }
        for weights in weights {
            weights[0] += anchor.position[0] - anchored[0];
            weights[1] += anchor.position[1] - anchored[1];
        }
        true
    }

    /// At rest where the returns are on average.
    pub(super) fn stand_at_mean(&mut self) {
        let mut mean = [0.0; 7];
        for kept in self.returns.all() {
            for (sum, value) in mean.iter_mut().zip(kept.position) {
                *sum += f64::from(value);
            }
        }
        let count = self.returns.all().len() as f64;
        self.now.weights[..self.knots.bases()].fill(mean.map(|sum| sum / count));
    }

    /// From the middle of the returns outwards: what is seen next is laid over the model of what was
    /// seen so far, starting where the process model puts it.
    pub(super) fn grow(&mut self, params: &EstimateParams) {
        let sparse = &EstimateParams { model: GROWTH_POINTS, deviation_m: GROWTH_M, ..*params };
        let all = self.returns.all();
        let time = |i: usize| f64::from(all[i].time_s);
        let middle = time(all.len() / 2);
        let (first, last) = (self.knots.start(), self.knots.end());
        let by = GROWTH_S.max((last - first) / GROWTHS_MAX);
        let mut reach = 2.0 * by;
        let mut begun = false;
        loop {
            let all = self.returns.all();
            let (from, to) = (middle - reach, middle + reach);
            self.active = all.partition_point(|kept| f64::from(kept.time_s) < from)
                ..all.partition_point(|kept| f64::from(kept.time_s) <= to);
            if begun {
                self.descend(sparse, GROWTH_ITERATIONS, None);
            }
            let rounds = if begun { GROWTH_ROUNDS } else { GROWTH_FIRST_ROUNDS };
            for _ in 0..rounds {
                self.extract(sparse);
                let iterations = if begun { GROWTH_ITERATIONS } else { GROWTH_FIRST_ITERATIONS };
                self.descend(sparse, iterations, None);
            }
            if from <= first && to >= last {
                break;
            }
            begun = true;
            reach += by;
        }
    }
}
