//! The returns of some 100 ms, of any number of sensors, in the world.

use super::{CELL_M, SIDE};
use glam::{DMat3, DVec3};
use raywake_core::dropped::DroppedReturns;
use raywake_core::output::{Origin, PointFlow};
use raywake_core::params::{POINTS_MAX, SLOTS};
use raywake_core::pose::Pose;
use raywake_core::return_clock::{ReturnClock, slot_of};
use raywake_core::sweep::{Rig, SENSORS_MAX, Sweep, Timing};

/// A velocity with a larger standard deviation tells nothing, m/s.
const SURE_MPS: f32 = 0.7;

/// A return in the world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Seen {
    /// m from the batch's corner.
    pub at: [f32; 3],
    /// Where its ray began, m from there.
    pub origin: [f32; 3],
    /// s after the batch's stamp.
    pub time_s: f32,
    /// Index of the sensor.
    pub sensor: u8,
    /// Whether rays pass to its left and right, once they have been looked at.
    pub passed: [bool; 2],
    /// Over ground by the flow, m/s, as far as it tells.
    pub velocity: Option<[f32; 2]>,
}

impl Seen {
    /// Index of the cell it lies in.
    pub fn cell(&self) -> usize {
        let [i, j] = cell(self.at);
        i * SIDE + j
    }
}

/// The flow of a sweep's returns.
#[derive(Clone, Copy, Debug)]
pub struct Flows<'a> {
    /// Of every return, in the sweep's order.
    pub of: &'a [PointFlow],
    /// Returns farther from the vehicle lie outside the flow's window, m.
    pub reach_m: f64,
}

impl Flows<'_> {
    /// Velocity of a return `away` from the vehicle, m/s.
    fn velocity(&self, n: usize, away: [f64; 2]) -> Option<[f32; 2]> {
        let inside = away[0] * away[0] + away[1] * away[1] < self.reach_m * self.reach_m;
        let flow = self.of.get(n).filter(|f| inside && f.origin != Origin::Unmatched)?;
        let sure = flow.covariance[0] + flow.covariance[2] < 2.0 * SURE_MPS * SURE_MPS;
        sure.then_some(flow.velocity_world_mps)
    }
}

/// Indices of the cell of a place in the window.
pub(super) fn cell(at: [f32; 3]) -> [usize; 2] {
    [at[0], at[1]].map(|v| ((v / CELL_M) as usize).min(SIDE - 1))
}

/// What has been taken since the last step.
pub(super) struct Batch {
    clock: ReturnClock,
    /// Stamp of the first sweep taken, s.
    pub stamp_s: Option<f64>,
    /// World position of the corner of the window: a corner of the lattice along x and y, the
    /// ground under the vehicle along z.
    pub corner: DVec3,
    pub returns: heapless::Vec<Seen, POINTS_MAX>,
    /// Left out since the last step.
    pub dropped: DroppedReturns,
}

impl Batch {
    pub fn new() -> Batch {
        Batch {
            clock: ReturnClock::new(),
            stamp_s: None,
            corner: DVec3::ZERO,
            returns: heapless::Vec::new(),
            dropped: DroppedReturns::default(),
        }
    }

    pub fn clear(&mut self) {
        self.stamp_s = None;
        self.returns.clear();
        self.dropped = DroppedReturns::default();
    }

    /// Adds the returns of a sweep. Those of a sweep without a finite stamp or pose are not finite.
    pub fn take(&mut self, rig: &Rig, sweep: &Sweep, flows: Option<Flows>) {
        let Pose { rotation, translation } = sweep.world_from_vehicle;
        let twist = [sweep.twist.linear, sweep.twist.angular];
        let finite = sweep.stamp_s.is_finite()
            && rotation.is_finite()
            && translation.is_finite()
            && twist.iter().all(|v| v.is_finite());
        if !finite {
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

        let timed = rig.timing != Timing::AtStamp;
        let mut places = [Place::default(); SLOTS];
        for (slot, place) in places[..if timed { SLOTS } else { 1 }].iter_mut().enumerate() {
            let moved = if timed { sweep.motion(rig, slot) } else { Pose::IDENTITY };
            let then = sweep.world_from_vehicle * moved;
            let at = if rig.distorted { then } else { sweep.world_from_vehicle };
            place.turn = at.matrix();
            place.at = at.translation - self.corner;
            place.offset_s = if timed { rig.timing.offset_s(slot as f64 + 0.5) } else { 0.0 };
            for (origin, mounted) in place.origins.iter_mut().zip(&rig.sensors) {
                *origin = metres((then * *mounted).translation - self.corner);
            }
        }
        // What the vehicle moves on within a slot.
        let drift = if rig.distorted { rotation * sweep.twist.linear } else { DVec3::ZERO };
        let edge = SIDE as f32 * CELL_M;
        let vehicle = under - self.corner;
        for (n, point) in sweep.points.iter().enumerate() {
            match self.dropped.admit(rig, point) {
                Some(false) => {}
                Some(true) => {
                    self.dropped.own_vehicle += 1;
                    continue;
                }
                None => continue,
            }
            let when = self.clock.slots(rig, point);
            let slot = if timed { slot_of(when) } else { 0 };
            let offset_s = rig.timing.offset_s(f64::from(when));
            let place = &places[slot];
            let [x, y, z] = point.position.map(f64::from);
            let drift = drift * (offset_s - place.offset_s);
            let at = metres(place.turn * DVec3::new(x, y, z) + place.at + drift);
            let inside = at[..2].iter().all(|v| *v >= 0.0 && *v < edge) && at[2].abs() < edge;
            if !inside {
                self.dropped.too_far += 1;
                continue;
            }
            let away = [at[0] as f64 - vehicle.x, at[1] as f64 - vehicle.y];
            let velocity = flows.as_ref().and_then(|f| f.velocity(n, away));
            let seen = Seen {
                at,
                origin: place.origins[point.sensor as usize],
                time_s: (after_s + offset_s) as f32,
                // Admitted: there is such a sensor, and there are few.
                sensor: point.sensor as u8,
                passed: [false; 2],
                velocity,
            };
            self.dropped.over_capacity += self.returns.push(seen).is_err() as u64;
        }
    }
}

/// The vehicle in one time slot.
#[derive(Clone, Copy, Default)]
struct Place {
    turn: DMat3,
    /// m from the corner.
    at: DVec3,
    /// s after the sweep's stamp.
    offset_s: f64,
    /// Of the sensors, m from the corner.
    origins: [[f32; 3]; SENSORS_MAX],
}

fn metres(v: DVec3) -> [f32; 3] {
    v.to_array().map(|c| c as f32)
}
