//! A young track: its motion is not known yet, and other starts are tried with every sweep.

use super::{BASES, FixedLag};
use crate::estimate::Estimator;
use crate::estimate::params::EstimateParams;
use crate::estimate::problem::Problem;
use crate::estimate::report::{Cost, EstimateReport};
use crate::estimate::state::{ControlPoint, HEADING, reverse};
use crate::spline::Knots;
use crate::wrap_angle;

/// Number of models that a solve makes, and of iterations with each: they bound the work of a
/// sweep.
pub(super) const ROUNDS: usize = 2;
pub(super) const ITERATIONS: usize = 3;

/// Where a solve starts.
#[derive(Clone, Copy)]
enum Guess {
    /// At rest.
    Rest,
    /// The tracker's history.
    History,
    /// The visible part: at this share of the way from its hindmost to its foremost return.
    Visible(f64),
}

/// Starts, used in turn. One end of the visible part may be where the view ends, while the other
/// moves.
const GUESSES: [Guess; 5] =
    [Guess::Rest, Guess::History, Guess::Visible(0.5), Guess::Visible(1.0), Guess::Visible(0.0)];

impl FixedLag {
    /// Solves from the current estimate, and from the next start in turn; keeps the cheaper
    /// solution.
    pub(super) fn estimate_young(&mut self, estimator: &mut Estimator, params: &EstimateParams) {
        let problem = &mut estimator.problem;
        let mut least = f64::MAX;
        if !self.published.is_empty() {
            problem.solution.control_points[..BASES].copy_from_slice(&self.control_points);
            least = self.solve(problem, params);
            self.keep(problem);
        }
        let guess = GUESSES[self.attempts % GUESSES.len()];
        self.attempts += 1;
        self.start(guess, problem, params);
        let cost = self.solve(problem, params);
        let stationary = params.fixed_lag.young_stationary_m;
        let rests = || {
            let moved = forward_m(&self.knots, &problem.solution.control_points, self.newest_s);
            libm::fabs(moved) <= stationary
        };
        if cost < least && (matches!(guess, Guess::Rest) || !rests()) {
            self.keep(problem);
        }
        self.forward_m = forward_m(&self.knots, &self.control_points, self.newest_s);
        self.face_forward(params.fixed_lag.reversed_m);
        self.anchor();
    }

    /// Sets the problem to a start.
    fn start(&self, guess: Guess, problem: &mut Problem, params: &EstimateParams) {
        match guess {
            Guess::Rest => {
                if !problem.rest_at_history_mean(&self.history) {
                    problem.rest_at_mean();
                }
                if let Some(last) = self.published.last() {
                    let control_points = &mut problem.solution.control_points[..BASES];
                    control_points.iter_mut().for_each(|point| point[HEADING] = last.heading);
                }
            }
            Guess::History => _ = problem.start(params, &self.history),
            Guess::Visible(share) => {
                problem.start(params, &self.history);
                problem.observe();
                let states = problem.endpoint_states(params, share);
                if !states.is_empty() {
                    problem.smooth(params, &states);
                }
            }
        }
    }

    /// Solves from the trajectory of the problem, extracting a sparse model in each round; returns
    /// the cost.
    fn solve(&mut self, problem: &mut Problem, params: &EstimateParams) -> f64 {
        let lag = &params.fixed_lag;
        let points = self.returns.len() / lag.young_returns_per_point;
        let sparse = &EstimateParams {
            model_points: points.min(lag.young_points_max).max(lag.young_points_min),
            return_sigma_m: lag.young_sigma_m,
            ..*params
        };
        let mut cost = f64::MAX;
        for _ in 0..ROUNDS {
            let mut report = EstimateReport::default();
            problem.extract(sparse);
            problem.descend(sparse, ITERATIONS, &mut report);
            self.iterations += report.iterations;
            cost = report.costs.last().map_or(cost, Cost::total);
        }
        cost
    }

    /// Reverses the object if it moved backwards overall.
    pub(super) fn face_forward(&mut self, reversed_m: f64) {
        if self.forward_m > -reversed_m {
            return;
        }
        self.forward_m = -self.forward_m;
        self.control_points.iter_mut().for_each(reverse);
        self.prior.iter_mut().for_each(|prior| reverse(&mut prior.mean));
        for point in &mut self.model.points {
            for [x, y, _] in [&mut point.at, &mut point.prior_mean] {
                (*x, *y) = (-*x, -*y);
            }
        }
        let [front, rear] = self.ends;
        self.ends = [-rear, -front];
    }

    /// Shifts the state to the point of the object that published states refer to, with its heading
    /// within half a turn of theirs: each start has its own origin.
    fn anchor(&mut self) {
        let mut by = [0.0; 3];
        for state in &self.published {
            let [x, y, z, heading, ..] = self.knots.value(&self.control_points, state.time_s);
            let (sin, cos) = libm::sincos(heading);
            let off = [state.position[0] - x, state.position[1] - y, state.position[2] - z];
            by[0] += cos * off[0] + sin * off[1];
            by[1] += cos * off[1] - sin * off[0];
            by[2] += off[2];
        }
        let by = by.map(|by| by / self.published.len().max(1) as f64);
        // Whole turns carry no meaning.
        let turns = self.published.last().map_or(0.0, |state| {
            let off = self.knots.value(&self.control_points, state.time_s)[HEADING] - state.heading;
            off - wrap_angle(off)
        });
        for [x, y, z, heading, ..] in &mut self.control_points {
            *heading -= turns;
            let (sin, cos) = libm::sincos(*heading);
            *x += cos * by[0] - sin * by[1];
            *y += sin * by[0] + cos * by[1];
            *z += by[2];
        }
        self.ends = self.ends.map(|end| end - by[0] as f32);
    }
}

/// Displacement along the last heading over the window, m.
fn forward_m(knots: &Knots, control_points: &[ControlPoint], until_s: f64) -> f64 {
    let [from, to] = [knots.start(), until_s].map(|time_s| knots.value(control_points, time_s));
    let (sin, cos) = libm::sincos(to[HEADING]);
    cos * (to[0] - from[0]) + sin * (to[1] - from[1])
}
