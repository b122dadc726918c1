//! Trajectory and shape of an object together, in continuous time (2.5).
//!
//! What is estimated is the maximum of the posterior (2.1): of `p(x) p(m) p(z | x, m)`, that is the
//! minimum of
//!
//! ```text
//! J_m = 1/2 Σ m' R_m^-1 m            R_m = extent² I
//! J_u = 1/2 ∫ e_u' Q_u^-1 e_u dt     e_u = dx/dt - f(x)
//! J_z = 1/2 Σ e_z' R_z^-1 e_z        e_z = R(φ)'(z - p) - m,  R_z = deviation² I
//! ```
//!
//! The dissertation prints (2.7) without the minus and the half, (2.23) with `R_m` for its inverse,
//! (2.24) and (2.25) without the half, (2.25) with `R_z` for its inverse and `R_z = σ_z I` for
//! `σ_z² I`; the above follows from Bayes' rule and from what a Gaussian is.
//!
//! Both the splines' weights and the model are unknowns of each Gauss-Newton step; [`normal`]
//! eliminates the model. Everything is in double precision but the places of returns and model points:
//! `Q_u^-1` reaches 1e6 beside `R_z^-1` of 4.
//!
//! The plain method stays where its start puts it: the visible face of an object changes as one
//! passes it, a history of centroids slides along, and the model takes up two shifted copies of one
//! face (figure 2.9). What cures that: where the object ends ([`EstimateParams::ends_m`]), and that rays
//! pass there ([`EstimateParams::passing`]), more starts than one ([`EstimateParams::starts`]), found by
//! a search over velocities ([`steady`]), a start that grows from the middle of the track over a sparse
//! model ([`EstimateParams::grows`]), returns that weigh across surfaces
//! ([`EstimateParams::surfaces`]), rays through model points ([`EstimateParams::carves`]). Damping and
//! a robust loss are for bad input. `raywake-lab eval tracks` measures each of these by itself.
//!
//! A round object hides where on it the origin lies: with one behind it, as a trailer's axle, it turns
//! later and more gently. So its points are near the origin ([`EstimateParams::length_m`]), and its
//! turns may be hard ([`EstimateParams::tails`]).

mod carve;
mod ends;
mod nearest;
mod normal;
mod params;
mod process;
mod report;
mod returns;
mod start;
mod steady;
#[cfg(test)]
mod synthetic;
mod system;
#[cfg(test)]
mod tests;
mod window;

pub use window::FixedLag;

use core::ops::Range;

use super::spline::{BASES_MAX, Knots, Laid};
use super::{ObjectReturn, ObjectState, RETURNS_MAX};
use ends::Ends;
use nearest::{Nearest, square_distance};
use normal::{Equations, Seen, Surface};
pub use params::EstimateParams;
use process::{Process, Weights};
pub use report::{Cost, Report, Start, Stop};
use returns::Returns;
use steady::Search;

/// Model points at most.
pub const MODEL_MAX: usize = 3000;
/// Iterations of a solve at most.
pub const ITERATIONS_MAX: usize = 64;

/// See [`system::System::solve`].
const LEAST_PIVOT: f64 = 1e-10;
/// A solve has converged when an iteration gains no more than this share of the cost.
const CONVERGED: f64 = 1e-4;

/// A trajectory with its shape.
struct Solution {
    weights: [Weights; BASES_MAX],
    model: [[f32; 3]; MODEL_MAX],
    surfaces: [Surface; MODEL_MAX],
    points: usize,
    /// Front and rear, m along the object.
    ends: [f32; 2],
}

impl Solution {
    const NONE: Solution = Solution {
        weights: [[0.0; 7]; BASES_MAX],
        model: [[0.0; 3]; MODEL_MAX],
        surfaces: [Surface::NONE; MODEL_MAX],
        points: 0,
        ends: [0.0; 2],
    };

    fn copy(&mut self, other: &Solution) {
        self.weights = other.weights;
        self.points = other.points;
        self.ends = other.ends;
        self.model[..other.points].copy_from_slice(&other.model[..other.points]);
        self.surfaces[..other.points].copy_from_slice(&other.surfaces[..other.points]);
    }
}

