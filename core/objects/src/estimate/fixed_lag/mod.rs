//! Fixed-lag smoothing: the same estimate over the last seconds, with every sweep.
//!
//! What leaves the window remains as a prior: the state at the window's first time, as estimated
//! when the window last advanced, and for each model point the mean of the returns that left, with
//! a precision proportional to their number. Every object needs its own [`FixedLag`] (about 30 KB);
//! one workspace serves all.
//!
//! A young track is solved twice with every sweep, over a new sparse model: from its current
//! estimate, and from one of several other starts in turn; the cheaper solution is kept.
//!
//! The turn rate keeps its Gaussian noise and does not decay here: a sweep's two iterations would
//! not find the minima that Student-t noise adds.
//!
//! The work of a push is thus bounded, however young its track and however many tracks appear at
//! once: [`FixedLag::ITERATIONS_MAX`] over [`FixedLag::RETURNS_MAX`] returns.

mod model;
#[cfg(test)]
mod tests;
mod young;

use super::Estimator;
use super::observation::Observation;
use super::params::{EstimateParams, FixedLagParams};
use super::problem::{Problem, StatePrior};
use super::report::EstimateReport;
use super::samples::{Sample, is_valid_return};
use super::state::{ControlPoint, is_valid, state_at};
use crate::spline::{DEGREE, Knots};
use crate::{ObjectReturn, ObjectState};
use heapless::Vec;
use model::WindowModel;

/// Length of the window, s. It and the following constants size what is kept.
const WINDOW_S: f64 = 2.5;
/// Maximum number of pieces of the splines, and their length, s: one piece more than the window,
/// for time to advance into.
const PIECES: usize = 6;
const PIECE_S: f64 = 0.5;
const BASES: usize = PIECES + DEGREE;
/// Returns kept of a sweep, besides its foremost and hindmost, and of the window at 10 Hz.
const PER_SWEEP: usize = 32;
const RETURNS: usize = 26 * (PER_SWEEP + 2);
/// Number of tracker states kept: those of the window at 10 Hz.
const HISTORY: usize = 32;
/// Number of published states of a young track that are kept.
const PUBLISHED: usize = 16;

/// A return of the window.
#[derive(Clone, Copy)]
struct WindowReturn {
    position: [f32; 3],
    time_s: f32,
    /// Its model point.
    nearest: u16,
}

/// The estimate of one object over its last seconds.
pub struct FixedLag {
    knots: Knots,
    control_points: [ControlPoint; BASES],
    prior: Option<StatePrior>,
    returns: Vec<WindowReturn, RETURNS>,
    history: Vec<ObjectState, HISTORY>,
    model: WindowModel,
    /// Front and rear, m along the object.
    ends: [f32; 2],
    /// Displacement forwards, m.
    forward_m: f64,
    /// States published while the track was young.
    published: Vec<ObjectState, PUBLISHED>,
    /// Number of starts tried.
    attempts: usize,
    /// Number of iterations of the last push.
    iterations: usize,
    /// First and last time of the track's returns, s.
    born_s: f64,
    newest_s: f64,
    begun: bool,
    restarts: u32,
}

impl Default for FixedLag {
    fn default() -> FixedLag {
        FixedLag::new()
    }
}

impl FixedLag {
    /// Maximum number of Gauss-Newton iterations of a push: those of both solves of a young track.
    pub const ITERATIONS_MAX: usize = 2 * young::ROUNDS * young::ITERATIONS;
    /// Maximum number of returns in each iteration.
    pub const RETURNS_MAX: usize = RETURNS;

    /// The estimate of an object not seen yet.
    pub const fn new() -> FixedLag {
        FixedLag {
            knots: Knots::NONE,
            control_points: [[0.0; 7]; BASES],
            prior: None,
            returns: Vec::new(),
            history: Vec::new(),
            model: WindowModel::new(),
            ends: [0.0; 2],
            forward_m: 0.0,
            published: Vec::new(),
            attempts: 0,
            iterations: 0,
            born_s: 0.0,
            newest_s: 0.0,
            begun: false,
            restarts: 0,
        }
    }

    /// Forgets the object, to start with another one.
    pub fn clear(&mut self) {
        self.prior = None;
        self.returns.clear();
        self.history.clear();
        self.model.points.clear();
        self.published.clear();
        self.attempts = 0;
        self.begun = false;
        self.restarts = 0;
    }

