//! Returns of a sweep, wherever the caller keeps them.

use raywake_core::sweep::Point;

/// Returns of a sweep, in any form.
pub trait ReturnSource {
    /// Number of returns.
    fn count(&self) -> usize;

    /// Copies all of them; `to` is as long as there are returns.
    fn copy(&self, to: &mut [Point]);
}

impl<R: ReturnSource + ?Sized> ReturnSource for &R {
    fn count(&self) -> usize {
        (**self).count()
    }

    fn copy(&self, to: &mut [Point]) {
        (**self).copy(to);
    }
}

impl ReturnSource for [Point] {
    fn count(&self) -> usize {
        self.len()
    }

    fn copy(&self, to: &mut [Point]) {
        to.copy_from_slice(self);
    }
}

/// Returns given by a function of their index.
pub struct ReturnsBy<F> {
    /// Number of returns.
    pub count: usize,
    /// The return with this index, which is less than `count`.
    pub at: F,
}

impl<F: Fn(usize) -> Point> ReturnSource for ReturnsBy<F> {
    fn count(&self) -> usize {
        self.count
    }

    fn copy(&self, to: &mut [Point]) {
        to.iter_mut().enumerate().for_each(|(index, to)| *to = (self.at)(index));
    }
}
