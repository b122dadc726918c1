//! Rigid motion in double precision.
//!
//! A pose named `target_from_source` maps points of `source` into `target`, so that
//! `world_from_vehicle * vehicle_from_sensor` cancels visibly. Axes are right-handed: x forward, y
//! left, z up; lengths in metres, angles in radians. Trigonometry comes from `libm`, so that every
//! machine gets the same bits.

use glam::{DMat3, DQuat, DVec3};

/// A rigid transform, `p_target = rotation * p_source + translation`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Origin of the source frame in the target frame, m.
    pub translation: DVec3,
}

/// Why twelve numbers are not a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseError {
    /// A NaN or an infinity.
    NotFinite,
    /// The 3x3 part is not a rotation to within 1e-3 (scaled, sheared or mirrored).
    NotRigid,
}

/// Largest deviation of `R^T R` from the identity still accepted as a rounded rotation.
const RIGID_TOLERANCE: f64 = 1e-3;

/// Step to which the pipeline rounds differences of positions, m, and velocities, m/s: 15 um.
/// Errors of poses are hundreds of times as large, and the rounding of poses 100 km away is a
/// millionth of it, so that the same bits come out wherever the world's origin lies.
const GRAIN: f64 = 1.0 / 65_536.0;
/// Numbers from here on are already whole steps.
const WHOLE: f64 = GRAIN / f64::EPSILON;

/// Rounds to the nearest whole number of steps.
pub fn to_grain(v: DVec3) -> DVec3 {
    let nearest = |c: f64| if c.abs() < WHOLE { libm::round(c / GRAIN) * GRAIN } else { c };
    DVec3::new(nearest(v.x), nearest(v.y), nearest(v.z))
}

/// Below this angle, rad, the limit at zero is used.
const TINY: f64 = 1e-12;

impl Pose {
    /// The identity.
    pub const IDENTITY: Pose = Pose { rotation: DQuat::IDENTITY, translation: DVec3::ZERO };

    /// A pose from unit quaternion and translation; the quaternion is normalised.
    pub fn new(rotation: DQuat, translation: DVec3) -> Pose {
        Pose { rotation: rotation.normalize(), translation }
    }

    /// A planar pose: position (m) and heading about +z (rad).
    pub fn planar(x: f64, y: f64, z: f64, yaw_rad: f64) -> Pose {
        let (s, c) = (libm::sin(0.5 * yaw_rad), libm::cos(0.5 * yaw_rad));
        Pose { rotation: DQuat::from_xyzw(0.0, 0.0, s, c), translation: DVec3::new(x, y, z) }
    }

    /// From a row-major 3x4 matrix `[R | t]`, as in a KITTI `poses.txt`.
    pub fn from_rows(m: &[f64; 12]) -> Result<Pose, PoseError> {
        if m.iter().any(|v| !v.is_finite()) {
            return Err(PoseError::NotFinite);
        }
        let r = DMat3::from_cols(
            DVec3::new(m[0], m[4], m[8]),
            DVec3::new(m[1], m[5], m[9]),
            DVec3::new(m[2], m[6], m[10]),
        );
        let gram = r.transpose() * r - DMat3::IDENTITY;
        let worst = gram.to_cols_array().iter().fold(0.0f64, |a, v| a.max(v.abs()));
        if worst > RIGID_TOLERANCE || r.determinant() < 0.0 {
            return Err(PoseError::NotRigid);
        }
        Ok(Pose::new(DQuat::from_mat3(&r), DVec3::new(m[3], m[7], m[11])))
    }

    /// The rotation as a matrix.
    pub fn matrix(&self) -> DMat3 {
        DMat3::from_quat(self.rotation)
    }

    /// The opposite transform, `source_from_target`.
    pub fn inverse(&self) -> Pose {
        let rotation = self.rotation.conjugate();
        Pose { rotation, translation: rotation * -self.translation }
    }

    /// Maps a point.
    pub fn transform(&self, p: DVec3) -> DVec3 {
        self.rotation * p + self.translation
    }

    /// Converts a velocity along the world's axes to one along this pose's axes; the planar part.
    pub fn along_axes(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let v = self.rotation.conjugate() * DVec3::new(x.into(), y.into(), 0.0);
        [v.x as f32, v.y as f32]
    }

