//! The front end of 2.4: from sweeps to tracks of objects.
//!
//! ```text
//! sweeps, poses -> [batch] -> [cells] -> [chunks] -> segments -> [assignment] -> tracks
//!                              z varies   linked                  gate of the EKF
//! ```
//! Returns of some 100 ms, of any number of sensors, each at its own time, are put into the world
//! (`batch`); those of objects are told by the variance of z in 2-D cells and by the ground (`cells`);
//! they are gathered in small containers in space and time, whose connected components are segments
//! (`chunks`). Each segment continues at most one track, by global nearest neighbour among those
//! within the gate of the filter's prediction (`assignment`), or begins one; a track that is not
//! observed for a while ends.
//!
//! With the flow of the returns ([`FrontEnd::take`]) what moves is an object's wherever it is,
//! neighbours that move differently are two, and the velocity of a segment joins its position in the
//! gate.

mod assignment;
mod batch;
mod cells;
mod chunks;
#[cfg(test)]
mod tests;
mod track;

pub use batch::Flows;
pub use cells::GroundMap;
pub use track::{HISTORY_MAX, LATEST_MAX, Life, Thinned, Track};

use super::centroid_ekf::{CentroidEkf, CentroidParams};
use super::panorama::Panorama;
use assignment::Assignment;
use batch::{Batch, Seen};
use cells::Cells;
use chunks::{Chunks, Segment};
use nalgebra::{Matrix2, Vector2};
use raywake_core::dropped::DroppedReturns;
use raywake_core::params::COLUMNS_MAX;
use raywake_core::record::NONE;
use raywake_core::sweep::{Rig, Sweep};

/// Tracks followed at once at most.
pub const TRACKS_MAX: usize = 160;
/// Segments of a batch that may be objects; further ones are counted.
pub const SEGMENTS_MAX: usize = 1024;
/// Edge of a 2-D cell, m.
pub const CELL_M: f32 = 0.4;
/// Cells along an axis of the window around the vehicle: 102 m.
pub const SIDE: usize = 255;
const CELLS: usize = SIDE * SIDE;
/// An object is farther than this from what a filter expects in no case, m and m/s: the rest is not
/// looked at closely.
const FAR_M: f64 = 5.0;
const FAR_MPS: f64 = 45.0;

const _: () = assert!(CELLS <= COLUMNS_MAX);

/// The front end's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontEndParams {
    /// The filters.
    pub centroid: CentroidParams,
    /// Variance of z in a cell from which on its returns are an object's, m².
    pub variance_m2: f32,
    /// Returns lower above the ground than this are the ground's, m.
    pub low_m: f32,
    /// Returns from this height above the ground on are an object's in any cell, m.
    pub raised_m: f32,
    /// Returns from this height on are no object's, m.
    pub high_m: f32,
    /// From this speed on the flow has a return moving, m/s.
    pub moving_mps: f32,
    /// Segments of fewer returns are no objects.
    pub returns_min: u32,
    /// Segments that extend farther along x or y are no objects, m.
    pub extent_max_m: f32,
    /// Limit of the squared Mahalanobis distance of a centroid: chi-square, three degrees of freedom.
    pub gate_d2: f64,
    /// Limit with the flow's velocity: five degrees of freedom.
    pub gate_with_flow_d2: f64,
    /// Standard deviation of a segment's velocity by the flow, m/s.
    pub flow_mps: f64,
    /// A track ends so long after its last observation, s.
    pub patience_s: f64,
    /// With fewer observations it ends at the first batch without one.
    pub observations_min: u32,
}

impl FrontEndParams {
    /// For cars, cyclists and people around a car with spinning sensors.
    pub const fn street() -> FrontEndParams {
        FrontEndParams {
            centroid: CentroidParams::dissertation(),
            variance_m2: 0.01,
            low_m: 0.2,
            raised_m: 0.5,
            high_m: 4.0,
            moving_mps: 0.5,
            returns_min: 15,
            extent_max_m: 18.0,
            // 99 % quantiles.
            gate_d2: 11.345,
            gate_with_flow_d2: 15.086,
            flow_mps: 0.7,
            patience_s: 0.5,
            observations_min: 3,
        }
    }

    fn moves(&self, velocity: Option<[f32; 2]>) -> bool {
        velocity.is_some_and(|[x, y]| x * x + y * y >= self.moving_mps * self.moving_mps)
    }
}

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Turnover {
    /// Returns left out before they were looked at.
    pub dropped: DroppedReturns,
    /// Returns of objects.
    pub object_returns: u64,
    /// Returns of objects beyond the capacity for chunks.
    pub unchunked: u64,
    /// Segments that may be objects.
    pub segments: u32,
    /// Segments too small for one.
    pub too_small: u32,
    /// Segments too large.
    pub too_large: u32,
    /// Segments beyond the capacity.
    pub unlisted: u32,
    /// Tracks begun.
    pub born: u32,
    /// Segments that found no room for a track.
    pub unborn: u32,
    /// Tracks continued.
    pub updated: u32,
    /// Tracks that wait unobserved.
    pub waiting: u32,
    /// Tracks ended.
    pub ended: u32,
    /// Of these, because time went backwards.
    pub reset: u32,
}

