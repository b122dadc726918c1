//! The box around a cloud.

use glam::DVec2;

/// Share of the points left outside on each side of the box.
const OUTSIDE: f64 = 0.01;

/// Steps per right angle in the search for the box's heading.
const STEPS: usize = 90;

/// Maximum number of points inspected, evenly spaced in their order.
const POINTS: usize = 2000;

/// Length, width and height of a cloud, m: of the upright box with the smallest area seen from
/// above that leaves out 1 % of the points on each side, the longer side first. The heading of the
/// cloud's frame does not matter. NaN if the cloud is empty.
pub fn extent(cloud: &[[f32; 3]]) -> [f64; 3] {
    let step = cloud.len().div_ceil(POINTS).max(1);
    let sample: Vec<[f64; 3]> = cloud.iter().step_by(step).map(|p| p.map(f64::from)).collect();
    if sample.is_empty() {
        return [f64::NAN; 3];
    }
    let sides = |turn: usize| {
        let way = DVec2::from_angle(turn as f64 / STEPS as f64 * std::f64::consts::FRAC_PI_2);
        [way, way.perp()].map(|axis| span(sample.iter().map(|p| axis.x * p[0] + axis.y * p[1])))
    };
    let all = (0..STEPS).map(sides);
    let narrowest = all.min_by(|a, b| (a[0] * a[1]).total_cmp(&(b[0] * b[1])));
    let [a, b] = narrowest.unwrap_or([f64::NAN; 2]);
    [a.max(b), a.min(b), span(sample.iter().map(|p| p[2]))]
}

/// Length of the interval that leaves out [`OUTSIDE`] on each side.
fn span(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let out = (OUTSIDE * values.len() as f64) as usize;
    let last = values.len() - 1 - out;
    let low = *values.select_nth_unstable_by(out, f64::total_cmp).1;
    let high = *values.select_nth_unstable_by(last, f64::total_cmp).1;
    high - low
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_sim::Rng;

    #[test]
    fn a_box_at_any_heading_with_a_few_stray_points() {
        let mut rng = Rng::new(3);
        for heading in [0.0, 0.4, 1.3, 2.6] {
            let way = DVec2::from_angle(heading);
            let mut cloud: Vec<[f32; 3]> = (0..4000)
                .map(|n| {
                    let (along, up) = (rng.range(-2.0, 2.0), rng.range(0.0, 1.5));
                    let side = 0.9 * rng.sign();
                    let p = if n % 3 == 0 {
                        DVec2::new(side * 2.0 / 0.9, 0.45 * along)
                    } else {
                        DVec2::new(along, side)
                    };
                    let p = way.rotate(p);
                    [p.x, p.y, up].map(|v| v as f32)
                })
                .collect();
            cloud.extend([[30.0; 3]; 15]);
            let [l, w, h] = extent(&cloud);
            assert!((l - 4.0).abs() < 0.1 && (w - 1.8).abs() < 0.1, "{heading}: {l} {w}");
            assert!((h - 1.5).abs() < 0.1, "{h}");
        }
        assert!(extent(&[]).iter().all(|v| v.is_nan()));
        assert_eq!(extent(&[[1.0; 3]]), [0.0; 3]);
    }
}
