//! The returns that take part: so many of a track, evenly in the order of their times.

use super::RETURNS_MAX;
use crate::objects::ObjectReturn;
use crate::objects::spline::{Basis, Knots};

/// Steps in which times are told apart where there are more returns than take part.
const TICKS: usize = 4096;

/// A return that takes part.
#[derive(Clone, Copy)]
pub(super) struct Kept {
    pub position: [f32; 3],
    pub time_s: f32,
    pub basis: Basis,
}

impl Kept {
    pub const NONE: Kept =
        Kept { position: [0.0; 3], time_s: 0.0, basis: Basis { first: 0, values: [0.0; 5] } };
}

/// They, in the order of time.
pub(super) struct Returns {
    kept: [Kept; RETURNS_MAX],
    count: usize,
    ticks: [u32; TICKS],
}

/// What became of the returns of a track.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Taken {
    pub first_s: f32,
    pub last_s: f32,
    pub not_finite: usize,
}

fn finite(seen: &ObjectReturn) -> bool {
    seen.time_s.is_finite() && seen.position.iter().chain(&seen.origin).all(|v| v.is_finite())
}

impl Returns {
    pub const fn new() -> Returns {
        Returns { kept: [Kept::NONE; RETURNS_MAX], count: 0, ticks: [0; TICKS] }
    }

    /// Takes `at_most` of the returns, every so manyth in the order of time (of one tick, in the order
    /// given). None where no return is finite.
    pub fn take(&mut self, returns: &[ObjectReturn], at_most: usize) -> Option<Taken> {
        self.count = 0;
        let (mut first_s, mut last_s) = (f32::MAX, f32::MIN);
        let mut sound = 0;
        for seen in returns.iter().filter(|seen| finite(seen)) {
            first_s = first_s.min(seen.time_s);
            last_s = last_s.max(seen.time_s);
            sound += 1;
        }
        if sound == 0 {
            return None;
        }
        let per_s = (TICKS - 1) as f32 / (last_s - first_s).max(1e-3);
        let tick = |seen: &ObjectReturn| ((seen.time_s - first_s) * per_s) as usize;
        self.ticks.fill(0);
        for seen in returns.iter().filter(|seen| finite(seen)) {
            self.ticks[tick(seen).min(TICKS - 1)] += 1;
        }
        let mut before = 0;
        for count in &mut self.ticks {
            before += core::mem::replace(count, before);
        }
        let at_most = at_most.clamp(1, RETURNS_MAX) as u64;
        let keep = at_most.min(sound as u64);
        for seen in returns.iter().filter(|seen| finite(seen)) {
            let rank = &mut self.ticks[tick(seen).min(TICKS - 1)];
            let taken_before = u64::from(*rank) * keep / sound as u64;
            let taken = (u64::from(*rank) + 1) * keep / sound as u64;
            *rank += 1;
            if taken > taken_before {
                self.kept[taken_before as usize] =
                    Kept { position: seen.position, time_s: seen.time_s, ..Kept::NONE };
            }
        }
        self.count = keep as usize;
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
        Some(Taken { first_s, last_s, not_finite: returns.len() - sound })
    }

    /// Computes every return's basis functions.
    pub fn lay(&mut self, knots: &Knots) {
        for kept in &mut self.kept[..self.count] {
            kept.basis = knots.basis(f64::from(kept.time_s));
        }
    }

    pub fn all(&self) -> &[Kept] {
        &self.kept[..self.count]
    }
}
