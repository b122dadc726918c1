//! Fixed lag: the same estimate over the last seconds, sweep by sweep.
//!
//! What leaves the window stays as a prior. The state at the window's first time is held where the
//! estimate had it when the window last moved on, with [`HELD`]; a model point keeps the mean of the
//! returns that left, as precise as they were many, up to [`HELD_RETURNS`]. An object needs its
//! [`FixedLag`] (some 30 KB); the workspace is one for all.
//!
//! A young track is solved twice with every sweep, over a sparse model made anew: on from where it is,
//! and from one other start, which take turns; the cheaper stays. A start has a frame of its own: it
//! is moved to where the states that came out before have the object, and what rests keeps its heading.
//!
//! So the work of a push is bounded, however young its track and however many appear at once:
//! [`FixedLag::ITERATIONS_MAX`] over [`FixedLag::RETURNS_MAX`] returns.

use super::normal::{Scatter, Seen, Surface};
use super::process::{Process, Weights};
use super::returns;
use super::start;
use super::{Cost, EstimateParams, Estimator, Known, Report};
use crate::spline::{DEGREE, Knots};
use crate::{ObjectReturn, ObjectState};
use heapless::Vec;

/// The window, s.
const WINDOW_S: f64 = 2.5;
/// Pieces of the splines at most, and their length, s: a piece more than the window, into which time
/// runs on.
const PIECES: usize = 6;
const PIECE_S: f64 = 0.5;
const BASES: usize = PIECES + DEGREE;
/// Returns of a sweep, beside its foremost and hindmost, and of the window at most.
const PER_SWEEP: usize = 32;
const RETURNS: usize = 26 * (PER_SWEEP + 2);
/// States at most that a young track keeps.
const SAID: usize = 16;
/// What went back by more than this on the whole faces the other way, m.
const BACK_M: f64 = 0.3;
/// Length at most by which a tracker's centroid may be off the estimate's, m.
const LONG_M: f64 = 15.0;
/// Model points at most.
const MODEL: usize = 128;
/// States of the history at most: those of the window, at 10 Hz.
const HISTORY: usize = 32;
/// Model points are at least so far apart at first, m; further by that factor when they are too many.
const SPACING_M: f32 = 0.3;
const WIDER: f32 = 1.25;
/// A track younger than that tries other starts, s.
const YOUNG_S: f64 = 1.5;
/// What goes no further meanwhile rests, m: its heading is a gauge, which stays, and its speed is noise.
const STILL_M: f64 = 0.5;
/// Models that a solve of it makes, and iterations with each.
const YOUNG_ROUNDS: usize = 2;
const YOUNG_ITERATIONS: usize = 3;
/// Returns for each point of these, and least and most points: with fewer returns for each, a model
/// explains motion as well by points of its own for every sweep.
const YOUNG_PER_POINT: usize = 6;
const YOUNG_MODEL: [usize; 2] = [12, 75];
const YOUNG_M: f64 = 0.15;
/// Where its solves start, by turns. One end may be where the view ends, while the other moves.
const STARTS: [Guess; 5] =
    [Guess::Rest, Guess::History, Guess::Seen(0.5), Guess::Seen(1.0), Guess::Seen(0.0)];
/// Additional deviation of a return along a surface, m: its model points are few, however short it is.
const LOOSE_M: f64 = 0.5;
/// Iterations with a sweep.
const ITERATIONS: usize = 2;
/// Deviation of a state that is held: m, rad, m/s, rad/s.
const HELD: Weights = [0.1, 0.1, 0.1, 0.02, 0.5, 0.2, 0.05];
/// A model point is held by so many returns at most.
const HELD_RETURNS: f32 = 20.0;

/// Where a solve of a young track starts.
#[derive(Clone, Copy)]
enum Guess {
    /// At rest.
    Rest,
    /// The tracker's history.
    History,
    /// What is seen: at this share of the way from its hindmost to its foremost return.
    Seen(f64),
}

#[derive(Clone, Copy)]
struct Held {
    position: [f32; 3],
    time_s: f32,
    nearest: u16,
}

#[derive(Clone, Copy)]
struct Point {
    at: [f32; 3],
    mean: [f32; 3],
    /// Returns that hold it.
    held: f32,
    scatter: Scatter,
}

