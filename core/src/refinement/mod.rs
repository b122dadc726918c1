//! Refinement of the flow below cell size: clusters of returns, and how each of them moved.
//!
//! Cells of 0.3 m limit what displacements by whole cells can express; this stage goes back to the
//! returns. It works on clusters rather than columns: all columns of a cluster share one rigid
//! motion. It has no counterpart in the dissertation. Per pair of sweeps:
//!
//! 1. Returns above the ground are thinned to one per sub-voxel ([`thinned_returns`]).
//! 2. Columns that touch form a cluster ([`segments`]).
//! 3. Each cluster is registered with the second sweep, and with one before the pair if
//!    [`refinement_sweeps`](crate::params::Profile::refinement_sweeps) allows ([`align`]):
//!    generalised ICP with a Geman-McClure kernel, both ways, from several starts: rest, what its
//!    tracklets predict, the displacements most of its columns found by energy minimisation, if
//!    none of these fits a search and, if it moves, how traffic moves ([`starts`]). Its ends show
//!    how far it slid along itself ([`slide`]).
//! 4. A hypothesis test separates dynamic clusters from static ones ([`hypothesis`]): with r0 and r
//!    the mean truncated residuals at rest and of the motion (as in MSAC: Torr and Zisserman,
//!    2000), the evidence for motion is (1 - r / r0) sqrt(r0 - r). Up to two sweeps before the pair
//!    are compared, the earlier one from 0.5 s before it at 10 Hz: a pedestrian has moved by then.
//!    At rest only what can be seen counts: where a return fits badly, or nothing is near, a ray
//!    must have passed to decide ([`sightlines`]). The same holds for a motion if the encoder says
//!    that the cluster could move, or if it moved in the last sweep; otherwise returns that end up
//!    out of sight count as missed, because behind a corner anything fits, except those that were
//!    outside the window before the pair. A cluster that moved in the last sweep needs less
//!    evidence.
//! 5. A static cluster may have a moving part ([`clusters`]): columns that fit badly at rest in the
//!    second sweep or in the earliest, or that came to where nothing was before. The remainder of
//!    the cluster, fragments next to the part and what the encoder takes for the rest of its body
//!    may go with it ([`bodies`]). A part is taken out again if it could not move, as far as the
//!    encoder knows, shows no motion of its own, and is where something was hit before: the cluster
//!    only passes it.
//! 6. All columns of a dynamic cluster move with it, including those that the background filter
//!    removed or that found no match, and the ground below it ([`footprint`]), unless the encoder
//!    takes that for road beside it. Covariances are inflated by the residual ([`refined`]).
//! 7. Cues determine how likely it is that a column moves ([`cues`], [`forest`]), among them what
//!    was hit before at the places it came to ([`history`]).
//!
//! Parameters are those of [`RefinementParams`](crate::params::RefinementParams), in metres;
//! internally, lengths are in voxels ([`scaled`]).

mod align;
mod bodies;
mod cloud;
mod cloud_detail;
mod cloud_ring;
mod cluster;
mod clusters;
pub mod cues;
mod footprint;
pub mod forest;
mod history;
mod hypothesis;
mod motion;
mod places;
mod ray_batch;
mod refined;
mod sample;
mod scaled;
mod scans;
mod search;
mod segments;
mod sightlines;
mod slide;
mod starts;
mod surface;
mod sweep_returns;
#[cfg(test)]
mod tests;
mod thinned_returns;

use crate::encoder::ColumnScores;
use crate::record::{Flow, SweepUniform, VALID, flow_displacement};
use crate::team::Team;
use cloud::Scratch;
use cloud_ring::CloudRing;
use clusters::Clusters;
pub(crate) use cues::Prediction;
use history::History;
pub(crate) use refined::Refined;
use scaled::Scaled;
use scans::Scans;
pub(crate) use sweep_returns::SweepReturns;

/// State of the refinement between sweeps.
pub struct Refinement {
    scaled: Option<Scaled>,
    clouds: CloudRing,
    history: History,
    scratch: Scratch,
    clusters: Clusters,
}

