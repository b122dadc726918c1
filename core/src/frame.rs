//! The frame of the grid (B.2.2 leaves it open), and everything that depends on the choice.
//!
//! [`Frame::Lattice`]: cell borders are fixed in the world and the window follows the vehicle by
//! whole cells. The displacement of static objects is then exactly zero, each sweep is traced only
//! once, and the search covers speed over ground. Points are quantised relative to the window's
//! central voxel, so the size of the window affects no voxel: that is why the sparse map and the
//! dense window agree. [`Frame::Sensor`]: the vehicle frame of each sweep, as in the dissertation;
//! motion is relative to the vehicle.

use crate::continuity::Reset;
use crate::motion_compensation::{EgoMotion, turn};
use crate::output::ColumnFlow;
use crate::params::{ANCHOR_ABOVE_GROUND_M, Frame, Profile};
use crate::pose::{Pose, Twist, to_grain};
use crate::sweep::{Rig, Sweep};
use crate::thinning::Thinning;
use crate::tracklet::{Observation, Tracklet};
use glam::DVec3;

/// Where the window lies in one sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// From vehicle coordinates to metres from the centre of the window's central voxel.
    pub grid_from_vehicle: Pose,
    /// Lattice index of the window's first voxel.
    pub corner: [i32; 3],
    /// World position of the centre of lattice cell (0, 0, 0), m (`Frame::Sensor`: the vehicle's).
    pub lattice_origin: DVec3,
}

/// The central voxel of a window; its level lies [`ANCHOR_ABOVE_GROUND_M`] above the ground.
pub fn central(profile: &Profile) -> [i32; 3] {
    let half = profile.side as i32 / 2;
    [half, half, profile.levels as i32 / 2]
}

/// Places the window. `lattice_origin` is that of the drive, or `None` on its first sweep: the
/// lattice then has a cell centre at the anchor, the point on the vehicle's axis
/// [`ANCHOR_ABOVE_GROUND_M`] above the ground.
pub fn place(profile: &Profile, rig: &Rig, pose: &Pose, lattice_origin: Option<DVec3>) -> Window {
    let anchor = DVec3::new(0.0, 0.0, rig.ground_m + ANCHOR_ABOVE_GROUND_M);
    match profile.frame {
        Frame::Sensor => Window {
            grid_from_vehicle: Pose { translation: -anchor, ..Pose::IDENTITY },
            corner: central(profile).map(|b| -b),
            lattice_origin: pose.translation,
        },
        Frame::Lattice => {
            let at = pose.transform(anchor);
            place_on_lattice(profile, pose, at, lattice_origin.unwrap_or(at))
        }
    }
}

/// [`place`] with the anchor at world position `at`.
fn place_on_lattice(profile: &Profile, pose: &Pose, at: DVec3, origin: DVec3) -> Window {
    // A pose absurdly far away saturates; its sweep does not continue any other.
    let index = |c: f64| libm::floor(c + 0.5).clamp(-FAR_CELLS, FAR_CELLS) as i32;
    let cell = (to_grain(at - origin) / profile.voxel_m).to_array().map(index);
    let below = central(profile);
    let centre = DVec3::from_array(cell.map(f64::from)) * profile.voxel_m;
    let translation = to_grain(pose.translation - origin) - centre;
    Window {
        grid_from_vehicle: Pose { rotation: pose.rotation, translation },
        corner: [0, 1, 2].map(|a| cell[a] - below[a]),
        lattice_origin: origin,
    }
}

/// The second pose in the frame of the first, its translation taken in whole steps.
fn motion(from: &Pose, to: &Pose) -> Pose {
    let (by, turned_back) =
        (to_grain(to.translation - from.translation), from.rotation.conjugate());
    let rotation = (turned_back * to.rotation).normalize();
    Pose { rotation, translation: turned_back * by }
}

/// Farther than any drive goes, yet within the range of an integer, cells.
const FAR_CELLS: f64 = 1e9;

/// One sweep's side of a pair.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Side {
    pub window: Window,
    pub pose: Pose,
    pub twist: Twist,
    pub stamp_s: f64,
    pub points: Thinning,
}

