//! Finds which segment continues which track: global nearest neighbour within the gates of the
//! filters' predictions (Bar-Shalom and Fortmann, 1988).

use super::assignment::Assignment;
use super::batch::Batch;
use super::segments::Segment;
use super::{FrontEndParams, SEGMENTS_MAX, TRACKS_MAX, Track, TrackStatus};
use crate::centroid_ekf::CentroidEkf;
use nalgebra::{Matrix2, Vector2};
use raywake_core::record::NONE;

pub(super) struct Association {
    assignment: Assignment,
    /// Slots of the tracks that may be continued: the rows of the assignment.
    live: heapless::Vec<u32, TRACKS_MAX>,
    /// Slot of the track of each segment, or [`NONE`].
    slot_of_segment: [u32; SEGMENTS_MAX],
    segments: usize,
}

impl Association {
    pub const fn new() -> Association {
        Association {
            assignment: Assignment::new(),
            live: heapless::Vec::new(),
            slot_of_segment: [0; SEGMENTS_MAX],
            segments: 0,
        }
    }

    /// Finds the segment that continues each live track.
    pub fn find<const R: usize, const H: usize>(
        &mut self,
        params: &FrontEndParams,
        batch: &Batch,
        segments: &[Segment],
        tracks: &[Track<R, H>],
    ) {
        self.live.clear();
        for (slot, track) in tracks.iter().enumerate() {
            let Some(ekf) = track.ekf.as_ref().filter(|_| track.status == TrackStatus::Live) else {
                continue;
            };
            let costs = self.assignment.costs(self.live.len());
            for (segment, cost) in segments.iter().zip(costs) {
                if let Some(share) = gate_share(params, batch, track, ekf, segment) {
                    *cost = share as f32;
                }
            }
            // There are as many rows as tracks.
            let _ = self.live.push(slot as u32);
        }
        self.segments = segments.len();
        self.assignment.solve(self.live.len(), self.segments, 1.0);
        for (segment, slot) in self.slot_of_segment[..self.segments].iter_mut().enumerate() {
            *slot = self.assignment.track(segment).map_or(NONE, |row| self.live[row]);
        }
    }

    /// Slot of a segment's track, or [`NONE`].
    pub fn slot(&self, segment: usize) -> u32 {
        self.slot_of_segment[segment]
    }

    /// Gives a segment to the track that begins with it.
    pub fn begin(&mut self, segment: usize, slot: usize) {
        self.slot_of_segment[segment] = slot as u32;
    }

    /// Slots of the tracks that no segment continues.
    pub fn unobserved(&self) -> impl Iterator<Item = usize> {
        let observed = &self.slot_of_segment[..self.segments];
        self.live.iter().filter(|slot| !observed.contains(slot)).map(|slot| *slot as usize)
    }
}

/// Squared Mahalanobis distance of a segment from a track's prediction, as a fraction of the gate;
/// none beyond it.
fn gate_share<const R: usize, const H: usize>(
    params: &FrontEndParams,
    batch: &Batch,
    track: &Track<R, H>,
    ekf: &CentroidEkf,
    segment: &Segment,
) -> Option<f64> {
    let (time_s, at) = segment.in_world(batch);
    let (after_s, place) = (time_s - track.start_s, track.place(at));
    let elapsed = (after_s - ekf.time_s()).max(0.0);
    let last = ekf.state().position;
    let far = params.coarse_gate_m + params.coarse_gate_mps * elapsed;
    if (0..2).any(|a| (place[a] - last[a]).abs() > far) {
        return None;
    }
    let mut ahead = *ekf;
    ahead.predict(&params.centroid, after_s);
    let d2 = ahead.distance2(&params.centroid, place);
    let share = match segment.velocity {
        None => d2 / params.association_d2,
        Some(v) => {
            let of_velocity = velocity_distance2(&ahead, v, params.segment_velocity_sigma_mps);
            (d2 + of_velocity) / params.association_with_flow_d2
        }
    };
    (share <= 1.0).then_some(share)
}

/// Squared Mahalanobis distance between the velocity from the flow and that of a filter.
pub(super) fn velocity_distance2(ekf: &CentroidEkf, velocity: [f64; 2], sigma_mps: f64) -> f64 {
    let (expected, [xx, xy, yy]) = ekf.velocity();
    let off = Vector2::new(velocity[0] - expected[0], velocity[1] - expected[1]);
    let noise = Matrix2::from_diagonal_element(sigma_mps * sigma_mps);
    // Positive definite because of the noise.
    let weight = (Matrix2::new(xx, xy, xy, yy) + noise).try_inverse().unwrap_or_default();
    (off.transpose() * weight * off)[0]
}