    /// Takes the returns of a sweep and the state of the tracker that found the object, and returns
    /// the object's state at the time of the newest return or, without a sound return, the state
    /// extrapolated to the tracker's time. A young track that has hardly moved is stationary.
    ///
    /// Returns from before the window are ignored. After a gap as long as the window, or when the
    /// estimate deviates from the tracker's by more than `shape_sigma_m` plus the object's length,
    /// at most `strayed_length_m`, the estimate restarts.
    pub fn push(
        &mut self,
        estimator: &mut Estimator,
        params: &EstimateParams,
        returns: &[ObjectReturn],
        baseline: &ObjectState,
    ) -> ObjectState {
        self.iterations = 0;
        self.remember(baseline);
        let times = returns.iter().filter(|one| is_valid_return(one)).map(|one| one.time_s);
        let Some(newest) = times.max_by(f32::total_cmp).map(f64::from) else {
            return if self.begun { self.state(baseline.time_s) } else { *baseline };
        };
        if self.begun && newest > self.newest_s + WINDOW_S {
            self.restart();
        }
        let elapsed = if self.begun { (newest - self.newest_s).max(0.0) } else { 0.0 };
        self.newest_s = if self.begun { self.newest_s.max(newest) } else { newest };
        let lag = &params.fixed_lag;
        let fresh = self.take(returns, baseline, lag);
        if !self.begun {
            self.begin(lag);
        }
        self.advance(lag);
        self.forward_m += self.state(self.newest_s).speed * elapsed;
        let young = self.published.is_empty() || self.newest_s - self.born_s < lag.young_s;
        self.estimate(estimator, params, fresh, young);
        let mut state = self.state(self.newest_s);
        if young {
            if libm::fabs(self.forward_m) <= lag.young_stationary_m {
                (state.speed, state.climb, state.turn_rate) = (0.0, 0.0, 0.0);
            }
            push_last(&mut self.published, state);
        }
        // A centroid can be anywhere on the object.
        let [front, rear] = self.ends.map(f64::from);
        let length_m = (front - rear).max(0.0).min(lag.strayed_length_m);
        if self.strayed(&state, params.shape_sigma_m + length_m) {
            self.restart();
            return *self.history.last().unwrap_or(&state);
        }
        state
    }

    /// Number of times the estimate restarted.
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// Gauss-Newton iterations of the last push.
    pub fn iterations(&self) -> usize {
        self.iterations
    }

    /// Adds a state of the tracker to the history.
    fn remember(&mut self, baseline: &ObjectState) {
        if !is_valid(baseline) {
            return;
        }
        let mut state = *baseline;
        // Backwards if the tracker has not found out yet which way the object faces.
        if state.speed < 0.0 {
            state.heading += core::f64::consts::PI;
            state.speed = -state.speed;
        }
        push_last(&mut self.history, state);
    }

    /// Takes evenly spaced returns of a sweep, its foremost and its hindmost; drops those older
    /// than the window. Returns how many are new.
    fn take(
        &mut self,
        returns: &[ObjectReturn],
        baseline: &ObjectState,
        params: &FixedLagParams,
    ) -> usize {
        let sound = || returns.iter().filter(|one| is_valid_return(one));
        let oldest = self.newest_s - WINDOW_S;
        let count = sound().count();
        let keep = count.min(PER_SWEEP);
        self.forget(oldest, params);
        let ends = self.outermost(returns, baseline);
        let before = self.returns.len();
        for (rank, one) in sound().enumerate() {
            let taken =
                (rank + 1) * keep / count > rank * keep / count || ends.contains(&Some(rank));
            if taken && f64::from(one.time_s) >= oldest {
                let one = WindowReturn { position: one.position, time_s: one.time_s, nearest: 0 };
                _ = self.returns.push(one);
            }
        }
        let fresh = self.returns.len() - before;
        self.returns.sort_unstable_by(|a, b| a.time_s.total_cmp(&b.time_s));
        fresh
    }

    /// Finds the foremost and the hindmost of the sound returns, allowing for the object's motion.
    fn outermost(&self, returns: &[ObjectReturn], baseline: &ObjectState) -> [Option<usize>; 2] {
        let state = if self.begun { self.state(self.newest_s) } else { *baseline };
        let (sin, cos) = libm::sincos(state.heading);
        let along = |one: &ObjectReturn| {
            let [x, y, _] = one.position.map(f64::from);
            cos * x + sin * y - state.speed * f64::from(one.time_s)
        };
        [1.0, -1.0].map(|forward| {
            let ranked = returns.iter().filter(|one| is_valid_return(one)).enumerate();
            ranked
                .max_by(|(_, a), (_, b)| (forward * along(a)).total_cmp(&(forward * along(b))))
                .map(|(rank, _)| rank)
        })
    }

    fn restart(&mut self) {
        let restarts = self.restarts + 1;
        self.clear();
        self.restarts = restarts;
    }

    fn begin(&mut self, params: &FixedLagParams) {
        self.begun = true;
        self.model.clear(params);
        self.born_s = self.returns.first().map_or(self.newest_s, |one| f64::from(one.time_s));
        self.knots = Knots::pieces(self.born_s, PIECE_S, 1);
    }