/// A state known with a precision.
#[derive(Clone, Copy)]
struct Known {
    time_s: f64,
    state: Weights,
    precision: Weights,
}

/// The workspace of an estimate, and its result.
pub struct Estimator {
    knots: Knots,
    returns: Returns,
    /// Those that the equations are made of.
    active: Range<usize>,
    /// What is known of the state at a time, beside the returns.
    known: Option<Known>,
    now: Solution,
    before: Solution,
    best: Solution,
    seen: [Seen; RETURNS_MAX],
    /// Returns by their model points.
    order: [u16; RETURNS_MAX],
    starts: [u16; MODEL_MAX + 1],
    nearest: Nearest<MODEL_MAX>,
    ends: Ends,
    equations: Equations,
    step: [Weights; BASES_MAX],
    search: Search,
}

impl Default for Estimator {
    fn default() -> Estimator {
        Estimator::new()
    }
}

impl Estimator {
    /// An empty one, all zeros: a static of it takes no room in a binary.
    pub const fn new() -> Estimator {
        Estimator {
            knots: Knots::NONE,
            returns: Returns::new(),
            active: 0..0,
            known: None,
            now: Solution::NONE,
            before: Solution::NONE,
            best: Solution::NONE,
            seen: [Seen::NONE; RETURNS_MAX],
            order: [0; RETURNS_MAX],
            starts: [0; MODEL_MAX + 1],
            nearest: Nearest::new(),
            ends: Ends::new(),
            equations: Equations::new(),
            step: [[0.0; 7]; BASES_MAX],
            search: Search::new(),
        }
    }

    /// Estimates trajectory and model from the returns of an object (any number, in any order) and
    /// the history of the tracker that found them.
    pub fn solve(
        &mut self,
        params: &EstimateParams,
        returns: &[ObjectReturn],
        history: &[ObjectState],
    ) -> Report {
        let mut report = Report::default();
        self.knots = Knots::NONE;
        self.known = None;
        self.best.weights.fill([0.0; 7]);
        self.best.points = 0;
        let Some(taken) = self.returns.take(returns, params.returns, params.passing) else {
            report.unsound = returns.len();
            return report;
        };
        let extent_m = params.extent_m;
        let params = &params.of(self.returns.length_m());
        let (knots, Laid { compressed, stretched }) =
            Knots::over(f64::from(taken.first_s), f64::from(taken.last_s), params.basis_s);
        self.knots = knots;
        self.returns.lay(&knots);
        report.returns = self.returns.all().len();
        report.unsound = taken.unsound;
        report.thinned = returns.len() - taken.unsound - report.returns;
        (report.compressed, report.stretched) = (compressed, stretched);

        report.no_history = !self.start(params, history);
        if params.grows {
            self.grow(&EstimateParams { ends_m: 0.0, ..params.plain() });
        }
        self.run(params, &mut report);
        self.best.copy(&self.now);
        if params.starts {
            let mut least = self.cost_with_ends(params, &report);
            for from in [Start::Steady, Start::Unsteady] {
                let begun = match from {
                    Start::Steady => self.start_steady(),
                    _ => self.start_unsteady(),
                };
                if !begun {
                    continue;
                }
                let mut other = Report { from, ..report.clone() };
                self.run(params, &mut other);
                let cost = self.cost_with_ends(params, &other);
                if cost < least {
                    (report, least) = (other, cost);
                    self.best.copy(&self.now);
                }
            }
            self.face_forward();
        }
        self.unwind();
        report.outside = self.outside(extent_m);
        report
    }

    /// Backwards at one heading is forwards at the opposite one: of the two, the way it goes for most
    /// of its track.
    fn face_forward(&mut self) {
        let weights = &mut self.best.weights[..self.knots.bases()];
        let speed: f64 = weights.iter().map(|weights| weights[4]).sum();
        if speed < 0.0 {
            for weights in weights {
                weights[3] += core::f64::consts::PI;
                weights[4] = -weights[4];
            }
            for [x, y, _] in &mut self.best.model[..self.best.points] {
                (*x, *y) = (-*x, -*y);
            }
        }
    }

