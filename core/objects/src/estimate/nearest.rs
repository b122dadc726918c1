//! Nearest model point (2.5.1.3): a grid of columns over the model, in fixed memory.

/// Number of cells along an axis.
const SIDE: usize = 64;
/// Points per cell: few, as they lie along an outline.
const POINTS_PER_CELL: f32 = 0.5;

/// Shortest edge of a cell, m.
const CELL_MIN_M: f32 = 0.01;
/// A search radius is widened by this factor, and by this many metres: rounding moves distances and
/// cells by less.
const WIDER: f32 = 1.0001;
const WIDER_M: f32 = 1e-5;

/// Points sorted by the cell they lie in.
pub(super) struct NearestGrid<const N: usize> {
    low: [f32; 2],
    per_m: f32,
    cell_m: f32,
    size: [usize; 2],
    starts: [u16; SIDE * SIDE + 1],
    points: [[f32; 3]; N],
    numbers: [u16; N],
    count: usize,
}

impl<const N: usize> NearestGrid<N> {
    pub const fn new() -> NearestGrid<N> {
        NearestGrid {
            low: [0.0; 2],
            per_m: 0.0,
            cell_m: 0.0,
            size: [0; 2],
            starts: [0; SIDE * SIDE + 1],
            points: [[0.0; 3]; N],
            numbers: [0; N],
            count: 0,
        }
    }

    /// Takes the first `N` of `points`, which are finite.
    pub fn fill(&mut self, points: &[[f32; 3]]) {
        let points = &points[..points.len().min(N)];
        self.count = points.len();
        let (mut low, mut high) = ([f32::MAX; 2], [f32::MIN; 2]);
        for point in points {
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        if points.is_empty() {
            return;
        }
        let extent = [high[0] - low[0], high[1] - low[1]];
        let by_count = libm::sqrtf(extent[0] * extent[1] * POINTS_PER_CELL / points.len() as f32);
        let by_side = extent[0].max(extent[1]) / (SIDE - 1) as f32;
        self.cell_m = by_count.max(by_side).max(CELL_MIN_M);
        self.per_m = 1.0 / self.cell_m;
        self.low = low;
        self.size = extent.map(|extent| ((extent * self.per_m) as usize + 1).min(SIDE));
        let cells = self.size[0] * self.size[1];
        self.starts[..=cells].fill(0);
        for point in points {
            let cell = self.cell(point);
            self.starts[cell + 1] += 1;
        }
        for i in 0..cells {
            self.starts[i + 1] += self.starts[i];
        }
        for (number, point) in points.iter().enumerate() {
            let cell = self.cell(point);
            let at = self.starts[cell] as usize;
            self.starts[cell] += 1;
            self.points[at] = *point;
            self.numbers[at] = number as u16;
        }
        for i in (1..=cells).rev() {
            self.starts[i] = self.starts[i - 1];
        }
        self.starts[0] = 0;
    }

    fn coordinate(&self, axis: usize, value: f32) -> usize {
        // The conversion to an integer saturates: whatever is below the grid is in its first cell.
        (((value - self.low[axis]) * self.per_m) as usize).min(self.size[axis] - 1)
    }

    fn cell(&self, point: &[f32; 3]) -> usize {
        self.coordinate(1, point[1]) * self.size[0] + self.coordinate(0, point[0])
    }

    /// Number and squared distance of the point nearest to `at`; of equally near ones, the first.
    /// None without points, or if no squared distance is finite. `guess` is a squared distance that
    /// some point is known to have, which shortens the search.
    pub fn find(&self, at: [f32; 3], guess: f32) -> Option<(u16, f32)> {
        if self.count == 0 || !at.iter().all(|value| value.is_finite()) {
            return None;
        }
        let (mut best, mut number) = (f32::MAX, u16::MAX);
        let mut reach = libm::sqrtf(guess).min(self.cell_m);
        let whole = (self.cell_m * (2 * SIDE) as f32 + reach + self.outside(at)).min(f32::MAX);
        loop {
            let wide = reach * WIDER + WIDER_M;
            let left = self.coordinate(0, at[0] - wide);
            let right = self.coordinate(0, at[0] + wide);
            let below = self.coordinate(1, at[1] - wide);
            let above = self.coordinate(1, at[1] + wide);
            for y in below..=above {
                let row = y * self.size[0];
                let range = self.starts[row + left] as usize..self.starts[row + right + 1] as usize;
                for (point, &n) in self.points[range.clone()].iter().zip(&self.numbers[range]) {
                    let d = square_distance(point, &at);
                    if d < best || (d == best && n < number) {
                        (best, number) = (d, n);
                    }
                }
            }
            if best <= reach * reach || reach > whole {
                return (number != u16::MAX).then_some((number, best));
            }
            // The nearest of all is no farther than the best of these.
            reach = if best < f32::MAX { libm::sqrtf(best) } else { 2.0 * reach };
            if best < f32::MAX {
                reach *= WIDER;
            }
        }
    }

    /// How far `at` lies outside the grid, m.
    fn outside(&self, at: [f32; 3]) -> f32 {
        let mut far = 0f32;
        for ((low, size), at) in self.low.iter().zip(self.size).zip(at) {
            let high = low + size as f32 * self.cell_m;
            far = far.max(low - at).max(at - high);
        }
        far
    }
}

/// Squared distance, m².
pub(super) fn square_distance(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::random::Random;
    use std::vec::Vec;

    fn brute(points: &[[f32; 3]], at: [f32; 3]) -> (u16, f32) {
        let (mut best, mut number) = (f32::MAX, 0);
        for (i, point) in points.iter().enumerate() {
            let d = square_distance(point, &at);
            if d < best {
                (best, number) = (d, i as u16);
            }
        }
        (number, best)
    }

    #[test]
    fn equals_that_of_brute_force() {
        let mut random = Random(1);
        let mut grid = raywake_alloc_guard::boxed!(NearestGrid<300>, NearestGrid::new());
        for (count, size) in [(1, 1.0), (2, 0.0), (40, 3.0), (300, 5.0), (300, 0.01), (300, 900.0)]
        {
            // On a lattice, so that there are ties.
            let points: Vec<[f32; 3]> = (0..count)
                .map(|_| [0, 1, 2].map(|_| libm::roundf(random.between(-8.0, 8.0)) * size / 8.0))
                .collect();
            grid.fill(&points);
            for _ in 0..300 {
                let at = [0, 1, 2].map(|_| libm::roundf(random.between(-24.0, 24.0)) * size / 16.0);
                let expected = brute(&points, at);
                let guess = square_distance(&points[random.below(count)], &at);
                assert_eq!(grid.find(at, guess), Some(expected), "{count} {size} {at:?}");
                assert_eq!(grid.find(at, f32::MAX), Some(expected), "{count} {size} {at:?}");
            }
        }
        for at in [[f32::NAN, 0.0, 0.0], [f32::INFINITY; 3], [1e30, 0.0, 0.0], [0.0, 0.0, -1e38]] {
            assert_eq!(grid.find(at, f32::MAX), None, "{at:?}");
        }
        grid.fill(&[]);
        assert_eq!(grid.find([0.0; 3], f32::MAX), None);
    }
}
