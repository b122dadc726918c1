//! Where an object ends, and what that implies for its motion.
//!
//! Along a smooth side all motions explain the returns equally well: a long vehicle that drives by
//! then seems static while its side grows (the failure of figure 2.9). But rays pass beyond its
//! ends: in every part of the track the foremost and the hindmost return lie at the same two places
//! of the object, unless something hides them. Both places are unknowns, eliminated like model
//! points. A return that falls short of its end weighs less than one beyond it, as the end may be
//! hidden, unless rays pass there; and it weighs hardly anything if the sensor looks along the
//! object from its other end.

use super::equations::Equations;
use super::model_point::ModelPoint;
use super::observation::Observation;
use super::params::EndpointParams;
use super::samples::Sample;
use super::state::{ControlPoint, state_at};
use super::surface::Surface;
use crate::ObjectState;
use crate::spline::Knots;
use heapless::Vec;

/// Maximum number of parts of a track; later ones are not used.
pub(super) const PARTS: usize = 160;
/// Precision of an end without returns, 1/m²: makes its elimination regular.
const PRIOR_PRECISION: f64 = 1e-6;

/// The indices of all parts.
const INDICES: [u16; PARTS] = {
    let mut indices = [0; PARTS];
    let mut n = 0;
    while n < PARTS {
        indices[n] = n as u16;
        n += 1;
    }
    indices
};

/// Whether rays pass a return on the side of the object's front (0) or rear (1).
fn passes(sample: &Sample, observation: &Observation, end: usize) -> bool {
    let [_, sensor, _] = observation.local_beyond(sample.origin_from_return());
    let [_, own, _] = observation.local();
    // Seen from its left, an object has its front on the left.
    sample.passed[if sensor > own { end } else { 1 - end }]
}

/// One end of an object: its outermost return in every part of the track.
struct End {
    samples: [Sample; PARTS],
    observations: [Observation; PARTS],
    /// Whether rays pass there, so that nothing hides the end.
    visible: [bool; PARTS],
}

impl End {
    const NONE: End = End {
        samples: [Sample::NONE; PARTS],
        observations: [Observation::NONE; PARTS],
        visible: [false; PARTS],
    };
}

/// Both ends: front, rear.
pub(super) struct Endpoints {
    ends: [End; 2],
    count: usize,
    /// Precision of a return at an end, 1/m².
    precision: f64,
}

impl Endpoints {
    pub const fn new() -> Endpoints {
        Endpoints { ends: [End::NONE; 2], count: 0, precision: 0.0 }
    }

    /// Finds the outermost returns among all, which are in order of time.
    pub fn find(
        &mut self,
        samples: &[Sample],
        observations: &[Observation],
        params: &EndpointParams,
    ) {
        let sigma = params.endpoint_sigma_m;
        self.count = 0;
        self.precision = if sigma > 0.0 { 1.0 / (sigma * sigma) } else { 0.0 };
        if sigma <= 0.0 {
            return;
        }
        let mut from = 0;
        while from < samples.len() && self.count < PARTS {
            let until = samples[from].time_s + params.endpoint_part_s;
            let to = from + samples[from..].partition_point(|s| s.time_s < until).max(1);
            if to - from >= params.endpoint_returns_min {
                let part = (&samples[from..to], &observations[from..to]);
                self.add_part(part.0, part.1, params.endpoint_passing_m);
            }
            from = to;
        }
    }

    fn add_part(&mut self, samples: &[Sample], observations: &[Observation], passing_m: f64) {
        let along = |i: usize| observations[i].local()[0];
        let (mut front, mut rear) = (0, 0);
        for i in 0..samples.len() {
            if along(i) > along(front) {
                front = i;
            }
            if along(i) < along(rear) {
                rear = i;
            }
        }
        for (n, (end, i)) in self.ends.iter_mut().zip([front, rear]).enumerate() {
            end.samples[self.count] = samples[i];
            end.observations[self.count] = observations[i];
            end.visible[self.count] = samples.iter().zip(observations).any(|(sample, seen)| {
                libm::fabs(seen.local()[0] - along(i)) < passing_m && passes(sample, seen, n)
            });
        }
        self.count += 1;
    }

    /// States of the object in every part, located by its front (`share` 1), by its rear (0), or by
    /// a point between them.
    pub fn states(
        &self,
        knots: &Knots,
        control_points: &[ControlPoint],
        share: f64,
    ) -> Vec<ObjectState, PARTS> {
        let [front, rear] = self.quantiles().map(f64::from);
        let middle = (0.5 - share) * (front - rear);
        let [fronts, rears] = &self.ends;
        let state = |n: usize| {
            let times = [&fronts.samples[n], &rears.samples[n]].map(|s| f64::from(s.time_s));
            let time_s = 0.5 * (times[0] + times[1]);
            let state = state_at(knots, control_points, time_s, time_s);
            let [ahead, behind] = [fronts, rears].map(|end| end.observations[n].local()[0]);
            let by = share * ahead + (1.0 - share) * behind + middle;
            let (sin, cos) = libm::sincos(state.heading);
            let [x, y, z] = state.position;
            ObjectState { position: [x + by * cos, y + by * sin, z], ..state }
        };
        (0..self.count).map(state).collect()
    }

