//! The output side: tracklets as records.

use super::Tracklet;
use crate::frame::{Side, centre_of};
use crate::motion_compensation::EgoMotion;
use crate::output::TrackletState;
use crate::params::Profile;
use glam::DVec3;

/// A tracklet at the time of the sweep `current`.
pub(crate) fn state_of(profile: &Profile, t: &Tracklet, current: &Side) -> TrackletState {
    let side = profile.side as i32;
    let (i, j) = (t.column as i32 / side, t.column as i32 % side);
    let place = |a: usize| (t.place[a] as f64 - 0.5) * profile.voxel_m + t.ekf.mean[a] as f64;
    let grid = centre_of(profile, i, j) + DVec3::new(place(0), place(1), 0.0);
    let at = current.window.grid_from_vehicle.inverse().transform(grid);
    let world = current.pose.transform(at);
    let ego = EgoMotion::new(&current.pose, &current.twist);
    let (heading_rad, speed_mps, velocity_world_mps, velocity_ego_mps) =
        profile.frame.motion_of(t, &ego, at);
    let corner = current.window.corner;
    TrackletState {
        cell: [corner[0] + i, corner[1] + j],
        position_world_m: [world.x, world.y],
        position_vehicle_m: [at.x as f32, at.y as f32],
        heading_rad,
        speed_mps,
        turn_rate_radps: t.ekf.mean[4],
        velocity_world_mps,
        velocity_ego_mps,
        covariance: core::array::from_fn(|a| {
            core::array::from_fn(|b| t.ekf.scale * t.ekf.covariance[(a, b)])
        }),
        age: t.age,
        probability: t.probability,
    }
}
