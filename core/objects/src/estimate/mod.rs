//! Joint trajectory and shape of an object in continuous time (2.5): B-splines estimated from
//! asynchronous returns (Furgale, Barfoot and Sibley, ICRA 2012), the shape as points that are
//! eliminated from each step.
//!
//! The estimate maximises the posterior (2.1), `p(x) p(m) p(z | x, m)`: it minimises
//!
//! ```text
//! J_m = 1/2 Σ m' R_m^-1 m            R_m = shape_sigma_m² I
//! J_u = 1/2 ∫ e_u' Q_u^-1 e_u dt     e_u = dx/dt - f(x)
//! J_z = 1/2 Σ e_z' R_z^-1 e_z        e_z = R(φ)'(z - p) - m,  R_z = return_sigma_m² I
//! ```
//!
//! The dissertation prints (2.7) without the minus and the half, (2.23) with `R_m` for its inverse,
//! (2.24) and (2.25) without the half, (2.25) with `R_z` for its inverse and `R_z = σ_z I` for
//! `σ_z² I`; the above follows from Bayes' rule and the definition of a Gaussian.
//!
//! Everything is in double precision except the positions of returns and model points: `Q_u^-1`
//! reaches 1e6, next to an `R_z^-1` of 4.
//!
//! The plain method stays where it starts: the visible face of an object changes as one passes it,
//! a history of centroids slides along, and the model fits two shifted copies of one face (figure
//! 2.9). The remedies, each an option of [`EstimateParams`] that `raywake-lab eval tracks` measures
//! separately:
//!
//! - `endpoints`: where the object ends, and that rays pass there ([`crate::panorama`]);
//! - `velocity_search`: several starts, found by a search over velocities;
//! - `initial`: a start grown from the middle of the track over a sparse model;
//! - `surface`: returns weighted across surfaces;
//! - `free_space`: removal of model points that rays went through;
//! - `process`: a Student-t turn rate: steady motion with a few hard turns.
//!
//! A round object does not show where its origin lies: with one behind it, like a trailer's axle,
//! it turns later and more gently. So its points are kept near the origin
//! ([`EstimateParams::reference_length_m`]).

mod cholesky;
mod endpoints;
mod equations;
mod fixed_lag;
mod free_space;
mod initial;
mod members;
mod model_point;
mod nearest;
mod observation;
mod params;
mod piece;
mod problem;
mod process;
mod report;
mod samples;
mod state;
mod steady;
mod surface;
#[cfg(test)]
mod synthetic;
#[cfg(test)]
mod tests;
mod velocity_search;

pub use fixed_lag::FixedLag;
pub use params::{
    EndpointParams, EstimateParams, FixedLagParams, FreeSpaceParams, GrowthParams, SearchParams,
    SmoothingParams,
};
pub use report::{Cost, EstimateReport, InitialGuess, Termination};

use crate::spline::Knots;
use crate::{ObjectReturn, ObjectState, wrap_angle};
use problem::{Problem, Solution};
use state::{HEADING, SPEED, reverse, state_at};
use velocity_search::VelocitySearch;

/// Maximum number of model points.
pub const MODEL_MAX: usize = 3000;
/// Maximum number of iterations of a solve.
pub const ITERATIONS_MAX: usize = 64;

/// The workspace of an estimate, and its result. Large: keep it in a box or a static.
pub struct Estimator {
    problem: Problem,
    best: Solution,
    search: VelocitySearch,
}

impl Default for Estimator {
    fn default() -> Estimator {
        Estimator::new()
    }
}

impl Estimator {
    /// An empty estimator, all zeros: as a static it takes no room in a binary.
    pub const fn new() -> Estimator {
        Estimator { problem: Problem::new(), best: Solution::NONE, search: VelocitySearch::new() }
    }

