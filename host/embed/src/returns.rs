//! Returns of a sweep, wherever the caller keeps them.

use raywake_core::sweep::Point;

/// Returns of a sweep, in any form. They are copied, a piece at a time, by any number of threads.
pub trait ReturnSource: Sync {
    /// Number of returns.
    fn count(&self) -> usize;

    /// Fills `to` with the returns from the index `first` on. There are that many.
    fn copy(&self, first: usize, to: &mut [Point]);
}

impl<R: ReturnSource + ?Sized> ReturnSource for &R {
    fn count(&self) -> usize {
        (**self).count()
    }

    fn copy(&self, first: usize, to: &mut [Point]) {
        (**self).copy(first, to);
    }
}

impl ReturnSource for [Point] {
    fn count(&self) -> usize {
        self.len()
    }

    fn copy(&self, first: usize, to: &mut [Point]) {
        to.copy_from_slice(&self[first..][..to.len()]);
    }
}

/// Returns given by a function of their index.
pub struct ReturnsBy<F> {
    /// Number of returns.
    pub count: usize,
    /// Returns the one with this index, which is less than `count`.
    pub at: F,
}

impl<F: Fn(usize) -> Point + Sync> ReturnSource for ReturnsBy<F> {
    fn count(&self) -> usize {
        self.count
    }

    fn copy(&self, first: usize, to: &mut [Point]) {
        for (index, to) in (first..).zip(to) {
            *to = (self.at)(index);
        }
    }
}
