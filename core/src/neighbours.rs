//! The columns around a column of a square window.

use core::ops::Range;

/// The columns at most `reach` from a column along each axis, itself included, in a window of
/// `side` by `side`; row by row, ascending.
#[inline(always)]
pub fn rows_near(column: u32, reach: u32, side: u32) -> impl Iterator<Item = Range<usize>> {
    let near = |at: u32| at.saturating_sub(reach)..(at + reach + 1).min(side);
    let (rows, across) = (near(column / side), near(column % side));
    rows.map(move |i| (i * side + across.start) as usize..(i * side + across.end) as usize)
}

/// The same, one by one.
#[cfg(feature = "pipeline")]
#[inline]
pub fn columns_near(column: usize, reach: usize, side: usize) -> impl Iterator<Item = usize> {
    rows_near(column as u32, reach as u32, side as u32).flatten()
}
