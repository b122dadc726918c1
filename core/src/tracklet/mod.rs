//! Flow tracklets (section 3.6.2): a filter for every column that is seen to move with the flow.
//!
//! One step: every tracklet with a valid flow at its cell is predicted, gated and updated, and
//! moves to the cell the flow leads to; a valid flow where there is no tracklet gives birth to one;
//! tracklets without a valid flow, or beyond the gate, end. Flows never share a target
//! (section 3.5.2.2), so no two tracklets can meet in a cell.

pub mod ekf;

use crate::params::{Birth, COLUMNS_MAX, FOREGROUND_MAX, Frame, Profile};
use crate::record::{Flow, NONE, Step, VALID, flow_displacement};
use ekf::Ekf;

/// A flow tracklet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracklet {
    /// Filter; positions from the centre of `column`, axes of the grid.
    pub ekf: Ekf,
    /// Observations after birth.
    pub age: u32,
    /// Column of the window.
    pub column: u32,
}

/// What happened to tracklets in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Turnover {
    /// Born.
    pub born: u32,
    /// Updated.
    pub updated: u32,
    /// Ended by the gate.
    pub gated: u32,
    /// Ended without a valid flow at their cell.
    pub lost: u32,
    /// Ended because their cell left the window.
    pub left: u32,
}

/// Sweeps over which the first displacement of a tracklet at rest is taken to have happened, at
/// most: what stood for long and starts is not slow.
const DEPARTURE_SWEEPS: u32 = 10;

/// Predicts and updates a tracklet with a displacement, and puts it into its new cell. Returns
/// whether it passed the gate.
pub(crate) fn observe(
    t: &mut Tracklet,
    profile: &Profile,
    r: f32,
    moved: [f32; 2],
    dt: f32,
) -> bool {
    let params = &profile.tracklet;
    if t.ekf.at_rest() && moved != [0.0; 2] && params.birth == Birth::Target {
        // From the sweep before its birth to this one.
        let elapsed = dt * (t.age + 2).min(DEPARTURE_SWEEPS) as f32;
        let departed = t.ekf.depart(params, r, moved, elapsed, dt);
        t.ekf = departed.unwrap_or(t.ekf);
        return departed.is_some();
    }
    t.ekf.predict(params, dt);
    let passed = t.ekf.update(params, r, moved);
    t.ekf.mean[0] -= moved[0];
    t.ekf.mean[1] -= moved[1];
    passed
}

/// All tracklets: fixed capacity, one per foreground column at most.
pub struct Tracklets {
    now: heapless::Vec<Tracklet, FOREGROUND_MAX>,
    next: heapless::Vec<Tracklet, FOREGROUND_MAX>,
    slot_of_column: [u32; COLUMNS_MAX],
}

impl Default for Tracklets {
    fn default() -> Self {
        Tracklets::new()
    }
}

impl Tracklets {
    /// No tracklets.
    pub const fn new() -> Tracklets {
        Tracklets {
            now: heapless::Vec::new(),
            next: heapless::Vec::new(),
            slot_of_column: [NONE; COLUMNS_MAX],
        }
    }

    /// The tracklets after the last step.
    pub fn all(&self) -> &[Tracklet] {
        &self.now
    }

    /// Drops all.
    pub fn clear(&mut self) {
        self.now.clear();
    }

    /// One step over `dt` seconds with the flows of `foreground` columns; `turned` is by how much
    /// the grid's axes turned since the sweep before, rad. `slot_of_source`, one element per
    /// foreground column, receives the index of its tracklet in [`Tracklets::all`] or [`NONE`].
    pub fn update(
        &mut self,
        profile: &Profile,
        step: &Step,
        dt: f32,
        turned: f32,
        foreground: &[u32],
        state: &[Flow],
        slot_of_source: &mut [u32],
    ) -> Turnover {
        let mut turnover = Turnover::default();
        let before = self.now.len() as u32;
        turnover.left = self.place(step);
        self.next.clear();
        for (&column, slot) in foreground.iter().zip(slot_of_source) {
            *slot = NONE;
            let flow = state[column as usize];
            if flow & VALID == 0 {
                continue;
            }
            let cells = flow_displacement(flow);
            let r = profile.voxel_m as f32;
            let moved = cells.map(|c| c as f32 * r);
            let known = self.slot_of_column[column as usize];
            let (mut ekf, age) = if known == NONE {
                turnover.born += 1;
                (Ekf::birth(&profile.tracklet, r, moved, dt), 0)
            } else {
                let mut t = self.now[known as usize];
                if !observe(&mut t, profile, r, moved, dt) {
                    turnover.gated += 1;
                    continue;
                }
                turnover.updated += 1;
                (t.ekf, t.age + 1)
            };
            if profile.frame == Frame::Sensor {
                ekf.turn_axes(turned);
            }
            let column = crate::flow::target(step, column, cells) as u32;
            // As many as there are foreground columns at most: there is room.
            if self.next.push(Tracklet { ekf, age, column }).is_ok() {
                *slot = self.next.len() as u32 - 1;
            }
        }
        turnover.lost = before - turnover.left - turnover.updated - turnover.gated;
        core::mem::swap(&mut self.now, &mut self.next);
        turnover
    }

    /// Finds the tracklets' columns in the new window. Returns how many are no longer in it.
    pub(crate) fn at(&self, column: usize) -> Option<&Tracklet> {
        self.now.get(self.slot_of_column[column] as usize)
    }

    pub(crate) fn place(&mut self, step: &Step) -> u32 {
        let side = step.side;
        self.slot_of_column.fill(NONE);
        let mut left = 0;
        for (slot, t) in self.now.iter().enumerate() {
            let i = t.column as i32 / side - step.shift_x;
            let j = t.column as i32 % side - step.shift_y;
            if (0..side).contains(&i) && (0..side).contains(&j) {
                self.slot_of_column[(i * side + j) as usize] = slot as u32;
            } else {
                left += 1;
            }
        }
        left
    }
}
