//! The median of measured values.

use std::cmp::Ordering;

/// The middle one of some values, the upper of two; `None` if there are none.
pub(super) fn median<T>(mut all: Vec<T>, order: impl FnMut(&T, &T) -> Ordering) -> Option<T> {
    let middle = all.len() / 2;
    all.sort_unstable_by(order);
    all.into_iter().nth(middle)
}
