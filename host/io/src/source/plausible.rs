//! Plausibility of recordings of any format.

use glam::DVec3;
use raywake_core::plausible::{FRAME_MAX_M, WORLD_MAX_M, is_time, is_within};
use raywake_core::pose::Pose;

use super::Overview;

/// Largest distance of a drive from its first pose, m; positions beyond are typing errors.
const REACH_MAX_M: f64 = 1e6;
/// Shortest time between two sweeps, s.
const STEP_MIN_S: f64 = 1e-6;

/// Checks a recording; `Err` says what is wrong.
pub(super) fn check(overview: &Overview) -> Result<(), String> {
    let Overview { rig, frames, track, .. } = overview;
    ground(rig.ground_m)?;
    for (n, sensor) in rig.sensors.iter().enumerate() {
        place(sensor.translation).map_err(|what| format!("sensor {n}: {what}"))?;
    }
    let first = track.poses.first().map_or(DVec3::ZERO, |pose| pose.translation);
    if !is_within(first, WORLD_MAX_M) {
        return Err(format!("the first pose is impossibly far away, at {:?} m", first.to_array()));
    }
    for (frame, pose) in frames.iter().zip(&track.poses) {
        reach(first, pose).map_err(|what| format!("the pose of frame {frame}: {what}"))?;
    }
    for (frame, &stamp_s) in frames.iter().zip(&track.stamps_s) {
        if !is_time(stamp_s) {
            return Err(format!("frame {frame} has an impossible time of {stamp_s:e} s"));
        }
    }
    // The stamps are finite by now.
    match track.stamps_s.windows(2).position(|pair| pair[1] - pair[0] < STEP_MIN_S) {
        Some(n) => {
            let frame = frames[n + 1];
            Err(format!("frame {frame} comes less than {STEP_MIN_S} s after the one before"))
        }
        None => Ok(()),
    }
}

/// `Err` if a pose is out of reach of a drive whose first pose is at `first`.
pub(super) fn reach(first: DVec3, pose: &Pose) -> Result<(), String> {
    let away = pose.translation - first;
    match pose.rotation.is_finite() && is_within(away, REACH_MAX_M) {
        true => Ok(()),
        false => Err(format!(
            "impossible: {:.3e} m from the first pose, or a rotation that is not finite",
            away.length()
        )),
    }
}

/// `Err` if the ground cannot be at this height in the frame of the returns, m.
pub fn ground(height_m: f64) -> Result<(), String> {
    place(DVec3::Z * height_m).map_err(|what| format!("the ground: {what}"))
}

/// `Err` if no part of a vehicle can be at this position in the frame of the returns, m.
pub fn place(place: DVec3) -> Result<(), String> {
    match is_within(place, FRAME_MAX_M) {
        true => Ok(()),
        false => Err(format!("at {:?} m, {FRAME_MAX_M:e} m at most", place.to_array())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::poses::PoseTrack;
    use raywake_core::sweep::{Rig, Timing};

    #[test]
    fn what_no_vehicle_has() {
        let at = |x| Pose { translation: DVec3::X * x, ..Pose::IDENTITY };
        let overview = |ground_m, sensor_m, poses_m: [f64; 2], stamps_s: [f64; 2]| {
            let sensors = [at(sensor_m)].into_iter().collect();
            check(&Overview {
                name: String::new(),
                rig: Rig {
                    sensors,
                    timing: Timing::AtStamp,
                    distorted: false,
                    ground_m,
                    own_vehicle: None,
                },
                frames: vec![7, 8],
                track: PoseTrack { poses: poses_m.map(at).into(), stamps_s: stamps_s.into() },
                epoch_ns: 0,
                trusted: false,
                notes: Vec::new(),
            })
        };
        let near = [1e8 - 1e6, 1e8];
        assert_eq!(overview(-1e4, 1e4, near, [-1e10, 1e10]), Ok(()));
        for (found, words) in [
            (overview(-1.1e4, 0.0, near, [0.0, 1.0]), "the ground"),
            (overview(f64::NAN, 0.0, near, [0.0, 1.0]), "the ground"),
            (overview(0.0, 1e300, near, [0.0, 1.0]), "sensor 0"),
            (overview(0.0, 0.0, [1.1e8; 2], [0.0, 1.0]), "first pose"),
            (overview(0.0, 0.0, [0.0, 1.1e6], [0.0, 1.0]), "frame 8"),
            (overview(0.0, 0.0, [0.0, f64::INFINITY], [0.0, 1.0]), "frame 8"),
            (overview(0.0, 0.0, near, [0.0, 1.1e10]), "frame 8"),
            (overview(0.0, 0.0, near, [0.0, 1e-7]), "frame 8"),
        ] {
            assert!(found.as_ref().is_err_and(|what| what.contains(words)), "{words}: {found:?}");
        }
    }
}
