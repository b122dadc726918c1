//! Motion compensation (section 3.7): between velocity over ground and velocity relative to the
//! moving vehicle.

use crate::pose::{Pose, Twist};
use glam::{DMat3, DVec3};

/// The vehicle's motion in one sweep, ready to be applied to many columns and points.
#[derive(Clone, Copy, Debug)]
pub struct EgoMotion {
    world_from_vehicle: DMat3,
    vehicle_from_world: DMat3,
    twist: Twist,
}

impl EgoMotion {
    /// The motion of a vehicle at `pose` moving with `twist`.
    pub fn new(pose: &Pose, twist: &Twist) -> EgoMotion {
        let world_from_vehicle = pose.matrix();
        EgoMotion {
            world_from_vehicle,
            vehicle_from_world: world_from_vehicle.transpose(),
            twist: *twist,
        }
    }

    /// Apparent velocity (m/s, vehicle axes) of a stationary point at `at` (vehicle frame, m): the
    /// odometry flow of section 3.4.2.
    #[inline]
    pub fn odometry(&self, at: DVec3) -> DVec3 {
        -self.twist.linear - self.twist.angular.cross(at)
    }

    /// Converts velocity over ground (world axes) to velocity relative to the vehicle (vehicle
    /// axes).
    #[inline]
    pub fn ego_from_world(&self, at: DVec3, velocity: [f32; 2]) -> [f32; 3] {
        let ground = DVec3::new(velocity[0] as f64, velocity[1] as f64, 0.0);
        let v = self.vehicle_from_world * ground + self.odometry(at);
        [v.x as f32, v.y as f32, v.z as f32]
    }

    /// Converts velocity relative to the vehicle (vehicle axes) to velocity over ground (world
    /// axes).
    pub fn world_from_ego(&self, at: DVec3, velocity: [f32; 2]) -> [f32; 2] {
        let relative = DVec3::new(velocity[0] as f64, velocity[1] as f64, 0.0);
        let v = self.world_from_vehicle * (relative - self.odometry(at));
        [v.x as f32, v.y as f32]
    }

    /// Rotates a covariance (xx, xy, yy) from vehicle axes to world axes.
    pub fn turn_covariance(&self, c: [f32; 3]) -> [f32; 3] {
        let x = self.world_from_vehicle.col(0);
        turned_covariance(x.x as f32, x.y as f32, c)
    }
}

/// Rotates a velocity and its covariance (xx, xy, yy) by `angle` (rad).
pub fn turn(angle: f32, [x, y]: [f32; 2], covariance: [f32; 3]) -> ([f32; 2], [f32; 3]) {
    let (sin, cos) = (libm::sinf(angle), libm::cosf(angle));
    ([cos * x - sin * y, sin * x + cos * y], turned_covariance(cos, sin, covariance))
}

fn turned_covariance(cos: f32, sin: f32, c: [f32; 3]) -> [f32; 3] {
    [
        cos * cos * c[0] - 2.0 * cos * sin * c[1] + sin * sin * c[2],
        cos * sin * (c[0] - c[2]) + (cos * cos - sin * sin) * c[1],
        sin * sin * c[0] + 2.0 * cos * sin * c[1] + cos * cos * c[2],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turning_vehicle() {
        let twist =
            Twist { linear: DVec3::new(10.0, 0.0, 0.0), angular: DVec3::new(0.0, 0.0, 0.5) };
        let ego =
            EgoMotion::new(&Pose::planar(3.0, 4.0, 0.0, core::f64::consts::FRAC_PI_2), &twist);
        let at = DVec3::new(20.0, 5.0, 0.0);
        // v + w x r = (10 - 2.5, 10): a wall there appears to move the opposite way.
        let seen = ego.ego_from_world(at, [0.0, 0.0]);
        assert!((seen[0] + 7.5).abs() < 1e-6 && (seen[1] + 10.0).abs() < 1e-6);
        let back = ego.world_from_ego(at, [seen[0], seen[1]]);
        assert!(back[0].abs() < 1e-5 && back[1].abs() < 1e-5);
        // Driving north at 10 m/s beside us: along +y of the world, stationary in our frame apart
        // from the rotation.
        let seen = ego.ego_from_world(DVec3::ZERO, [0.0, 10.0]);
        assert!(seen.iter().all(|v| v.abs() < 1e-5));
        let turned = ego.turn_covariance([4.0, 0.0, 1.0]);
        assert!((turned[0] - 1.0).abs() < 1e-5 && (turned[2] - 4.0).abs() < 1e-5);
        let (v, c) = turn(core::f32::consts::FRAC_PI_2, [3.0, 1.0], [4.0, 0.0, 1.0]);
        assert!((v[0] + 1.0).abs() < 1e-5 && (v[1] - 3.0).abs() < 1e-5);
        assert!((c[0] - 1.0).abs() < 1e-5 && (c[2] - 4.0).abs() < 1e-5);
    }
}
