//! Packets of the GPS and inertial unit, in the format and by the conventions of KITTI's
//! development kit: Mercator position scaled by the first latitude, `Rz(yaw) Ry(pitch) Rx(roll)`.

use super::layout::spaced;
use glam::{DQuat, DVec3};
use raywake_core::pose::{Pose, Twist};

/// Radius of the projection's sphere, m.
const EARTH_RADIUS_M: f64 = 6_378_137.0;
/// Latitude and longitude (degrees) of the unit on the first frame, and the altitude of the world's
/// origin, m.
const FIRST: [f64; 3] = [45.0, 7.0, 100.0];
/// Step of the differences that yield velocities and accelerations, s.
const STEP_S: f64 = 1e-3;
/// m/s^2; an accelerometer at rest measures it upwards.
const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, 9.81);

/// Names and meanings of the fields of a packet.
pub const FORMAT: &str = "\
lat: latitude of the inertial unit (deg)
lon: longitude (deg)
alt: altitude (m)
roll: roll, positive with the left side up (rad)
pitch: pitch, positive with the front down (rad)
yaw: heading, 0 is east, counter-clockwise (rad)
vn: velocity to the north (m/s)
ve: velocity to the east (m/s)
vf: velocity forward, parallel to the earth (m/s)
vl: velocity to the left, parallel to the earth (m/s)
vu: velocity upwards (m/s)
ax: acceleration along x of the unit, gravity included (m/s^2)
ay: acceleration along y of the unit (m/s^2)
az: acceleration along z of the unit (m/s^2)
af: acceleration forward, parallel to the earth (m/s^2)
al: acceleration to the left, parallel to the earth (m/s^2)
au: acceleration upwards, gravity included (m/s^2)
wx: turn rate about x of the unit (rad/s)
wy: turn rate about y of the unit (rad/s)
wz: turn rate about z of the unit (rad/s)
wf: turn rate about the forward axis (rad/s)
wl: turn rate about the left axis (rad/s)
wu: turn rate about the upward axis (rad/s)
posacc: accuracy of the position (m)
velacc: accuracy of the velocity (m/s)
navstat: navigation status
numsats: satellites
posmode: position mode
velmode: velocity mode
orimode: orientation mode
";

/// Makes the packets of one drive.
pub struct Unit {
    /// Position of the unit on the first frame, in the simulation's world.
    origin: DVec3,
}

impl Unit {
    /// Creates the unit; `first` is `world_from_imu` on the first frame.
    pub fn new(first: Pose) -> Unit {
        Unit { origin: DVec3::new(first.translation.x, first.translation.y, 0.0) }
    }

    /// Returns the packet at a time (s) of a unit that moves as `world_from_imu`.
    pub fn packet(&self, world_from_imu: &dyn Fn(f64) -> Pose, t: f64) -> String {
        let [before, here, after] = [t - STEP_S, t, t + STEP_S].map(world_from_imu);
        let velocity = (after.translation - before.translation) / (2.0 * STEP_S);
        let bend = after.translation - 2.0 * here.translation + before.translation;
        let acceleration = bend / (STEP_S * STEP_S) + GRAVITY;
        let rates = turn_rates(&here, &before, &after);

        let angles = roll_pitch_yaw(&here);
        let level = DQuat::from_rotation_z(-angles[2]);
        let along = level * velocity;
        let measured = here.rotation.conjugate() * acceleration;
        let pushed = level * acceleration;
        let turned = level * (here.rotation * rates);
        let place = self.place(here.translation);
        // Fourteen decimals of a degree resolve a nanometre.
        let exact = place.into_iter().chain(angles).map(|v| format!("{v:.14}"));
        let motion = [velocity.y, velocity.x]
            .into_iter()
            .chain(along.to_array())
            .chain(measured.to_array())
            .chain(pushed.to_array())
            .chain(rates.to_array())
            .chain(turned.to_array());
        let motion = motion.map(|v| format!("{v:.12}"));
        spaced(exact.chain(motion)) + " 0 0 4 10 4 4 0\n"
    }

    /// Latitude and longitude (deg) and altitude (m) of a place in the world.
    fn place(&self, at: DVec3) -> [f64; 3] {
        let [latitude, longitude, altitude] = FIRST;
        let metres = EARTH_RADIUS_M * latitude.to_radians().cos();
        let way = at - self.origin;
        let first_north = (0.5 * (90.0 + latitude)).to_radians().tan().ln();
        let north = 2.0 * (first_north + way.y / metres).exp().atan().to_degrees() - 90.0;
        [north, longitude + (way.x / metres).to_degrees(), altitude + at.z]
    }
}

/// Turn rates about the unit's own axes, rad/s.
fn turn_rates(here: &Pose, before: &Pose, after: &Pose) -> DVec3 {
    let rate = |other: &Pose, dt_s: f64| -> Twist { (here.inverse() * *other).twist(dt_s) };
    0.5 * (rate(before, -STEP_S).angular + rate(after, STEP_S).angular)
}

/// Angles of `Rz(yaw) Ry(pitch) Rx(roll)`, rad.
fn roll_pitch_yaw(pose: &Pose) -> [f64; 3] {
    let m = pose.matrix();
    let (x, z_row) = (m.x_axis, m.row(2));
    [z_row.y.atan2(z_row.z), (-x.z).atan2(x.x.hypot(x.y)), x.y.atan2(x.x)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fields(text: &str) -> Vec<f64> {
        text.split_whitespace().map(|w| w.parse().unwrap()).collect()
    }

    #[test]
    fn thirty_fields_of_a_turn() {
        // 10 m/s on a circle of 20 m to the left, climbing 1 m/s.
        let on_circle = |t: f64| {
            let a = 0.5 * t;
            Pose::planar(20.0 * a.sin(), 20.0 * (1.0 - a.cos()), t, a)
        };
        let packet = fields(&Unit::new(on_circle(0.0)).packet(&on_circle, 0.0));
        assert_eq!(packet.len(), 30);
        assert_eq!(FORMAT.lines().count(), 30);
        let expected = [45.0, 7.0, 100.0, 0.0, 0.0, 0.0, 0.0, 10.0, 10.0, 0.0, 1.0];
        let rest = [0.0, 5.0, 9.81, 0.0, 5.0, 9.81, 0.0, 0.0, 0.5, 0.0, 0.0, 0.5];
        for (n, (a, b)) in packet.iter().zip(expected.iter().chain(&rest)).enumerate() {
            assert!((a - b).abs() < 1e-5, "field {n}: {a}, not {b}");
        }
        // Half a revolution later, it heads west.
        let t = 2.0 * std::f64::consts::PI;
        let packet = fields(&Unit::new(on_circle(0.0)).packet(&on_circle, t));
        assert!((packet[7] + 10.0).abs() < 1e-4 && (packet[8] - 10.0).abs() < 1e-4);
        assert!((packet[0] - 45.0 - (40.0f64 / EARTH_RADIUS_M).to_degrees()).abs() < 1e-8);
    }

    #[test]
    fn angles() {
        let turn = DQuat::from_rotation_z(0.7)
            * DQuat::from_rotation_y(-0.2)
            * DQuat::from_rotation_x(0.1);
        let [roll, pitch, yaw] = roll_pitch_yaw(&Pose::new(turn, DVec3::ZERO));
        assert!((roll - 0.1).abs() < 1e-12 && (pitch + 0.2).abs() < 1e-12);
        assert!((yaw - 0.7).abs() < 1e-12);
    }
}
