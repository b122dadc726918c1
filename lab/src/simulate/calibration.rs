//! The calibration of a day: a forward-looking camera and an inertial unit, placed roughly as on
//! KITTI's vehicle, and the files that describe them.

use super::layout::{rotation_rows, spaced};
use glam::{DMat3, DQuat, DVec3};
use raywake_core::pose::Pose;
use raywake_core::sweep::Rig;
use raywake_io::Error;
use std::fs;
use std::path::Path;

/// Size of the camera's image, pixels.
pub const IMAGE: [f64; 2] = [1242.0, 375.0];
/// Focal length, pixels, for a horizontal field of view of 81.6 degrees.
const FOCAL: f64 = 720.0;
/// Where the optical axis meets the image, pixels.
const CENTRE: [f64; 2] = [620.5, 187.0];
/// How far cameras 00 to 03 sit to the left of camera 00, m.
const LEFT_M: [f64; 4] = [0.0, -0.54, 0.06, -0.48];
/// The camera with labels in its view.
const LABELLED: usize = 2;
/// Camera 00, relative to the ground point beneath the first sensor, m.
const CAMERA: DVec3 = DVec3::new(0.27, 0.0, 1.65);
/// The inertial unit, relative to the same point, m.
const IMU: DVec3 = DVec3::new(-0.81, 0.32, 0.93);

/// Camera 02, in whose view objects are labelled.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    camera_from_vehicle: Pose,
}

/// Pose of something mounted at this place on the rig's vehicle, with parallel axes.
fn mounted(rig: &Rig, place: DVec3) -> Pose {
    let below = DVec3::new(rig.sensors[0].translation.x, 0.0, rig.ground_m);
    Pose { rotation: DQuat::IDENTITY, translation: below + place }
}

/// `vehicle_from_imu`.
pub fn imu(rig: &Rig) -> Pose {
    mounted(rig, IMU)
}

/// `camera_from_vehicle` of camera 00 (x right, y down, z forward).
fn camera_from_vehicle(rig: &Rig) -> Pose {
    // Rows are the camera's axes.
    let axes = DMat3::from_cols(-DVec3::Y, -DVec3::Z, DVec3::X);
    let vehicle_from_camera = Pose::new(DQuat::from_mat3(&axes), mounted(rig, CAMERA).translation);
    vehicle_from_camera.inverse()
}

/// `P_rect_NN`, from rectified camera 00 to pixels, row by row.
fn projection(camera: usize) -> [f64; 12] {
    let [u, v] = CENTRE;
    [FOCAL, 0.0, u, FOCAL * LEFT_M[camera], 0.0, FOCAL, v, 0.0, 0.0, 0.0, 1.0, 0.0]
}

impl Camera {
    /// The camera of a rig.
    pub fn new(rig: &Rig) -> Camera {
        Camera { camera_from_vehicle: camera_from_vehicle(rig) }
    }

    /// Whether a point of the vehicle frame lies in the image.
    pub fn sees(&self, point: DVec3) -> bool {
        let at = self.camera_from_vehicle.transform(point);
        let p = projection(LABELLED);
        let (u, v) = (p[0] * at.x + p[2] * at.z + p[3], p[5] * at.y + p[6] * at.z);
        let within = |value: f64, size: f64| (0.0..size * at.z).contains(&value);
        at.z > 0.0 && within(u, IMAGE[0]) && within(v, IMAGE[1])
    }
}

/// Writes the calibration of a rig to the folder of a day, unless it is already there.
///
/// Fails if the folder holds a different one.
pub fn write(day: &Path, rig: &Rig) -> Result<(), Error> {
    for (name, text) in [
        ("calib_cam_to_cam.txt", cameras()),
        ("calib_velo_to_cam.txt", velo_to_cam(rig)),
        ("calib_imu_to_velo.txt", rigid(&imu(rig))),
    ] {
        let path = day.join(name);
        if !path.exists() {
            raywake_io::sink::atomic::write(&path, |out| {
                std::io::Write::write_all(out, text.as_bytes())
            })?;
        } else if fs::read(&path).map_err(Error::reading(&path))? != text.as_bytes() {
            let what = "belongs to drives with other sensors; use another folder for these";
            return Err(Error::input(&path, "", what));
        }
    }
    Ok(())
}

/// A rigid transform as KITTI writes it.
fn rigid(pose: &Pose) -> String {
    let (r, t) = (spaced(rotation_rows(pose)), spaced(pose.translation.to_array()));
    format!("calib_time: 01-Jan-2000 12:00:00\nR: {r}\nT: {t}\n")
}

/// `calib_velo_to_cam.txt`.
fn velo_to_cam(rig: &Rig) -> String {
    rigid(&camera_from_vehicle(rig)) + "delta_f: 0 0\ndelta_c: 0 0\n"
}

/// `calib_cam_to_cam.txt`: cameras without distortion, already rectified.
fn cameras() -> String {
    let mut text = String::from("calib_time: 01-Jan-2000 12:00:00\ncorner_dist: 0.1\n");
    let unit = "1 0 0 0 1 0 0 0 1";
    let (size, [u, v]) = (spaced(IMAGE), CENTRE);
    for (n, left) in LEFT_M.iter().enumerate() {
        text += &format!("S_{n:02}: {size}\nK_{n:02}: {FOCAL} 0 {u} 0 {FOCAL} {v} 0 0 1\n");
        text += &format!("D_{n:02}: 0 0 0 0 0\nR_{n:02}: {unit}\nT_{n:02}: {left} 0 0\n");
        text += &format!("S_rect_{n:02}: {size}\nR_rect_{n:02}: {unit}\n");
        text += &format!("P_rect_{n:02}: {}\n", spaced(projection(n)));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_sim::SensorRig;

    #[test]
    fn the_camera_looks_forward() {
        for name in SensorRig::NAMES {
            let options = raywake_sim::Options {
                rig: name.parse().unwrap(),
                sweeps: 1,
                density: 0.0,
                ..Default::default()
            };
            let rig = raywake_sim::Drive::new(1, options).rig();
            let camera = Camera::new(&rig);
            let ahead = |x: f64, y: f64, z: f64| {
                camera.sees(DVec3::new(rig.sensors[0].translation.x + x, y, rig.ground_m + z))
            };
            assert!(ahead(20.0, 0.0, 1.0) && !ahead(-20.0, 0.0, 1.0), "{name}");
            // Half the view is atan(620.5 / 720) = 40.8 degrees.
            assert!(ahead(20.27, 17.1, 1.0) && !ahead(20.27, 17.4, 1.0));
            assert!(ahead(20.27, -17.1, 1.0) && !ahead(20.27, -17.5, 1.0));
            // And atan(187 / 720) down and up.
            assert!(ahead(5.27, 0.0, 0.4) && !ahead(5.27, 0.0, 0.3) && !ahead(5.27, 0.0, 3.0));
        }
    }

    #[test]
    fn matrices() {
        let rig = SensorRig::hdl64();
        let drive = raywake_sim::Drive::new(
            1,
            raywake_sim::Options { rig, sweeps: 1, density: 0.0, ..Default::default() },
        );
        let text = velo_to_cam(&drive.rig());
        let numbers = |key: &str| -> Vec<f64> {
            let line = text.lines().find_map(|l| l.strip_prefix(key)).unwrap();
            line.split_whitespace().map(|w| w.parse().unwrap()).collect()
        };
        let off = |a: Vec<f64>, b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(off(numbers("R:"), &[0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0]), "{text}");
        assert!(off(numbers("T:"), &[0.0, -0.08, -0.27]), "{text}");
    }
}
