//! Where an object ends, and what that says of its motion.
//!
//! Along a smooth side all trajectories explain the returns alike: a long vehicle that passes by then
//! seems to stand, and its side grows instead (the failure of figure 2.9). But a ray beyond its end
//! passes: in every part of the track the foremost and the hindmost return lie at the same two places
//! of the object, unless something hides them. Both places are unknowns, eliminated as a model point
//! is. A return that falls short of its end counts for less than one beyond it, as the end may be
//! hidden, unless rays pass there; hardly at all where the sensor looks along the object from its other
//! end.

use super::normal::{Equations, Seen, Surface, follow};
use super::process::Weights;
use super::returns::Kept;
use crate::ObjectState;
use crate::spline::Knots;
use heapless::Vec;

/// A part of the track, s.
const PART_S: f32 = 0.2;
/// Parts at most; later ones tell nothing.
const PARTS: usize = 160;
/// Returns of a part that tell where it ends.
const ENOUGH: usize = 6;
/// A return further off than this counts no more for being further, m.
const BOUND_M: f64 = 0.3;
/// One that falls short by more than this counts ever less: something hides the end, m.
const HIDDEN_M: f64 = 1.0;
/// Share that counts of one that falls short.
const SHORT: f64 = 0.3;
/// Slope of the view, across to along, from which on the far end is believed to be seen.
const SLOPE: f64 = 0.3;
/// Rays pass an end where they pass a return no further from it, m.
const END_M: f64 = 0.5;
/// Precision of an end without returns, 1/m²: none.
const LOOSE: f64 = 1e-6;

/// Whether rays pass a return on the side on which the object's front (0) or rear (1) is.
fn passes(kept: &Kept, seen: &Seen, end: usize) -> bool {
    let [_, sensor, _] = seen.frame(kept.origin_from_return());
    let [_, own, _] = seen.place();
    // Seen from its left, an object has its front on the left.
    kept.passed[if sensor > own { end } else { 1 - end }]
}

/// The returns that are foremost and hindmost in their part of the track.
pub(super) struct Ends {
    kept: [[Kept; PARTS]; 2],
    seen: [[Seen; PARTS]; 2],
    /// Whether rays pass there: nothing hides the end.
    open: [[bool; PARTS]; 2],
    order: [u16; PARTS],
    count: usize,
    precision: f64,
}

impl Ends {
    pub const fn new() -> Ends {
        let mut order = [0; PARTS];
        let mut n = 0;
        while n < PARTS {
            order[n] = n as u16;
            n += 1;
        }
        Ends {
            kept: [[Kept::NONE; PARTS]; 2],
            seen: [[Seen::NONE; PARTS]; 2],
            open: [[false; PARTS]; 2],
            order,
            count: 0,
            precision: 0.0,
        }
    }

    /// Takes them from all returns, in the order of time.
    pub fn find(&mut self, kept: &[Kept], seen: &[Seen], deviation_m: f64) {
        self.count = 0;
        self.precision = if deviation_m > 0.0 { 1.0 / (deviation_m * deviation_m) } else { 0.0 };
        if deviation_m <= 0.0 {
            return;
        }
        let mut from = 0;
        while from < kept.len() && self.count < PARTS {
            let until = kept[from].time_s + PART_S;
            let to = from + kept[from..].partition_point(|kept| kept.time_s < until).max(1);
            if to - from >= ENOUGH {
                let along = |i: usize| seen[i].place()[0];
                let (mut last, mut first) = (from, from);
                for i in from..to {
                    if along(i) > along(last) {
                        last = i;
                    }
                    if along(i) < along(first) {
                        first = i;
                    }
                }
                for (end, i) in [last, first].into_iter().enumerate() {
                    self.kept[end][self.count] = kept[i];
                    self.seen[end][self.count] = seen[i];
                    self.open[end][self.count] = (from..to).any(|n| {
                        let off = libm::fabs(along(n) - along(i));
                        off < END_M && passes(&kept[n], &seen[n], end)
                    });
                }
                self.count += 1;
            }
            from = to;
        }
    }