    /// What is too small or too round to have a heading may have made many turns on its way here:
    /// whole ones mean nothing, and the heading begins within half a turn of zero.
    fn unwind(&mut self) {
        let weights = &mut self.best.weights[..self.knots.bases()];
        let [.., heading, _, _, _] = self.knots.value(weights, self.knots.start());
        let turns = heading - start::turn(heading);
        for weights in weights {
            weights[3] -= turns;
        }
    }

    /// State of the object at `time_s`. Outside the time of its returns it goes on as at the end; all
    /// zeros where there is no estimate.
    pub fn state(&self, time_s: f64) -> ObjectState {
        if self.knots == Knots::NONE {
            return ObjectState { time_s, ..ObjectState::default() };
        }
        let inside = time_s.clamp(self.knots.start(), self.knots.end());
        state(&self.knots, &self.best.weights, inside, time_s)
    }

    /// Model points, m, in the object's frame.
    pub fn model(&self) -> &[[f32; 3]] {
        &self.best.model[..self.best.points]
    }

    /// Cost of the estimate in `now`, that of its ends too.
    fn cost_with_ends(&mut self, params: &EstimateParams, report: &Report) -> f64 {
        let kept = &self.returns.all()[self.active.clone()];
        self.ends.find(kept, &self.seen, params.ends_m);
        let ends = self.ends.lay(&self.ends.begin());
        report.costs.last().map_or(f64::MAX, Cost::total) + ends
    }

    /// A solve from the trajectory in `now`.
    fn run(&mut self, params: &EstimateParams, report: &mut Report) {
        report.costs.clear();
        (report.iterations, report.carved) = (0, 0);
        self.active = 0..self.returns.all().len();
        if params.ends_m > 0.0 {
            let params = &params.plain();
            self.extract(params);
            self.descend(params, params.iterations, Some(report));
        }
        let params = &EstimateParams { ends_m: 0.0, ..*params };
        self.extract(params);
        report.stop = self.descend(params, params.iterations, Some(report));
        if params.carves {
            for _ in 0..carve::CARVINGS {
                let carved = self.carve(params.deviation_m);
                report.carved += carved;
                if carved == 0 {
                    break;
                }
                report.stop = self.descend(params, params.iterations, Some(report));
            }
        }
    }

    /// Model points from the returns: so many of them, evenly in the order of time.
    fn extract(&mut self, params: &EstimateParams) {
        let kept = &self.returns.all()[self.active.clone()];
        let points = params.model.clamp(1, MODEL_MAX).min(kept.len());
        for (kept, seen) in kept.iter().zip(&mut self.seen) {
            *seen = Seen::look(&self.now.weights, kept);
        }
        for (i, model) in self.now.model[..points].iter_mut().enumerate() {
            let nth = (2 * i + 1) * kept.len() / (2 * points);
            *model = self.seen[nth].place().map(|value| value as f32);
        }
        let surface = Surface {
            held: 1.0 / (params.extent_m * params.extent_m),
            ..Surface::round(1.0 / (params.deviation_m * params.deviation_m))
        };
        self.now.surfaces[..points].fill(surface);
        self.now.points = points;
        self.ends.find(kept, &self.seen, params.ends_m);
        self.now.ends = self.ends.begin();
    }