/// The front end's state between steps; the tracks are the caller's. Large: keep it in a box.
pub struct FrontEnd {
    batch: Batch,
    cells: Cells,
    chunks: Chunks,
    assignment: Assignment,
    panorama: Panorama,
    /// Slots of the tracks that may be continued: the rows of the assignment.
    rows: heapless::Vec<u32, TRACKS_MAX>,
    /// Segments without a track.
    free: heapless::Vec<u32, SEGMENTS_MAX>,
    /// Slot of the track of each segment, or [`NONE`].
    slot_of_segment: [u32; SEGMENTS_MAX],
    last_s: f64,
    next_id: u32,
}

impl Default for FrontEnd {
    fn default() -> Self {
        FrontEnd::new()
    }
}

impl FrontEnd {
    /// A front end at rest.
    pub fn new() -> FrontEnd {
        FrontEnd {
            batch: Batch::new(),
            cells: Cells::new(),
            chunks: Chunks::new(),
            assignment: Assignment::new(),
            panorama: Panorama::new(),
            rows: heapless::Vec::new(),
            free: heapless::Vec::new(),
            slot_of_segment: [NONE; SEGMENTS_MAX],
            last_s: f64::NEG_INFINITY,
            next_id: 0,
        }
    }

    /// Adds a sweep to the batch of the next step, as many as there are, each with its own stamp.
    /// `flows` are those of its points, where they are known.
    pub fn take(&mut self, rig: &Rig, sweep: &Sweep, flows: Option<Flows>) {
        self.batch.take(rig, sweep, flows);
    }

    /// Continues the tracks with what has been taken since the last step. `tracks` are the same as
    /// then, the first [`TRACKS_MAX`] of them are used; those that have ended can be looked at until
    /// the next step.
    pub fn step(
        &mut self,
        params: &FrontEndParams,
        map: Option<&GroundMap>,
        tracks: &mut [Track],
    ) -> Turnover {
        let used = tracks.len().min(TRACKS_MAX);
        let tracks = &mut tracks[..used];
        tracks.iter_mut().filter(|t| t.life == Life::Ended).for_each(Track::free);
        let mut turnover = Turnover { dropped: self.batch.dropped, ..Turnover::default() };
        if let Some(stamp_s) = self.batch.stamp_s {
            if stamp_s <= self.last_s {
                turnover.reset = end(tracks, |_| true);
            }
            self.last_s = stamp_s;
            turnover.ended =
                turnover.reset + end(tracks, |t| stamp_s - t.last_s() > params.patience_s);
            self.segment(params, map, &mut turnover);
            self.associate(params, tracks);
            self.advance(params, tracks, &mut turnover);
            self.look_beside();
            self.distribute(tracks);
        }
        self.batch.clear();
        turnover
    }

    /// Ends all tracks, as at the end of a drive. Returns how many there were.
    pub fn finish(&mut self, tracks: &mut [Track]) -> u32 {
        tracks.iter_mut().filter(|t| t.life == Life::Ended).for_each(Track::free);
        end(tracks, |_| true)
    }

    /// Finds where rays pass the returns of segments.
    fn look_beside(&mut self) {
        let FrontEnd { panorama, batch, chunks, .. } = self;
        let ray = |seen: &Seen| (seen.sensor, seen.origin, seen.at);
        let wanted = |n| chunks.segment_of(n).is_some();
        panorama.look(&mut batch.returns, ray, wanted, |seen, passed| seen.passed = passed);
    }

    fn segment(
        &mut self,
        params: &FrontEndParams,
        map: Option<&GroundMap>,
        turnover: &mut Turnover,
    ) {
        let (batch, cells) = (&self.batch, &mut self.cells);
        cells.label(params, batch, map);
        let left = self.chunks.segment(params, batch, |n| cells.is_object(n));
        let objects = (0..batch.returns.len()).filter(|n| cells.is_object(*n));
        turnover.object_returns = objects.count() as u64;
        turnover.unchunked = left.returns;
        turnover.segments = self.chunks.segments().len() as u32;
        turnover.too_small = left.too_small;
        turnover.too_large = left.too_large;
        turnover.unlisted = left.over_capacity;
    }

