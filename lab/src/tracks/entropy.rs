//! Crispness of a cloud: the entropy of Sheehan, Harrison and Newman (2.6.4).

use raywake_sim::Rng;
use std::collections::HashMap;
use std::f64::consts::PI;

/// Sigma of 2.6.4, m.
pub const SIGMA_M: f64 = 0.05;

/// Pairs farther apart than this many sigmas are left out: each would have added less than e^-16 of
/// what a pair at distance zero adds. The resulting error of the entropy is less than e^-16 divided
/// by the mean of all pairs in the same unit: 1e-4 nats for a cloud of entropy 2.
const CUT_SIGMAS: f64 = 8.0;

/// Maximum number of points whose pairs are summed.
const SAMPLE: usize = 10_000;

type Point = [f32; 3];

/// Entropy of a cloud, nats; NaN if it is empty or a point is not finite.
///
/// From a cloud of more than [`SAMPLE`] points that many are drawn (the same indices for clouds of
/// equal size), and the mean over their pairs replaces the mean over all pairs of different points;
/// pairs of a point with itself count by their share in the whole cloud.
pub fn entropy(cloud: &[Point]) -> f64 {
    if cloud.is_empty() || cloud.iter().flatten().any(|v| !v.is_finite()) {
        return f64::NAN;
    }
    let sample = sample(cloud);
    let (n, m) = (cloud.len() as f64, sample.len() as f64);
    let others = if m > 1.0 { 2.0 * pairs(sample) / (m * (m - 1.0)) } else { 0.0 };
    let alone = 1.0 / n;
    let peak = (4.0 * PI * SIGMA_M * SIGMA_M).powf(-1.5);
    -(peak * (alone + (1.0 - alone) * others)).ln()
}

/// The points whose pairs are summed: a fixed draw without replacement.
fn sample(cloud: &[Point]) -> Vec<Point> {
    let mut points = cloud.to_vec();
    if points.len() > SAMPLE {
        let mut rng = Rng::new(0xE47);
        for n in 0..SAMPLE {
            let left = points.len() - n;
            points.swap(n, n + (rng.unit() * left as f64) as usize);
        }
        points.truncate(SAMPLE);
    }
    points
}

/// Sum of exp(-d² / 4 sigma²) over pairs of different points, each pair once.
fn pairs(mut points: Vec<Point>) -> f64 {
    let cut = CUT_SIGMAS * SIGMA_M;
    let cell = |p: &Point| p.map(|v| (f64::from(v) / cut).floor() as i64);
    points.sort_unstable_by_key(cell);
    let mut cells: HashMap<[i64; 3], &[Point]> = HashMap::new();
    for points in points.chunk_by(|a, b| cell(a) == cell(b)) {
        cells.insert(cell(&points[0]), points);
    }
    let (scale, cut2) = ((-0.25 / (SIGMA_M * SIGMA_M)) as f32, (cut * cut) as f32);
    let between = |a: &Point, rest: &[Point]| -> f64 {
        let near = rest.iter().map(|b| [0, 1, 2].map(|i| a[i] - b[i]));
        let near = near.map(|d| d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).filter(|d2| *d2 < cut2);
        near.map(|d2| f64::from((scale * d2).exp())).sum()
    };
    let mut sum = 0.0;
    for points in points.chunk_by(|a, b| cell(a) == cell(b)) {
        for (n, a) in points.iter().enumerate() {
            sum += between(a, &points[n + 1..]);
        }
        let here = cell(&points[0]);
        // Half of the neighbours: the others have this cell as theirs.
        for step in (-1..=1).flat_map(|x| (-1..=1).map(move |y| [x, y])) {
            for z in -1..=1 {
                let step = [step[0], step[1], z];
                if step <= [0; 3] {
                    continue;
                }
                let there = [0, 1, 2].map(|i| here[i] + step[i]);
                if let Some(rest) = cells.get(&there) {
                    sum += points.iter().map(|a| between(a, rest)).sum::<f64>();
                }
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the definition.
    fn defined(cloud: &[Point]) -> f64 {
        let variance = 2.0 * SIGMA_M * SIGMA_M;
        let normal = |a: &Point, b: &Point| {
            let d2: f64 = (0..3).map(|i| f64::from(a[i] - b[i]).powi(2)).sum();
            (2.0 * PI * variance).powf(-1.5) * (-0.5 * d2 / variance).exp()
        };
        let sum: f64 = cloud.iter().flat_map(|a| cloud.iter().map(|b| normal(a, b))).sum();
        -(sum / (cloud.len() as f64).powi(2)).ln()
    }

    /// Two walls of a car's size, `noise` m thick.
    fn walls(count: usize, noise: f64) -> Vec<Point> {
        let mut rng = Rng::new(5);
        let mut wall = |n: usize| {
            let (along, up) = (rng.range(-2.0, 2.0), rng.range(0.0, 1.5));
            let off = noise * rng.bell();
            if n.is_multiple_of(3) { [off - 2.0, 0.4 * along, up] } else { [along, off - 0.8, up] }
        };
        (0..count).map(|n| wall(n).map(|v| v as f32)).collect()
    }

    #[test]
    fn equals_the_double_sum() {
        for (count, noise) in [(1, 0.0), (2, 0.1), (1500, 0.02), (1500, 0.2)] {
            let cloud = walls(count, noise);
            let (fast, exact) = (entropy(&cloud), defined(&cloud));
            assert!((fast - exact).abs() < 2e-4, "{count}, {noise}: {fast} {exact}");
        }
    }

    #[test]
    fn a_sample_represents_a_large_cloud() {
        let cloud = walls(16_000, 0.03);
        let (fast, exact) = (entropy(&cloud), defined(&cloud));
        assert!((fast - exact).abs() < 0.01, "{fast} {exact}");
    }

    #[test]
    fn crisp_costs_less_wherever_it_is() {
        let [crisp, blurred] = [0.02, 0.1].map(|noise| entropy(&walls(4000, noise)));
        assert!(crisp < blurred - 0.3, "{crisp} {blurred}");
        let moved: Vec<Point> =
            walls(4000, 0.02).iter().map(|p| [p[0] + 7.3, p[1] - 3.1, p[2] + 0.7]).collect();
        assert!((entropy(&moved) - crisp).abs() < 1e-3);
        assert!(entropy(&[]).is_nan() && entropy(&[[f32::NAN; 3]]).is_nan());
    }
}
