//! The returns that an estimate uses: a bounded number, as evenly spaced in time as possible.

use crate::spline::{Basis, Knots};
use crate::{ObjectReturn, RETURNS_MAX};

/// Time bins of a track, within which returns keep the given order.
const TICKS: usize = 4096;
/// No track gets so far from its anchor and its start, m and s.
const FAR: f32 = 1e5;
/// Minimum time that ticks divide, s: all returns may be of one instant.
const SPAN_MIN_S: f32 = 1e-3;
/// Number of parts of a track, which may contribute equally many returns.
const PARTS: usize = 128;
const TICKS_PER_PART: usize = TICKS / PARTS;

/// Time over which the length of an object is measured, s: it hardly moves meanwhile.
const GLANCE_S: f32 = 0.1;
/// Maximum number of glances used, and returns that one needs.
const GLANCES: usize = 128;
const GLANCE_RETURNS: usize = 6;

/// A return in use. Positions are metres from the track's anchor, times seconds after its start.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub position: [f32; 3],
    /// Where its ray began.
    pub origin: [f32; 3],
    pub time_s: f32,
    /// See [`ObjectReturn::passed`].
    pub passed: [bool; 2],
    pub basis: Basis,
}

impl Sample {
    pub const NONE: Sample = Sample {
        position: [0.0; 3],
        origin: [0.0; 3],
        time_s: 0.0,
        passed: [false; 2],
        basis: Basis { first: 0, values: [0.0; 5] },
    };

    /// A sample without a ray.
    pub fn at(position: [f32; 3], time_s: f32) -> Sample {
        Sample { position, origin: position, time_s, ..Sample::NONE }
    }

    /// Vector from the end of its ray to the ray's origin, m.
    pub fn origin_from_return(&self) -> [f64; 3] {
        core::array::from_fn(|d| f64::from(self.origin[d]) - f64::from(self.position[d]))
    }
}

/// Samples in order of time.
pub(super) struct Samples {
    all: [Sample; RETURNS_MAX],
    count: usize,
    ticks: [u32; TICKS],
    length_m: f32,
}

/// First and last time of the returns taken, and the number of unsound ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Taken {
    pub first_s: f32,
    pub last_s: f32,
    pub unsound: usize,
}

/// Maximum number of returns taken from a part, such that all parts together give at most `at_most`
/// (or one each).
fn quota(counts: &[u32; PARTS], at_most: usize) -> u32 {
    let (mut low, mut high) = (1, at_most as u32 + 1);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        let together: u64 = counts.iter().map(|&count| u64::from(count.min(middle))).sum();
        if together <= at_most as u64 { low = middle } else { high = middle }
    }
    low
}

/// Whether a return is finite and within the range of a track.
pub(super) fn is_valid_return(one: &ObjectReturn) -> bool {
    let places = one.position.iter().chain(&one.origin);
    one.time_s.abs() <= FAR && places.map(|value| value.abs()).all(|value| value <= FAR)
}

impl Samples {
    pub const fn new() -> Samples {
        Samples { all: [Sample::NONE; RETURNS_MAX], count: 0, ticks: [0; TICKS], length_m: 0.0 }
    }

    /// Takes at most `at_most` of the returns: parts of the track with more than their quota give
    /// every k-th, in time order (within a tick, in the given order). Which rays pass is kept only
    /// if `passing`. None if no return is sound.
    pub fn take(
        &mut self,
        returns: &[ObjectReturn],
        at_most: usize,
        passing: bool,
    ) -> Option<Taken> {
        self.count = 0;
        let at_most = at_most.clamp(1, RETURNS_MAX);
        let sound = || returns.iter().filter(|one| is_valid_return(one));
        let times = || sound().map(|one| one.time_s);
        let (first_s, last_s) = (times().reduce(f32::min)?, times().reduce(f32::max)?);
        let per_s = TICKS as f32 / (last_s - first_s).max(SPAN_MIN_S);
        let tick = |one: &ObjectReturn| (((one.time_s - first_s) * per_s) as usize).min(TICKS - 1);
        let counts = self.count_ticks(sound().map(tick));
        let most = quota(&counts, at_most);
        let mut firsts = [0u32; PARTS];
        let mut total = 0;
        for (first, count) in firsts.iter_mut().zip(counts) {
            *first = total;
            total += count.min(most);
        }
        for one in sound() {
            let tick = tick(one);
            let part = tick / TICKS_PER_PART;
            let (of, take) = (u64::from(counts[part]), u64::from(counts[part].min(most)));
            let rank = u64::from(self.ticks[tick]);
            self.ticks[tick] += 1;
            let nth = rank * take / of;
            let place = (firsts[part] + nth as u32) as usize;
            if (rank + 1) * take / of > nth && place < RETURNS_MAX {
                self.all[place] = Sample {
                    origin: one.origin,
                    passed: one.passed.map(|passed| passed && passing),
                    ..Sample::at(one.position, one.time_s)
                };
            }
        }
        self.count = (total as usize).min(at_most);
        self.sort();
        self.length_m = self.measure();
        Some(Taken { first_s, last_s, unsound: returns.len() - sound().count() })
    }

