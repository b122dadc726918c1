//! A cluster and how well a motion explains its returns.

use super::motion::{Motion, TARGETS_MAX};
use super::sample::{CloudPoint, Mean};
use super::scans::{Scans, Target};
use crate::column_set::ColumnSet;

/// Maximum number of a cluster's returns that are registered; up to as many of the second sweep
/// are registered back. Bounds the time a cluster takes.
pub const SAMPLES_MAX: usize = 96;
/// Maximum number of columns of the second sweep that are examined; bounds the stack.
const TARGET_COLUMNS_MAX: usize = 1024;
/// Residual from which a return counts as missed rather than found.
const HALF_MISSED: f32 = 0.5;

pub type CloudPoints = heapless::Vec<CloudPoint, SAMPLES_MAX>;

/// Residuals in one sweep, of the returns that can be seen there.
#[derive(Clone, Copy)]
pub struct SeenResidual {
    mean: Mean,
    /// Share of the returns that can be seen.
    visible: f32,
}

/// Residuals of one motion: of the cluster's returns in every sweep, and of the second sweep's
/// returns in the first, each only if it can be seen.
pub struct SeenResiduals {
    in_sweeps: heapless::Vec<SeenResidual, TARGETS_MAX>,
    backward: heapless::Vec<f32, SAMPLES_MAX>,
}

impl SeenResiduals {
    /// Their mean, 0 if there are none.
    pub fn value(&self) -> f32 {
        self.value_in(|_| true)
    }

    /// The same of the `wanted` sweeps only, and of all returns of the second sweep.
    fn value_in(&self, wanted: impl Fn(usize) -> bool) -> f32 {
        let mut mean = Mean::default();
        let in_sweeps = self.in_sweeps.iter().enumerate().filter(|(n, _)| wanted(*n));
        in_sweeps.for_each(|(_, seen)| mean.include(seen.mean));
        self.backward.iter().for_each(|m| mean.add(*m));
        mean.value()
    }

    /// The share of the cluster's returns that can be seen in the second sweep.
    pub fn visible(&self) -> f32 {
        self.in_sweeps[0].visible
    }
}

/// A cluster: its columns, some of its returns, and what they are registered with.
pub struct Cluster<'a> {
    pub scans: Scans<'a>,
    pub columns: &'a [u32],
    /// Every k-th of its returns.
    pub samples: CloudPoints,
    /// Their mean, voxels from the first sweep's window corner.
    pub centre: [f32; 2],
    /// Largest extent along an axis, voxels.
    pub extent: f32,
    /// Whether the encoder takes it for something that could move, or it moved in the last sweep.
    pub could_move: bool,
}