    /// Gauss-Newton iterations.
    fn descend(
        &mut self,
        params: &EstimateParams,
        iterations: usize,
        report: Option<&mut Report>,
    ) -> Stop {
        let mut unreported = Report::default();
        let report = report.unwrap_or(&mut unreported);
        let mut cost = self.associate(params);
        cost.process = self.begin(params);
        if report.costs.is_empty() {
            _ = report.costs.push(cost);
        }
        let mut damping = if params.damping { 1e-4 } else { 0.0 };
        for _ in 0..iterations {
            if report.iterations == ITERATIONS_MAX {
                return Stop::Iterations;
            }
            self.before.copy(&self.now);
            let Some(()) = self.step(damping) else { return Stop::NotFinite };
            let mut next = self.associate(params);
            next.process = self.begin(params);
            report.iterations += 1;
            let gain = cost.total() - next.total();
            let worse = params.damping && gain < 0.0;
            if !next.total().is_finite() || worse {
                self.now.copy(&self.before);
                if !params.damping {
                    return Stop::NotFinite;
                }
                _ = report.costs.push(cost);
                self.associate(params);
                self.begin(params);
                damping *= 10.0;
                continue;
            }
            _ = report.costs.push(next);
            damping *= 0.3;
            let converged = libm::fabs(gain) <= CONVERGED * cost.total();
            cost = next;
            if converged {
                return Stop::Converged;
            }
        }
        Stop::Iterations
    }

    /// Begins the equations with what is known without returns; its cost.
    fn begin(&mut self, params: &EstimateParams) -> f64 {
        let n = self.knots.bases();
        let weights = &self.now.weights[..n];
        self.equations.clear(n);
        let process = Process::of(params);
        let mut cost = process::add(&self.knots, weights, &process, &mut self.equations);
        if let Some(known) = &self.known {
            let now = self.knots.value(weights, known.time_s);
            let miss: Weights = core::array::from_fn(|d| known.state[d] - now[d]);
            for (miss, precision) in miss.iter().zip(known.precision) {
                cost += 0.5 * precision * miss * miss;
            }
            let basis = self.knots.basis(known.time_s);
            start::observe(&mut self.equations, &basis, &miss, &known.precision);
        }
        cost
    }

    /// Finds every return's model point at the trajectory in `now`; the cost, but for the process.
    fn associate(&mut self, params: &EstimateParams) -> Cost {
        let kept = &self.returns.all()[self.active.clone()];
        let model = &self.now.model[..self.now.points];
        self.nearest.fill(model);
        self.starts[..=model.len()].fill(0);
        for (kept, seen) in kept.iter().zip(&mut self.seen) {
            let guess = usize::from(seen.nearest);
            *seen = Seen::look(&self.now.weights, kept);
            let place = seen.place().map(|value| value as f32);
            let far = model.get(guess).map_or(f32::MAX, |guess| square_distance(guess, &place));
            // Any will do for what is beyond all numbers: its cost tells.
            seen.nearest = self.nearest.find(place, far).map_or(0, |(number, _)| number);
            self.starts[usize::from(seen.nearest) + 1] += 1;
        }
        for i in 0..model.len() {
            self.starts[i + 1] += self.starts[i];
        }
        for (i, seen) in self.seen[..kept.len()].iter().enumerate() {
            let at = &mut self.starts[usize::from(seen.nearest)];
            self.order[usize::from(*at)] = i as u16;
            *at += 1;
        }
        for i in (1..=model.len()).rev() {
            self.starts[i] = self.starts[i - 1];
        }
        self.starts[0] = 0;
        if params.surfaces {
            self.find_surfaces(params);
        }
        self.cost(params)
    }

    /// The patch of each model point, from how its returns scatter.
    fn find_surfaces(&mut self, params: &EstimateParams) {
        let least = params.deviation_m * params.deviation_m;
        for number in 0..self.now.points {
            let order =
                &self.order[usize::from(self.starts[number])..usize::from(self.starts[number + 1])];
            let mut scatter = self.now.surfaces[number].scatter;
            for &i in order {
                scatter.add(self.seen[usize::from(i)].place(), self.now.model[number]);
            }
            let count = f64::from(scatter.count);
            let [xx, xy, yy, zz] = scatter.sums.map(|sum| f64::from(sum) / count);
            let half = 0.5 * (xx - yy);
            let spread = libm::sqrt(half * half + xy * xy);
            let middle = 0.5 * (xx + yy);
            // Of the smaller eigenvalue.
            let (nx, ny) = if half < 0.0 { (spread - half, -xy) } else { (-xy, spread + half) };
            let length = libm::sqrt(nx * nx + ny * ny);
            let normal = if length > 0.0 { [nx / length, ny / length] } else { [1.0, 0.0] };
            let small = (middle - spread).max(0.0);
            let loose = params.loose_m * params.loose_m;
            let flat = small * small / (small * small + zz * zz);
            let variances =
                [small + loose * flat, middle + spread + loose, zz + loose * (1.0 - flat)];
            let precision = variances.map(|variance| 1.0 / (least + variance));
            let surface = &mut self.now.surfaces[number];
            (surface.normal, surface.precision) = (normal, precision);
        }
    }