/// What is kept of an object between sweeps.
pub struct FixedLag {
    knots: Knots,
    weights: [Weights; BASES],
    known: Option<Known>,
    returns: Vec<Held, RETURNS>,
    history: Vec<ObjectState, HISTORY>,
    model: Vec<Point, MODEL>,
    /// Front and rear, m along the object.
    ends: [f32; 2],
    /// How far it went forward, m.
    gone_m: f64,
    /// What was said of it while it was young.
    said: Vec<ObjectState, SAID>,
    /// Starts tried.
    tried: usize,
    /// Iterations of the last push.
    iterations: usize,
    spacing_m: f32,
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
    /// Gauss-Newton iterations of a push at most: those of both solves of a young track.
    pub const ITERATIONS_MAX: usize = 2 * YOUNG_ROUNDS * YOUNG_ITERATIONS;
    /// Returns of each at most.
    pub const RETURNS_MAX: usize = RETURNS;

    /// That of an object not seen yet.
    pub const fn new() -> FixedLag {
        FixedLag {
            knots: Knots::NONE,
            weights: [[0.0; 7]; BASES],
            known: None,
            returns: Vec::new(),
            history: Vec::new(),
            model: Vec::new(),
            ends: [0.0; 2],
            gone_m: 0.0,
            said: Vec::new(),
            tried: 0,
            iterations: 0,
            spacing_m: 0.0,
            born_s: 0.0,
            newest_s: 0.0,
            begun: false,
            restarts: 0,
        }
    }

    /// Forgets the object, for another one.
    pub fn clear(&mut self) {
        self.known = None;
        self.returns.clear();
        self.history.clear();
        self.model.clear();
        self.said.clear();
        self.tried = 0;
        self.begun = false;
        self.restarts = 0;
    }

    /// Takes in what a sweep saw of the object and what the tracker that found it says, and returns
    /// the object's state at the time of the newest return. Without a sound return that is the
    /// state as it goes on until the tracker's time. A young track that has hardly gone anywhere is
    /// said to stand.
    ///
    /// Returns before the window are ignored. After a gap as long as the window, or when the estimate
    /// leaves the tracker's by more than `extent_m`, the estimate starts again.
    pub fn push(
        &mut self,
        estimator: &mut Estimator,
        params: &EstimateParams,
        returns: &[ObjectReturn],
        baseline: &ObjectState,
    ) -> ObjectState {
        self.iterations = 0;
        let sound = || returns.iter().filter(|seen| returns::sound(seen));
        let newest = sound().map(|seen| f64::from(seen.time_s)).max_by(f64::total_cmp);
        if start::sound(baseline) {
            if self.history.is_full() {
                self.history.remove(0);
            }
            let mut state = *baseline;
            // Backwards for a tracker that has not found out yet which way the object faces.
            if state.speed < 0.0 {
                state.heading += core::f64::consts::PI;
                state.speed = -state.speed;
            }
            _ = self.history.push(state);
        }
        let Some(newest) = newest else {
            return if self.begun { self.state(baseline.time_s) } else { *baseline };
        };
        if self.begun && newest > self.newest_s + WINDOW_S {
            self.restart();
        }
        let elapsed = if self.begun { (newest - self.newest_s).max(0.0) } else { 0.0 };
        self.newest_s = if self.begun { self.newest_s.max(newest) } else { newest };
        let oldest = self.newest_s - WINDOW_S;
        let count = sound().count();
        let keep = count.min(PER_SWEEP);
        self.forget(oldest);
        let ends = self.ends_of(returns, baseline);
        let before = self.returns.len();
        for (rank, seen) in sound().enumerate() {
            let taken =
                (rank + 1) * keep / count > rank * keep / count || ends.contains(&Some(rank));
            if taken && f64::from(seen.time_s) >= oldest {
                let held = Held { position: seen.position, time_s: seen.time_s, nearest: 0 };
                _ = self.returns.push(held);
            }
        }
        let fresh = self.returns.len() - before;
        self.returns.sort_unstable_by(|a, b| a.time_s.total_cmp(&b.time_s));
        if !self.begun {
            self.begin();
        }
        self.advance();
        self.gone_m += self.state(self.newest_s).speed * elapsed;
        let young = self.said.is_empty() || self.newest_s - self.born_s < YOUNG_S;
        self.estimate(estimator, params, fresh, young);
        let mut state = self.state(self.newest_s);
        if young && libm::fabs(self.gone_m) <= STILL_M {
            (state.speed, state.climb, state.turn_rate) = (0.0, 0.0, 0.0);
        }
        if young {
            if self.said.is_full() {
                self.said.remove(0);
            }
            _ = self.said.push(state);
        }
        // A centroid can be anywhere on the object.
        let [front, rear] = self.ends.map(f64::from);
        if self.strayed(&state, params.extent_m + (front - rear).clamp(0.0, LONG_M)) {
            self.restart();
            return *self.history.last().unwrap_or(&state);
        }
        state
    }

