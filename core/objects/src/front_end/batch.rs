//! The returns of about 100 ms, from any number of sensors, in the world.

use super::{CELL_M, FrontEndParams, SIDE};
use glam::{DMat3, DVec3};
use raywake_core::dropped::DroppedReturns;
use raywake_core::encoder::ColumnClass;
use raywake_core::output::{FlowBasis, PointFlow, PointFlows, Status};
use raywake_core::params::{POINTS_MAX, Profile, SENSORS_MAX, SLOTS};
use raywake_core::pose::Pose;
use raywake_core::return_clock::{ReturnClock, slot_of};
use raywake_core::sweep::{Point, Rig, Sweep, Timing};
use raywake_core::thinning::TakenPoints;

/// A return in the world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct BatchReturn {
    /// m from the batch's corner.
    pub position: [f32; 3],
    /// Where its ray began, m from the corner.
    pub origin: [f32; 3],
    /// s after the batch's stamp.
    pub time_s: f32,
    /// Index of the sensor.
    pub sensor: u8,
    /// Whether rays pass on its left and right, once that is known.
    pub passed: [bool; 2],
    /// Velocity over ground by the flow, m/s, if known.
    pub velocity: Option<[f32; 2]>,
    /// P(moves) by the flow and the class of its column, if known.
    pub p_moves: Option<f32>,
    pub class: Option<ColumnClass>,
    /// Its index among its sweep's returns.
    pub index: u32,
    /// Index of the cell it lies in.
    pub cell: u32,
}

/// The flow of a sweep's returns.
#[derive(Clone, Copy, Debug)]
pub struct Flows<'a> {
    /// Those of all returns.
    pub of: PointFlows<'a>,
    /// Distance from the vehicle beyond which returns lie outside the flow's window, m.
    pub reach_m: f64,
}

impl Flows<'_> {
    /// How far the window of a profile reaches: all its columns except one at the edge, m.
    pub fn reach_m(profile: &Profile) -> f64 {
        (0.5 * f64::from(profile.side) - 1.0) * profile.voxel_m
    }

    /// The flow of a return `away` (m) from the vehicle.
    fn at(&self, n: usize, away: [f64; 2]) -> Option<PointFlow> {
        let inside = away[0] * away[0] + away[1] * away[1] < self.reach_m * self.reach_m;
        self.of.get(n).filter(|f| inside && f.status != Status::OverCapacity)
    }
}

/// Velocity of a return, m/s, if the flow is certain of it.
fn velocity(flow: PointFlow, sigma_max_mps: f32) -> Option<[f32; 2]> {
    let sum = flow.covariance[0] + flow.covariance[2];
    let certain = sum < 2.0 * sigma_max_mps * sigma_max_mps;
    (certain && flow.basis != FlowBasis::Unmatched).then_some(flow.velocity_world_mps)
}

/// Indices of the cell that contains a point of the window, along x and y.
pub(super) fn cell_along(at: [f32; 3]) -> [usize; 2] {
    [at[0], at[1]].map(|v| ((v / CELL_M) as usize).min(SIDE - 1))
}

/// Index of that cell.
pub(super) fn cell(at: [f32; 3]) -> u32 {
    let [i, j] = cell_along(at);
    (i * SIDE + j) as u32
}

/// What was taken since the last step.
pub(super) struct Batch {
    /// Made with the first sweep.
    clock: Option<ReturnClock>,
    /// Stamp of the first sweep taken, s.
    pub stamp_s: Option<f64>,
    /// World position of the corner of the window: a corner of the lattice along x and y, the
    /// ground under the vehicle along z.
    pub corner: DVec3,
    pub returns: heapless::Vec<BatchReturn, POINTS_MAX>,
    /// Returns left out since the last step.
    pub dropped: DroppedReturns,
    /// Whether the step is done: the contents are those of the last step.
    pub is_done: bool,
}

impl Batch {
    pub const fn new() -> Batch {
        Batch {
            clock: None,
            stamp_s: None,
            corner: DVec3::ZERO,
            returns: heapless::Vec::new(),
            dropped: DroppedReturns::ZERO,
            is_done: false,
        }
    }

    /// Forgets the returns of a step that is done.
    pub fn begin(&mut self) {
        if self.is_done {
            self.stamp_s = None;
            self.returns.clear();
            self.dropped = DroppedReturns::default();
            self.is_done = false;
        }
    }

    /// Converts a point relative to the corner to the world, m.
    pub fn in_world(&self, at: [f64; 3]) -> [f64; 3] {
        let corner = self.corner.to_array();
        [0, 1, 2].map(|a| corner[a] + at[a])
    }

