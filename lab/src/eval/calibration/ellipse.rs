//! Covariance ellipses: how far out of them an error lies.

/// The smaller variance is taken to be at least this share of the larger: single precision cannot
/// distinguish a thinner ellipse from a line.
const THIN: f64 = 1e-6;

/// Content of the smallest ellipse of a covariance (xx, xy, yy) that contains an error, 0..1: if
/// the errors are normal with that covariance, it exceeds any `p` for a share `1 - p` of them. 1
/// for whatever no ellipse contains: an invalid covariance, or an error that is not a number.
pub fn content(error: [f32; 2], covariance: [f32; 3]) -> f64 {
    let d2 = squared_distance(error.map(f64::from), covariance.map(f64::from));
    // The chi-square distribution with two degrees of freedom.
    -(-0.5 * d2).exp_m1()
}

/// Squared Mahalanobis distance.
fn squared_distance([x, y]: [f64; 2], [xx, xy, yy]: [f64; 3]) -> f64 {
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let spread = half.hypot(xy);
    let (great, small) = (mean + spread, mean - spread);
    let sound = great > 0.0 && great.is_finite() && small >= -THIN * great;
    if !sound || !x.is_finite() || !y.is_finite() {
        return f64::INFINITY;
    }
    let (sin, cos) = (0.5 * xy.atan2(half)).sin_cos();
    let (along, across) = (x * cos + y * sin, y * cos - x * sin);
    along * along / great + across * across / small.max(THIN * great)
}

/// Standard deviation along one axis, the same for both: the root of half the trace.
pub fn deviation([xx, _, yy]: [f32; 3]) -> f32 {
    (0.5 * (xx + yy)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_by_the_inverse() {
        let [x, y, xx, xy, yy] = [0.3, -0.7, 2.0, 0.6, 0.5];
        let by_hand = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy);
        assert!((squared_distance([x, y], [xx, xy, yy]) - by_hand).abs() < 1e-12);
        // Along an axis, three deviations out.
        assert!((squared_distance([0.0, 1.5], [4.0, 0.0, 0.25]) - 9.0).abs() < 1e-12);
        // Tabulated quantiles of chi-square.
        for (d2, share) in [(2.279f32, 0.68), (5.991, 0.95)] {
            assert!((content([d2.sqrt(), 0.0], [1.0, 0.0, 1.0]) - share).abs() < 1e-4);
        }
        assert!((deviation([0.08, 0.5, 0.10]) - 0.3).abs() < 1e-7);
    }

    #[test]
    fn ellipses_as_thin_as_a_line() {
        // Variance along the diagonal only, in single precision.
        let line = [0.09f32, 0.09, 0.09];
        assert!((content([0.3, 0.3], line) - content([0.3, 0.0], [0.09, 0.0, 0.09])).abs() < 1e-3);
        assert!(content([0.3, -0.3], line) > 0.999_999);
        assert_eq!(content([0.0, 0.0], line), 0.0);
        let one_axis = [0.04f32, 0.0, 0.0];
        assert!(content([0.1, 0.0], one_axis) < 0.2 && content([0.0, 0.1], one_axis) == 1.0);
    }

    #[test]
    fn invalid_covariances_hold_nothing() {
        let none = [
            [0.0, 0.0, 0.0],
            [-1.0, 0.0, -1.0],
            [1.0, 2.0, 1.0],
            [1.0, 0.0, -0.5],
            [f32::NAN, 0.0, 1.0],
            [f32::INFINITY, 0.0, 1.0],
        ];
        for covariance in none {
            assert_eq!(content([0.0, 0.0], covariance), 1.0, "{covariance:?}");
        }
        for error in [[f32::NAN, 0.0], [0.0, f32::INFINITY]] {
            assert_eq!(content(error, [1.0, 0.0, 1.0]), 1.0);
        }
    }
}