    /// Estimates trajectory and model from the returns of an object (any number, in any order) and
    /// the history of the tracker that found it.
    pub fn solve(
        &mut self,
        params: &EstimateParams,
        returns: &[ObjectReturn],
        history: &[ObjectState],
    ) -> EstimateReport {
        let mut report = EstimateReport::default();
        let problem = &mut self.problem;
        problem.knots = Knots::NONE;
        problem.prior = None;
        self.best.control_points.fill([0.0; 7]);
        self.best.points = 0;
        let Some(taken) = problem.samples.take(returns, params.returns, params.passing) else {
            report.unsound = returns.len();
            return report;
        };
        let params = &params.for_length(problem.samples.length_m());
        let [first_s, last_s] = [taken.first_s, taken.last_s].map(f64::from);
        problem.set_knots(Knots::over(first_s, last_s, params.basis_s));
        report.returns = problem.samples.all().len();
        report.unsound = taken.unsound;
        report.thinned = returns.len() - taken.unsound - report.returns;

        problem.start(params, history);
        if params.growth.growth {
            problem.grow(&params.gaussian().without_endpoints());
        }
        self.run(params, &mut report);
        self.best.copy(&self.problem.solution);
        if params.multi_start {
            self.try_other_starts(params, &mut report);
            self.face_forward();
        }
        self.unwind();
        report
    }

    /// Also solves from steady motions; the cheapest solution remains.
    fn try_other_starts(&mut self, params: &EstimateParams, report: &mut EstimateReport) {
        let mut least = self.problem.cost_with_endpoints(params, report);
        for from in [InitialGuess::Steady, InitialGuess::Unsteady] {
            if !self.start(from, params) {
                continue;
            }
            let mut other = EstimateReport { from, ..report.clone() };
            self.run(params, &mut other);
            let cost = self.problem.cost_with_endpoints(params, &other);
            if cost < least {
                (*report, least) = (other, cost);
                self.best.copy(&self.problem.solution);
            }
        }
    }

    /// Searches for a start and sets the problem to it. False if there is none.
    fn start(&mut self, from: InitialGuess, params: &EstimateParams) -> bool {
        let Estimator { problem, search, .. } = self;
        match from {
            InitialGuess::History => false,
            InitialGuess::Steady => steady::start_steady(problem, search, params),
            InitialGuess::Unsteady => steady::start_unsteady(problem, search, params),
        }
    }

    /// Solves from the trajectory of the problem.
    fn run(&mut self, params: &EstimateParams, report: &mut EstimateReport) {
        let problem = &mut self.problem;
        report.costs.clear();
        (report.iterations, report.carved) = (0, 0);
        problem.active = 0..problem.samples.all().len();
        if params.endpoints.endpoint_sigma_m > 0.0 {
            let gaussian = &params.gaussian();
            problem.extract(gaussian);
            problem.descend(gaussian, params.iterations, report);
        }
        let params = &params.without_endpoints();
        problem.extract(params);
        report.termination = problem.descend(params, params.iterations, report);
        for _ in 0..params.free_space.carving_rounds {
            let carved = problem.carve(params.return_sigma_m, &params.free_space);
            report.carved += carved;
            if carved == 0 {
                break;
            }
            report.termination = problem.descend(params, params.iterations, report);
        }
    }

    /// Backwards at one heading is forwards at the opposite one: chooses the one with which it
    /// moves forwards for most of its track.
    fn face_forward(&mut self) {
        let control_points = &mut self.best.control_points[..self.problem.knots.bases()];
        let speed: f64 = control_points.iter().map(|point| point[SPEED]).sum();
        if speed < 0.0 {
            control_points.iter_mut().for_each(reverse);
            for [x, y, _] in &mut self.best.model[..self.best.points] {
                (*x, *y) = (-*x, -*y);
            }
        }
    }

    /// An object too small or too round to have a heading may have made many turns by now: whole
    /// turns carry no meaning, and the heading is made to begin within half a turn of zero.
    fn unwind(&mut self) {
        let knots = &self.problem.knots;
        let control_points = &mut self.best.control_points[..knots.bases()];
        let heading = knots.value(control_points, knots.start())[HEADING];
        let turns = heading - wrap_angle(heading);
        control_points.iter_mut().for_each(|point| point[HEADING] -= turns);
    }

    /// State of the object at `time_s`, extrapolated outside the times of its returns; all zeros if
    /// there is no estimate.
    pub fn state(&self, time_s: f64) -> ObjectState {
        let knots = &self.problem.knots;
        if *knots == Knots::NONE {
            return ObjectState { time_s, ..ObjectState::default() };
        }
        let inside = time_s.clamp(knots.start(), knots.end());
        state_at(knots, &self.best.control_points, inside, time_s)
    }

    /// Model points, m, in the object's frame.
    pub fn model(&self) -> &[[f32; 3]] {
        &self.best.model[..self.best.points]
    }
}
