//! Poses from the GPS and inertial unit of a KITTI drive, by the convention of its development kit:
//! Mercator position scaled by the first latitude, `Rz(yaw) Ry(pitch) Rx(roll)`.

use std::path::Path;

use glam::{DMat3, DQuat, DVec3};
use raywake_core::pose::Pose;

use super::poses::{pose_from, shift};
use super::{plausible, text, whole};
use crate::Error;

/// Radius of the sphere of the Mercator projection, m.
const EARTH_RADIUS_M: f64 = 6_378_137.0;

/// Number of values used from a packet: lat (deg), lon (deg), alt (m), roll, pitch, yaw (rad).
const FIELDS: usize = 6;

/// `velo_from_imu` of KITTI's recording vehicle to the centimetre, for drives without a
/// calibration: axes assumed parallel, (-0.81, 0.32, -0.80) m.
pub(super) fn default_velo_from_imu() -> Pose {
    shift(DVec3::new(-0.81, 0.32, -0.80))
}

/// `velo_from_imu` from a `calib_imu_to_velo.txt` (lines `R:` of nine and `T:` of three numbers).
pub(super) fn read_calibration(path: &Path) -> Result<Pose, Error> {
    let text = whole::read_text(path)?;
    let rotation = text::keyed::<9>(path, &text, "R")?;
    let translation = text::keyed::<3>(path, &text, "T")?;
    let (Some((line, r)), Some((t_line, t))) = (rotation, translation) else {
        return Err(Error::input(path, "", "lines `R:` and `T:` expected"));
    };
    let place = plausible::place(t.into());
    place.map_err(|what| Error::input(path, format!("line {t_line}"), what))?;
    let rows = [r[0], r[1], r[2], t[0], r[3], r[4], r[5], t[1], r[6], r[7], r[8], t[2]];
    pose_from(&rows, path, format!("line {line}"))
}

/// One packet file: `lat lon alt roll pitch yaw` and more that is not used.
pub(super) fn read_packet(path: &Path) -> Result<[f64; FIELDS], Error> {
    let text = whole::read_text(path)?;
    let (line, content) =
        text::lines(&text).next().ok_or_else(|| Error::input(path, "", "is empty"))?;
    let all = text::numbers(path, line, content)?;
    let what = || format!("{FIELDS} or more numbers expected, {} found", all.len());
    let packet = all
        .first_chunk()
        .copied()
        .ok_or_else(|| Error::input(path, format!("line {line}"), what()))?;
    check(&packet).map_err(|what| Error::input(path, format!("line {line}"), what))?;
    Ok(packet)
}

/// Checks that the numbers can be projected.
fn check(packet: &[f64; FIELDS]) -> Result<(), String> {
    if packet.iter().any(|v| !v.is_finite()) {
        return Err("a NaN or infinite number".into());
    }
    // The Mercator projection excludes the poles.
    if packet[0].abs() > 89.0 || packet[1].abs() > 360.0 {
        return Err(format!("({}, {}) is not a latitude and longitude", packet[0], packet[1]));
    }
    Ok(())
}

/// Scale at which the projection preserves lengths at this latitude (deg).
pub(super) fn scale(latitude_deg: f64) -> f64 {
    libm::cos(latitude_deg.to_radians())
}

/// `world_from_imu`, x east, y north, z up.
pub(super) fn pose(packet: &[f64; FIELDS], scale: f64) -> Pose {
    let [latitude, longitude, altitude, roll, pitch, yaw] = *packet;
    let north = libm::log(libm::tan((90.0 + latitude).to_radians() * 0.5));
    let translation = DVec3::new(
        scale * EARTH_RADIUS_M * longitude.to_radians(),
        scale * EARTH_RADIUS_M * north,
        altitude,
    );
    let [z, y] = [DMat3::from_rotation_z(yaw), DMat3::from_rotation_y(pitch)];
    Pose::new(DQuat::from_mat3(&(z * y * DMat3::from_rotation_x(roll))), translation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::FRAC_PI_2;

    #[test]
    fn a_degree_north_and_a_metre_up() {
        let s = scale(49.0);
        let a = pose(&[49.0, 8.4, 100.0, 0.0, 0.0, FRAC_PI_2], s);
        let b = pose(&[49.001, 8.4, 101.0, 0.0, 0.0, FRAC_PI_2], s);
        // Heading north: the displacement is forward.
        let moved = (a.inverse() * b).translation;
        let expected = EARTH_RADIUS_M * 0.001f64.to_radians();
        assert!((moved.x - expected).abs() < 0.01, "{moved}");
        assert!(moved.y.abs() < 1e-6 && (moved.z - 1.0).abs() < 1e-9, "{moved}");
    }

    #[test]
    fn angles_turn_the_right_way() {
        let up = |packet: [f64; 6]| pose(&packet, 1.0);
        // Positive pitch lowers the nose, positive roll raises the left side.
        let pitched = up([0.0, 0.0, 0.0, 0.0, 0.1, 0.0]);
        assert!((pitched.rotation * DVec3::X).z < -0.09);
        let rolled = up([0.0, 0.0, 0.0, 0.1, 0.0, 0.0]);
        assert!((rolled.rotation * DVec3::Y).z > 0.09);
        assert!((up([0.0, 0.0, 0.0, 0.0, 0.0, 0.3]).yaw_rad() - 0.3).abs() < 1e-12);
        assert!(check(&[f64::NAN; 6]).is_err() && check(&[90.0, 0.0, 0.0, 0.0, 0.0, 0.0]).is_err());
    }
}
