//! Flow tracklets (section 3.6.2): an EKF for every column that the flow observes.
//!
//! A tracklet follows a point of an object from cell to cell: the middle of the column it was born
//! in, moved by every displacement since. Positions are relative to that point, so f32 suffices
//! wherever the vehicle drives. One step: a tracklet whose cell was observed is predicted, gated,
//! updated and moved on; one whose cell was not takes over the nearest adjacent observed column
//! that no other has; an observed column without a tracklet gives birth to one; the rest coast for
//! [`crate::params::TrackletParams::coast_sweeps`], then end. If two tracklets end up in one cell,
//! a moving one is kept rather than one at rest, and of two alike the older.

pub mod ekf;
pub(crate) mod observe;
pub(crate) mod state;
#[cfg(test)]
mod tests;

use crate::params::{Birth, COLUMNS_MAX, FOREGROUND_MAX, Frame, Profile, TrackletParams};
use crate::record::{NONE, SweepUniform};
use crate::refinement::cues::{Cues, PREDICTING_AGE, Prediction};
use ekf::Ekf;
use nalgebra::Matrix2;

/// A flow tracklet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracklet {
    /// Filter; positions are relative to the point it follows, along the axes of the grid.
    pub ekf: Ekf,
    /// Number of observations after birth.
    pub age: u32,
    /// Sweeps since the last observation.
    pub missed: u32,
    /// Column of the window.
    pub column: u32,
    /// The point it follows, relative to the column's corner, cells: 0 to 1.
    pub place: [f32; 2],
    /// P(moves), as last observed.
    pub probability: f32,
}

/// How a column of the pair's first sweep moved.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// Column of the new window.
    pub column: u32,
    /// Displacement along the grid's axes, m.
    pub moved: [f32; 2],
    /// Its covariance (xx, xy, yy), m².
    pub covariance: [f32; 3],
    /// Cues to whether it moves.
    pub cues: Cues,
    /// P(moves).
    pub probability: f32,
    /// Index of its tracklet in [`Tracklets::all`] after the step, or [`NONE`].
    pub slot: u32,
}

crate::counters! {
    /// What happened to tracklets in a step.
    pub struct TrackletTurnover {
        /// Born.
        pub born,
        /// Updated.
        pub updated,
        /// Ended by the gate.
        pub gated,
        /// Coasting unobserved.
        pub waiting,
        /// Ended in favour of another one in the same cell.
        pub merged,
        /// Ended unobserved, or for lack of room.
        pub lost,
        /// Ended because their cell left the window.
        pub left,
    }
}

/// Predicts and updates a tracklet with a displacement. Returns whether it passed the gate.
pub(crate) fn observe(
    t: &mut Tracklet,
    profile: &Profile,
    moved: [f32; 2],
    covariance: [f32; 3],
    dt: f32,
) -> bool {
    let params = &profile.tracklet;
    let noise = position_noise(params, covariance);
    let refined = profile.refinement_sweeps > 0;
    if refined {
        // The errors of registrations are independent: the next displacement does not make up for
        // the error of this one, as it does in whole cells.
        t.ekf.measure_place(noise);
    }
    if t.ekf.at_rest() && moved != [0.0; 2] && params.birth == Birth::Target {
        // Number of sweeps from the one before its birth to this one.
        let sweeps = if refined { 1 } else { t.age + 2 };
        let elapsed = (dt * sweeps as f32).min(params.departure_s.max(dt));
        let departed = t.ekf.depart(params, noise, moved, elapsed, dt);
        t.ekf = departed.unwrap_or(t.ekf);
        return departed.is_some();
    }
    t.ekf.predict(params, dt);
    let passed = t.ekf.update(params, noise, moved);
    t.ekf.mean[0] -= moved[0];
    t.ekf.mean[1] -= moved[1];
    passed
}

/// Covariance of a position. A displacement lies between two positions with equal errors: half of
/// its covariance belongs to each, as does half of that of the poses between them.
fn position_noise(params: &TrackletParams, [xx, xy, yy]: [f32; 3]) -> Matrix2<f32> {
    let of_poses = params.pose_noise_m * params.pose_noise_m;
    Matrix2::new(xx + of_poses, xy, xy, yy + of_poses) * 0.5
}

