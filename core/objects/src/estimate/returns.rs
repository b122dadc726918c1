//! The returns that take part: so many of a track, evenly in the order of their times.

use crate::ObjectReturn;
use crate::RETURNS_MAX;
use crate::spline::{Basis, Knots};

/// Steps in which times are told apart where there are more returns than take part.
const TICKS: usize = 4096;
/// No track gets so far from its anchor and its start, m and s.
const FAR: f32 = 1e5;
/// Parts of a track that may give equally many.
const PARTS: usize = 128;
const TICKS_PER_PART: usize = TICKS / PARTS;

/// Parts of a track in which the object's length is measured, s: it hardly moves meanwhile. Their
/// number at most, and returns of one that tells.
const GLANCE_S: f32 = 0.1;
const GLANCES: usize = 128;
const GLANCE_RETURNS: usize = 6;

/// A return that takes part.
#[derive(Clone, Copy)]
pub(super) struct Kept {
    pub position: [f32; 3],
    /// Where its ray began.
    pub origin: [f32; 3],
    pub time_s: f32,
    /// See [`ObjectReturn::passed`].
    pub passed: [bool; 2],
    pub basis: Basis,
}

impl Kept {
    pub const NONE: Kept = Kept {
        position: [0.0; 3],
        origin: [0.0; 3],
        time_s: 0.0,
        passed: [false; 2],
        basis: Basis { first: 0, values: [0.0; 5] },
    };

    /// The way from its end to its beginning, m.
    pub fn origin_from_return(&self) -> [f64; 3] {
        core::array::from_fn(|d| f64::from(self.origin[d]) - f64::from(self.position[d]))
    }
}

/// They, in the order of time.
pub(super) struct Returns {
    kept: [Kept; RETURNS_MAX],
    count: usize,
    ticks: [u32; TICKS],
    length_m: f32,
}

/// What became of the returns of a track.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Taken {
    pub first_s: f32,
    pub last_s: f32,
    pub unsound: usize,
}

/// How many a part may give at most, so that all together give no more than `at_most` (or one each).
fn share(counts: &[u32; PARTS], at_most: usize) -> u32 {
    let (mut low, mut high) = (1, at_most as u32 + 1);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        let together: u64 = counts.iter().map(|&count| u64::from(count.min(middle))).sum();
        if together <= at_most as u64 { low = middle } else { high = middle }
    }
    low
}

/// Whether a return is a number, and one that a track can hold.
pub(super) fn sound(seen: &ObjectReturn) -> bool {
    let places = seen.position.iter().chain(&seen.origin);
    seen.time_s.abs() <= FAR && places.map(|value| value.abs()).all(|value| value <= FAR)
}

impl Returns {
    pub const fn new() -> Returns {
        Returns { kept: [Kept::NONE; RETURNS_MAX], count: 0, ticks: [0; TICKS], length_m: 0.0 }
    }

