//! The unevenness of the ground: too small to affect whoever stands on it, but seen by the laser.

use crate::rng::Rng;

/// Widths of the bumps, m, and their share of the height.
const WAVES: [(f64, f64); 2] = [(0.35, 0.4), (2.3, 0.6)];

/// A number in [-1, 1) for a lattice point.
fn at_lattice(x: i64, y: i64, wave: usize) -> f64 {
    let key = (x as u64) ^ (y as u64).rotate_left(24) ^ (wave as u64).rotate_left(56);
    2.0 * Rng::new(key).unit() - 1.0
}

/// Bilinear interpolation between the points of a random lattice.
fn bumps(x: f64, y: f64, wave: usize) -> f64 {
    let (fx, fy) = (x.floor(), y.floor());
    let (u, v) = (x - fx, y - fy);
    let (i, j) = (fx as i64, fy as i64);
    let row = |j: i64| (1.0 - u) * at_lattice(i, j, wave) + u * at_lattice(i + 1, j, wave);
    (1.0 - v) * row(j) + v * row(j + 1)
}

/// Height of the bumps at a place in the street frame, from -1 to 1.
pub(crate) fn roughness(x: f64, y: f64) -> f64 {
    let wave = |(n, (width, share)): (usize, &(f64, f64))| share * bumps(x / width, y / width, n);
    WAVES.iter().enumerate().map(wave).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounded_continuous_and_rough() {
        let (mut square, mut last) = (0.0, roughness(-5.0, 3.1));
        for i in 1..10_000 {
            let r = roughness(-5.0 + 0.01 * f64::from(i), 3.1);
            assert!(r.abs() <= 1.0 && (r - last).abs() < 0.06);
            square += r * r / 1e4;
            last = r;
        }
        assert!((0.02..0.4).contains(&square), "{square}");
    }
}
