//! What the classifier sees of a column, with the symmetry of the square built in.
//!
//! The lattice lies at any heading to the street, so a patch turned by a quarter or mirrored is as
//! likely as the patch itself. The loss of a linear classifier is convex: averaged over the eight
//! symmetries its minimum is symmetric. Fitting one weight per orbit of patch columns, to counts
//! of voxels, therefore finds the minimum that augmenting the samples eightfold would.

use raywake_core::record::{Column, SweepUniform};
use raywake_core::stages::background_filter::PATCH;

/// Levels the filter is trained for.
pub const LEVELS: usize = 14;
/// Sets of patch columns that the square's symmetries map onto each other.
const ORBITS: usize = 6;
/// Counts per sample: orbit, then free and occupied, then level.
pub const WIDTH: usize = ORBITS * 2 * LEVELS;

/// How many voxels of an orbit are free, and occupied, at each level.
pub type Features = [u8; WIDTH];

/// Orbit of the patch column `n`, counted as in the weights file (`di` outermost).
fn orbit(n: usize) -> usize {
    let [a, b] = [n / PATCH, n % PATCH].map(|d| d.abs_diff(PATCH / 2));
    match (a.max(b), a.min(b)) {
        (0, _) => 0,
        (1, least) => 1 + least,
        (_, least) => 3 + least,
    }
}

/// Features of a column; what lies outside the window is unknown.
pub fn features(step: &SweepUniform, columns: &[Column], index: usize) -> Features {
    let side = step.side as usize;
    let half = PATCH / 2;
    let mut counts = [0; WIDTH];
    for n in 0..PATCH * PATCH {
        // Wraps below zero, and is then not within the window.
        let i = (index / side + n / PATCH).wrapping_sub(half);
        let j = (index % side + n % PATCH).wrapping_sub(half);
        if i >= side || j >= side {
            continue;
        }
        let of_orbit = &mut counts[orbit(n) * 2 * LEVELS..][..2 * LEVELS];
        let mut state = columns[i * side + j][0];
        while state != 0 {
            let bit = state.trailing_zeros() as usize;
            of_orbit[bit / 16 * LEVELS + bit % 16] += 1;
            state &= state - 1;
        }
    }
    counts
}

/// Weights per orbit to weights per patch column, in the order of the weights file.
pub fn expand<T: Copy>(weights: &[T]) -> Vec<T> {
    (0..PATCH * PATCH)
        .flat_map(|n| &weights[orbit(n) * 2 * LEVELS..][..2 * LEVELS])
        .copied()
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orbits_have_their_sizes() {
        let mut sizes = [0; ORBITS];
        (0..25).for_each(|n| sizes[orbit(n)] += 1);
        assert_eq!(sizes, [1, 4, 4, 4, 8, 4]);
        assert_eq!(orbit(12), 0);
    }

    #[test]
    fn counts_of_a_corner() {
        let step = SweepUniform { side: 5, levels: 14, ..Default::default() };
        let mut columns = [[0; 2]; 25];
        columns[0] = [1 << 3 | 1 << (16 + 13), 1];
        columns[1] = [1, 0];
        columns[5] = [1, 0];
        let counts = features(&step, &columns, 0);
        assert_eq!((counts[3], counts[2 * LEVELS - 1], counts[2 * LEVELS]), (1, 1, 2));
        assert_eq!(counts.iter().map(|c| *c as u32).sum::<u32>(), 4);
        assert_eq!(features(&step, &columns, 24).iter().max(), Some(&0));
    }
}
