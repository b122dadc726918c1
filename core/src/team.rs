//! Work that may be split over threads. Core has none; the caller may provide some.
//!
//! Clusters are registered independently of each other, each into a slot of its own; the rays of a
//! sweep and the velocities of its points are computed in parts. Neither the number of threads nor
//! the instructions they use therefore change any bit of the results.

use core::ops::Range;
use raywake_simd::Simd;

/// Threads that share work by fork and join.
pub trait Team: Sync {
    /// Runs both, possibly at the same time, and returns when both are done.
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send);

    /// The instruction set they use.
    fn simd(&self) -> Simd {
        Simd::BASELINE
    }
}

/// A team as a trait object, for stages, which are called through pointers.
pub trait Workers: Sync {
    /// [`Team::join`].
    fn join_both(&self, a: &mut (dyn FnMut() + Send), b: &mut (dyn FnMut() + Send));

    /// [`Team::simd`].
    fn simd(&self) -> Simd;
}

impl<T: Team> Workers for T {
    fn join_both(&self, a: &mut (dyn FnMut() + Send), b: &mut (dyn FnMut() + Send)) {
        self.join(a, b);
    }

    fn simd(&self) -> Simd {
        Team::simd(self)
    }
}

/// A team of one thread.
pub struct SingleThread;

impl Team for SingleThread {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        a();
        b();
    }
}

/// Fills each slot with the value of its index, counted from `first`.
#[cfg(feature = "pipeline")]
pub(crate) fn fill<T: Send>(
    team: &impl Team,
    first: usize,
    slots: &mut [T],
    value: &(impl Fn(usize) -> T + Sync),
) {
    each(team, first, slots, &|index, slot| *slot = value(index));
}

/// Does the work of each slot, given its index counted from `first`. Halves recursively, so that
/// idle threads can steal work.
#[cfg(feature = "pipeline")]
pub(crate) fn each<T: Send>(
    team: &impl Team,
    first: usize,
    slots: &mut [T],
    work: &(impl Fn(usize, &mut T) + Sync),
) {
    match slots {
        [] => {}
        [slot] => work(first, slot),
        _ => {
            let half = slots.len() / 2;
            let (a, b) = slots.split_at_mut(half);
            team.join(|| each(team, first, a, work), || each(team, first + half, b, work));
        }
    }
}

/// Calls `work` with ranges of rows and the output for them, `length` elements per row, until all
/// are done; ranges of at most `piece_max` rows are not split further.
pub(crate) fn share<T: Send>(
    workers: &dyn Workers,
    piece_max: usize,
    rows: Range<usize>,
    out: &mut [T],
    length: usize,
    work: &(dyn Fn(Range<usize>, &mut [T]) + Sync),
) {
    if rows.len() <= piece_max {
        return work(rows, out);
    }
    let middle = rows.start + rows.len() / 2;
    let (first, second) = out.split_at_mut((middle - rows.start) * length);
    workers.join_both(
        &mut || share(workers, piece_max, rows.start..middle, first, length, work),
        &mut || share(workers, piece_max, middle..rows.end, second, length, work),
    );
}
