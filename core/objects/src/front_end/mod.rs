//! The front end of 2.4: from sweeps to tracks of objects.
//!
//! ```text
//! sweeps, poses -> [batch] -> [object_returns] -> [segments] -> [association] -> tracks
//!                              z varies           connected      gate of the EKF
//!                                                 chunks
//! ```
//! Returns of about 100 ms, from any number of sensors, each at its own time, are placed in the
//! world (`batch`); those of objects are found by the variance of z in 2-D cells and by the ground
//! (`object_returns`); they are gathered in small containers in space and time (`chunks`), whose
//! connected components are segments (`segments`). Each segment continues at most one track
//! (`association`), or begins one; a track that is not observed for a while ends.
//!
//! With the flow of the returns ([`FrontEnd::take`]), whatever moves belongs to an object wherever
//! it is, neighbours that move differently are two objects, and the velocity of a segment joins its
//! position in the gate.

mod assignment;
mod association;
mod batch;
mod chunks;
mod counts;
mod object_returns;
mod params;
#[cfg(test)]
pub(crate) mod scene;
mod segments;
#[cfg(test)]
mod tests;
mod thinned;
mod track;

pub use batch::Flows;
pub use counts::TrackingCounts;
pub use object_returns::GroundMap;
pub use params::FrontEndParams;
pub use thinned::Thinned;
pub use track::{HISTORY_MAX, LATEST_MAX, StateVariances, Track, TrackStatus};

use crate::panorama::Panorama;
use association::Association;
use batch::{Batch, BatchReturn};
use object_returns::ObjectReturns;
use raywake_core::params::SIDE_MAX;
use raywake_core::sweep::{Rig, Sweep};
use segments::Segmentation;

/// Maximum number of tracks followed at once.
pub const TRACKS_MAX: usize = 160;
/// Maximum number of segments of a batch that may be objects; further ones are counted.
pub const SEGMENTS_MAX: usize = 1024;
/// Edge of a 2-D cell, m. With [`SIDE`] it sizes the window.
pub const CELL_M: f32 = 0.4;
/// Number of cells along an axis of the window around the vehicle: 102 m.
pub const SIDE: usize = 255;
const CELLS: usize = SIDE * SIDE;

const _: () = assert!(SIDE <= SIDE_MAX);

/// The front end's state between steps; the tracks are the caller's. Large: keep it in a box.
pub struct FrontEnd {
    batch: Batch,
    objects: ObjectReturns,
    segments: Segmentation,
    association: Association,
    panorama: Panorama,
    /// Segments without a track.
    unassigned: heapless::Vec<u32, SEGMENTS_MAX>,
    last_s: Option<f64>,
    next_id: u32,
}

impl Default for FrontEnd {
    fn default() -> Self {
        FrontEnd::new()
    }
}

impl FrontEnd {
    /// A front end at rest.
    pub const fn new() -> FrontEnd {
        FrontEnd {
            batch: Batch::new(),
            objects: ObjectReturns::new(),
            segments: Segmentation::new(),
            association: Association::new(),
            panorama: Panorama::new(),
            unassigned: heapless::Vec::new(),
            last_s: None,
            next_id: 0,
        }
    }

    /// Adds a sweep to the batch of the next step; there may be several, each with its own stamp.
    /// `flows` are those of its points, if known.
    pub fn take(
        &mut self,
        params: &FrontEndParams,
        rig: &Rig,
        sweep: &Sweep,
        flows: Option<Flows>,
    ) {
        self.batch.take(params, rig, sweep, flows);
    }

    /// Continues the tracks with what was taken since the last step. `tracks` are the same as in
    /// that step; the first [`TRACKS_MAX`] of them are used. Those that have ended can be read
    /// until the next step.
    pub fn step<const R: usize, const H: usize>(
        &mut self,
        params: &FrontEndParams,
        map: Option<&GroundMap>,
        tracks: &mut [Track<R, H>],
    ) -> TrackingCounts {
        let used = tracks.len().min(TRACKS_MAX);
        let tracks = &mut tracks[..used];
        free_ended(tracks);
        self.batch.begin();
        let mut counts =
            TrackingCounts { dropped: self.batch.dropped, ..TrackingCounts::default() };
        if let Some(stamp_s) = self.batch.stamp_s {
            if self.last_s.is_some_and(|last_s| stamp_s <= last_s) {
                counts.reset = end(tracks, |_| true);
            }
            self.last_s = Some(stamp_s);
            counts.ended = counts.reset + end(tracks, |t| stamp_s - t.last_s() > params.patience_s);
            let FrontEnd { batch, objects, segments, association, .. } = self;
            objects.find(params, batch, map);
            segments.find(params, batch, |n| objects.contain(n), &mut counts);
            association.find(params, batch, segments.all(), tracks);
            self.continue_tracks(params, tracks, &mut counts);
            self.begin_tracks(params, tracks, &mut counts);
            // Needed by estimates only.
            if R > 0 {
                self.find_passing(params);
            }
            self.distribute(tracks);
            tracks.iter_mut().for_each(|track| track.complete(params));
        }
        self.batch.is_done = true;
        counts
    }