    /// Takes `at_most` of the returns, as evenly in time as they allow: parts of the track that have
    /// more give equally many, every so manyth in the order of time (within a tick, in the order
    /// given), with or without what rays pass. None where no return is sound.
    pub fn take(
        &mut self,
        returns: &[ObjectReturn],
        at_most: usize,
        passing: bool,
    ) -> Option<Taken> {
        self.count = 0;
        let (mut first_s, mut last_s) = (f32::MAX, f32::MIN);
        let mut count = 0;
        for seen in returns.iter().filter(|seen| sound(seen)) {
            first_s = first_s.min(seen.time_s);
            last_s = last_s.max(seen.time_s);
            count += 1;
        }
        if count == 0 {
            return None;
        }
        let per_s = TICKS as f32 / (last_s - first_s).max(1e-3);
        let tick =
            |seen: &ObjectReturn| (((seen.time_s - first_s) * per_s) as usize).min(TICKS - 1);
        self.ticks.fill(0);
        for seen in returns.iter().filter(|seen| sound(seen)) {
            self.ticks[tick(seen)] += 1;
        }
        let mut counts = [0u32; PARTS];
        for (ticks, count) in self.ticks.chunks_exact_mut(TICKS_PER_PART).zip(&mut counts) {
            for tick in ticks {
                *count += core::mem::replace(tick, *count);
            }
        }
        let most = share(&counts, at_most.clamp(1, RETURNS_MAX));
        let mut places = [0u32; PARTS];
        let mut keep = 0;
        for (place, count) in places.iter_mut().zip(counts) {
            *place = keep;
            keep += count.min(most);
        }
        for seen in returns.iter().filter(|seen| sound(seen)) {
            let tick = tick(seen);
            let part = tick / TICKS_PER_PART;
            let (of, kept) = (u64::from(counts[part]), u64::from(counts[part].min(most)));
            let rank = u64::from(self.ticks[tick]);
            self.ticks[tick] += 1;
            let nth = rank * kept / of;
            if (rank + 1) * kept / of > nth {
                let place = (places[part] + nth as u32) as usize;
                if place < RETURNS_MAX {
                    self.kept[place] = Kept {
                        position: seen.position,
                        origin: seen.origin,
                        time_s: seen.time_s,
                        passed: seen.passed.map(|passed| passed && passing),
                        ..Kept::NONE
                    };
                }
            }
        }
        let keep = (keep as usize).min(at_most.clamp(1, RETURNS_MAX));
        self.count = keep;
        let kept = &mut self.kept[..self.count];
        // Equal times come in an order of their own: nothing may hang on that of the sort.
        kept.sort_unstable_by(|a, b| {
            let places = || a.position.iter().zip(&b.position);
            a.time_s.total_cmp(&b.time_s).then_with(|| {
                places()
                    .map(|(a, b)| a.total_cmp(b))
                    .find(|o| o.is_ne())
                    .unwrap_or(core::cmp::Ordering::Equal)
            })
        });
        self.length_m = self.measure();
        Some(Taken { first_s, last_s, unsound: returns.len() - count })
    }

    /// Takes just these, which are in the order of time; the first [`RETURNS_MAX`] of them.
    pub fn set(&mut self, returns: impl Iterator<Item = ([f32; 3], f32)>) {
        self.count = 0;
        for (kept, (position, time_s)) in self.kept.iter_mut().zip(returns) {
            *kept = Kept { position, origin: position, time_s, ..Kept::NONE };
            self.count += 1;
        }
        self.length_m = self.measure();
    }

    /// Computes every return's basis functions.
    pub fn lay(&mut self, knots: &Knots) {
        for kept in &mut self.kept[..self.count] {
            kept.basis = knots.basis(f64::from(kept.time_s));
        }
    }

    /// About how long the object is: the diagonal of what is seen of it in a glance, which four of
    /// five glances do not exceed; 0 where no glance tells.
    pub fn length_m(&self) -> f32 {
        self.length_m
    }

    fn measure(&self) -> f32 {
        let mut diagonals = heapless::Vec::<f32, GLANCES>::new();
        let mut rest = self.all();
        while let [first, ..] = rest {
            let until = first.time_s + GLANCE_S;
            let (glance, later) =
                rest.split_at(rest.partition_point(|kept| kept.time_s < until).max(1));
            rest = later;
            if glance.len() < GLANCE_RETURNS {
                continue;
            }
            let [x, y] = [0, 1].map(|d| {
                let values = || glance.iter().map(|kept| kept.position[d]);
                values().fold(f32::MIN, f32::max) - values().fold(f32::MAX, f32::min)
            });
            if diagonals.push(libm::sqrtf(x * x + y * y)).is_err() {
                break;
            }
        }
        diagonals.sort_unstable_by(f32::total_cmp);
        diagonals.get(diagonals.len() * 4 / 5).copied().unwrap_or(0.0)
    }

    pub fn all(&self) -> &[Kept] {
        &self.kept[..self.count]
    }
}
