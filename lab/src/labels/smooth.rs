//! Least squares over a few boxes of a track.

use glam::{DMat3, DVec3};

/// Sweeps on either side whose boxes contribute to a smoothed box: 11 in all, a second at 10 Hz.
const HALF_WINDOW: usize = 5;

/// A box in the world, as labelled.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub index: usize,
    pub stamp_s: f64,
    pub at: DVec3,
    pub yaw: f64,
}

/// Position (m), velocity (m/s) and heading (rad) of a fitted motion.
pub(super) struct Fit {
    pub at: DVec3,
    pub velocity: DVec3,
    pub yaw: f64,
}

/// The motion at sample `n` from its window; for exact samples from the adjacent ones only.
pub(super) fn fit(samples: &[Sample], n: usize, exact: bool) -> Fit {
    let half = if exact { 1 } else { HALF_WINDOW };
    let near = |s: &&Sample| s.index.abs_diff(samples[n].index) <= half;
    let window: Vec<Sample> = samples.iter().filter(near).copied().collect();
    let degree = match window.len() {
        few if exact => (few - 1).min(2),
        few @ 1..5 => few.min(2) - 1,
        _ => 2,
    };
    polynomial(&window, samples[n].stamp_s, degree)
}

/// The least-squares polynomial of a degree up to 2 through the samples, evaluated at a stamp.
pub(super) fn polynomial(samples: &[Sample], stamp_s: f64, degree: usize) -> Fit {
    let mut gram = DMat3::ZERO;
    // Sums of powers of time by x, y, z, heading.
    let mut sums = [DVec3::ZERO; 4];
    for s in samples {
        let t = s.stamp_s - stamp_s;
        let powers = DVec3::new(1.0, t, t * t);
        gram += DMat3::from_cols(powers, powers * t, powers * (t * t));
        for (sum, value) in sums.iter_mut().zip([s.at.x, s.at.y, s.at.z, s.yaw]) {
            *sum += powers * value;
        }
    }
    // Powers above the degree get the coefficient 0.
    for power in degree + 1..3 {
        for other in 0..3 {
            gram.col_mut(other)[power] = 0.0;
        }
        *gram.col_mut(power) = DVec3::AXES[power];
        sums.iter_mut().for_each(|sum| sum[power] = 0.0);
    }
    let inverse = gram.inverse();
    let [x, y, z, yaw] = sums.map(|sum| inverse * sum);
    let of = |power: usize| DVec3::new(x[power], y[power], z[power]);
    Fit { at: of(0), velocity: of(1), yaw: yaw.x }
}