    /// The returns of the last step's sweeps that belong to a track: the return's index in its
    /// sweep, and the slot of its track.
    pub fn members(&self) -> impl Iterator<Item = (usize, usize)> {
        let slot = |n: usize| Some(self.association.slot(self.segments.of_return(n)?));
        let all = self.batch.returns.iter().enumerate();
        let all = all.filter_map(move |(n, one)| Some((one.index as usize, slot(n)? as usize)));
        all.filter(|(_, slot)| *slot < TRACKS_MAX)
    }

    /// Ends all tracks, as at the end of a drive. Returns how many there were.
    pub fn finish<const R: usize, const H: usize>(&mut self, tracks: &mut [Track<R, H>]) -> u64 {
        free_ended(tracks);
        end(tracks, |_| true)
    }

    /// Finds where rays pass the returns of segments.
    fn find_passing(&mut self, params: &FrontEndParams) {
        let FrontEnd { panorama, batch, segments, .. } = self;
        let ray = |one: &BatchReturn| (one.sensor, one.origin, one.position);
        let wanted = |n| segments.of_return(n).is_some();
        let found = |one: &mut BatchReturn, passed| one.passed = passed;
        panorama.look(&params.passing, &mut batch.returns, ray, wanted, found);
    }

    /// Updates the tracks that have a segment; the others wait, or end.
    fn continue_tracks<const R: usize, const H: usize>(
        &mut self,
        params: &FrontEndParams,
        tracks: &mut [Track<R, H>],
        counts: &mut TrackingCounts,
    ) {
        self.unassigned.clear();
        for (n, segment) in self.segments.all().iter().enumerate() {
            let (time_s, at) = segment.in_world(&self.batch);
            match tracks.get_mut(self.association.slot(n) as usize) {
                Some(track) => {
                    track.observe(&params.centroid, time_s, at);
                    counts.updated += 1;
                }
                // There is room for all.
                None => _ = self.unassigned.push(n as u32),
            }
        }
        for slot in self.association.unobserved() {
            if tracks[slot].observations < params.observations_min {
                tracks[slot].status = TrackStatus::Ended;
                counts.ended += 1;
            } else {
                counts.waiting += 1;
            }
        }
    }

    /// Begins a track with each segment that has none, largest first, as long as there is room.
    fn begin_tracks<const R: usize, const H: usize>(
        &mut self,
        params: &FrontEndParams,
        tracks: &mut [Track<R, H>],
        counts: &mut TrackingCounts,
    ) {
        let segments = self.segments.all();
        let count = |n: u32| segments[n as usize].count;
        self.unassigned.sort_unstable_by_key(|n| (u32::MAX - count(*n), *n));
        for &n in &self.unassigned {
            let Some(slot) = tracks.iter().position(|t| t.status == TrackStatus::Free) else {
                counts.unborn += 1;
                continue;
            };
            let (time_s, at) = segments[n as usize].in_world(&self.batch);
            tracks[slot].begin(self.next_id, &params.centroid, time_s, at);
            self.next_id = self.next_id.wrapping_add(1);
            self.association.begin(n as usize, slot);
            counts.born += 1;
        }
    }

    /// Passes the returns of every segment to its track.
    fn distribute<const R: usize, const H: usize>(&self, tracks: &mut [Track<R, H>]) {
        let Some(stamp_s) = self.last_s else { return };
        for (n, one) in self.batch.returns.iter().enumerate() {
            let Some(segment) = self.segments.of_return(n) else { continue };
            if let Some(track) = tracks.get_mut(self.association.slot(segment) as usize) {
                let time_s = stamp_s + one.time_s as f64;
                let world = |v: [f32; 3]| self.batch.in_world(v.map(f64::from));
                track.keep(time_s, world(one.position), world(one.origin), one);
            }
        }
    }
}

/// Frees the slots of tracks that have ended.
fn free_ended<const R: usize, const H: usize>(tracks: &mut [Track<R, H>]) {
    tracks.iter_mut().filter(|t| t.status == TrackStatus::Ended).for_each(Track::free);
}

/// Ends live tracks. Returns how many.
fn end<const R: usize, const H: usize>(
    tracks: &mut [Track<R, H>],
    which: impl Fn(&Track<R, H>) -> bool,
) -> u64 {
    let mut ended = 0;
    for track in tracks.iter_mut().filter(|t| t.status == TrackStatus::Live && which(t)) {
        track.status = TrackStatus::Ended;
        ended += 1;
    }
    ended
}