/// Rounding far from the drive's start and to whole steps amounts to less; a cell is larger.
const SLIP_MAX_M: f64 = 1e-3;

impl Side {
    /// How far static structure is from where the shifted window of the next sweep has it, m.
    /// `None` without a lattice, if none of it stays in view, or if the windows are so far away
    /// that positions do not resolve cells.
    fn slip_m(&self, profile: &Profile, next: &Side, shift: [i32; 3]) -> Option<f64> {
        let far = |w: &Window| w.corner.iter().any(|c| f64::from(*c).abs() > FAR_CELLS / 2.0);
        let beyond = shift.iter().any(|cells| cells.unsigned_abs() >= profile.side);
        if profile.frame != Frame::Lattice || beyond || far(&self.window) || far(&next.window) {
            return None;
        }
        let at = |window: &Window| window.grid_from_vehicle.translation;
        let moved = next.pose.translation - self.pose.translation;
        let shift_m = DVec3::from_array(shift.map(f64::from)) * profile.voxel_m;
        Some((at(&self.window) - at(&next.window) + moved - shift_m).length())
    }
}

/// The placement of a new sweep.
pub(crate) struct Arrival {
    pub window: Window,
    /// Cells from the previous window.
    pub shift: [i32; 3],
    /// Set if the sweep has no usable predecessor.
    pub reset: Option<Reset>,
}

/// Two consecutive sweeps.
pub(crate) struct SweepPair<'a> {
    pub profile: &'a Profile,
    pub before: Side,
    pub current: Side,
    /// Time between them, s.
    pub dt_s: f64,
    /// Pose of the vehicle at the second sweep in its frame at the first.
    moved: Pose,
    /// How much the vehicle turned in between, rad.
    pub turned_rad: f32,
    /// The vehicle's motion between the two, at the first: the odometry flow.
    pub ego: EgoMotion,
}

/// The last two sweeps, and the lattice of the drive.
pub(crate) struct Sides {
    lattice_origin: Option<DVec3>,
    pub before: Option<Side>,
    pub current: Option<Side>,
}

impl Sides {
    /// Before the first sweep.
    pub const fn new() -> Sides {
        Sides { lattice_origin: None, before: None, current: None }
    }

    /// Adds a sweep. One that does not continue the previous sweep has none before it.
    pub fn advance(&mut self, profile: &Profile, rig: &Rig, sweep: &Sweep) -> Arrival {
        let pose = sweep.world_from_vehicle;
        self.before = self.current.take();
        let reset = match &self.before {
            None => Some(Reset::First),
            Some(before) => {
                let dt_s = sweep.stamp_s - before.stamp_s;
                profile.limits.broken(&before.pose, &pose, dt_s)
            }
        };
        self.before = self.before.filter(|_| reset.is_none());
        let window = place(profile, rig, &pose, self.lattice_origin);
        self.lattice_origin.get_or_insert(window.lattice_origin);
        let points = Thinning::new(sweep.points.len(), profile.returns());
        let (stamp_s, twist) = (sweep.stamp_s, sweep.twist);
        let side = Side { window, pose, twist, stamp_s, points };
        self.current = Some(side);
        let before = self.before.as_ref();
        let shift = profile.frame.shift(profile.side as i32, before.map(|b| &b.window), &window);
        let slip_m = before.and_then(|before| before.slip_m(profile, &side, shift));
        assert!(slip_m.is_none_or(|m| m < SLIP_MAX_M), "{slip_m:?} from {before:?} to {side:?}");
        Arrival { window, shift, reset }
    }

    /// Both sweeps, if the second continues the first.
    pub fn pair<'a>(&self, profile: &'a Profile) -> Option<SweepPair<'a>> {
        Some(SweepPair::new(profile, self.before?, self.current?))
    }
}

