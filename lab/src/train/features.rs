//! The classifier's view of a column, with or without the symmetry of the square built in.
//!
//! The lattice can have any heading relative to the street, so a patch rotated by a quarter turn or
//! mirrored is as likely as the patch itself. The loss of a linear classifier is convex: averaged
//! over the eight symmetries its minimum is symmetric. Fitting one weight per orbit of patch
//! columns, to counts of voxels, therefore finds the minimum that augmenting the samples eightfold
//! would find.

use raywake_core::record::{Column, SweepUniform};
use raywake_core::stages::background_filter::PATCH;

/// Levels the filter is trained for.
pub const LEVELS: usize = 14;

/// Which columns of the patch share their weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WeightTying {
    /// Those that the square's symmetries map onto each other.
    Square,
    /// None, as in (3.6): a weight for every voxel and state.
    Untied,
}

/// Orbit of the patch column `n`, numbered as in the weights file (`di` outermost).
fn orbit(n: usize) -> usize {
    let [a, b] = [n / PATCH, n % PATCH].map(|d| d.abs_diff(PATCH / 2));
    match (a.max(b), a.min(b)) {
        (0, _) => 0,
        (1, least) => 1 + least,
        (_, least) => 3 + least,
    }
}

impl WeightTying {
    /// Set of patch columns sharing weights that column `n` belongs to.
    fn set(self, n: usize) -> usize {
        match self {
            WeightTying::Square => orbit(n),
            WeightTying::Untied => n,
        }
    }

    /// Number of counts per sample: by set, then free and occupied, then level.
    pub fn width(self) -> usize {
        (1 + self.set(PATCH * PATCH - 1)) * 2 * LEVELS
    }

    /// How many voxels of a set are free, and occupied, at each level around a column; everything
    /// outside the window is unknown.
    pub fn features(self, step: &SweepUniform, columns: &[Column], index: usize) -> Vec<u8> {
        let side = step.side as usize;
        let half = PATCH / 2;
        let mut counts = vec![0; self.width()];
        for n in 0..PATCH * PATCH {
            // Wraps below zero, and is then outside the window.
            let i = (index / side + n / PATCH).wrapping_sub(half);
            let j = (index % side + n % PATCH).wrapping_sub(half);
            if i >= side || j >= side {
                continue;
            }
            let of_set = &mut counts[self.set(n) * 2 * LEVELS..][..2 * LEVELS];
            let mut state = columns[i * side + j][0];
            while state != 0 {
                let bit = state.trailing_zeros() as usize;
                of_set[bit / 16 * LEVELS + bit % 16] += 1;
                state &= state - 1;
            }
        }
        counts
    }

    /// Expands weights per set to weights per patch column, in the order of the weights file.
    pub fn expand<T: Copy>(self, weights: &[T]) -> Vec<T> {
        (0..PATCH * PATCH)
            .flat_map(|n| &weights[self.set(n) * 2 * LEVELS..][..2 * LEVELS])
            .copied()
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orbits_have_their_sizes() {
        let mut sizes = [0; 6];
        (0..25).for_each(|n| sizes[orbit(n)] += 1);
        assert_eq!(sizes, [1, 4, 4, 4, 8, 4]);
        assert_eq!(orbit(12), 0);
        let widths = [WeightTying::Square, WeightTying::Untied].map(WeightTying::width);
        assert_eq!(widths, [6 * 28, 700]);
    }

    #[test]
    fn counts_of_a_corner() {
        let step = SweepUniform { side: 5, levels: 14, ..Default::default() };
        let mut columns = [[0; 2]; 25];
        columns[0] = [1 << 3 | 1 << (16 + 13), 1];
        columns[1] = [1, 0];
        columns[5] = [1, 0];
        let counts = WeightTying::Square.features(&step, &columns, 0);
        assert_eq!((counts[3], counts[2 * LEVELS - 1], counts[2 * LEVELS]), (1, 1, 2));
        assert_eq!(counts.iter().map(|c| *c as u32).sum::<u32>(), 4);
        assert_eq!(WeightTying::Square.features(&step, &columns, 24).iter().max(), Some(&0));
        // The corner is the patch's centre, column 12; the others are 13 and 17.
        let bits = WeightTying::Untied.features(&step, &columns, 0);
        let set: Vec<usize> = (0..700).filter(|n| bits[*n] == 1).collect();
        let expected = [12 * 28 + 3, 12 * 28 + 27, 13 * 28, 17 * 28];
        assert_eq!((set, bits.iter().max()), (expected.to_vec(), Some(&1)));
    }
}