    /// Initial places of the ends, m: beyond all but a fifth of the outermost returns.
    pub fn quantiles(&self) -> [f32; 2] {
        let mut places = [0.0f32; PARTS];
        let fifth = self.count / 5;
        core::array::from_fn(|end| {
            let observations = &self.ends[end].observations[..self.count];
            for (place, observation) in places.iter_mut().zip(observations) {
                *place = observation.local()[0] as f32;
            }
            let places = &mut places[..self.count];
            places.sort_unstable_by(f32::total_cmp);
            let nth = if end == 0 { self.count.saturating_sub(1 + fifth) } else { fifth };
            places.get(nth).copied().unwrap_or(0.0)
        })
    }

    /// Evaluates residuals and precisions for places of the ends, m; returns the cost.
    pub fn evaluate(&mut self, places: &[f32; 2], params: &EndpointParams) -> f64 {
        let mut cost = 0.0;
        for (n, (end, &at)) in self.ends.iter_mut().zip(places).enumerate() {
            let surface = surface(at);
            let forward = if n == 0 { 1.0 } else { -1.0 };
            let all = end.observations.iter_mut().zip(&end.samples).zip(&end.visible);
            for ((observation, sample), &visible) in all.take(self.count) {
                observation.evaluate(&[at, 0.0, 0.0], &surface);
                let residual = forward * (observation.local()[0] - f64::from(at));
                let [x, y, _] = observation.local_beyond(sample.origin_from_return());
                let ahead = forward * (x - f64::from(at));
                let weight = view_weight(ahead, y, params.endpoint_slope);
                let hidden = residual < 0.0 && !visible;
                let weight = weight * if hidden { params.endpoint_hidden_weight } else { 1.0 };
                let precision = self.precision * weight;
                let (share, square) = loss(libm::fabs(residual), hidden, params);
                observation.precision = [precision * share, 0.0, 0.0];
                cost += 0.5 * precision * square;
            }
        }
        cost
    }

    /// Adds the ends to the equations and eliminates them.
    pub fn add(&self, places: &[f32; 2], equations: &mut Equations) {
        for (end, &at) in self.ends.iter().zip(places) {
            let (samples, observations) = self.found(end);
            equations.add_returns(samples, observations);
            equations.eliminate(&self.point(end, at, &surface(at)));
        }
    }

    /// Moves the ends according to a step of the control points.
    pub fn back_substitute(&self, places: &mut [f32; 2], step: &[ControlPoint]) {
        for (end, at) in self.ends.iter().zip(places) {
            *at += self.point(end, *at, &surface(*at)).back_substitute(step)[0] as f32;
        }
    }

    fn found<'a>(&self, end: &'a End) -> (&'a [Sample], &'a [Observation]) {
        (&end.samples[..self.count], &end.observations[..self.count])
    }

    fn point<'a>(&self, end: &'a End, at: f32, surface: &'a Surface) -> ModelPoint<'a> {
        let (samples, observations) = self.found(end);
        let members = &INDICES[..self.count];
        ModelPoint { members, samples, observations, model: [at, 0.0, 0.0], surface }
    }
}

fn surface(at: f32) -> Surface {
    Surface { prior_precision: PRIOR_PRECISION, prior_mean: [at, 0.0, 0.0], ..Surface::NONE }
}

/// Weight of an end seen from a sensor `ahead` of it and `aside`, m: full from beyond the end or
/// from the side.
fn view_weight(ahead: f64, aside: f64, full_slope: f64) -> f64 {
    let slope = if ahead < 0.0 { libm::fabs(aside) / -ahead } else { full_slope };
    let view = (slope / full_slope).min(1.0);
    view * view
}

/// Share of the precision, and squared residual: Huber loss beyond the end, Geman-McClure loss
/// short of it if it may be hidden.
fn loss(residual: f64, hidden: bool, params: &EndpointParams) -> (f64, f64) {
    let (bound, scale) = (params.endpoint_bound_m, params.endpoint_hidden_m);
    if hidden {
        let fall = 1.0 / (1.0 + residual * residual / (scale * scale));
        (fall * fall, residual * residual * fall)
    } else if residual < bound {
        (1.0, residual * residual)
    } else {
        (bound / residual, bound * (2.0 * residual - bound))
    }
}
