//! The sweeps that clusters are registered with, and the residual of one return.

use super::cloud::{Cloud, DetailedCloud};
use super::cloud_detail::CloudDetail;
use super::cues::Looks;
use super::history::History;
use super::motion::Motion;
use super::sample::{CloudPoint, Mean, minus, squared_distance};
use super::scaled::Scaled;
use crate::encoder::{ColumnScores, could_move};

/// A sweep that clusters are registered with: where its window lies relative to the first sweep's,
/// and what share of the motion over the pair has happened from stamp to stamp.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    pub index: usize,
    pub cloud: &'a Cloud,
    pub offset: [f32; 3],
    pub share: f32,
}

/// All of a cluster's returns are compared with the pair's second sweep, but only every other one,
/// counted twice, with each earlier sweep. With all of them there, precision and recall are the
/// same to within 0.3 % (18 drives of 25 sweeps on simulated outskirts, three rigs), and a sweep of
/// KITTI drive 0005 takes 5 % longer on one core.
const EARLIER_STRIDE: usize = 2;

impl Target<'_> {
    /// The stride at which a cluster's returns are compared with it.
    pub fn stride(&self) -> usize {
        if self.index == 0 { 1 } else { EARLIER_STRIDE }
    }

    /// What share of a motion over the pair has happened when a cluster is seen in this sweep.
    pub fn share(&self, motion: &Motion) -> f32 {
        self.share + motion.delay[self.index]
    }

    /// Where a return of the first sweep is expected in this one, voxels of this one's window.
    pub fn predict(&self, s: &CloudPoint, motion: &Motion) -> [f32; 3] {
        let d = motion.of([s.at[0], s.at[1]]);
        let share = self.share(motion);
        [
            s.at[0] + share * d[0] + self.offset[0],
            s.at[1] + share * d[1] + self.offset[1],
            s.at[2] + self.offset[2],
        ]
    }

    /// Where a return of this sweep was in the first one, voxels of the first sweep's window.
    pub fn retrace(&self, q: &CloudPoint, motion: &Motion) -> [f32; 3] {
        let share = self.share(motion);
        let at = minus(q.at, self.offset);
        let d = motion.of([at[0] - share * motion.delta.x, at[1] - share * motion.delta.y]);
        [at[0] - share * d[0], at[1] - share * d[1], at[2]]
    }
}

/// What clusters are registered with.
#[derive(Clone, Copy)]
pub struct Scans<'a> {
    pub scaled: &'a Scaled,
    /// The pair's first sweep, which the clusters are taken from.
    pub first: DetailedCloud<'a>,
    /// The pair's second sweep, then earlier ones.
    pub targets: &'a [Target<'a>],
    /// Detail of the pair's second sweep.
    pub detail: &'a CloudDetail,
    /// The encoder's scores of the first sweep's columns, empty if nothing is encoded.
    pub scores: &'a [ColumnScores],
    /// The most frequent displacements that tracklets predict for the pair, voxels.
    pub traffic: &'a [[f32; 2]],
    /// From the pair's first stamp to the second, s.
    pub span_s: f64,
    /// Where something was hit before the pair.
    pub history: &'a History,
}

impl<'a> Scans<'a> {
    /// Share of looks that hit something else ([`Looks::worn`]) of those at columns of the first
    /// sweep, had they come with this motion. `with` tells what else came with them. Nothing is
    /// excused as having been at rest there.
    pub fn worn(&self, columns: &[u32], motion: &Motion, with: impl Fn(usize) -> bool) -> f32 {
        let is_part = |c: usize| with(c) || columns.binary_search(&(c as u32)).is_ok();
        let mut looks = Looks::default();
        for c in columns.iter().map(|c| *c as usize) {
            let by = motion.of(self.first.centre_of(c));
            looks += self.history.looks(self.first, c, by, self.span_s, None, is_part);
        }
        looks.worn()
    }

