//! Whether one sweep continues another.

use crate::pose::Pose;

crate::params! {
    /// How far apart two consecutive sweeps may be. Any road vehicle at any rate above 2 Hz stays
    /// within the defaults.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ContinuityLimits {
        /// Maximum time between sweeps.
        pub gap_s: f64 = 0.5, "s", (above 0 to 10);
        /// Maximum speed between poses.
        pub jump_mps: f64 = 70.0, "m/s", (above 0 to 1000);
        /// Maximum turn rate between poses.
        pub spin_radps: f64 = 6.0, "rad/s", (above 0 to 100);
    }
}

/// Why a sweep does not continue the previous one: tracklets are dropped, no flow is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reset {
    /// The first sweep.
    First,
    /// Time stood still or went backwards by this much, s.
    Backwards(f64),
    /// More time passed than the limit allows, s.
    Gap(f64),
    /// The poses imply a speed above the limit, m/s.
    Jump(f64),
    /// The poses imply a turn rate above the limit, rad/s.
    Spin(f64),
}

impl ContinuityLimits {
    /// Returns why the step between two poses in `dt_s` seconds cannot be continuous motion, if so.
    pub fn broken(&self, from: &Pose, to: &Pose, dt_s: f64) -> Option<Reset> {
        if dt_s <= 0.0 || dt_s.is_nan() {
            return Some(Reset::Backwards(dt_s));
        }
        if dt_s > self.gap_s {
            return Some(Reset::Gap(dt_s));
        }
        let twist = (from.inverse() * *to).twist(dt_s);
        let (speed, spin) = (twist.linear.length(), twist.angular.length());
        if speed > self.jump_mps || speed.is_nan() {
            return Some(Reset::Jump(speed));
        }
        (spin > self.spin_radps || spin.is_nan()).then_some(Reset::Spin(spin))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_limit() {
        let (l, at) = (ContinuityLimits::DEFAULT, |x, yaw| Pose::planar(x, 0.0, 0.0, yaw));
        let broken = |x, yaw, dt| l.broken(&at(0.0, 0.0), &at(x, yaw), dt);
        assert_eq!(broken(5.0, 0.1, 0.1), None);
        assert_eq!(broken(5.0, 0.1, 0.0), Some(Reset::Backwards(0.0)));
        assert_eq!(broken(5.0, 0.1, 0.7), Some(Reset::Gap(0.7)));
        assert!(matches!(broken(8.0, 0.0, 0.1), Some(Reset::Jump(v)) if (v - 80.0).abs() < 1e-9));
        assert!(matches!(broken(0.0, 1.5, 0.1), Some(Reset::Spin(w)) if (w - 15.0).abs() < 1e-9));
        assert!(matches!(broken(f64::NAN, 0.0, 0.1), Some(Reset::Jump(_))));
        assert!(matches!(broken(0.0, 0.0, f64::NAN), Some(Reset::Backwards(_))));
    }
}
