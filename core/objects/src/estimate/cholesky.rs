//! A dense symmetric system of equations of fixed capacity: small once the model points are
//! eliminated.

/// `A x = b` of a size set at run time, at most `N`; `L` is `N * N`.
pub(super) struct CholeskySystem<const N: usize, const L: usize> {
    size: usize,
    /// Lower triangle by rows; after [`CholeskySystem::solve`] its Cholesky factor.
    matrix: [f64; L],
    /// Right-hand side; after [`CholeskySystem::solve`] the solution.
    pub vector: [f64; N],
    scale: [f64; N],
}

impl<const N: usize, const L: usize> CholeskySystem<N, L> {
    pub const fn new() -> CholeskySystem<N, L> {
        assert!(N * N == L);
        CholeskySystem { size: 0, matrix: [0.0; L], vector: [0.0; N], scale: [0.0; N] }
    }

    pub fn clear(&mut self, size: usize) {
        self.size = size;
        self.matrix[..size * size].fill(0.0);
        self.vector[..size].fill(0.0);
    }

    /// Adds to an element and its mirror image.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        self.matrix[i.max(j) * self.size + i.min(j)] += value;
    }

    /// Eliminates an unknown whose own element is `diagonal`, with the right-hand side `rhs`:
    /// subtracts `row row' / diagonal` from the block that begins at `from`.
    pub fn eliminate(&mut self, from: usize, row: &[f64], diagonal: f64, rhs: f64) {
        for (i, &own) in row.iter().enumerate() {
            let factor = own / diagonal;
            let at = (from + i) * self.size + from;
            for (element, other) in self.matrix[at..=at + i].iter_mut().zip(row) {
                *element -= factor * other;
            }
        }
        let share = rhs / diagonal;
        for (sum, value) in self.vector[from..].iter_mut().zip(row) {
            *sum -= share * value;
        }
    }

    /// Multiplies the diagonal by `1 + share`.
    pub fn damp(&mut self, share: f64) {
        for i in 0..self.size {
            let at = i * self.size + i;
            self.matrix[at] *= 1.0 + share;
        }
    }

    /// Solves by Cholesky factorisation after scaling the diagonal to ones. A pivot below `least`,
    /// of a direction that nothing determines, is raised to it: the solution then hardly moves in
    /// that direction. False if the solution is not finite.
    pub fn solve(&mut self, least: f64) -> bool {
        let n = self.size;
        for i in 0..n {
            let diagonal = self.matrix[i * n + i];
            self.scale[i] = if diagonal > 0.0 { 1.0 / libm::sqrt(diagonal) } else { 1.0 };
        }
        for i in 0..n {
            let (above, rest) = self.matrix.split_at_mut(i * n);
            let row = &mut rest[..=i];
            for (element, scale) in row.iter_mut().zip(&self.scale) {
                *element *= scale * self.scale[i];
            }
            for j in 0..i {
                let other = &above[j * n..=j * n + j];
                let sum = row[j] - dot(&row[..j], &other[..j]);
                row[j] = sum * other[j];
            }
            let pivot = row[i] - dot(&row[..i], &row[..i]);
            // The reciprocal of the factor's diagonal is stored in its place.
            row[i] = 1.0 / libm::sqrt(if pivot > least { pivot } else { least });
        }
        for i in 0..n {
            let row = &self.matrix[i * n..=i * n + i];
            let sum = self.vector[i] * self.scale[i] - dot(&row[..i], &self.vector[..i]);
            self.vector[i] = sum * row[i];
        }
        for i in (0..n).rev() {
            let solved = self.vector[i] * self.matrix[i * n + i];
            self.vector[i] = solved;
            for j in 0..i {
                self.vector[j] -= self.matrix[i * n + j] * solved;
            }
        }
        for (value, scale) in self.vector[..n].iter_mut().zip(&self.scale) {
            *value *= scale;
        }
        self.vector[..n].iter().all(|value| value.is_finite())
    }
}

/// Four partial sums, so that no addition waits for the previous one.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let tail: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a4.zip(b4) {
        for i in 0..4 {
            sums[i] += x[i] * y[i];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + tail
}

#[cfg(test)]
pub(super) mod tests {
    extern crate std;
    use super::*;
    use crate::random::Random;
    use std::vec;
    use std::vec::Vec;

    /// Gaussian elimination with pivoting, of rows that end with the right-hand side.
    pub fn gauss(mut rows: Vec<Vec<f64>>) -> Vec<f64> {
        let n = rows.len();
        for i in 0..n {
            let best = (i..n).max_by(|&a, &b| rows[a][i].abs().total_cmp(&rows[b][i].abs()));
            rows.swap(i, best.unwrap());
            let pivot = rows[i].clone();
            for row in &mut rows[i + 1..] {
                let factor = row[i] / pivot[i];
                for (value, pivot) in row.iter_mut().zip(&pivot).skip(i) {
                    *value -= factor * pivot;
                }
            }
        }
        let mut x = vec![0.0; n];
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|j| rows[i][j] * x[j]).sum();
            x[i] = (rows[i][n] - known) / rows[i][i];
        }
        x
    }

    #[test]
    fn agrees_with_elimination() {
        let mut random = Random(9);
        let mut system = CholeskySystem::<23, 529>::new();
        for n in [1, 2, 7, 23] {
            system.clear(n);
            let mut rows = vec![vec![0.0; n + 1]; n];
            // Squares of random rows, with weights as far apart as the precisions are.
            for k in 0..2 * n {
                let row: Vec<f64> = (0..n).map(|_| random.normal()).collect();
                let weight = if k % 2 == 0 { 1e6 } else { 4.0 };
                for i in 0..n {
                    for j in 0..n {
                        rows[i][j] += weight * row[i] * row[j];
                        if j <= i {
                            system.add(j, i, weight * row[i] * row[j]);
                        }
                    }
                }
            }
            for (row, value) in rows.iter_mut().zip(&mut system.vector) {
                row[n] = random.normal();
                *value = row[n];
            }
            assert!(system.solve(1e-12));
            for (ours, known) in system.vector.iter().zip(gauss(rows)) {
                assert!((ours - known).abs() < 1e-7 * (known.abs() + 1e-3), "{ours} {known}");
            }
        }
    }

    #[test]
    fn barely_moves_along_undetermined_directions() {
        let mut system = CholeskySystem::<2, 4>::new();
        system.clear(2);
        for (i, j) in [(0, 0), (1, 0), (1, 1)] {
            system.add(i, j, 1.0);
        }
        system.vector = [1.0, 1.0];
        assert!(system.solve(1e-10));
        assert!((system.vector[0] + system.vector[1] - 1.0).abs() < 1e-6);
        assert!(system.vector[1].abs() < 1e-3);
        system.clear(2);
        system.vector[0] = f64::NAN;
        assert!(!system.solve(1e-10));
    }
}