    /// How often the estimate started again.
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// Gauss-Newton iterations of the last push.
    pub fn iterations(&self) -> usize {
        self.iterations
    }

    /// Model points; none while the track is young.
    pub fn points(&self) -> usize {
        self.model.len()
    }

    /// Which of the sound returns are foremost and hindmost, as the object goes on.
    fn ends_of(&self, returns: &[ObjectReturn], baseline: &ObjectState) -> [Option<usize>; 2] {
        let state = if self.begun { self.state(self.newest_s) } else { *baseline };
        let (sin, cos) = libm::sincos(state.heading);
        let along = |seen: &ObjectReturn| {
            let [x, y, _] = seen.position.map(f64::from);
            cos * x + sin * y - state.speed * f64::from(seen.time_s)
        };
        [1.0, -1.0].map(|forward| {
            returns
                .iter()
                .filter(|seen| returns::sound(seen))
                .enumerate()
                .max_by(|(_, a), (_, b)| (forward * along(a)).total_cmp(&(forward * along(b))))
                .map(|(rank, _)| rank)
        })
    }

    fn restart(&mut self) {
        let restarts = self.restarts + 1;
        self.clear();
        self.restarts = restarts;
    }

    fn begin(&mut self) {
        self.begun = true;
        self.spacing_m = SPACING_M;
        self.born_s = self.returns.first().map_or(self.newest_s, |held| f64::from(held.time_s));
        self.knots = Knots::pieces(self.born_s, PIECE_S, 1);
    }

    /// Whether the estimate has nothing to do with the tracker's any more.
    fn strayed(&self, state: &ObjectState, extent_m: f64) -> bool {
        let Some(baseline) = self.history.last() else { return !start::sound(state) };
        let ahead = state.time_s - baseline.time_s;
        let (sin, cos) = libm::sincos(baseline.heading);
        let go = baseline.speed * ahead;
        let off = [
            state.position[0] - baseline.position[0] - go * cos,
            state.position[1] - baseline.position[1] - go * sin,
            state.position[2] - baseline.position[2],
        ];
        let square: f64 = off.iter().map(|v| v * v).sum();
        !start::sound(state) || square > extent_m * extent_m
    }

    fn state(&self, time_s: f64) -> ObjectState {
        super::state(&self.knots, &self.weights, time_s.min(self.newest_s), time_s)
    }

    /// Drops returns from before `oldest`; each leaves its weight with its model point.
    fn forget(&mut self, oldest: f64) {
        let left = self.returns.partition_point(|held| f64::from(held.time_s) < oldest);
        for held in &self.returns[..left] {
            let Some(point) = self.model.get_mut(usize::from(held.nearest)) else { continue };
            let kept = super::returns::Kept {
                position: held.position,
                origin: held.position,
                time_s: held.time_s,
                basis: self.knots.basis(f64::from(held.time_s)),
                ..super::returns::Kept::NONE
            };
            let place = Seen::look(&self.weights, &kept).place();
            point.held = (point.held + 1.0).min(HELD_RETURNS);
            for (mean, place) in point.mean.iter_mut().zip(place) {
                *mean += (place as f32 - *mean) / point.held;
            }
            if point.scatter.count > HELD_RETURNS {
                let share = HELD_RETURNS / point.scatter.count;
                point.scatter.count *= share;
                point.scatter.sums = point.scatter.sums.map(|sum| sum * share);
            }
            point.scatter.add(place, point.at);
        }
        self.returns.copy_within(left.., 0);
        self.returns.truncate(self.returns.len() - left);
    }

    /// Moves the splines on until they hold the newest time: first by more pieces, then by later ones.
    fn advance(&mut self) {
        while self.newest_s > self.knots.end() {
            let pieces = self.knots.spans();
            if pieces < PIECES {
                self.knots = Knots::pieces(self.knots.start(), PIECE_S, pieces + 1);
            } else {
                let first = self.knots.start() + PIECE_S;
                self.known = Some(Known {
                    time_s: first,
                    state: self.knots.value(&self.weights, first),
                    precision: HELD.map(|deviation| 1.0 / (deviation * deviation)),
                });
                self.knots = Knots::pieces(first, PIECE_S, PIECES);
                self.weights.copy_within(1.., 0);
            }
            let n = self.knots.bases();
            self.weights[n - 1] =
                core::array::from_fn(|d| 2.0 * self.weights[n - 2][d] - self.weights[n - 3][d]);
        }
    }