impl Refinement {
    pub(crate) const fn new() -> Refinement {
        Refinement {
            scaled: None,
            clouds: CloudRing::new(),
            history: History::new(),
            scratch: Scratch::new(),
            clusters: Clusters::new(),
        }
    }

    /// Forgets all sweeps.
    pub(crate) fn clear(&mut self) {
        self.clouds.clear();
        self.history.clear();
    }

    /// Inserts the cloud of a sweep. `apart` is set to whether each return is ground or above the
    /// height of clusters. Returns how many returns had no room.
    pub(crate) fn insert_cloud(
        &mut self,
        team: &impl Team,
        returns: SweepReturns,
        apart: &mut [bool],
    ) -> usize {
        let scaled = self.scaled.insert(Scaled::new(returns.profile));
        self.clouds.insert(team, scaled, returns, apart, &mut self.scratch)
    }

    /// Finds the motion of the clusters of the pair's first sweep. `flow` holds the matches of the
    /// columns of the new window, `scores` the encoder's scores of the first sweep's columns, empty
    /// if nothing is encoded; `predicted` gives what the tracklet of a column of the new window
    /// predicts.
    pub(crate) fn run(
        &mut self,
        team: &impl Team,
        step: &SweepUniform,
        flow: &[Flow],
        scores: &[ColumnScores],
        predicted: impl Fn(usize) -> Option<Prediction> + Sync,
    ) {
        self.clusters.clear();
        let (Some(scaled), Some(span_s)) = (&self.scaled, self.clouds.span_s()) else {
            return;
        };
        let first = self.clouds.first();
        let side = first.side;
        let shifted = |c: usize| {
            let (i, j) = ((c / side) as i32 - step.shift_x, (c % side) as i32 - step.shift_y);
            let inside = (0..step.side).contains(&i) && (0..step.side).contains(&j);
            inside.then_some((i * step.side + j) as usize)
        };
        let flow = |c: usize| shifted(c).map_or(0, |c| flow[c]);
        let predicted = |c: usize| shifted(c).and_then(&predicted);
        let targets = self.clouds.targets(span_s);
        let detail = self.clouds.second().detail;
        let traffic = &starts::traffic(first.columns().filter_map(predicted));
        let (targets, history) = (&targets, &self.history);
        let scans = Scans { scaled, first, targets, detail, scores, traffic, span_s, history };
        self.clusters.find(team, scans, flow, predicted);
        self.history.push(first, |c| self.clusters.came(c));
    }

    /// Number of columns in clusters that there was no room for: they are taken as static.
    pub(crate) fn beyond_capacity(&self) -> usize {
        self.clusters.beyond
    }

    /// How a column of the first sweep's window moved, if it is part of a moving cluster.
    pub(crate) fn at(&self, column: u32) -> Option<Refined> {
        let cluster = self.clusters.of(column as usize).filter(|f| f.is_dynamic)?;
        let side = self.clouds.first().side as u32;
        let at = [column / side, column % side].map(|c| c as f32 + 0.5);
        let cues = self.clusters.cues(column as usize);
        Some(Refined { cues, ..Refined::of(self.scaled.as_ref()?, cluster, at) })
    }

    /// How a column of the new window moved, or that it is static.
    pub(crate) fn of(&self, step: &SweepUniform, column: usize, flow: Flow) -> Refined {
        let Some(scaled) = &self.scaled else {
            return Refined::nothing();
        };
        let side = step.side;
        let (i, j) = (column as i32 / side + step.shift_x, column as i32 % side + step.shift_y);
        let inside = (0..side).contains(&i) && (0..side).contains(&j);
        let before = (i * side + j) as usize;
        let matched = (flow & VALID != 0).then(|| flow_displacement(flow).map(|d| d as f32));
        let Some(own) = inside.then(|| self.clusters.of(before)).flatten() else {
            return Refined::at_rest(scaled, 0.0).as_static(scaled, matched);
        };
        let refined = Refined::of(scaled, own, [i as f32 + 0.5, j as f32 + 0.5]);
        let refined = Refined { cues: self.clusters.cues(before), ..refined };
        if own.is_dynamic { refined } else { refined.as_static(scaled, matched) }
    }
}
