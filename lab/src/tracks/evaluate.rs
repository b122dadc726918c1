//! Evaluates every tracker on every object.

use super::entropy::entropy;
use super::errors::Errors;
use super::extent::extent;
use super::object::{Moment, Object, moment_at};
use super::tracker::{Track, baseline, baseline_live, fixed_lag, motion};
use crate::labels::Kind;
use glam::DVec2;
use raywake_objects::centroid_ekf::CentroidParams;
use raywake_objects::estimate::{
    Cost, EndpointParams, EstimateParams, Estimator, FreeSpaceParams, GrowthParams, Termination,
};
use raywake_objects::{ObjectReturn, ObjectState};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// A tracker with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// The extended Kalman filter of centroids, its states revised by what it learns later.
    Baseline,
    /// The same with its states as first estimated.
    BaselineLive,
    /// Trajectory and shape together.
    Proposed(EstimateParams),
    /// The same, started from the true trajectory instead of the baseline's: what the method itself
    /// makes of the returns, whatever its start.
    FromTruth(EstimateParams),
    /// The same over the last seconds, after every batch, as on board: judged by its states as
    /// first estimated.
    FixedLag(EstimateParams),
}

/// The trackers of the tables and their names: those of the dissertation, then each option
/// separately.
pub fn methods() -> [(&'static str, Method); 18] {
    let (printed, ours) = (EstimateParams::DISSERTATION, EstimateParams::DEFAULT);
    let of = Method::Proposed;
    let dense = |params| of(EstimateParams { model_points: 3000, ..params });
    let carving = |carving_rounds| FreeSpaceParams { carving_rounds, ..FreeSpaceParams::DEFAULT };
    let endpoints = EndpointParams { endpoint_sigma_m: 0.0, ..ours.endpoints };
    let growth = GrowthParams { growth: false, ..ours.growth };
    [
        ("baseline EKF", Method::Baseline),
        ("as printed, n_m = 300", of(printed)),
        ("as printed, n_m = 3000", dense(printed)),
        ("ours, n_m = 300", of(ours)),
        ("ours, n_m = 3000", dense(ours)),
        ("as printed, from the true start", Method::FromTruth(printed)),
        (
            "as printed, R_z = 0.5 m²",
            of(EstimateParams { return_sigma_m: std::f64::consts::FRAC_1_SQRT_2, ..printed }),
        ),
        ("as printed, damped", of(EstimateParams { damping: true, ..printed })),
        ("as printed, carved by rays", of(EstimateParams { free_space: carving(3), ..printed })),
        ("ours without endpoints", of(EstimateParams { endpoints, ..ours })),
        ("ours without passing rays", of(EstimateParams { passing: false, ..ours })),
        ("ours not carved", of(EstimateParams { free_space: carving(0), ..ours })),
        ("ours not grown", of(EstimateParams { growth, ..ours })),
        ("ours from one start", of(EstimateParams { multi_start: false, ..ours })),
        ("ours without surfaces", of(EstimateParams { surfaces: false, ..ours })),
        ("ours, Gaussian turns", of(EstimateParams { student_dof: 0.0, ..ours })),
        ("baseline EKF, live", Method::BaselineLive),
        ("ours, fixed lag", Method::FixedLag(ours)),
    ]
}

/// Index in [`methods`] of the tracker as printed, with 300 points.
pub const PRINTED: usize = 1;
/// Index in [`methods`] of our tracker with 300 points.
pub const OURS: usize = 3;
/// Indices in [`methods`] of the baseline and the trackers as printed that table 2.1 is broken down
/// by.
pub const AS_PRINTED: [usize; 4] = [0, 1, 5, 6];
/// Number of trackers in the dissertation's tables, the first ones.
pub const MAIN: usize = 5;

/// Results of one tracker on one object.
#[derive(Clone, Debug)]
pub struct Score {
    pub errors: Errors,
    /// Entropy of the whole cloud, nats.
    pub entropy: f64,
    /// Length, width, height of the cloud, m.
    pub extent: [f64; 3],
    /// Costs at the start and after each iteration; empty for the baseline.
    pub costs: Vec<Cost>,
    pub stop: Termination,
    /// Time of the estimate, or of all estimates if there is one per batch, s; 0 for the baseline.
    pub seconds: f64,
}

/// Results of all trackers on one object.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Drive and number.
    pub name: String,
    pub kind: Kind,
    /// Length, width and height of its box, m.
    pub size: [f64; 3],
    /// Whether it is stationary.
    pub stationary: bool,
    pub returns: usize,
    pub span_s: f64,
    /// Mean range of its returns, m.
    pub range_m: f64,
    /// Range of the nearest of its returns, m.
    pub nearest_m: f64,
    /// Difference between its greatest and smallest true heading, rad.
    pub turned_rad: f64,
    /// Entropy of its cloud using its true trajectory, nats.
    pub entropy: f64,
    /// Extent of that cloud, m.
    pub extent: [f64; 3],
    /// In the order of [`methods`].
    pub scores: Vec<Score>,
}