impl<'a> SweepPair<'a> {
    fn new(profile: &'a Profile, before: Side, current: Side) -> SweepPair<'a> {
        let dt_s = current.stamp_s - before.stamp_s;
        let moved = motion(&before.pose, &current.pose);
        let ego = EgoMotion::new(&before.pose, &moved.twist(dt_s));
        let turned_rad = moved.yaw_rad() as f32;
        SweepPair { profile, before, current, dt_s, moved, turned_rad, ego }
    }

    /// The first sweep's vehicle frame from the second's window: the corners differ by whole cells.
    pub fn vehicle_from_grid(&self) -> Pose {
        let (before, current) = (&self.before.window, &self.current.window);
        let cells = |a: usize| (before.corner[a] - current.corner[a]) as f64;
        let moved = core::array::from_fn(|a| cells(a) * self.profile.voxel_m);
        let mut grid_from_vehicle = before.grid_from_vehicle;
        grid_from_vehicle.translation += DVec3::from_array(moved);
        grid_from_vehicle.inverse()
    }

    /// Sets the displacement over ground and the velocities of an observed column at `at` (first
    /// sweep's vehicle frame): its tracklet's velocity or, if there was no room for one, that of
    /// the displacement.
    pub fn set_motion(
        &self,
        at: DVec3,
        o: &Observation,
        tracklet: Option<&Tracklet>,
        flow: &mut ColumnFlow,
    ) {
        let dt = self.dt_s as f32;
        let of_pair = (o.moved.map(|v| v / dt), o.covariance.map(|v| v / (dt * dt)));
        flow.displacement_m = o.moved;
        flow.displacement_covariance = o.covariance;
        match self.profile.frame {
            Frame::Lattice => {
                (flow.velocity_world_mps, flow.covariance) =
                    tracklet.map_or(of_pair, |t| t.ekf.velocity());
                self.set_relative(at, flow);
            }
            Frame::Sensor => {
                let motion = tracklet.map_or(of_pair, |t| self.velocity_at_first(t));
                self.set_over_ground(at, motion, flow);
            }
        }
    }

    /// Outputs an observed column as static. It still moves as observed with
    /// [`ColumnFlow::probability`]; its covariances include that.
    pub fn set_static(&self, at: DVec3, flow: &mut ColumnFlow) {
        let p = flow.probability;
        let as_static = |covariance: &mut [f32; 3], by: &mut [f32; 2]| {
            let [x, y] = core::mem::take(by);
            *covariance =
                [covariance[0] + p * x * x, covariance[1] + p * x * y, covariance[2] + p * y * y];
        };
        as_static(&mut flow.displacement_covariance, &mut flow.displacement_m);
        as_static(&mut flow.covariance, &mut flow.velocity_world_mps);
        self.set_relative(at, flow);
    }

    /// Velocity, along the first sweep's axes, of a tracklet already turned to the second's.
    fn velocity_at_first(&self, t: &Tracklet) -> ([f32; 2], [f32; 3]) {
        let (velocity, covariance) = t.ekf.velocity();
        turn(self.turned_rad, velocity, covariance)
    }

    /// Sets the motion over ground from a column's displacement and its velocity (with covariance)
    /// along the vehicle's axes.
    fn set_over_ground(
        &self,
        at: DVec3,
        (velocity, covariance): ([f32; 2], [f32; 3]),
        flow: &mut ColumnFlow,
    ) {
        let [x, y] = flow.displacement_m.map(f64::from);
        let to = self.moved.transform(at + DVec3::new(x, y, 0.0));
        let by = self.before.pose.rotation * (to - at);
        flow.displacement_m = [by.x as f32, by.y as f32];
        flow.velocity_ego_mps = velocity;
        let planar = DVec3::new(at.x, at.y, 0.0);
        flow.velocity_world_mps = self.ego.world_from_ego(planar, velocity);
        flow.covariance = self.ego.turn_covariance(covariance);
    }

    /// Sets the velocity relative to the vehicle from a column's velocity over ground.
    pub fn set_relative(&self, at: DVec3, flow: &mut ColumnFlow) {
        let planar = DVec3::new(at.x, at.y, 0.0);
        let [x, y, _] = self.ego.ego_from_world(planar, flow.velocity_world_mps);
        flow.velocity_ego_mps = [x, y];
    }
}

impl Frame {
    /// Cells from the previous window to the new one; without a previous one, enough that none of
    /// it stays in view.
    fn shift(self, side: i32, before: Option<&Window>, now: &Window) -> [i32; 3] {
        match (before, self) {
            (Some(before), Frame::Lattice) => core::array::from_fn(|a| {
                now.corner[a].saturating_sub(before.corner[a]).clamp(-side, side)
            }),
            (Some(_), Frame::Sensor) => [0; 3],
            (None, _) => [side, 0, 0],
        }
    }

