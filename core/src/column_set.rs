//! Sets of columns of the window.

use crate::params::COLUMNS_MAX;

/// A set of columns, one bit each: small enough for the stack.
pub struct ColumnSet([u64; COLUMNS_MAX.div_ceil(64)]);

impl ColumnSet {
    pub const fn new() -> ColumnSet {
        ColumnSet([0; COLUMNS_MAX.div_ceil(64)])
    }

    /// Removes all columns.
    pub fn clear(&mut self) {
        self.0.fill(0);
    }

    /// Adds a column. Returns whether it was new.
    pub fn insert(&mut self, column: usize) -> bool {
        let is_new = !self.contains(column);
        self.insert_if(column, true);
        is_new
    }

    /// Adds a column if told to, without a branch.
    pub fn insert_if(&mut self, column: usize, wanted: bool) {
        self.0[column / 64] |= u64::from(wanted) << (column % 64);
    }

    /// Adds columns.
    pub fn insert_all(&mut self, columns: impl Iterator<Item = usize>) {
        columns.for_each(|c| self.insert_if(c, true));
    }

    /// Whether a column is in it.
    pub fn contains(&self, column: usize) -> bool {
        self.0[column / 64] >> (column % 64) & 1 != 0
    }

    /// Its columns, ascending.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = usize> {
        let some = self.0.iter().enumerate().filter(|(_, word)| **word != 0);
        some.flat_map(|(n, word)| {
            (0..64).filter(move |b| word >> b & 1 != 0).map(move |b| 64 * n + b)
        })
    }

    /// Its words, 64 columns each, to be filled by several threads.
    pub fn words(&mut self) -> &mut [u64] {
        &mut self.0
    }

    /// Removes columns.
    pub fn remove(&mut self, columns: &[u32]) {
        columns.iter().for_each(|c| self.0[*c as usize / 64] &= !(1 << (c % 64)));
    }
}
