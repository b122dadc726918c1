//! Sums of the updates of each voxel (B.2.3).

use super::Update;

/// Sums runs of equal keys of `sorted` into `voxels`, which must hold as many elements; returns the
/// number of runs.
pub fn reduce_by_key(sorted: &[Update], voxels: &mut [Update]) -> usize {
    let mut runs = 0;
    for &[key, log_odds] in sorted {
        if runs > 0 && voxels[runs - 1][0] == key {
            voxels[runs - 1][1] = voxels[runs - 1][1].wrapping_add(log_odds);
        } else {
            voxels[runs] = [key, log_odds];
            runs += 1;
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_summed() {
        let minus = (-1i32) as u32;
        let sorted = [[3, minus], [3, 10], [3, minus], [7, minus], [9, 10], [9, 10]];
        let mut voxels = [[0; 2]; 6];
        assert_eq!(reduce_by_key(&sorted, &mut voxels), 3);
        assert_eq!(voxels[..3], [[3, 8], [7, minus], [9, 20]]);
        assert_eq!(reduce_by_key(&[], &mut voxels), 0);
    }
}