    fn estimate(
        &mut self,
        estimator: &mut Estimator,
        params: &EstimateParams,
        fresh: usize,
        young: bool,
    ) {
        estimator.knots = self.knots;
        estimator.known = self.known;
        estimator.returns.set(self.returns.iter().map(|held| (held.position, held.time_s)));
        estimator.returns.lay(&self.knots);
        estimator.active = 0..self.returns.len();
        // Two iterations with a sweep do not find the other minima that hard turns bring.
        let params = &EstimateParams {
            loose_m: LOOSE_M,
            extent_m: params.extent_m,
            turn_s: f64::INFINITY,
            ..params.of(estimator.returns.length_m()).plain()
        };
        if young {
            self.estimate_young(estimator, params);
            return;
        }
        if self.model.is_empty() {
            for (kept, seen) in estimator.returns.all().iter().zip(&mut estimator.seen) {
                *seen = Seen::look(&self.weights, kept);
            }
            self.add_points(estimator, self.returns.len());
        }
        estimator.now.weights[..BASES].copy_from_slice(&self.weights);
        let unit = 1.0 / (params.deviation_m * params.deviation_m);
        estimator.now.points = self.model.len();
        for (i, point) in self.model.iter().enumerate() {
            estimator.now.model[i] = point.at;
            estimator.now.surfaces[i] = Surface {
                mean: point.mean,
                held: unit * f64::from(point.held.max(0.1)),
                scatter: point.scatter,
                ..Surface::round(unit)
            };
        }
        estimator.now.ends = self.ends;
        let mut report = Report::default();
        estimator.descend(params, ITERATIONS, Some(&mut report));
        self.iterations += report.iterations;
        self.keep(estimator);
        for (point, at) in self.model.iter_mut().zip(&estimator.now.model) {
            point.at = *at;
        }
        self.add_points(estimator, fresh);
        self.face_forward();
    }

    /// Takes the trajectory in `now`.
    fn keep(&mut self, estimator: &Estimator) {
        self.weights.copy_from_slice(&estimator.now.weights[..BASES]);
        self.ends = estimator.now.ends;
    }

    /// Solves on from where it is, and from the start whose turn it is.
    fn estimate_young(&mut self, estimator: &mut Estimator, params: &EstimateParams) {
        let mut least = f64::MAX;
        if !self.said.is_empty() {
            estimator.now.weights[..BASES].copy_from_slice(&self.weights);
            least = self.solve(estimator, params);
            self.keep(estimator);
        }
        let from = STARTS[self.tried % STARTS.len()];
        self.tried += 1;
        self.start(from, estimator, params);
        let cost = self.solve(estimator, params);
        let rests = || {
            let gone = gone(&self.knots, &estimator.now.weights, self.newest_s);
            libm::fabs(gone) <= STILL_M
        };
        if cost < least && (matches!(from, Guess::Rest) || !rests()) {
            self.keep(estimator);
        }
        self.gone_m = gone(&self.knots, &self.weights, self.newest_s);
        self.face_forward();
        self.anchor();
    }

    /// Puts a start into `now`.
    fn start(&self, from: Guess, estimator: &mut Estimator, params: &EstimateParams) {
        match from {
            Guess::Rest => {
                if !start::stand(&self.history, &mut estimator.now.weights[..BASES]) {
                    estimator.stand_at_mean();
                }
                if let Some(said) = self.said.last() {
                    let weights = &mut estimator.now.weights[..BASES];
                    weights.iter_mut().for_each(|weights| weights[3] = said.heading);
                }
            }
            Guess::History => _ = estimator.start(params, &self.history),
            Guess::Seen(share) => {
                estimator.start(params, &self.history);
                let Estimator { knots, returns, seen, ends, now, equations, step, .. } = estimator;
                for (kept, seen) in returns.all().iter().zip(seen.iter_mut()) {
                    *seen = Seen::look(&now.weights, kept);
                }
                ends.find(returns.all(), seen, params.ends_m);
                let places = ends.places(knots, &now.weights, share);
                if !places.is_empty() {
                    let weights = &mut now.weights[..knots.bases()];
                    start::smooth(knots, &places, &Process::of(params), equations, weights, step);
                }
            }
        }
    }

    /// Solves from the trajectory in `now`, with models of what is seen by then; its cost.
    fn solve(&mut self, estimator: &mut Estimator, params: &EstimateParams) -> f64 {
        let [least, most] = YOUNG_MODEL;
        let model = (self.returns.len() / YOUNG_PER_POINT).clamp(least, most);
        let sparse = &EstimateParams { model, deviation_m: YOUNG_M, ..*params };
        estimator.active = 0..self.returns.len();
        let mut cost = f64::MAX;
        for _ in 0..YOUNG_ROUNDS {
            let mut report = Report::default();
            estimator.extract(sparse);
            estimator.descend(sparse, YOUNG_ITERATIONS, Some(&mut report));
            self.iterations += report.iterations;
            cost = report.costs.last().map_or(cost, Cost::total);
        }
        cost
    }

