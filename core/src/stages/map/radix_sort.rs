//! Stable sort of updates by key (B.2.3), least significant digit first.

use crate::params::TILE;
use crate::record::Update;

/// Sorts the first `count_tiles[TILE]` of `updates` by key; equal keys keep their order. `scratch`
/// must have room for the same number. Digits are bytes here; the kernels take four bits at a time.
pub fn radix_sort(count_tiles: &[u32], updates: &mut [Update], scratch: &mut [Update]) {
    let count = count_tiles[TILE] as usize;
    let (updates, scratch) = (&mut updates[..count], &mut scratch[..count]);
    let mut histograms = [[0u32; 256]; 4];
    for [key, _] in updates.iter() {
        for (digit, histogram) in key.to_le_bytes().into_iter().zip(&mut histograms) {
            histogram[digit as usize] += 1;
        }
    }
    let (mut from, mut to) = (updates, scratch);
    for (digit, histogram) in histograms.iter_mut().enumerate() {
        let mut sum = 0;
        for count in histogram.iter_mut() {
            sum += core::mem::replace(count, sum);
        }
        for &update in from.iter() {
            let place = &mut histogram[(update[0] >> (8 * digit) & 0xff) as usize];
            to[*place as usize] = update;
            *place += 1;
        }
        // After four passes the result is back in `updates`.
        core::mem::swap(&mut from, &mut to);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec;
    use std::vec::Vec;

    #[test]
    fn equals_a_stable_sort() {
        for n in [0u32, 1, 2, 1023, 1024, 5000] {
            for spread in [1u32, 2, 300, u32::MAX] {
                let mut updates: Vec<Update> =
                    (0..n).map(|i| [i.wrapping_mul(2654435761) % spread, i]).collect();
                let mut wanted = updates.clone();
                wanted.sort_by_key(|u| u[0]);
                let mut scratch = vec![[0; 2]; updates.len()];
                let mut count_tiles = [0; TILE + 1];
                count_tiles[TILE] = n;
                radix_sort(&count_tiles, &mut updates, &mut scratch);
                assert!(updates == wanted, "{n} keys below {spread}");
            }
        }
    }
}