/// All tracklets, with a fixed capacity beyond which none are born.
pub struct Tracklets {
    now: heapless::Vec<Tracklet, FOREGROUND_MAX>,
    next: heapless::Vec<Tracklet, FOREGROUND_MAX>,
    slot_of_column: [u32; COLUMNS_MAX],
    observation_of_column: [u32; COLUMNS_MAX],
    claimed: [bool; FOREGROUND_MAX],
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
            slot_of_column: [0; COLUMNS_MAX],
            observation_of_column: [0; COLUMNS_MAX],
            claimed: [false; FOREGROUND_MAX],
        }
    }

    /// The tracklets after the last step.
    pub fn all(&self) -> &[Tracklet] {
        &self.now
    }

    /// The tracklet in a column of the new window, after [`Tracklets::place`].
    pub(crate) fn at(&self, column: usize) -> Option<&Tracklet> {
        self.now.get(self.slot_of_column[column] as usize)
    }

    /// What the tracklet in a column predicts over `dt_s` seconds, voxels; `None` below
    /// [`PREDICTING_AGE`].
    pub(crate) fn predict(&self, column: usize, dt_s: f32, voxel_m: f32) -> Option<Prediction> {
        let &Tracklet { ekf, probability, .. } =
            self.at(column).filter(|t| t.age >= PREDICTING_AGE)?;
        let by = ekf.velocity().0.map(|v| v * dt_s / voxel_m);
        Some(Prediction { by, certainty: ekf.certainty(), probability })
    }

    /// Drops all tracklets.
    pub fn clear(&mut self) {
        self.now.clear();
    }

    /// One step over `dt` seconds, after [`Tracklets::place`], with the observed columns in
    /// ascending order; `left` is what that returned, `turned` how far the grid's axes have turned
    /// since the previous sweep, rad.
    pub(crate) fn update(
        &mut self,
        profile: &Profile,
        step: &SweepUniform,
        dt: f32,
        turned: f32,
        left: u32,
        observed: &mut [Observation],
    ) -> TrackletTurnover {
        let mut turnover = TrackletTurnover { left: left.into(), ..TrackletTurnover::default() };
        let known = self.now.len() as u64;
        self.claim(observed);
        if profile.tracklet.takes_over {
            self.take_over(step, observed);
        }
        self.next.clear();
        // From here on, indexed by the cells moved to.
        self.slot_of_column.fill(NONE);
        for o in observed {
            let known = self.now.get(core::mem::replace(&mut o.slot, NONE) as usize);
            let Some(mut t) = continued(known, profile, o, dt, &mut turnover) else { continue };
            if profile.frame == Frame::Sensor {
                t.ekf.turn_axes(turned);
            }
            let by = o.moved.map(|v| v / profile.voxel_m as f32);
            o.slot = self.put(step, o.column, by, t, &mut turnover);
        }
        self.coast(profile, step, dt, &mut turnover);
        // Swapping them would move both entirely through the stack.
        self.now.clear();
        self.now.extend(self.next.iter().copied());
        let TrackletTurnover { born, gated, merged, lost, left, .. } = turnover;
        let ended = gated + merged + lost + left;
        assert_eq!(self.now.len() as u64 + ended, known + born, "{turnover:?}");
        turnover
    }

    /// Assigns each observation the tracklet in its column.
    fn claim(&mut self, observed: &mut [Observation]) {
        self.observation_of_column.fill(NONE);
        self.claimed.fill(false);
        for (n, o) in observed.iter_mut().enumerate() {
            o.slot = self.slot_of_column[o.column as usize];
            self.observation_of_column[o.column as usize] = n as u32;
            if let Some(claimed) = self.claimed.get_mut(o.slot as usize) {
                *claimed = true;
            }
        }
    }

    /// Lets each tracklet whose cell was not observed take the nearest adjacent free column that
    /// was.
    fn take_over(&mut self, step: &SweepUniform, observed: &mut [Observation]) {
        let side = step.side;
        for (slot, t) in self.now.iter_mut().enumerate() {
            if t.column == NONE || self.claimed[slot] {
                continue;
            }
            let (i, j) = (t.column as i32 / side, t.column as i32 % side);
            let mut best = (f32::INFINITY, NONE);
            for (di, dj) in (-1..=1).flat_map(|a| (-1..=1).map(move |b| (a, b))) {
                if !(0..side).contains(&(i + di)) || !(0..side).contains(&(j + dj)) {
                    continue;
                }
                let n = self.observation_of_column[((i + di) * side + j + dj) as usize];
                let free = observed.get(n as usize).is_some_and(|o| o.slot == NONE);
                let [x, y] = [di as f32 + 0.5 - t.place[0], dj as f32 + 0.5 - t.place[1]];
                if free && x * x + y * y < best.0 {
                    best = (x * x + y * y, n);
                }
            }
            if let Some(o) = observed.get_mut(best.1 as usize) {
                o.slot = slot as u32;
                self.claimed[slot] = true;
                let by = [o.column as i32 / side - i, o.column as i32 % side - j];
                // The nearest point of that column.
                t.place = [0, 1].map(|a| (t.place[a] - by[a] as f32).clamp(0.0, INSIDE));
            }
        }
    }

    /// Puts a tracklet into the cell it ends up in, `by` cells from `column`. If two meet, a moving
    /// one is kept rather than one at rest, and of two alike the older. Returns the slot.
    fn put(
        &mut self,
        step: &SweepUniform,
        column: u32,
        by: [f32; 2],
        t: Tracklet,
        turnover: &mut TrackletTurnover,
    ) -> u32 {
        let side = step.side;
        let from = [column as i32 / side, column as i32 % side];
        let at: [f32; 2] = core::array::from_fn(|a| t.place[a] + by[a]);
        let cells = at.map(|v| libm::floorf(v) as i32);
        // Two sweeps a nanosecond apart can give a speed that overflows the cell indices.
        let [i, j] = [0, 1].map(|a| from[a].saturating_add(cells[a]));
        if !(0..side).contains(&i) || !(0..side).contains(&j) {
            turnover.left += 1;
            return NONE;
        }
        let column = (i * side + j) as u32;
        let place = core::array::from_fn(|a| (at[a] - cells[a] as f32).clamp(0.0, INSIDE));
        let t = Tracklet { column, place, ..t };
        let there = self.slot_of_column[column as usize];
        if let Some(other) = self.next.get_mut(there as usize) {
            turnover.merged += 1;
            // With the output velocity of the one at rest, a moving object would appear static.
            let rank = |t: &Tracklet| (!t.ekf.at_rest(), t.age);
            if rank(&t) > rank(other) {
                *other = t;
            }
            return there;
        }
        if self.next.push(t).is_err() {
            turnover.lost += 1;
            return NONE;
        }
        let slot = self.next.len() as u32 - 1;
        self.slot_of_column[column as usize] = slot;
        slot
    }

    /// Lets unobserved tracklets move on as predicted for a while, with growing covariance (5.2.2).
    fn coast(
        &mut self,
        profile: &Profile,
        step: &SweepUniform,
        dt: f32,
        turnover: &mut TrackletTurnover,
    ) {
        for slot in 0..self.now.len() {
            let t = self.now[slot];
            let coasts = t.missed < profile.tracklet.coast_sweeps && t.age > t.missed;
            if t.column == NONE || self.claimed[slot] {
                continue;
            }
            if !coasts {
                turnover.lost += 1;
                continue;
            }
            let mut t = Tracklet { missed: t.missed + 1, ..t };
            t.ekf.predict(&profile.tracklet, dt);
            let by = [t.ekf.mean[0], t.ekf.mean[1]];
            t.ekf.mean[0] = 0.0;
            t.ekf.mean[1] = 0.0;
            turnover.waiting += 1;
            let cells = by.map(|v| v / profile.voxel_m as f32);
            self.put(step, t.column, cells, t, turnover);
        }
    }

    /// Finds the tracklets' columns in the new window. Returns how many are no longer in it; their
    /// column is [`NONE`].
    pub(crate) fn place(&mut self, step: &SweepUniform) -> u32 {
        let side = step.side;
        self.slot_of_column.fill(NONE);
        let mut left = 0;
        for (slot, t) in self.now.iter_mut().enumerate() {
            let i = t.column as i32 / side - step.shift_x;
            let j = t.column as i32 % side - step.shift_y;
            t.column = NONE;
            if (0..side).contains(&i) && (0..side).contains(&j) {
                t.column = (i * side + j) as u32;
                self.slot_of_column[t.column as usize] = slot as u32;
            } else {
                left += 1;
            }
        }
        left
    }
}

/// Largest coordinate inside a cell: the float before 1.
const INSIDE: f32 = 1.0 - f32::EPSILON;

/// What a known tracklet, or none, becomes with an observation of its column; `None` if it ends.
fn continued(
    known: Option<&Tracklet>,
    profile: &Profile,
    o: &Observation,
    dt: f32,
    turnover: &mut TrackletTurnover,
) -> Option<Tracklet> {
    if let Some(known) = known {
        let mut t = *known;
        if observe(&mut t, profile, o.moved, o.covariance, dt) {
            turnover.updated += 1;
            return Some(Tracklet { age: t.age + 1, missed: 0, probability: o.probability, ..t });
        }
        turnover.gated += 1;
        if profile.tracklet.birth == Birth::Source {
            return None;
        }
    }
    turnover.born += 1;
    Some(born(profile, o, dt))
}

fn born(profile: &Profile, o: &Observation, dt: f32) -> Tracklet {
    let noise = position_noise(&profile.tracklet, o.covariance);
    let ekf = Ekf::birth(&profile.tracklet, noise, o.moved, dt);
    let (column, probability) = (o.column, o.probability);
    Tracklet { ekf, age: 0, missed: 0, column, place: [0.5; 2], probability }
}
