//! B-splines of degree 4 on uniform knots (2.5.2.1).
//!
//! The knots continue evenly for four spacings beyond either end of the domain, so that every basis
//! function has the same shape and every time of the domain is covered by five of them. A spline of
//! `n` basis functions has `n - 4` pieces.

/// Degree of the polynomials.
pub const DEGREE: usize = 4;
/// Number of basis functions that are nonzero at a time.
pub const SUPPORT: usize = DEGREE + 1;
/// Maximum number of basis functions of a spline.
pub const BASES_MAX: usize = 64;
/// Shortest domain, s, so that returns at a single instant have a basis.
pub const DOMAIN_MIN_S: f64 = 0.1;

/// A domain that exceeds a whole number of spacings by less than this still has that number.
const ROUNDING: f64 = 1e-9;

/// Uniform knots.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Knots {
    start: f64,
    spacing: f64,
    pieces: usize,
}

/// The basis functions at a time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Basis {
    /// Index of the first one that is nonzero there.
    pub first: usize,
    /// Its value, and those of the four after it.
    pub values: [f64; SUPPORT],
}

impl Basis {
    /// Returns the first four elements, position and heading, of splines with the given control
    /// points.
    pub fn pose<const D: usize>(&self, control_points: &[[f64; D]]) -> [f64; 4] {
        let mut pose = [0.0; 4];
        for (control_point, value) in control_points[self.first..].iter().zip(self.values) {
            for (sum, element) in pose.iter_mut().zip(control_point) {
                *sum += element * value;
            }
        }
        pose
    }
}

impl Knots {
    /// No knots: no spline uses these.
    pub const NONE: Knots = Knots { start: 0.0, spacing: 0.0, pieces: 0 };

    /// One basis function for every `every` seconds from `start` to `end`, at least five and at
    /// most [`BASES_MAX`].
    pub fn over(start: f64, end: f64, every: f64) -> Knots {
        let domain = (end - start).max(DOMAIN_MIN_S);
        let wanted = libm::ceil(domain / every - ROUNDING);
        let bases = wanted.clamp(SUPPORT as f64, BASES_MAX as f64);
        let pieces = bases as usize - DEGREE;
        Knots { start, spacing: domain / pieces as f64, pieces }
    }

    /// The given number of pieces of the given length.
    pub fn pieces(start: f64, spacing: f64, pieces: usize) -> Knots {
        Knots { start, spacing, pieces: pieces.clamp(1, BASES_MAX - DEGREE) }
    }

    /// Number of basis functions.
    pub fn bases(&self) -> usize {
        self.pieces + DEGREE
    }

    /// Number of polynomial pieces of the domain.
    pub fn spans(&self) -> usize {
        self.pieces
    }

    /// Length of a piece, s.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// First time of the domain, s.
    pub fn start(&self) -> f64 {
        self.start
    }

    /// Last time of the domain, s.
    pub fn end(&self) -> f64 {
        self.start + self.pieces as f64 * self.spacing
    }

    /// Knot `i` of `bases() + 5`, s.
    pub fn knot(&self, i: usize) -> f64 {
        self.start + (i as f64 - DEGREE as f64) * self.spacing
    }

    /// Mean of the knots inside basis function `i`, s (Greville abscissa): the spline with these
    /// for control points is the time.
    pub fn centre(&self, i: usize) -> f64 {
        self.knot(i) + 0.5 * SUPPORT as f64 * self.spacing
    }

    /// The piece that `time` falls into, and the position in it, 0 to 1. Times outside the domain
    /// are clamped to its ends.
    fn locate(&self, time: f64) -> (usize, f64) {
        let at = ((time - self.start) / self.spacing).clamp(0.0, self.pieces as f64);
        let piece = (at as usize).min(self.pieces - 1);
        (piece, at - piece as f64)
    }

    /// Basis functions at `time` (2.16, 2.17).
    pub fn basis(&self, time: f64) -> Basis {
        let (first, u) = self.locate(time);
        Basis { first, values: cox_de_boor::<DEGREE>(u) }
    }

    /// Values and derivatives (1/s) of the basis functions at `u`, 0 to 1, of every piece.
    pub fn shape(&self, u: f64) -> ([f64; SUPPORT], [f64; SUPPORT]) {
        let lower = cox_de_boor::<{ DEGREE - 1 }>(u);
        let rate = 1.0 / self.spacing;
        let mut slopes = [0.0; SUPPORT];
        for (i, slope) in slopes.iter_mut().enumerate() {
            let before = if i > 0 { lower[i - 1] } else { 0.0 };
            let after = if i < DEGREE { lower[i] } else { 0.0 };
            *slope = (before - after) * rate;
        }
        (cox_de_boor::<DEGREE>(u), slopes)
    }