    /// Heading of the x axis about +z, rad.
    pub fn yaw_rad(&self) -> f64 {
        let x = self.rotation * DVec3::X;
        libm::atan2(x.y, x.x)
    }

    /// The constant twist that leads from the identity to this pose in `dt_s` seconds.
    pub fn twist(&self, dt_s: f64) -> Twist {
        let q = if self.rotation.w < 0.0 { -self.rotation } else { self.rotation };
        let v = DVec3::new(q.x, q.y, q.z);
        let s = libm::sqrt(v.dot(v));
        // 2 atan2(|v|, w) / |v| tends to 2 at the identity.
        let k = if s > TINY { 2.0 * libm::atan2(s, q.w) / s } else { 2.0 };
        Twist { linear: self.translation / dt_s, angular: v * (k / dt_s) }
    }
}

impl core::ops::Mul for Pose {
    type Output = Pose;
    fn mul(self, b: Pose) -> Pose {
        Pose {
            rotation: (self.rotation * b.rotation).normalize(),
            translation: self.rotation * b.translation + self.translation,
        }
    }
}

/// Velocity of the vehicle over one sweep, in the vehicle frame at the sweep's stamp.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist {
    /// m/s.
    pub linear: DVec3,
    /// rad/s, axis times rate.
    pub angular: DVec3,
}

impl Twist {
    /// No motion.
    pub const ZERO: Twist = Twist { linear: DVec3::ZERO, angular: DVec3::ZERO };

    /// The linear velocity in whole steps: far from the world's origin it is then the same as near
    /// it.
    pub fn to_grain(self) -> Twist {
        Twist { linear: to_grain(self.linear), ..self }
    }

    /// Motion over `dt_s`: rotation and translation are interpolated separately, which over the
    /// time span of one sweep differs from the screw motion by less than a millimetre.
    pub fn over(&self, dt_s: f64) -> Pose {
        let w = self.angular * dt_s;
        let angle = libm::sqrt(w.dot(w));
        // sin(a/2)/a tends to 1/2 at zero.
        let k = if angle > TINY { libm::sin(0.5 * angle) / angle } else { 0.5 };
        let rotation = DQuat::from_xyzw(w.x * k, w.y * k, w.z * k, libm::cos(0.5 * angle));
        Pose::new(rotation, self.linear * dt_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_inverse_and_twist() {
        let p = Pose::planar(1.0, 2.0, 3.0, 0.5);
        let m = p.matrix();
        let r = |i: usize| m.row(i);
        let rows =
            [r(0).x, r(0).y, r(0).z, 1.0, r(1).x, r(1).y, r(1).z, 2.0, r(2).x, r(2).y, r(2).z, 3.0];
        let q = Pose::from_rows(&rows).unwrap();
        assert!((q.yaw_rad() - 0.5).abs() < 1e-12);
        let e = p * p.inverse();
        assert!(e.translation.length() < 1e-12 && (e.rotation.w - 1.0).abs() < 1e-12);
        let back = p.twist(0.1).over(0.1);
        assert!((back.yaw_rad() - 0.5).abs() < 1e-12);
        assert!((back.translation - p.translation).length() < 1e-12);
    }

    #[test]
    fn steps() {
        let v = to_grain(DVec3::new(0.3, -1e308, 7.0));
        assert!((v.x - 0.3).abs() <= 0.5 * GRAIN && v.x / GRAIN == libm::round(v.x / GRAIN));
        assert_eq!([v.y, v.z], [-1e308, 7.0]);
        assert_eq!((WHOLE + 0.3 - WHOLE) / GRAIN % 1.0, 0.0);
    }

    #[test]
    fn invalid_poses() {
        let mut m = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        assert!(Pose::from_rows(&m).is_ok());
        m[0] = -1.0;
        assert_eq!(Pose::from_rows(&m), Err(PoseError::NotRigid));
        m[0] = 1.1;
        assert_eq!(Pose::from_rows(&m), Err(PoseError::NotRigid));
        m[0] = f64::NAN;
        assert_eq!(Pose::from_rows(&m), Err(PoseError::NotFinite));
    }
}
