//! One trajectory and model being estimated: Gauss-Newton iterations with Levenberg-Marquardt
//! damping, each with new nearest model points (as in iterated closest points).

use core::ops::Range;

use super::endpoints::{Endpoints, PARTS};
use super::equations::Equations;
use super::members::Members;
use super::model_point::ModelPoint;
use super::nearest::{NearestGrid, square_distance};
use super::observation::Observation;
use super::params::EstimateParams;
use super::process::{self, ProcessModel};
use super::report::{Cost, EstimateReport, Termination};
use super::samples::Samples;
use super::state::ControlPoint;
use super::surface::Surface;
use super::{ITERATIONS_MAX, MODEL_MAX};
use crate::spline::{BASES_MAX, Knots};
use crate::{ObjectState, RETURNS_MAX};

/// A trajectory with its model.
pub(super) struct Solution {
    pub control_points: [ControlPoint; BASES_MAX],
    pub model: [[f32; 3]; MODEL_MAX],
    pub surfaces: [Surface; MODEL_MAX],
    /// Number of model points.
    pub points: usize,
    /// Front and rear, m along the object.
    pub ends: [f32; 2],
}

impl Solution {
    pub const NONE: Solution = Solution {
        control_points: [[0.0; 7]; BASES_MAX],
        model: [[0.0; 3]; MODEL_MAX],
        surfaces: [Surface::NONE; MODEL_MAX],
        points: 0,
        ends: [0.0; 2],
    };

    pub fn copy(&mut self, other: &Solution) {
        self.control_points = other.control_points;
        self.points = other.points;
        self.ends = other.ends;
        self.model[..other.points].copy_from_slice(&other.model[..other.points]);
        self.surfaces[..other.points].copy_from_slice(&other.surfaces[..other.points]);
    }
}

/// A state known independently of the returns.
#[derive(Clone, Copy)]
pub(super) struct StatePrior {
    pub time_s: f64,
    pub mean: ControlPoint,
    pub precision: ControlPoint,
}

/// The workspace of an estimate.
pub(super) struct Problem {
    pub knots: Knots,
    pub samples: Samples,
    /// Samples that the equations are built from.
    pub active: Range<usize>,
    pub prior: Option<StatePrior>,
    pub solution: Solution,
    previous: Solution,
    /// One for each active sample.
    pub observations: [Observation; RETURNS_MAX],
    pub members: Members,
    nearest: NearestGrid<MODEL_MAX>,
    pub endpoints: Endpoints,
    pub equations: Equations,
    pub step: [ControlPoint; BASES_MAX],
}

impl Problem {
    /// All zeros: as a static it takes no room in a binary.
    pub const fn new() -> Problem {
        Problem {
            knots: Knots::NONE,
            samples: Samples::new(),
            active: 0..0,
            prior: None,
            solution: Solution::NONE,
            previous: Solution::NONE,
            observations: [Observation::NONE; RETURNS_MAX],
            members: Members::new(),
            nearest: NearestGrid::new(),
            endpoints: Endpoints::new(),
            equations: Equations::new(),
            step: [[0.0; 7]; BASES_MAX],
        }
    }

    /// Sets the knots, and the basis functions of all samples.
    pub fn set_knots(&mut self, knots: Knots) {
        self.knots = knots;
        self.samples.set_bases(&knots);
        self.active = 0..self.samples.all().len();
    }

    /// Observes the active samples from the trajectory.
    pub fn observe(&mut self) {
        let samples = &self.samples.all()[self.active.clone()];
        for (sample, observation) in samples.iter().zip(&mut self.observations) {
            *observation = Observation::of(&self.solution.control_points, sample);
        }
    }

    /// Makes a model of the active samples: returns evenly spaced in time order.
    pub fn extract(&mut self, params: &EstimateParams) {
        self.observe();
        let count = self.active.len();
        let points = params.model_points.clamp(1, MODEL_MAX).min(count);
        for (i, model) in self.solution.model[..points].iter_mut().enumerate() {
            *model = self.observations[(2 * i + 1) * count / (2 * points)].local_f32();
        }
        let precision = |sigma: f64| 1.0 / (sigma * sigma);
        let surface = Surface {
            prior_precision: precision(params.shape_sigma_m),
            ..Surface::isotropic(precision(params.return_sigma_m))
        };
        self.solution.surfaces[..points].fill(surface);
        self.solution.points = points;
        self.find_endpoints(params);
        self.solution.ends = self.endpoints.quantiles();
    }

    fn find_endpoints(&mut self, params: &EstimateParams) {
        let samples = &self.samples.all()[self.active.clone()];
        self.endpoints.find(samples, &self.observations[..samples.len()], &params.endpoints);
    }

    /// States of the object located by its visible ends; see [`Endpoints::states`].
    pub fn endpoint_states(
        &mut self,
        params: &EstimateParams,
        share: f64,
    ) -> heapless::Vec<ObjectState, PARTS> {
        self.find_endpoints(params);
        self.endpoints.states(&self.knots, &self.solution.control_points, share)
    }

    /// Cost of the last descent, including that of the endpoints.
    pub fn cost_with_endpoints(&mut self, params: &EstimateParams, report: &EstimateReport) -> f64 {
        self.find_endpoints(params);
        let ends = self.endpoints.quantiles();
        let cost = self.endpoints.evaluate(&ends, &params.endpoints);
        report.costs.last().map_or(f64::MAX, Cost::total) + cost
    }

