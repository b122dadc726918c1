//! Converts range images to returns.

use std::f64::consts::PI;

use glam::{DQuat, DVec3, EulerRot};
use raywake_core::pose::Pose;
use raywake_core::sweep::Point;

/// A laser: a row of its image is a beam, from the highest down, a column a direction.
pub(super) struct RangeLaser {
    pub vehicle_from_laser: Pose,
    /// Of its beams, from the lowest up, rad; empty if they are evenly spaced.
    pub inclinations: Vec<f64>,
    /// The smallest and the largest inclination, rad.
    pub range: [f64; 2],
}

/// Values of an image's pixels: `values[(row * columns + column) * channels + channel]`.
pub(super) struct Image {
    pub values: Vec<f32>,
    pub rows: usize,
    pub columns: usize,
    pub channels: usize,
}

/// A pixel begins with range (m) and intensity.
const CHANNELS_MIN: usize = 2;
/// Roll, pitch and yaw (rad) and position (m) of the vehicle in the world.
const POSE_CHANNELS: usize = 6;

impl RangeLaser {
    /// Returns of an image in the vehicle's frame, with this sensor number. Given the vehicle's
    /// pose at each pixel and the world's pose in its frame at the stamp, they are compensated for
    /// its motion. Fails if the numbers of beams or pixels differ.
    pub fn points<'a>(
        &'a self,
        image: &'a Image,
        pixels: Option<(&'a Image, &'a Pose)>,
        number: u32,
    ) -> Result<impl Iterator<Item = Point> + 'a, String> {
        let &Image { rows, columns, channels, .. } = image;
        if channels < CHANNELS_MIN {
            return Err(format!("pixels of {channels} numbers, at least {CHANNELS_MIN} expected"));
        }
        if !self.inclinations.is_empty() && self.inclinations.len() != rows {
            return Err(format!("{rows} rows, but {} beams", self.inclinations.len()));
        }
        let fits = |poses: &Image| {
            [poses.rows, poses.columns, poses.channels] == [rows, columns, POSE_CHANNELS]
        };
        if pixels.is_some_and(|(poses, _)| !fits(poses)) {
            return Err(format!("the pixel poses are not {rows} x {columns}"));
        }
        let inclinations: Vec<(f64, f64)> =
            (0..rows).map(|row| self.inclination(row, rows)).collect();
        let azimuths: Vec<(f64, f64)> =
            (0..columns).map(|column| self.azimuth(column, columns)).collect();
        let pixel = move |n: usize| {
            let value = |channel: usize| image.values[n * channels + channel];
            let range_m = f64::from(value(0));
            // It is -1 if there is no return.
            if range_m.is_nan() || range_m <= 0.0 {
                return None;
            }
            let ((s, c), (sin, cos)) = (inclinations[n / columns], azimuths[n % columns]);
            let at = DVec3::new(range_m * c * cos, range_m * c * sin, range_m * s);
            let mut at = self.vehicle_from_laser.transform(at);
            if let Some((poses, vehicle_from_world)) = pixels {
                at = vehicle_from_world.transform(pose_of(poses, n).transform(at));
            }
            let given = Some(value(1)).filter(|v| !v.is_nan());
            let intensity = given.unwrap_or(0.0).clamp(0.0, 1.0);
            let position = at.as_vec3().to_array();
            Some(Point { position, intensity, offset_s: 0.0, sensor: number })
        };
        Ok((0..rows * columns).filter_map(pixel))
    }

    /// Sine and cosine of a row's inclination.
    fn inclination(&self, row: usize, rows: usize) -> (f64, f64) {
        let from_below = rows - 1 - row;
        let even = || {
            let [least, largest] = self.range;
            least + (from_below as f64 + 0.5) / rows as f64 * (largest - least)
        };
        libm::sincos(self.inclinations.get(from_below).copied().unwrap_or_else(even))
    }

    /// Sine and cosine of a column's direction in the laser's frame: the first one points to the
    /// rear of the vehicle, each one after it further clockwise.
    fn azimuth(&self, column: usize, columns: usize) -> (f64, f64) {
        let forward = self.vehicle_from_laser.rotation * DVec3::X;
        let turned = libm::atan2(forward.y, forward.x);
        let share = (columns as f64 - column as f64 - 0.5) / columns as f64;
        libm::sincos((2.0 * share - 1.0) * PI - turned)
    }
}

/// `world_from_vehicle` at a pixel.
fn pose_of(poses: &Image, n: usize) -> Pose {
    let value = |channel: usize| f64::from(poses.values[n * POSE_CHANNELS + channel]);
    let turn = DQuat::from_euler(EulerRot::ZYX, value(2), value(1), value(0));
    Pose::new(turn, DVec3::new(value(3), value(4), value(5)))
}