    /// Adds the returns of a sweep. All returns of a sweep without a finite stamp or pose count as
    /// not finite.
    pub fn take(
        &mut self,
        params: &FrontEndParams,
        rig: &Rig,
        sweep: &Sweep,
        flows: Option<Flows>,
    ) {
        self.begin();
        if !is_finite(sweep) {
            self.dropped.not_finite += sweep.points.len() as u64;
            return;
        }
        let under = sweep.world_from_vehicle.transform(DVec3::new(0.0, 0.0, rig.ground_m));
        if self.stamp_s.is_none() {
            self.stamp_s = Some(sweep.stamp_s);
            let first =
                |v: f64| (libm::floor(v / CELL_M as f64) - (SIDE / 2) as f64) * CELL_M as f64;
            self.corner = DVec3::new(first(under.x), first(under.y), under.z);
        }
        let after_s = sweep.stamp_s - self.stamp_s.unwrap_or(sweep.stamp_s);
        let motion = SweepMotion::new(rig, sweep, self.corner);
        let edge = SIDE as f32 * CELL_M;
        let vehicle = under - self.corner;
        let clock = self.clock.get_or_insert_with(ReturnClock::new);
        let room = self.returns.capacity() - self.returns.len();
        let points = TakenPoints::new(sweep.points, room);
        self.dropped.over_capacity += points.left_out() as u64;
        for (n, point) in points.indexed() {
            match self.dropped.admit(rig, point) {
                Some(false) => {}
                Some(true) => {
                    self.dropped.own_vehicle += 1;
                    continue;
                }
                None => continue,
            }
            let (placed, offset_s) = motion.place(rig, point, clock.slots(rig, point));
            let at = placed.position;
            let inside = at[..2].iter().all(|v| *v >= 0.0 && *v < edge) && at[2].abs() < edge;
            if !inside {
                self.dropped.too_far += 1;
                continue;
            }
            let away = [at[0] as f64 - vehicle.x, at[1] as f64 - vehicle.y];
            let flow = flows.as_ref().and_then(|f| f.at(n, away));
            let one = BatchReturn {
                time_s: (after_s + offset_s) as f32,
                velocity: flow.and_then(|f| velocity(f, params.flow_sigma_max_mps)),
                p_moves: flow.map(|f| f.probability),
                class: flow.and_then(|f| f.class),
                index: n as u32,
                cell: cell(at),
                ..placed
            };
            // There is room for all that are taken.
            let _ = self.returns.push(one);
        }
    }
}

fn is_finite(sweep: &Sweep) -> bool {
    let Pose { rotation, translation } = sweep.world_from_vehicle;
    let vectors = [translation, sweep.twist.linear, sweep.twist.angular];
    sweep.stamp_s.is_finite() && rotation.is_finite() && vectors.iter().all(|v| v.is_finite())
}

/// The vehicle in one time slot.
#[derive(Clone, Copy, Default)]
struct SlotPose {
    rotation: DMat3,
    /// m from the corner.
    translation: DVec3,
    /// s after the sweep's stamp.
    offset_s: f64,
    /// Origins of the sensors' rays, m from the corner.
    origins: [[f32; 3]; SENSORS_MAX],
}

/// The vehicle's motion over a sweep.
struct SweepMotion {
    slots: [SlotPose; SLOTS],
    /// Whether returns have times.
    timed: bool,
    /// Velocity of the vehicle within a slot if it distorts the sweep, m/s.
    drift: DVec3,
}

impl SweepMotion {
    fn new(rig: &Rig, sweep: &Sweep, corner: DVec3) -> SweepMotion {
        let timed = rig.timing != Timing::AtStamp;
        let mut slots = [SlotPose::default(); SLOTS];
        for (slot, pose) in slots[..if timed { SLOTS } else { 1 }].iter_mut().enumerate() {
            let moved = if timed { sweep.motion(rig, slot) } else { Pose::IDENTITY };
            let then = sweep.world_from_vehicle * moved;
            let at = if rig.distorted { then } else { sweep.world_from_vehicle };
            pose.rotation = at.matrix();
            pose.translation = at.translation - corner;
            pose.offset_s = if timed { rig.timing.offset_s(slot as f64 + 0.5) } else { 0.0 };
            for (origin, mounted) in pose.origins.iter_mut().zip(&rig.sensors) {
                *origin = single((then * *mounted).translation - corner);
            }
        }
        let rotation = sweep.world_from_vehicle.rotation;
        let drift = if rig.distorted { rotation * sweep.twist.linear } else { DVec3::ZERO };
        SweepMotion { slots, timed, drift }
    }

    /// Places an admitted point by its time in slots; also returns that time after the stamp, s.
    fn place(&self, rig: &Rig, point: &Point, when: f32) -> (BatchReturn, f64) {
        let slot = &self.slots[if self.timed { slot_of(when) } else { 0 }];
        let offset_s = rig.timing.offset_s(f64::from(when));
        let [x, y, z] = point.position.map(f64::from);
        let drift = self.drift * (offset_s - slot.offset_s);
        let one = BatchReturn {
            position: single(slot.rotation * DVec3::new(x, y, z) + slot.translation + drift),
            origin: slot.origins[point.sensor as usize],
            // The sensor exists, and there are few.
            sensor: point.sensor as u8,
            ..BatchReturn::default()
        };
        (one, offset_s)
    }
}

fn single(v: DVec3) -> [f32; 3] {
    v.to_array().map(|c| c as f32)
}