/// The raw result of a tracker.
pub struct Run {
    pub track: Track,
    costs: Vec<Cost>,
    stop: Termination,
    seconds: f64,
}

pub fn track(
    object: &Object,
    history: &[ObjectState],
    method: &Method,
    estimator: &mut Estimator,
) -> Run {
    let begin = Instant::now();
    let done = |track: Track, seconds: f64| Run {
        track,
        costs: Vec::new(),
        stop: Termination::default(),
        seconds,
    };
    let live = match method {
        Method::Baseline => return done(Track::of(object, motion(history)), 0.0),
        Method::Proposed(params) | Method::FromTruth(params) => {
            let start: Vec<ObjectState> = match method {
                Method::FromTruth(_) => history.iter().map(|s| true_state(object, s)).collect(),
                _ => history.to_vec(),
            };
            let report = estimator.solve(params, &object.returns, &start);
            let seconds = begin.elapsed().as_secs_f64();
            let track = Track::of(object, |t| estimator.state(t).into());
            let costs = report.costs.to_vec();
            return Run { costs, stop: report.termination, ..done(track, seconds) };
        }
        Method::BaselineLive => baseline_live(object, &CentroidParams::DEFAULT),
        Method::FixedLag(params) => fixed_lag(object, params, estimator),
    };
    let seconds = begin.elapsed().as_secs_f64();
    // Judged by its states themselves; the cloud uses the motion interpolated between them.
    let moments = live.iter().map(|s| Moment::from(*s)).collect();
    done(Track { moments, ..Track::of(object, motion(&live)) }, seconds)
}

/// The true state of the object at the time of a state.
fn true_state(object: &Object, state: &ObjectState) -> ObjectState {
    let truth = moment_at(&object.truth, state.time_s);
    let along = DVec2::from_angle(truth.heading);
    ObjectState {
        time_s: state.time_s,
        position: truth.position.to_array(),
        heading: truth.heading,
        speed: along.dot(truth.velocity.truncate()),
        climb: truth.velocity.z,
        turn_rate: truth.turn_rate,
    }
}

/// Scores a tracker on an object.
fn score(
    object: &Object,
    history: &[ObjectState],
    method: &Method,
    estimator: &mut Estimator,
) -> Score {
    let Run { track, costs, stop, seconds } = track(object, history, method, estimator);
    let errors = match object.stationary {
        true => Errors::stationary(&track.moments),
        false => Errors::moving(&track.moments, &object.truth),
    };
    let (entropy, extent) = (entropy(&track.cloud), extent(&track.cloud));
    Score { errors, entropy, extent, costs, stop, seconds }
}

fn outcome(object: &Object, history: &[ObjectState], estimator: &mut Estimator) -> Outcome {
    let really = Track::of(object, |t| moment_at(&object.truth, t));
    let range = |r: &ObjectReturn| {
        let [x, y, z] = [0, 1, 2].map(|i| f64::from(r.position[i] - r.origin[i]));
        (x * x + y * y + z * z).sqrt()
    };
    let headings =
        |of: fn(f64, f64) -> f64| object.truth.iter().map(|m| m.heading).reduce(of).unwrap_or(0.0);
    let ranges: f64 = object.returns.iter().map(range).sum();
    let nearest_m = object.returns.iter().map(range).fold(f64::INFINITY, f64::min);
    Outcome {
        name: object.name.clone(),
        kind: object.kind,
        size: object.size,
        stationary: object.stationary,
        returns: object.returns.len(),
        span_s: object.span_s(),
        range_m: ranges / object.returns.len() as f64,
        nearest_m,
        turned_rad: headings(f64::max) - headings(f64::min),
        entropy: entropy(&really.cloud),
        extent: extent(&really.cloud),
        scores: methods().iter().map(|(_, m)| score(object, history, m, estimator)).collect(),
    }
}

/// The baseline's history of every object.
pub fn histories(objects: &[Object]) -> Vec<Vec<ObjectState>> {
    objects.iter().map(|o| baseline(o, &CentroidParams::DEFAULT)).collect()
}

/// Evaluates all trackers on all objects, with the baseline's history of each, `jobs` at a time.
/// Returns the outcomes in the order of the objects.
pub fn evaluate(objects: &[Object], histories: &[Vec<ObjectState>], jobs: usize) -> Vec<Outcome> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
        loop {
            let n = next.fetch_add(1, Ordering::Relaxed);
            let (Some(object), Some(history)) = (objects.get(n), histories.get(n)) else {
                return;
            };
            let outcome = outcome(object, history, &mut estimator);
            done.lock().expect("no thread panics with it").push((n, outcome));
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..jobs.clamp(1, objects.len().max(1)) {
            scope.spawn(work);
        }
    });
    let mut done = done.into_inner().expect("no thread panicked with it");
    done.sort_by_key(|(n, _)| *n);
    done.into_iter().map(|(_, outcome)| outcome).collect()
}
