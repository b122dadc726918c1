//! Levels of the pyramid as rows of cells.

use crate::team::{Team, share};
use raywake_simd::Simd;

/// A square level, with all channels of a cell contiguous.
#[derive(Clone, Copy)]
pub struct Plane<'a, const CHANNELS: usize> {
    /// Cells along an axis.
    pub side: usize,
    pub cells: &'a [u8],
}

impl<'a, const CHANNELS: usize> Plane<'a, CHANNELS> {
    /// The cells of a row.
    #[inline(always)]
    pub fn row(&self, row: usize) -> &'a [[u8; CHANNELS]] {
        &self.cells.as_chunks().0[row * self.side..][..self.side]
    }

    #[inline(always)]
    pub fn at(&self, row: usize, at: usize) -> &'a [u8; CHANNELS] {
        &self.row(row)[at]
    }
}

/// The 2 x 2 cells below one of the next level, concatenated.
#[inline(always)]
pub fn gathered<const CHANNELS: usize, const ALL: usize>(
    below: &Plane<CHANNELS>,
    row: usize,
    at: usize,
) -> [u8; ALL] {
    let mut all = [0; ALL];
    for (n, x) in all.as_chunks_mut::<CHANNELS>().0.iter_mut().enumerate() {
        *x = *below.at(2 * row + n / 2, 2 * at + n % 2);
    }
    all
}

/// Fills rows of `length`, possibly several at a time. `fill` is inlined so that it is compiled for
/// the team's instruction set.
#[inline(always)]
pub fn each_row<T: Send>(
    team: &impl Team,
    out: &mut [T],
    length: usize,
    fill: impl Fn(Simd, usize, &mut [T]) + Sync + Copy,
) {
    let (simd, rows) = (team.simd(), out.len() / length);
    share(team, 1, 0..rows, out, length, &move |rows, out| {
        simd.run(
            #[inline(always)]
            move |simd| fill(simd, rows.start, out),
        );
    });
}
