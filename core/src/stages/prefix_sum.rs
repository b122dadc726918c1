//! Exclusive prefix sum.

use crate::params::TILE;

/// `sums[n]` becomes the sum of `values[..n]`, element [`TILE`] of `tiles` the sum of all. The
/// kernels leave the sums of their tiles in the elements before it.
pub fn prefix_sum(values: &[u32], tiles: &mut [u32], sums: &mut [u32]) {
    assert!(values.len() == sums.len());
    let mut total = 0;
    for (&value, sum) in values.iter().zip(sums) {
        *sum = total;
        total += value;
    }
    tiles[TILE] = total;
}
