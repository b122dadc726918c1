//! Sums of the updates of each voxel (B.2.3).

use crate::params::TILE;
use crate::record::Update;

/// Sums runs of equal keys among the first `count_tiles[TILE]` of the sorted `updates` into
/// `voxels`, which must have room for the same number; `run_tiles[TILE]` becomes the number of
/// runs.
pub fn reduce_by_key(
    count_tiles: &[u32],
    updates: &[Update],
    voxels: &mut [Update],
    run_tiles: &mut [u32],
) {
    let mut runs = 0;
    for &[key, log_odds] in &updates[..count_tiles[TILE] as usize] {
        if runs > 0 && voxels[runs - 1][0] == key {
            voxels[runs - 1][1] = voxels[runs - 1][1].wrapping_add(log_odds);
        } else {
            voxels[runs] = [key, log_odds];
            runs += 1;
        }
    }
    run_tiles[TILE] = runs as u32;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_summed() {
        let minus = (-1i32) as u32;
        let sorted = [[3, minus], [3, 10], [3, minus], [7, minus], [9, 10], [9, 10]];
        let mut voxels = [[0; 2]; 6];
        let (mut counts, mut runs) = ([0; TILE + 1], [0; TILE + 1]);
        counts[TILE] = 6;
        reduce_by_key(&counts, &sorted, &mut voxels, &mut runs);
        assert_eq!(runs[TILE], 3);
        assert_eq!(voxels[..3], [[3, 8], [7, minus], [9, 20]]);
        reduce_by_key(&[0; TILE + 1], &sorted, &mut voxels, &mut runs);
        assert_eq!(runs[TILE], 0);
    }
}