    /// Whether the estimate is farther than `distance_m` from the tracker's.
    fn strayed(&self, state: &ObjectState, distance_m: f64) -> bool {
        let Some(baseline) = self.history.last() else { return !is_valid(state) };
        let ahead = state.time_s - baseline.time_s;
        let (sin, cos) = libm::sincos(baseline.heading);
        let travelled = baseline.speed * ahead;
        let off = [
            state.position[0] - baseline.position[0] - travelled * cos,
            state.position[1] - baseline.position[1] - travelled * sin,
            state.position[2] - baseline.position[2],
        ];
        let square: f64 = off.iter().map(|v| v * v).sum();
        !is_valid(state) || square > distance_m * distance_m
    }

    fn state(&self, time_s: f64) -> ObjectState {
        state_at(&self.knots, &self.control_points, time_s.min(self.newest_s), time_s)
    }

    /// Drops returns from before `oldest`; from now on each contributes to its model point.
    fn forget(&mut self, oldest: f64, params: &FixedLagParams) {
        let left = self.returns.partition_point(|one| f64::from(one.time_s) < oldest);
        for one in &self.returns[..left] {
            let basis = self.knots.basis(f64::from(one.time_s));
            let sample = Sample { basis, ..Sample::at(one.position, one.time_s) };
            let local = Observation::of(&self.control_points, &sample).local();
            self.model.absorb(one.nearest, local, params);
        }
        self.returns.copy_within(left.., 0);
        self.returns.truncate(self.returns.len() - left);
    }

    /// Advances the splines until they contain the newest time: first by adding pieces, then by
    /// shifting them.
    fn advance(&mut self, params: &FixedLagParams) {
        while self.newest_s > self.knots.end() {
            let pieces = self.knots.spans();
            if pieces < PIECES {
                self.knots = Knots::pieces(self.knots.start(), PIECE_S, pieces + 1);
            } else {
                let first = self.knots.start() + PIECE_S;
                self.prior = Some(StatePrior {
                    time_s: first,
                    mean: self.knots.value(&self.control_points, first),
                    precision: params.prior_sigmas().map(|sigma| 1.0 / (sigma * sigma)),
                });
                self.knots = Knots::pieces(first, PIECE_S, PIECES);
                self.control_points.copy_within(1.., 0);
            }
            let n = self.knots.bases();
            let [before, last] = [self.control_points[n - 3], self.control_points[n - 2]];
            self.control_points[n - 1] = core::array::from_fn(|d| 2.0 * last[d] - before[d]);
        }
    }

    fn estimate(
        &mut self,
        estimator: &mut Estimator,
        params: &EstimateParams,
        fresh: usize,
        young: bool,
    ) {
        let problem = &mut estimator.problem;
        problem.prior = self.prior;
        problem.samples.set(self.returns.iter().map(|one| (one.position, one.time_s)));
        problem.set_knots(self.knots);
        // Two iterations per sweep do not find the other minima that hard turns bring.
        let params = &EstimateParams {
            tangential_sigma_m: params.fixed_lag.lag_tangential_sigma_m,
            shape_sigma_m: params.shape_sigma_m,
            turn_decay_s: f64::INFINITY,
            ..params.for_length(problem.samples.length_m()).gaussian()
        };
        if young {
            self.estimate_young(estimator, params);
        } else {
            self.estimate_on(problem, params, fresh);
            self.face_forward(params.fixed_lag.reversed_m);
        }
    }

    /// Solves from the current estimate, with the existing model.
    fn estimate_on(&mut self, problem: &mut Problem, params: &EstimateParams, fresh: usize) {
        let lag = &params.fixed_lag;
        problem.solution.control_points[..BASES].copy_from_slice(&self.control_points);
        if self.model.points.is_empty() {
            problem.observe();
            let all = self.returns.len();
            self.model.extend(&mut self.returns, &problem.observations, all, lag);
        }
        let precision = 1.0 / (params.return_sigma_m * params.return_sigma_m);
        problem.solution.points = self.model.points.len();
        for (i, point) in self.model.points.iter().enumerate() {
            problem.solution.model[i] = point.at;
            problem.solution.surfaces[i] = point.surface(precision);
        }
        problem.solution.ends = self.ends;
        let mut report = EstimateReport::default();
        problem.descend(params, lag.lag_iterations, &mut report);
        self.iterations += report.iterations;
        self.keep(problem);
        for (point, at) in self.model.points.iter_mut().zip(&problem.solution.model) {
            point.at = *at;
        }
        self.model.extend(&mut self.returns, &problem.observations, fresh, lag);
    }

    /// Adopts the trajectory of the problem.
    fn keep(&mut self, problem: &Problem) {
        self.control_points.copy_from_slice(&problem.solution.control_points[..BASES]);
        self.ends = problem.solution.ends;
    }
}

/// Appends to the last states, dropping the first if there is no room.
fn push_last<const N: usize>(states: &mut Vec<ObjectState, N>, state: ObjectState) {
    if states.is_full() {
        states.remove(0);
    }
    _ = states.push(state);
}
