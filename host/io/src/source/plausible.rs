//! What no vehicle does: numbers of a recording that are finite and still cannot be, whatever
//! format they come from. Beyond them arithmetic overflows, and returns fall where they are not.

use glam::DVec3;
use raywake_core::pose::Pose;

use super::Overview;

/// Farthest a drive leads from its first pose, m; positions beyond are typing errors.
const REACH_MAX_M: f64 = 1e6;
/// Farthest the first pose lies from the origin of the world, m: grids of maps have origins some
/// thousands of kilometres away.
const WORLD_MAX_M: f64 = 1e8;
/// Farthest a sensor or the ground lies from the origin of the returns, m: there the numbers of a
/// return are 1 mm apart.
const FRAME_MAX_M: f64 = 1e4;
/// Largest time that is believed, s: 1970 is 1.8e9 s ago.
pub(super) const TIME_MAX_S: f64 = 1e10;
/// Shortest time between two sweeps, s.
const STEP_MIN_S: f64 = 1e-6;

/// `Err` with what is wrong in a recording.
pub(super) fn check(overview: &Overview) -> Result<(), String> {
    let Overview { rig, frames, track, .. } = overview;
    ground(rig.ground_m)?;
    for (n, sensor) in rig.sensors.iter().enumerate() {
        place(sensor.translation).map_err(|what| format!("sensor {n}: {what}"))?;
    }
    let first = track.poses.first().map_or(DVec3::ZERO, |pose| pose.translation);
    if !within(first, WORLD_MAX_M) {
        return Err(format!("the first pose is at {:?} m", first.to_array()));
    }
    for (frame, pose) in frames.iter().zip(&track.poses) {
        reach(first, pose).map_err(|what| format!("the pose of frame {frame}: {what}"))?;
    }
    for (frame, &stamp_s) in frames.iter().zip(&track.stamps_s) {
        // Not the other way round: NaN lies within nothing.
        if !(-TIME_MAX_S..=TIME_MAX_S).contains(&stamp_s) {
            return Err(format!("frame {frame} has a time of {stamp_s:e} s"));
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

/// `Err` where a drive with its first pose at `first` does not lead to a pose.
pub(super) fn reach(first: DVec3, pose: &Pose) -> Result<(), String> {
    let away = pose.translation - first;
    match pose.rotation.is_finite() && within(away, REACH_MAX_M) {
        true => Ok(()),
        false => Err(format!("{:.3e} m from the first pose", away.length())),
    }
}

/// `Err` where the ground cannot be at that height in the frame of the returns, m.
pub fn ground(height_m: f64) -> Result<(), String> {
    place(DVec3::Z * height_m).map_err(|what| format!("the ground: {what}"))
}

/// `Err` where nothing of a vehicle can be at that place in the frame of the returns, m.
pub fn place(place: DVec3) -> Result<(), String> {
    match within(place, FRAME_MAX_M) {
        true => Ok(()),
        false => Err(format!("at {:?} m, {FRAME_MAX_M:e} m at most", place.to_array())),
    }
}

/// NaN is not.
fn within(place: DVec3, most_m: f64) -> bool {
    place.is_finite() && place.abs().max_element() <= most_m
}
