//! Eigenvalues of small symmetric matrices by Jacobi's rotations.

/// Sweeps over all off-diagonal elements; six bring any matrix of size six to rounding.
const SWEEPS: usize = 12;
/// An element this small beside those of the diagonal is rounding.
const NOTHING: f64 = 1e-17;

/// Eigenvalues in rising order and their unit eigenvectors (`vectors[k]` belongs to `values[k]`) of
/// a symmetric matrix with finite elements.
pub fn symmetric<const N: usize>(mut a: [[f64; N]; N]) -> ([f64; N], [[f64; N]; N]) {
    // Rows of `v` become the eigenvectors.
    let mut v = [[0.0; N]; N];
    for (i, row) in v.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for _ in 0..SWEEPS {
        let mut rotated = false;
        for p in 0..N {
            for q in p + 1..N {
                rotated |= rotate(&mut a, &mut v, p, q);
            }
        }
        if !rotated {
            break;
        }
    }
    let mut order: [usize; N] = std::array::from_fn(|i| i);
    order.sort_by(|i, j| a[*i][*i].total_cmp(&a[*j][*j]));
    (order.map(|i| a[i][i]), order.map(|i| v[i]))
}

/// One rotation in the plane of axes p and q that makes element (p, q) zero, unless it is nothing
/// beside the diagonal already. Returns whether it was needed.
fn rotate<const N: usize>(
    a: &mut [[f64; N]; N],
    v: &mut [[f64; N]; N],
    p: usize,
    q: usize,
) -> bool {
    if a[p][q].abs() <= NOTHING * (a[p][p].abs() + a[q][q].abs()) {
        return false;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    for k in 0..N {
        (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
        (v[p][k], v[q][k]) = (c * v[p][k] - s * v[q][k], s * v[p][k] + c * v[q][k]);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_matrix_and_the_definition() {
        let (values, _) = symmetric([[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, -5.0]]);
        assert!(values.iter().zip([-5.0, 1.0, 3.0]).all(|(a, b)| (a - b).abs() < 1e-12));
        let a: [[f64; 6]; 6] = std::array::from_fn(|i| {
            std::array::from_fn(|j| ((i * j + i + j) as f64).sin() + if i == j { 3.0 } else { 0.0 })
        });
        let (values, vectors) = symmetric(a);
        assert!(values.is_sorted());
        for (value, vector) in values.iter().zip(vectors) {
            for (row, component) in a.iter().zip(vector) {
                let product: f64 = row.iter().zip(vector).map(|(x, y)| x * y).sum();
                assert!((product - value * component).abs() < 1e-12);
            }
        }
        assert_eq!(symmetric([[0.0; 3]; 3]).0, [0.0; 3]);
    }
}
