//! Exclusive prefix sum.

/// `sums[n]` becomes the sum of `values[..n]`; returns the sum of all.
pub fn prefix_sum(values: &[u32], sums: &mut [u32]) -> u32 {
    assert!(values.len() == sums.len());
    let mut total = 0;
    for (&value, sum) in values.iter().zip(sums) {
        *sum = total;
        total += value;
    }
    total
}