    /// States of the object in every part by what is foremost, by what is hindmost (1 and 0 of the
    /// way from rear to front), or by what lies between (0.5).
    pub fn places(
        &self,
        knots: &Knots,
        weights: &[Weights],
        share: f64,
    ) -> Vec<ObjectState, PARTS> {
        let [fronts, rears] = &self.kept;
        let [front, rear] = self.begin().map(f64::from);
        let middle = (0.5 - share) * (front - rear);
        let parts = fronts.iter().zip(rears).zip(self.seen[0].iter().zip(&self.seen[1]));
        parts
            .take(self.count)
            .map(|((front, rear), (ahead, behind))| {
                let time_s = 0.5 * (f64::from(front.time_s) + f64::from(rear.time_s));
                let state = super::state(knots, weights, time_s, time_s);
                let by = share * ahead.place()[0] + (1.0 - share) * behind.place()[0] + middle;
                let (sin, cos) = libm::sincos(state.heading);
                let [x, y, z] = state.position;
                ObjectState { position: [x + by * cos, y + by * sin, z], ..state }
            })
            .collect()
    }

    /// Where the ends are at first: beyond all but a fifth of them.
    pub fn begin(&self) -> [f32; 2] {
        let mut places = [0.0f32; PARTS];
        let fifth = self.count / 5;
        core::array::from_fn(|end| {
            for (place, seen) in places.iter_mut().zip(&self.seen[end][..self.count]) {
                *place = seen.place()[0] as f32;
            }
            let places = &mut places[..self.count];
            places.sort_unstable_by(f32::total_cmp);
            let nth = if end == 0 { self.count.saturating_sub(1 + fifth) } else { fifth };
            places.get(nth).copied().unwrap_or(0.0)
        })
    }

    /// Lays them over the ends; their cost.
    pub fn lay(&mut self, ends: &[f32; 2]) -> f64 {
        let mut cost = 0.0;
        for (end, &at) in ends.iter().enumerate() {
            let surface = self.surface(at);
            let forward = if end == 0 { 1.0 } else { -1.0 };
            let all = self.seen[end].iter_mut().zip(&self.kept[end]).zip(&self.open[end]);
            for ((seen, kept), &open) in all.take(self.count) {
                seen.lay(&[at, 0.0, 0.0], &surface, 0.0);
                let miss = forward * (seen.place()[0] - f64::from(at));
                let [x, y, _] = seen.frame(kept.origin_from_return());
                let ahead = forward * (x - f64::from(at));
                // Seen from its own side, or from the side.
                let slope = if ahead < 0.0 { libm::fabs(y) / -ahead } else { SLOPE };
                let view = (slope / SLOPE).min(1.0);
                let hidden = miss < 0.0 && !open;
                let counts = view * view * if hidden { SHORT } else { 1.0 };
                let off = libm::fabs(miss);
                let precision = self.precision * counts;
                // Bounded slope beyond the end, bounded cost before it where it may be hidden.
                let (share, square) = if hidden {
                    let fall = 1.0 / (1.0 + off * off / (HIDDEN_M * HIDDEN_M));
                    (fall * fall, off * off * fall)
                } else if off < BOUND_M {
                    (1.0, off * off)
                } else {
                    (BOUND_M / off, BOUND_M * (2.0 * off - BOUND_M))
                };
                seen.precision = [precision * share, 0.0, 0.0];
                cost += 0.5 * precision * square;
            }
        }
        cost
    }

    /// Adds them to the equations, the ends eliminated.
    pub fn add(&self, ends: &[f32; 2], equations: &mut Equations) {
        for (end, &at) in ends.iter().enumerate() {
            let (kept, seen) = (&self.kept[end][..self.count], &self.seen[end][..self.count]);
            equations.add_returns(kept, seen);
            let order = &self.order[..self.count];
            equations.eliminate(order, kept, seen, &[at, 0.0, 0.0], &self.surface(at));
        }
    }

    /// Moves the ends with a step of the splines.
    pub fn follow(&self, ends: &mut [f32; 2], step: &[Weights]) {
        for (end, at) in ends.iter_mut().enumerate() {
            let (kept, seen) = (&self.kept[end][..self.count], &self.seen[end][..self.count]);
            let order = &self.order[..self.count];
            let by = follow(order, kept, seen, &[*at, 0.0, 0.0], &self.surface(*at), step);
            *at += by[0] as f32;
        }
    }

    fn surface(&self, at: f32) -> Surface {
        Surface { held: LOOSE, mean: [at, 0.0, 0.0], ..Surface::NONE }
    }
}
