//! The median of what a source measures.

use std::cmp::Ordering;

/// The middle one of some values, the upper one of two; `None` without any.
pub(super) fn median<T>(mut all: Vec<T>, order: impl FnMut(&T, &T) -> Ordering) -> Option<T> {
    let middle = all.len() / 2;
    all.sort_unstable_by(order);
    all.into_iter().nth(middle)
}