    /// Finds the segment that continues each track.
    fn associate(&mut self, params: &FrontEndParams, tracks: &[Track]) {
        let segments = self.chunks.segments();
        self.rows.clear();
        for (slot, track) in tracks.iter().enumerate() {
            let Some(ekf) = track.ekf.as_ref().filter(|_| track.life == Life::Live) else {
                continue;
            };
            let costs = self.assignment.costs(self.rows.len());
            for (segment, cost) in segments.iter().zip(costs) {
                let (time_s, at) = in_world(&self.batch, segment);
                let (after_s, place) = (time_s - track.start_s, track.place(at));
                let elapsed = (after_s - ekf.time_s()).max(0.0);
                let last = ekf.state().position;
                let far = FAR_M + FAR_MPS * elapsed;
                if (0..2).any(|a| (place[a] - last[a]).abs() > far) {
                    continue;
                }
                let mut ahead = *ekf;
                ahead.predict(&params.centroid, after_s);
                let d2 = ahead.distance2(&params.centroid, place);
                // As a share of the gate.
                let share = match segment.velocity {
                    None => d2 / params.gate_d2,
                    Some(v) => {
                        let of_velocity = velocity_distance2(&ahead, v, params.flow_mps);
                        (d2 + of_velocity) / params.gate_with_flow_d2
                    }
                };
                if share <= 1.0 {
                    *cost = share as f32;
                }
            }
            // There are as many rows as tracks.
            let _ = self.rows.push(slot as u32);
        }
        self.assignment.solve(self.rows.len(), segments.len(), 1.0);
        for (segment, slot) in self.slot_of_segment[..segments.len()].iter_mut().enumerate() {
            *slot = self.assignment.track(segment).map_or(NONE, |row| self.rows[row]);
        }
    }

    /// Continues, begins and ends tracks.
    fn advance(&mut self, params: &FrontEndParams, tracks: &mut [Track], turnover: &mut Turnover) {
        let segments = self.chunks.segments();
        self.free.clear();
        for (n, segment) in segments.iter().enumerate() {
            let (time_s, at) = in_world(&self.batch, segment);
            match tracks.get_mut(self.slot_of_segment[n] as usize) {
                Some(track) => {
                    track.observe(&params.centroid, time_s, at);
                    turnover.updated += 1;
                }
                // There is room for all.
                None => _ = self.free.push(n as u32),
            }
        }
        for &slot in &self.rows {
            let track = &mut tracks[slot as usize];
            if !self.slot_of_segment[..segments.len()].contains(&slot) {
                if track.observations < params.observations_min {
                    track.life = Life::Ended;
                    turnover.ended += 1;
                } else {
                    turnover.waiting += 1;
                }
            }
        }
        // Of those for which there may be no room, the best seen first.
        let count = |n: u32| segments[n as usize].count;
        self.free.sort_unstable_by_key(|n| (u32::MAX - count(*n), *n));
        for &n in &self.free {
            let Some(slot) = tracks.iter().position(|t| t.life == Life::Free) else {
                turnover.unborn += 1;
                continue;
            };
            let (time_s, at) = in_world(&self.batch, &segments[n as usize]);
            tracks[slot].begin(self.next_id, &params.centroid, time_s, at);
            self.next_id = self.next_id.wrapping_add(1);
            self.slot_of_segment[n as usize] = slot as u32;
            turnover.born += 1;
        }
    }

    /// Hands the returns of every segment to its track.
    fn distribute(&self, tracks: &mut [Track]) {
        for (n, seen) in self.batch.returns.iter().enumerate() {
            let slot = self.chunks.segment_of(n).map_or(NONE, |s| self.slot_of_segment[s]);
            if let Some(track) = tracks.get_mut(slot as usize) {
                let time_s = self.last_s + seen.time_s as f64;
                let world = |v: [f32; 3]| from_corner(&self.batch, v.map(f64::from));
                track.keep(time_s, world(seen.at), world(seen.origin), seen);
            }
        }
    }
}

/// Ends live tracks. Returns how many.
fn end(tracks: &mut [Track], which: impl Fn(&Track) -> bool) -> u32 {
    let mut ended = 0;
    for track in tracks.iter_mut().filter(|t| t.life == Life::Live && which(t)) {
        track.life = Life::Ended;
        ended += 1;
    }
    ended
}

/// Time and place of a segment in the world.
fn in_world(batch: &Batch, segment: &Segment) -> (f64, [f64; 3]) {
    (batch.stamp_s.unwrap_or(0.0) + segment.time_s, from_corner(batch, segment.centroid))
}

fn from_corner(batch: &Batch, at: [f64; 3]) -> [f64; 3] {
    let corner = batch.corner.to_array();
    [0, 1, 2].map(|a| corner[a] + at[a])
}

/// Squared Mahalanobis distance between a velocity of the flow, of standard deviation `flow_mps`,
/// and that of a filter.
fn velocity_distance2(ekf: &CentroidEkf, velocity: [f64; 2], flow_mps: f64) -> f64 {
    let (expected, [xx, xy, yy]) = ekf.velocity();
    let off = Vector2::new(velocity[0] - expected[0], velocity[1] - expected[1]);
    let noise = Matrix2::from_diagonal_element(flow_mps * flow_mps);
    // Positive definite by the noise.
    let weight = (Matrix2::new(xx, xy, xy, yy) + noise).try_inverse().unwrap_or_default();
    (off.transpose() * weight * off)[0]
}