    /// Splines with the given control points at `time`, by de Boor's algorithm (2.19 to 2.21).
    pub fn value<const D: usize>(&self, control_points: &[[f64; D]], time: f64) -> [f64; D] {
        let (first, u) = self.locate(time);
        let mut d: [[f64; D]; SUPPORT] = core::array::from_fn(|i| control_points[first + i]);
        for r in 1..=DEGREE {
            for i in (r..=DEGREE).rev() {
                let alpha = (u + (DEGREE - i) as f64) / (SUPPORT - r) as f64;
                let before = d[i - 1];
                for (own, before) in d[i].iter_mut().zip(before) {
                    *own = (1.0 - alpha) * before + alpha * *own;
                }
            }
        }
        d[DEGREE]
    }
}

/// Basis functions of degree `P` that are nonzero at `u`, 0 to 1, of a piece, in order; followed by
/// zeros.
fn cox_de_boor<const P: usize>(u: f64) -> [f64; SUPPORT] {
    let mut values = [0.0; SUPPORT];
    values[0] = 1.0;
    for p in 1..=P {
        let mut carried = 0.0;
        for (r, value) in values[..p].iter_mut().enumerate() {
            let share = *value / p as f64;
            *value = carried + ((r + 1) as f64 - u) * share;
            carried = (u + (p - r - 1) as f64) * share;
        }
        values[p] = carried;
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// (2.16) and (2.17) as written.
    fn defined(knots: &Knots, i: usize, p: usize, x: f64) -> f64 {
        let t = |i| knots.knot(i);
        if p == 0 {
            return if t(i) <= x && x < t(i + 1) { 1.0 } else { 0.0 };
        }
        (x - t(i)) / (t(i + p) - t(i)) * defined(knots, i, p - 1, x)
            + (t(i + p + 1) - x) / (t(i + p + 1) - t(i + 1)) * defined(knots, i + 1, p - 1, x)
    }

    #[test]
    fn basis_is_that_of_the_recursion() {
        let mut random = Random(3);
        for (start, end) in [(0.0, 6.05), (-3.0, 1.0), (100.0, 100.4)] {
            let knots = Knots::over(start, end, 0.5);
            for _ in 0..200 {
                let time = start + (end - start) * random.uniform();
                let basis = knots.basis(time);
                for i in 0..knots.bases() {
                    let value = i
                        .checked_sub(basis.first)
                        .and_then(|i| basis.values.get(i))
                        .unwrap_or(&0.0);
                    assert!((value - defined(&knots, i, DEGREE, time)).abs() < 1e-9, "{i} {time}");
                }
            }
        }
    }

    #[test]
    fn basis_sums_to_one_and_holds_ends() {
        let knots = Knots::over(2.0, 8.0, 0.5);
        assert_eq!((knots.bases(), knots.start(), knots.end()), (12, 2.0, 8.0));
        for i in -20..=120 {
            let basis = knots.basis(2.0 + 0.06 * f64::from(i));
            assert!((basis.values.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            assert!(basis.first + SUPPORT <= knots.bases());
        }
        assert_eq!(knots.basis(0.0), knots.basis(2.0));
        assert_eq!(knots.basis(9.0), knots.basis(8.0));
    }

    #[test]
    fn slopes_are_differences() {
        let knots = Knots::over(0.0, 3.0, 0.25);
        let step = 1e-6;
        for i in 1..50 {
            let u = f64::from(i) / 50.0;
            let (values, slopes) = knots.shape(u);
            let (more, _) = knots.shape(u + step);
            let (less, _) = knots.shape(u - step);
            let basis = knots.basis(u * knots.spacing()).values;
            for k in 0..SUPPORT {
                let slope = (more[k] - less[k]) / (2.0 * step * knots.spacing());
                assert!((slope - slopes[k]).abs() < 1e-7);
                assert!((values[k] - basis[k]).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn de_boor_is_the_weighted_sum() {
        let mut random = Random(4);
        let knots = Knots::over(-1.0, 9.3, 0.5);
        let mut weights = [[0.0; 2]; BASES_MAX];
        weights.as_flattened_mut().fill_with(|| random.normal());
        for _ in 0..200 {
            let time = -2.0 + 12.0 * random.uniform();
            let basis = knots.basis(time);
            let value = knots.value(&weights, time);
            for d in 0..2 {
                let sum: f64 =
                    (0..SUPPORT).map(|i| basis.values[i] * weights[basis.first + i][d]).sum();
                assert!((sum - value[d]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn short_tracks_compress_and_long_ones_stretch() {
        let bases = |domain: f64| Knots::over(0.0, domain, 0.5).bases();
        assert_eq!(bases(0.0), 5);
        assert_eq!(bases(2.4), 5);
        assert_eq!(bases(2.5), 5);
        assert_eq!(bases(2.6), 6);
        assert_eq!(bases(32.0), BASES_MAX);
        assert_eq!(bases(1e6), BASES_MAX);
        let knots = Knots::over(5.0, 5.0, 0.5);
        assert_eq!(knots.end(), 5.0 + DOMAIN_MIN_S);
    }
}