    /// Lays the returns over their model points; the cost, but for the process.
    fn cost(&mut self, params: &EstimateParams) -> Cost {
        let robust = params.robust * params.robust;
        let mut cost = Cost::default();
        let points = self.now.model[..self.now.points].iter().zip(&self.now.surfaces);
        for (model, surface) in points {
            cost.model += 0.5 * surface.held * f64::from(square_distance(model, &surface.mean));
        }
        let count = self.active.len();
        for seen in &mut self.seen[..count] {
            let number = usize::from(seen.nearest);
            let model = &self.now.model[number];
            cost.returns += seen.lay(model, &self.now.surfaces[number], robust);
            let place = seen.place().map(|value| value as f32);
            cost.residual_m += f64::from(libm::sqrtf(square_distance(model, &place)));
        }
        cost.residual_m /= count as f64;
        let kept = &self.returns.all()[self.active.clone()];
        self.ends.find(kept, &self.seen[..count], params.ends_m);
        cost.returns += self.ends.lay(&self.now.ends);
        cost
    }

    /// One step of trajectory and model; `equations` hold the process term.
    fn step(&mut self, damping: f64) -> Option<()> {
        let kept = &self.returns.all()[self.active.clone()];
        let n = self.knots.bases();
        let now = &mut self.now;
        self.equations.add_returns(kept, &self.seen);
        let orders =
            |number: usize| usize::from(self.starts[number])..usize::from(self.starts[number + 1]);
        for number in 0..now.points {
            let order = &self.order[orders(number)];
            let (model, surface) = (&now.model[number], &now.surfaces[number]);
            self.equations.eliminate(order, kept, &self.seen, model, surface);
        }
        self.ends.add(&now.ends, &mut self.equations);
        self.equations.planar.damp(damping);
        self.equations.vertical.damp(damping);
        let step = &mut self.step[..n];
        self.equations.solve(LEAST_PIVOT, step)?;
        for number in 0..now.points {
            let order = &self.order[orders(number)];
            let (model, surface) = (&mut now.model[number], &now.surfaces[number]);
            let by = normal::follow(order, kept, &self.seen, model, surface, step);
            for (value, by) in model.iter_mut().zip(by) {
                *value = (f64::from(*value) + by) as f32;
            }
        }
        self.ends.follow(&mut now.ends, step);
        for (weights, step) in now.weights.iter_mut().zip(step) {
            for (weight, step) in weights.iter_mut().zip(step) {
                *weight += *step;
            }
        }
        Some(())
    }

    /// Returns that took part and lie beyond `extent_m` from the object's origin.
    fn outside(&self, extent_m: f64) -> usize {
        let far = |kept: &&returns::Kept| {
            Seen::look(&self.best.weights, kept).square_range() > extent_m * extent_m
        };
        self.returns.all().iter().filter(far).count()
    }
}

/// State at `time_s`, as it goes on from `inside`.
fn state(knots: &Knots, weights: &[Weights], inside: f64, time_s: f64) -> ObjectState {
    let [x, y, z, heading, speed, climb, turn_rate] = knots.value(weights, inside);
    let beyond = time_s - inside;
    let (sin, cos) = libm::sincos(heading);
    let position = [x + beyond * speed * cos, y + beyond * speed * sin, z + beyond * climb];
    ObjectState { time_s, position, heading, speed, climb, turn_rate }
}