    /// Of both headings, the one that it went with on the whole.
    fn face_forward(&mut self) {
        if self.gone_m > -BACK_M {
            return;
        }
        self.gone_m = -self.gone_m;
        let turn = |weights: &mut Weights| {
            weights[3] += core::f64::consts::PI;
            weights[4] = -weights[4];
        };
        self.weights.iter_mut().for_each(turn);
        self.known.iter_mut().for_each(|known| turn(&mut known.state));
        for point in &mut self.model {
            for [x, y, _] in [&mut point.at, &mut point.mean] {
                (*x, *y) = (-*x, -*y);
            }
        }
        let [front, rear] = self.ends;
        self.ends = [-rear, -front];
    }

    /// Lets the state be that of the point of the object that it was of before, with its heading within
    /// half a turn of that.
    fn anchor(&mut self) {
        let mut by = [0.0; 3];
        for said in &self.said {
            let [x, y, z, heading, ..] = self.knots.value(&self.weights, said.time_s);
            let (sin, cos) = libm::sincos(heading);
            let off = [said.position[0] - x, said.position[1] - y, said.position[2] - z];
            by[0] += cos * off[0] + sin * off[1];
            by[1] += cos * off[1] - sin * off[0];
            by[2] += off[2];
        }
        let by = by.map(|by| by / self.said.len().max(1) as f64);
        // Whole turns mean nothing.
        let turns = self.said.last().map_or(0.0, |said| {
            let [.., heading, _, _, _] = self.knots.value(&self.weights, said.time_s);
            let off = heading - said.heading;
            off - start::turn(off)
        });
        for [x, y, z, heading, ..] in &mut self.weights {
            *heading -= turns;
            let (sin, cos) = libm::sincos(*heading);
            *x += cos * by[0] - sin * by[1];
            *y += sin * by[0] + cos * by[1];
            *z += by[2];
        }
        self.ends = self.ends.map(|end| end - by[0] as f32);
    }

    /// Makes model points of the last `fresh` returns where there are none near, and notes which
    /// model point each return is at.
    fn add_points(&mut self, estimator: &Estimator, fresh: usize) {
        let all = self.returns.len();
        for i in 0..all {
            let seen = &estimator.seen[i];
            let place = seen.place().map(|value| value as f32);
            self.returns[i].nearest = seen.nearest;
            if i + fresh < all {
                continue;
            }
            let square = self.spacing_m * self.spacing_m;
            let near = |point: &Point| super::square_distance(&point.at, &place) < square;
            if !self.model.iter().any(near) {
                if self.model.is_full() {
                    self.thin();
                }
                let point = Point { at: place, mean: place, held: 0.0, scatter: Scatter::ONE };
                _ = self.model.push(point);
            }
        }
        if fresh == all {
            self.assign(estimator);
        }
    }

    /// Nearest model points by brute force, where the model is new.
    fn assign(&mut self, estimator: &Estimator) {
        for (held, seen) in self.returns.iter_mut().zip(&estimator.seen) {
            let place = seen.place().map(|value| value as f32);
            let mut best = f32::MAX;
            for (number, point) in self.model.iter().enumerate() {
                let square = super::square_distance(&point.at, &place);
                if square < best {
                    (best, held.nearest) = (square, number as u16);
                }
            }
        }
    }

    /// Spaces model points wider, until there is room.
    fn thin(&mut self) {
        while self.model.is_full() {
            self.spacing_m *= WIDER;
            let square = self.spacing_m * self.spacing_m;
            let mut kept = 0;
            for i in 0..self.model.len() {
                let point = self.model[i];
                let near = |other: &Point| super::square_distance(&other.at, &point.at) < square;
                if !self.model[..kept].iter().any(near) {
                    self.model[kept] = point;
                    kept += 1;
                }
            }
            self.model.truncate(kept);
        }
    }
}

/// How far it goes forward over the window, m.
fn gone(knots: &Knots, weights: &[Weights], until_s: f64) -> f64 {
    let [from, to] = [knots.start(), until_s].map(|time_s| knots.value(weights, time_s));
    let (sin, cos) = libm::sincos(to[3]);
    cos * (to[0] - from[0]) + sin * (to[1] - from[1])
}
