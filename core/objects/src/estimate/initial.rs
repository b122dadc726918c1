//! The first trajectory (2.5.3): splines fitted to the history of another tracker, smoothed with
//! the process model, or at rest; then grown from the middle of the track.

use super::params::{EstimateParams, SmoothingParams};
use super::problem::Problem;
use super::process::{self, ProcessModel};
use super::report::EstimateReport;
use super::state::{ControlPoint, TURN_RATE, elements, unwrapped};
use crate::ObjectState;

/// Maximum number of growth steps, however long the track.
const GROWTHS_MAX: f64 = 64.0;

impl Problem {
    /// Sets the first trajectory of a solve from a history. False if there is none: everything is
    /// then at rest at the mean of the returns.
    pub fn start(&mut self, params: &EstimateParams, history: &[ObjectState]) -> bool {
        if !self.fit(history) {
            self.rest_at_mean();
            return false;
        }
        if params.multi_start {
            self.smooth(&params.gaussian(), history);
        }
        true
    }

    /// Least-squares fit of the splines to the elements of every state. False if there is no
    /// history.
    fn fit(&mut self, history: &[ObjectState]) -> bool {
        let Some(first) = unwrapped(history).next().map(|state| elements(&state)) else {
            return false;
        };
        let n = self.knots.bases();
        let control_points = &mut self.solution.control_points[..n];
        control_points.fill(first);
        self.equations.clear(n);
        for state in unwrapped(history) {
            let state_elements = elements(&state);
            let residual: ControlPoint = core::array::from_fn(|d| state_elements[d] - first[d]);
            self.equations.add_state(&self.knots.basis(state.time_s), &residual, &[1.0; 7]);
        }
        self.equations.regularise(control_points);
        self.equations.step(control_points, &mut self.step)
    }

    /// Finds the trajectory that a history of positions and the process model determine together (a
    /// Gauss-Newton smoother). The headings of slow states are noise and hardly count.
    pub fn smooth(&mut self, params: &EstimateParams, history: &[ObjectState]) {
        let n = self.knots.bases();
        let control_points = &mut self.solution.control_points[..n];
        let model = ProcessModel::of(params);
        let smoothing = &params.smoothing;
        for iteration in 0..smoothing.smoothing_iterations {
            self.equations.clear(n);
            process::add(&self.knots, control_points, &model, &mut self.equations);
            let plain = iteration < smoothing.smoothing_plain_iterations;
            for state in unwrapped(history) {
                let now = self.knots.value(control_points, state.time_s);
                let state_elements = elements(&state);
                let mut residual: ControlPoint =
                    core::array::from_fn(|d| state_elements[d] - now[d]);
                residual[TURN_RATE] = -now[TURN_RATE];
                let precision = history_precision(smoothing, state.speed, &residual, plain);
                self.equations.add_state(&self.knots.basis(state.time_s), &residual, &precision);
            }
            self.equations.regularise(control_points);
            if !self.equations.step(control_points, &mut self.step) {
                return;
            }
        }
    }

    /// Sets everything at rest at the mean of the history. False if there is none.
    pub fn rest_at_history_mean(&mut self, history: &[ObjectState]) -> bool {
        let mut sum = [0.0; 4];
        let mut count = 0.0;
        for state in unwrapped(history) {
            for (sum, value) in sum.iter_mut().zip(elements(&state)) {
                *sum += value;
            }
            count += 1.0;
        }
        let [x, y, z, heading] = sum.map(|sum| sum / count);
        if count > 0.0 {
            self.solution.control_points[..self.knots.bases()]
                .fill([x, y, z, heading, 0.0, 0.0, 0.0]);
        }
        count > 0.0
    }

    /// Sets everything at rest at the mean of the returns.
    pub fn rest_at_mean(&mut self) {
        let mut mean = [0.0; 7];
        for sample in self.samples.all() {
            for (sum, value) in mean.iter_mut().zip(sample.position) {
                *sum += f64::from(value);
            }
        }
        let count = self.samples.all().len() as f64;
        self.solution.control_points[..self.knots.bases()].fill(mean.map(|sum| sum / count));
    }

    /// Grows the trajectory from the middle of the returns outwards: the next returns are
    /// registered to the model of those seen so far, starting where the process model puts them.
    pub fn grow(&mut self, params: &EstimateParams) {
        let growth = &params.growth;
        let sparse = &EstimateParams {
            model_points: growth.growth_points,
            return_sigma_m: growth.growth_sigma_m,
            ..*params
        };
        let samples = self.samples.all();
        let middle = f64::from(samples[samples.len() / 2].time_s);
        let (first, last) = (self.knots.start(), self.knots.end());
        let by = growth.growth_step_s.max((last - first) / GROWTHS_MAX);
        let mut reach = 2.0 * by;
        let mut begun = false;
        let (mut rounds, mut iterations) =
            (growth.growth_first_rounds, growth.growth_first_iterations);
        loop {
            let (from, to) = (middle - reach, middle + reach);
            let samples = self.samples.all();
            self.active = samples.partition_point(|sample| f64::from(sample.time_s) < from)
                ..samples.partition_point(|sample| f64::from(sample.time_s) <= to);
            let descend = |problem: &mut Problem| {
                problem.descend(sparse, iterations, &mut EstimateReport::default());
            };
            if begun {
                descend(self);
            }
            for _ in 0..rounds {
                self.extract(sparse);
                descend(self);
            }
            if from <= first && to >= last {
                break;
            }
            begun = true;
            (rounds, iterations) = (growth.growth_rounds, growth.growth_iterations);
            reach += by;
        }
    }
}

/// Precision of a state of a history, given its residual: for its position, its heading and a turn
/// rate of zero.
fn history_precision(
    params: &SmoothingParams,
    speed: f64,
    residual: &ControlPoint,
    plain: bool,
) -> ControlPoint {
    let SmoothingParams { history_sigma_m, history_heading_sigma_rad, .. } = *params;
    let SmoothingParams { turn_rate_prior_radps, heading_speed_mps, .. } = *params;
    let moves = speed * speed;
    let believed = moves / (moves + heading_speed_mps * heading_speed_mps);
    let heading = believed * believed / (history_heading_sigma_rad * history_heading_sigma_rad);
    let outlier = params.smoothing_outlier_m * params.smoothing_outlier_m;
    let square = (residual[0] * residual[0] + residual[1] * residual[1]) / outlier;
    let fall = 1.0 / (1.0 + square);
    let weight = if plain { 1.0 } else { fall * fall };
    let place = weight / (history_sigma_m * history_sigma_m);
    let turn_rate = 1.0 / (turn_rate_prior_radps * turn_rate_prior_radps);
    [place, place, place, heading, 0.0, 0.0, turn_rate]
}