    /// Runs Gauss-Newton iterations. Needs a model.
    pub fn descend(
        &mut self,
        params: &EstimateParams,
        iterations: usize,
        report: &mut EstimateReport,
    ) -> Termination {
        let mut cost = self.linearise(params);
        if report.costs.is_empty() {
            _ = report.costs.push(cost);
        }
        let mut damping = if params.damping { params.damping_first } else { 0.0 };
        for _ in 0..iterations {
            if report.iterations == ITERATIONS_MAX {
                return Termination::Iterations;
            }
            self.previous.copy(&self.solution);
            let Some(()) = self.step(damping) else { return Termination::NotFinite };
            let next = self.linearise(params);
            report.iterations += 1;
            let gain = cost.total() - next.total();
            let worse = params.damping && gain < 0.0;
            if !next.total().is_finite() || worse {
                self.solution.copy(&self.previous);
                if !params.damping {
                    return Termination::NotFinite;
                }
                _ = report.costs.push(cost);
                self.linearise(params);
                damping *= params.damping_up;
                continue;
            }
            _ = report.costs.push(next);
            damping *= params.damping_down;
            let converged = libm::fabs(gain) <= params.convergence * cost.total();
            cost = next;
            if converged {
                return Termination::Converged;
            }
        }
        Termination::Iterations
    }

    /// Computes residuals and derivatives at the solution; returns the cost.
    fn linearise(&mut self, params: &EstimateParams) -> Cost {
        self.associate();
        if params.surfaces {
            self.fit_surfaces(params);
        }
        let cost = self.evaluate(params);
        Cost { process: self.begin_equations(params), ..cost }
    }

    /// Begins the equations with the process model and the prior; returns their cost.
    fn begin_equations(&mut self, params: &EstimateParams) -> f64 {
        let n = self.knots.bases();
        let control_points = &self.solution.control_points[..n];
        self.equations.clear(n);
        let model = ProcessModel::of(params);
        let mut cost = process::add(&self.knots, control_points, &model, &mut self.equations);
        if let Some(prior) = &self.prior {
            let state = self.knots.value(control_points, prior.time_s);
            let residual: ControlPoint = core::array::from_fn(|d| prior.mean[d] - state[d]);
            for (residual, precision) in residual.iter().zip(prior.precision) {
                cost += 0.5 * precision * residual * residual;
            }
            let basis = self.knots.basis(prior.time_s);
            self.equations.add_state(&basis, &residual, &prior.precision);
        }
        cost
    }

    /// Finds the nearest model point of every active sample.
    fn associate(&mut self) {
        let samples = &self.samples.all()[self.active.clone()];
        let model = &self.solution.model[..self.solution.points];
        self.nearest.fill(model);
        for (sample, observation) in samples.iter().zip(&mut self.observations) {
            let guess = usize::from(observation.nearest);
            *observation = Observation::of(&self.solution.control_points, sample);
            let local = observation.local_f32();
            let far = model.get(guess).map_or(f32::MAX, |guess| square_distance(guess, &local));
            // If it is not finite, any will do: the cost shows it.
            observation.nearest = self.nearest.find(local, far).map_or(0, |(number, _)| number);
        }
        self.members.group(model.len(), &self.observations[..samples.len()]);
    }

    /// Fits the surface of every model point to its returns.
    fn fit_surfaces(&mut self, params: &EstimateParams) {
        let Solution { model, surfaces, points, .. } = &mut self.solution;
        for (number, (model, surface)) in model[..*points].iter().zip(surfaces).enumerate() {
            let mut scatter = surface.scatter;
            for &i in self.members.of(number) {
                scatter.add(self.observations[usize::from(i)].local(), *model);
            }
            surface.fit(&scatter, params);
        }
    }

    /// Evaluates the samples at their model points; returns the cost without the process term.
    fn evaluate(&mut self, params: &EstimateParams) -> Cost {
        let mut cost = Cost::default();
        let points = self.solution.model[..self.solution.points].iter();
        for (model, surface) in points.zip(&self.solution.surfaces) {
            let square = f64::from(square_distance(model, &surface.prior_mean));
            cost.model += 0.5 * surface.prior_precision * square;
        }
        let count = self.active.len();
        for observation in &mut self.observations[..count] {
            let number = usize::from(observation.nearest);
            let model = &self.solution.model[number];
            cost.returns += observation.evaluate(model, &self.solution.surfaces[number]);
            let square = square_distance(model, &observation.local_f32());
            cost.residual_m += f64::from(libm::sqrtf(square));
        }
        cost.residual_m /= count as f64;
        self.find_endpoints(params);
        cost.returns += self.endpoints.evaluate(&self.solution.ends, &params.endpoints);
        cost
    }

    /// Takes one step of trajectory, model and ends; the equations hold process and prior. None if
    /// there is no finite solution.
    fn step(&mut self, damping: f64) -> Option<()> {
        let samples = &self.samples.all()[self.active.clone()];
        let (observations, members) = (&self.observations[..], &self.members);
        let Solution { control_points, model, surfaces, points, ends } = &mut self.solution;
        let point = |number: usize, model: &[f32; 3]| ModelPoint {
            members: members.of(number),
            samples,
            observations,
            model: *model,
            surface: &surfaces[number],
        };
        let model = &mut model[..*points];
        self.equations.add_returns(samples, observations);
        for (number, model) in model.iter().enumerate() {
            self.equations.eliminate(&point(number, model));
        }
        self.endpoints.add(ends, &mut self.equations);
        self.equations.planar.damp(damping);
        self.equations.vertical.damp(damping);
        let n = self.knots.bases();
        if !self.equations.step(&mut control_points[..n], &mut self.step) {
            return None;
        }
        let step = &self.step[..n];
        for (number, model) in model.iter_mut().enumerate() {
            let by = point(number, model).back_substitute(step);
            for (value, by) in model.iter_mut().zip(by) {
                *value = (f64::from(*value) + by) as f32;
            }
        }
        self.endpoints.back_substitute(ends, step);
        Some(())
    }
}