    /// The pair's second sweep.
    pub fn second(&self) -> DetailedCloud<'a> {
        DetailedCloud { cloud: self.targets[0].cloud, detail: self.detail }
    }

    /// Score of what could move for a column of the first sweep, nats; 0 if it has none.
    pub fn could_move(&self, column: usize) -> f32 {
        self.scores.get(column).map_or(0.0, could_move)
    }

    /// Whether a column goes with no moving cluster.
    pub fn stays(&self, column: usize) -> bool {
        self.could_move(column) < self.scaled.params.could_move_min
    }

    /// Whether a column could move rather than not, as far as the encoder knows.
    pub fn could_rather_move(&self, column: usize) -> bool {
        self.could_move(column) >= 0.0
    }

    /// Truncated residual of a return of the cloud `of` against what was found at its predicted
    /// place, 0 to 1: all returns that are missed count the same.
    pub fn residual(
        &self,
        of: DetailedCloud,
        s: &CloudPoint,
        at: [f32; 3],
        found: Option<(f32, CloudPoint)>,
    ) -> f32 {
        let Some((d2, q)) = found else { return 1.0 };
        let Scaled { inlier, truncation, .. } = *self.scaled;
        // Near enough that the surface hardly matters.
        if d2 < inlier * inlier {
            return 0.0;
        }
        let weight = of.weight(self.scaled, s.index);
        // Weights are rounded: along a surface the distance might come out negative.
        (squared_distance(&weight, minus(q.at, at)) / (truncation * truncation)).clamp(0.0, 1.0)
    }

    /// Residual of a return of the first sweep in a target sweep, if it moved.
    pub fn dynamic_residual(&self, s: &CloudPoint, motion: &Motion, target: &Target) -> f32 {
        let at = target.predict(s, motion);
        self.residual(self.first, s, at, target.cloud.nearest(at, s.sensor, self.reach_inlier()))
    }

    /// The same, if it can be determined.
    pub fn seen_residual(&self, s: &CloudPoint, motion: &Motion, target: &Target) -> Option<f32> {
        self.decisive_residual(self.first, s, target.cloud, target.predict(s, motion))
    }

    /// Residual of a return of the first sweep in the second, if it was static; `None` if it cannot
    /// be determined.
    pub fn static_residual(&self, s: &CloudPoint) -> Option<f32> {
        self.seen_residual(s, &Motion::default(), &self.targets[0])
    }

    /// Residual of a return of the cloud `of` in another if it is predicted to be `at` there. If it
    /// fits badly, what is near may be another part of its surface, and a ray must have passed to
    /// decide. A ray that was stopped earlier decides nothing.
    pub fn decisive_residual(
        &self,
        of: DetailedCloud,
        s: &CloudPoint,
        other: &Cloud,
        at: [f32; 3],
    ) -> Option<f32> {
        let found = other.nearest(at, s.sensor, self.reach_inlier());
        let near = self.residual(of, s, at, found);
        if near < self.scaled.params.sight_residual {
            return Some(near);
        }
        // Outside the window no returns are kept, and along a wall rays end farther on.
        if other.column_at([at[0], at[1]]).is_none() {
            return found.map(|_| near);
        }
        let weight = of.weight(self.scaled, s.index);
        let behind = other.sightlines.depth(other.simd, self.scaled, at, &weight, s.offset_s)?;
        let ratio = behind / self.scaled.truncation;
        (ratio > -1.0).then(|| near.min(ratio * ratio))
    }

    /// Mean residual of some returns of a column, 0 if it cannot be determined.
    pub fn column_residual(
        &self,
        column: usize,
        residual: impl Fn(&CloudPoint) -> Option<f32>,
    ) -> f32 {
        let returns = self.first.column(column);
        let looked_at = self.scaled.params.column_returns as usize;
        let stride = returns.len().div_ceil(looked_at).max(1);
        let mut mean = Mean::default();
        let samples = returns.step_by(stride).map(|n| self.first.sample(n));
        samples.filter_map(|s| residual(&s)).for_each(|m| mean.add(m));
        mean.value()
    }

    /// Mean residual of a column at rest in the earliest sweep, 0 if that is the pair's second.
    pub fn early_residual(&self, column: usize) -> f32 {
        let [_, .., earliest] = self.targets else { return 0.0 };
        self.column_residual(column, |s| self.seen_residual(s, &Motion::default(), earliest))
    }

    /// By how much the returns of a column fit rest worse than a motion, 0 if that cannot be seen.
    pub fn misfit(&self, column: usize, motion: &Motion) -> f32 {
        let mut mean = Mean::default();
        for s in self.first.column(column).map(|n| self.first.sample(n)) {
            if let Some(rest) = self.static_residual(&s) {
                mean.add(rest - self.dynamic_residual(&s, motion, &self.targets[0]));
            }
        }
        mean.value()
    }

    /// Limits of the search for the nearest return: how far it goes, and how near is near enough.
    pub fn reach_inlier(&self) -> [f32; 2] {
        [self.scaled.match_distance, self.scaled.inlier]
    }

    /// The same if the very nearest is needed.
    pub fn reach_exact(&self) -> [f32; 2] {
        [self.scaled.match_distance, 0.0]
    }
}