    /// Counts the returns of every part; `ticks` become the rank of each tick's first in its part.
    fn count_ticks(&mut self, ticks: impl Iterator<Item = usize>) -> [u32; PARTS] {
        self.ticks.fill(0);
        ticks.for_each(|tick| self.ticks[tick] += 1);
        let mut counts = [0u32; PARTS];
        for (ticks, count) in self.ticks.chunks_exact_mut(TICKS_PER_PART).zip(&mut counts) {
            for tick in ticks {
                *count += core::mem::replace(tick, *count);
            }
        }
        counts
    }

    /// By time, and at equal times by position: nothing may depend on the order of an unstable
    /// sort.
    fn sort(&mut self) {
        self.all[..self.count].sort_unstable_by(|a, b| {
            let places = a.position.iter().zip(&b.position);
            let place = places.map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne());
            a.time_s.total_cmp(&b.time_s).then(place.unwrap_or(core::cmp::Ordering::Equal))
        });
    }

    /// Takes the first [`RETURNS_MAX`] of these positions and times, which are in order of time.
    pub fn set(&mut self, returns: impl Iterator<Item = ([f32; 3], f32)>) {
        self.count = 0;
        for (sample, (position, time_s)) in self.all.iter_mut().zip(returns) {
            *sample = Sample::at(position, time_s);
            self.count += 1;
        }
        self.length_m = self.measure();
    }

    /// Computes every sample's basis functions.
    pub fn set_bases(&mut self, knots: &Knots) {
        for sample in &mut self.all[..self.count] {
            sample.basis = knots.basis(f64::from(sample.time_s));
        }
    }

    /// Visible length of the object, m: the diagonal of the part seen in a glance that four of five
    /// glances do not exceed; 0 if no glance has enough returns.
    pub fn length_m(&self) -> f32 {
        self.length_m
    }

    fn measure(&self) -> f32 {
        let mut diagonals = heapless::Vec::<f32, GLANCES>::new();
        let mut rest = self.all();
        while let [first, ..] = rest {
            let until = first.time_s + GLANCE_S;
            let end = rest.partition_point(|sample| sample.time_s < until).max(1);
            let (glance, later) = rest.split_at(end);
            rest = later;
            if glance.len() < GLANCE_RETURNS {
                continue;
            }
            let [x, y] = [0, 1].map(|d| {
                let values = || glance.iter().map(|sample| sample.position[d]);
                values().fold(f32::MIN, f32::max) - values().fold(f32::MAX, f32::min)
            });
            if diagonals.push(libm::sqrtf(x * x + y * y)).is_err() {
                break;
            }
        }
        diagonals.sort_unstable_by(f32::total_cmp);
        diagonals.get(diagonals.len() * 4 / 5).copied().unwrap_or(0.0)
    }

    pub fn all(&self) -> &[Sample] {
        &self.all[..self.count]
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    #[test]
    fn object_length_is_measured_at_a_glance() {
        let mut returns = raywake_alloc_guard::boxed!(Samples, Samples::new());
        // 8 m along the diagonal of the plane at 5 m/s; half of it hidden for half a second.
        let mut look = |count: usize| {
            let seen = (0..count).map(|i| {
                let time_s = 4.0 * i as f32 / count as f32;
                let hidden = (1.0..1.5).contains(&time_s);
                let along = 5.0 * time_s + (i % 5) as f32 * if hidden { 1.0 } else { 2.0 };
                ([0.6 * along, 0.8 * along, 0.0], time_s)
            });
            returns.set(seen);
            returns.length_m()
        };
        let length = look(2000);
        assert!((8.0..8.6).contains(&length), "{length}");
        // Too few in every glance.
        assert_eq!(look(80), 0.0);
    }
}