impl<'a> Cluster<'a> {
    /// A cluster of some columns of the first sweep.
    pub fn new(scans: Scans<'a>, columns: &'a [u32]) -> Cluster<'a> {
        let first = scans.first;
        let returns = || columns.iter().flat_map(|c| first.column(*c as usize));
        let stride = returns().count().div_ceil(SAMPLES_MAX).max(1);
        let samples: CloudPoints = returns().step_by(stride).map(|n| first.sample(n)).collect();
        let count = samples.len() as f32;
        let along = |a: usize| samples.iter().map(move |s| s.at[a]);
        let centre = [0, 1].map(|a| along(a).sum::<f32>() / count);
        let extent = [0, 1].map(|a| {
            along(a).fold(f32::NEG_INFINITY, f32::max) - along(a).fold(f32::INFINITY, f32::min)
        });
        let extent = extent[0].max(extent[1]);
        // More likely than not. With a threshold of 1 nat, recall at a precision of 95 % is 0.1
        // points lower (streets).
        let could_move = columns.iter().map(|c| scans.could_move(*c as usize)).sum::<f32>() > 0.0;
        Cluster { scans, columns, samples, centre, extent, could_move }
    }

    /// Distance from the middle of the window, where the vehicle is, voxels, but not less than the
    /// minimum range.
    pub fn range(&self) -> f32 {
        let middle = 0.5 * self.scans.first.side as f32;
        let [x, y] = self.centre.map(|c| c - middle);
        libm::sqrtf(x * x + y * y).max(self.scans.scaled.range_min)
    }

    /// Lists the columns of the second sweep that have returns and lie in or next to those the
    /// cluster would be in; returns how many returns they have. If a cluster is too large for the
    /// list, its first columns are enough.
    fn target_columns(
        &self,
        motion: &Motion,
        visited: &mut ColumnSet,
        list: &mut heapless::Vec<u32, TARGET_COLUMNS_MAX>,
    ) -> usize {
        let target = &self.scans.targets[0];
        let side = self.scans.first.side;
        let mut total = 0;
        'columns: for &c in self.columns {
            let at = self.scans.first.centre_of(c as usize);
            let d = motion.of(at);
            let i = (at[0] + d[0] + target.offset[0]) as i32;
            let j = (at[1] + d[1] + target.offset[1]) as i32;
            for a in i.saturating_sub(1).max(0)..i.saturating_add(2).min(side as i32) {
                for b in j.saturating_sub(1).max(0)..j.saturating_add(2).min(side as i32) {
                    let column = a as usize * side + b as usize;
                    let n = target.cloud.column(column).len();
                    if list.is_full() {
                        break 'columns;
                    }
                    if n > 0 && visited.insert(column) {
                        let _ = list.push(column as u32);
                        total += n;
                    }
                }
            }
        }
        visited.remove(list);
        total
    }

    /// Returns of the second sweep where the cluster would be.
    pub fn target_samples(&self, motion: &Motion, visited: &mut ColumnSet) -> CloudPoints {
        let cloud = self.scans.targets[0].cloud;
        let mut columns = heapless::Vec::new();
        let total = self.target_columns(motion, visited, &mut columns);
        let returns = columns.iter().flat_map(|c| cloud.column(*c as usize));
        let stride = total.div_ceil(SAMPLES_MAX).max(1);
        returns.step_by(stride).map(|n| cloud.sample(n)).collect()
    }

    /// Mean truncated residual of a motion, both ways: 0 (all returns lie on something) to 1 (none
    /// does). A return that ends up where nothing can be seen counts as missed, unless the cluster
    /// could move and most of it is seen in the second sweep: behind a corner anything fits.
    /// `None` if it is not below `limit`: the sum ends as soon as it cannot be.
    pub fn residual_below(
        &self,
        limit: f32,
        motion: &Motion,
        visited: &mut ColumnSet,
    ) -> Option<f32> {
        let targets = self.scans.targets;
        let second = self.could_move.then(|| self.seen_in(&targets[0], motion));
        let second = second.filter(|second| self.is_majority(second.visible));
        let mut mean = Mean::default();
        let mut left = targets.iter().map(|t| self.count_in(t)).sum::<usize>() + SAMPLES_MAX;
        for target in targets {
            mean.include(match second {
                Some(second) if target.index == 0 => second.mean,
                Some(_) => self.seen_in(target, motion).mean,
                None => self.all_in(target, motion),
            });
            left -= self.count_in(target);
            // Even if all that is still to come fits perfectly: no residual is negative, and
            // rounding keeps the order.
            if mean.value_with(left as f32) >= limit {
                return None;
            }
        }
        match second {
            Some(_) => self.seen_backward(motion, visited).for_each(|m| mean.add(m)),
            None => self.add_all_backward(&mut mean, motion, visited),
        }
        Some(mean.value()).filter(|residual| *residual < limit)
    }

    /// What the cluster's returns count for in one sweep, at most.
    fn count_in(&self, target: &Target) -> usize {
        self.samples.len().next_multiple_of(target.stride())
    }

    /// Residuals of a motion in one sweep.
    fn all_in(&self, target: &Target, motion: &Motion) -> Mean {
        let mut mean = Mean::default();
        for s in self.samples.iter().step_by(target.stride()) {
            let [x, y, _] = target.predict(s, motion);
            // What has just entered the window was outside it before.
            if target.index > 0 && target.cloud.column_at([x, y]).is_none() {
                continue;
            }
            let residual = self.scans.dynamic_residual(s, motion, target);
            mean.add_weighted(residual, target.stride() as f32);
        }
        mean
    }

    /// The same from the returns that can be seen, and their share of all returns.
    fn seen_in(&self, target: &Target, motion: &Motion) -> SeenResidual {
        let mut mean = Mean::default();
        let looked_at = self.samples.iter().step_by(target.stride());
        let count = self.count_in(target);
        let seen = looked_at.filter_map(|s| self.scans.seen_residual(s, motion, target));
        seen.for_each(|m| mean.add_weighted(m, target.stride() as f32));
        SeenResidual { mean, visible: mean.count / count.max(1) as f32 }
    }

    /// Whether this share of its returns counts as most of them.
    fn is_majority(&self, visible: f32) -> bool {
        visible > self.scans.scaled.params.visible_ratio
    }

    /// Adds residuals of the second sweep's returns in the first.
    fn add_all_backward(&self, mean: &mut Mean, motion: &Motion, visited: &mut ColumnSet) {
        let (scans, target) = (&self.scans, &self.scans.targets[0]);
        for q in &self.target_samples(motion, visited) {
            let at = target.retrace(q, motion);
            let found = scans.first.nearest(at, q.sensor, scans.reach_inlier());
            let residual = scans.residual(scans.second(), q, at, found);
            // Static structure was there before.
            if residual < HALF_MISSED || !self.was_occupied(q) {
                mean.add(residual);
            }
        }
    }

    /// Residuals of the second sweep's returns in the first, of those that can be seen.
    fn seen_backward(&self, motion: &Motion, visited: &mut ColumnSet) -> impl Iterator<Item = f32> {
        let (scans, target) = (&self.scans, &self.scans.targets[0]);
        self.target_samples(motion, visited).into_iter().filter_map(move |q| {
            let at = target.retrace(&q, motion);
            scans.decisive_residual(scans.second(), &q, &scans.first, at)
        })
    }

    /// [`Cluster::seen`] at rest. `in_earliest` is [`Cluster::seen_in_earliest`], if that is known.
    pub fn seen_at_rest(
        &self,
        in_earliest: Option<SeenResidual>,
        visited: &mut ColumnSet,
    ) -> SeenResiduals {
        self.seen_after(in_earliest, &Motion::around(self.centre), visited)
    }

    /// The residual at rest to compare with that of a motion, given `at_rest`, all residuals at
    /// rest. It leaves out the sweeps that show little of where the cluster would have been: they
    /// may show all of it at rest, and would then contribute to that residual only.
    pub fn compared_residual(&self, at_rest: &SeenResiduals, motion: &Motion) -> f32 {
        let targets = self.scans.targets;
        at_rest.value_in(|n| self.is_majority(self.seen_in(&targets[n], motion).visible))
    }

    /// The residuals at rest and of a motion, over its returns that can be seen in the other sweeps
    /// either way, 0 if none can. Returns of the second sweep are left out: something else may have
    /// come there.
    pub fn own_residuals(&self, motion: &Motion) -> [f32; 2] {
        let [mut rest, mut moved] = [Mean::default(); 2];
        for target in self.scans.targets {
            for s in self.samples.iter().step_by(target.stride()) {
                let seen = |motion| self.scans.seen_residual(s, motion, target);
                if let Some((at_rest, in_motion)) = seen(&Motion::default()).zip(seen(motion)) {
                    rest.add_weighted(at_rest, target.stride() as f32);
                    moved.add_weighted(in_motion, target.stride() as f32);
                }
            }
        }
        [rest.value(), moved.value()]
    }

    /// The residual of its returns at rest in the second sweep alone, 0 if none can be seen.
    pub fn second_residual(&self) -> f32 {
        self.seen_in(&self.scans.targets[0], &Motion::around(self.centre)).mean.value()
    }

    /// Residuals at rest in the earliest sweep, if that is before the pair.
    pub fn seen_in_earliest(&self) -> Option<SeenResidual> {
        let [_, .., earliest] = self.scans.targets else { return None };
        Some(self.seen_in(earliest, &Motion::around(self.centre)))
    }

    /// The mean of those, if most returns can be seen there.
    pub fn residual_at_rest(&self, in_earliest: SeenResidual) -> Option<f32> {
        self.is_majority(in_earliest.visible).then(|| in_earliest.mean.value())
    }

    /// The residuals of a motion over the returns that can be seen.
    pub fn seen(&self, motion: &Motion, visited: &mut ColumnSet) -> SeenResiduals {
        self.seen_after(None, motion, visited)
    }

    /// The same if the residuals in the earliest sweep may already be known.
    fn seen_after(
        &self,
        earliest: Option<SeenResidual>,
        motion: &Motion,
        visited: &mut ColumnSet,
    ) -> SeenResiduals {
        let targets = self.scans.targets;
        let in_sweeps = targets.iter().map(|target| {
            let in_earliest = earliest.filter(|_| target.index + 1 == targets.len());
            in_earliest.unwrap_or_else(|| self.seen_in(target, motion))
        });
        let in_sweeps = in_sweeps.collect();
        SeenResiduals { in_sweeps, backward: self.seen_backward(motion, visited).collect() }
    }

    /// Whether something was already where a return of the second sweep is.
    fn was_occupied(&self, q: &CloudPoint) -> bool {
        let at = self.scans.targets[0].retrace(q, &Motion::default());
        let truncation = self.scans.scaled.truncation;
        let nearest = self.scans.first.nearest(at, q.sensor, self.scans.reach_inlier());
        nearest.is_some_and(|n| n.0 < truncation * truncation)
    }
}