    /// Heading and speed over ground, velocity over ground and relative to the vehicle, of a
    /// tracklet at `at` (vehicle frame).
    pub(crate) fn motion_of(
        self,
        t: &Tracklet,
        ego: &EgoMotion,
        at: DVec3,
    ) -> (f32, f32, [f32; 2], [f32; 2]) {
        let planar = DVec3::new(at.x, at.y, 0.0);
        let (v, _) = t.ekf.velocity();
        match self {
            Frame::Lattice => {
                let [x, y, _] = ego.ego_from_world(planar, v);
                (t.ekf.mean[2], t.ekf.mean[3], v, [x, y])
            }
            Frame::Sensor => {
                let w = ego.world_from_ego(planar, v);
                (libm::atan2f(w[1], w[0]), libm::sqrtf(w[0] * w[0] + w[1] * w[1]), w, v)
            }
        }
    }
}

/// The centre of a column, at the level of the anchor, relative to the window's central voxel, m.
pub(crate) fn centre_of(profile: &Profile, i: i32, j: i32) -> DVec3 {
    let [ci, cj, _] = central(profile);
    DVec3::new((i - ci) as f64, (j - cj) as f64, 0.0) * profile.voxel_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::Timing;

    /// Cells from the previous window, and whether there is one, for successive positions 0.1 s
    /// apart.
    fn shifts<const N: usize>(places: [[f64; 3]; N]) -> [([i32; 3], bool); N] {
        let (profile, mut sides) = (Profile::hdl64(), Sides::new());
        let rig = Rig {
            sensors: heapless::Vec::new(),
            timing: Timing::AtStamp,
            distorted: false,
            ground_m: -1.7,
            own_vehicle: None,
        };
        let mut stamp_s = 0.0;
        places.map(|place| {
            stamp_s += 0.1;
            let world_from_vehicle =
                Pose { translation: DVec3::from_array(place), ..Pose::IDENTITY };
            let twist = Twist::ZERO;
            let sweep = Sweep { stamp_s, points: &[], world_from_vehicle, twist };
            let arrival = sides.advance(&profile, &rig, &sweep);
            (arrival.shift, arrival.reset.is_none())
        })
    }

    #[test]
    fn windows_are_shifted_by_whole_cells() {
        for from in [0.0, 0.1, 1e5, -3e7] {
            let at = |x: f64| [from + x, -from, 0.0];
            let found = shifts([at(0.0), at(0.16), at(0.44), at(0.46), at(-0.46)]);
            let cells = [[1, 0, 0], [0, 0, 0], [1, 0, 0], [-4, 0, 0]].map(|shift| (shift, true));
            assert_eq!(found[1..], cells, "from {from}");
        }
    }

    #[test]
    fn ambiguous_places_are_tolerated() {
        for far in [4e8, 1e13, 1e300, f64::MAX, f64::INFINITY, f64::NAN] {
            shifts([[0.0; 3], [far, 0.0, 0.0], [far, 1.0, 0.0], [-far, 0.0, 0.0], [0.0; 3]]);
            shifts([[far, 0.0, 0.0], [far, 1.0, 0.0], [far, 30.0, 0.0]]);
        }
        // The distance from the drive's start is rounded down once, and up once.
        let far = 1e15;
        shifts([[0.0625, 0.0, 0.0], [far, 0.0, 0.0], [far + 0.375, 0.0, 0.0]]);
    }
}
