//! Sums over the returns of one piece of the splines, which touch the same basis functions.

use super::cholesky::CholeskySystem;
use crate::spline::{BASES_MAX, SUPPORT};

const PLANAR: usize = 5 * BASES_MAX;
const VERTICAL: usize = 2 * BASES_MAX;

/// The system of the plane and that of the height.
pub(super) type Planar = CholeskySystem<PLANAR, { PLANAR * PLANAR }>;
pub(super) type Vertical = CholeskySystem<VERTICAL, { VERTICAL * VERTICAL }>;

/// Number of terms that a return adds for a pair of basis functions, before their values.
pub(super) const TERMS: usize = 7;
const PAIRS: usize = SUPPORT * (SUPPORT + 1) / 2;

/// Sums over the returns of one piece of the splines.
pub(super) struct Piece {
    matrix: [[f64; PAIRS]; TERMS],
    vector: [[f64; SUPPORT]; 4],
}

impl Piece {
    pub const EMPTY: Piece = Piece { matrix: [[0.0; PAIRS]; TERMS], vector: [[0.0; SUPPORT]; 4] };

    pub fn add(&mut self, values: &[f64; SUPPORT], terms: &[f64; TERMS], rhs: &[f64; 4]) {
        let mut products = [0.0; PAIRS];
        let mut at = 0;
        for i in 0..SUPPORT {
            for j in 0..=i {
                products[at] = values[i] * values[j];
                at += 1;
            }
        }
        for (sums, term) in self.matrix.iter_mut().zip(terms) {
            for (sum, product) in sums.iter_mut().zip(&products) {
                *sum += term * product;
            }
        }
        for (sums, rhs) in self.vector.iter_mut().zip(rhs) {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += rhs * value;
            }
        }
    }

    pub fn flush(&mut self, first: usize, planar: &mut Planar, vertical: &mut Vertical) {
        let mut at = 0;
        for i in 0..SUPPORT {
            for j in 0..=i {
                let [xx, xy, yy, xh, yh, hh, zz] = core::array::from_fn(|t| self.matrix[t][at]);
                let block = [[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]];
                for (a, row) in block.iter().enumerate() {
                    for (b, &value) in row.iter().enumerate() {
                        if i > j || a >= b {
                            planar.add(3 * (first + i) + a, 3 * (first + j) + b, value);
                        }
                    }
                }
                vertical.add(first + i, first + j, zz);
                at += 1;
            }
            for d in 0..3 {
                planar.vector[3 * (first + i) + d] += self.vector[d][i];
            }
            vertical.vector[first + i] += self.vector[3][i];
        }
        *self = Piece::EMPTY;
    }
}
