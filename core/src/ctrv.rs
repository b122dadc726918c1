//! Constant turn rate and velocity (CTRV): shared by the filters of flow tracklets (section 3.6.1)
//! and of object tracks (section 2.4).

use nalgebra::{Matrix2, Matrix4, Vector2};

/// Variance of an unknown heading: uniform over a full turn, pi²/3.
const HEADING_UNKNOWN: f32 = 3.289_868;

/// The motion implied by two measured positions.
pub struct TwoPointStart {
    /// rad.
    pub heading: f32,
    /// m/s.
    pub speed: f32,
    /// Covariance of (x, y, heading, speed) at the second position.
    pub covariance: Matrix4<f32>,
}

impl TwoPointStart {
    /// From the displacement `moved` (m) over `dt` seconds between positions of covariance `noise`,
    /// R. The errors of position and velocity are correlated: var(v) = 2 R / dt², cov(x, v) = R /
    /// dt, converted to heading and speed.
    pub fn of(noise: Matrix2<f32>, moved: [f32; 2], dt: f32) -> TwoPointStart {
        let distance = libm::sqrtf(moved[0] * moved[0] + moved[1] * moved[1]);
        let (heading, speed) = (libm::atan2f(moved[1], moved[0]), distance / dt);
        let ahead = if distance > 0.0 {
            Vector2::new(moved[0] / distance, moved[1] / distance)
        } else {
            Vector2::new(1.0, 0.0)
        };
        let aside = Vector2::new(-ahead.y, ahead.x);
        let (along, across) = (noise * ahead / dt, noise * aside / dt);
        let of_speed = 2.0 * ahead.dot(&along) / dt;
        let of_heading = 2.0 * aside.dot(&across) / (dt * speed * speed);
        let known = of_heading < HEADING_UNKNOWN;
        let mut p = Matrix4::zeros();
        p.fixed_view_mut::<2, 2>(0, 0).copy_from(&noise);
        p[(2, 2)] = if known { of_heading } else { HEADING_UNKNOWN };
        p[(3, 3)] = of_speed;
        for axis in 0..2 {
            (p[(axis, 3)], p[(3, axis)]) = (along[axis], along[axis]);
            if known {
                let c = across[axis] / speed;
                (p[(axis, 2)], p[(2, axis)]) = (c, c);
            }
        }
        if known {
            let c = 2.0 * aside.dot(&along) / (dt * speed);
            (p[(2, 3)], p[(3, 2)]) = (c, c);
        }
        TwoPointStart { heading, speed, covariance: p }
    }
}
