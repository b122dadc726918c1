//! What goes with a moving cluster besides the columns that were found to move, and what does not.

use super::cluster::Cluster;
use super::clusters::{Clusters, is_moving, is_static};
use super::cues::Prediction;
use super::hypothesis::{self, evidence};
use super::motion::Motion;
use super::scans::Scans;
use crate::column_set::ColumnSet;
use crate::neighbours::columns_near;
use crate::record::NONE;

/// Maximum number of moving clusters near a fragment that are tried; the first ones are enough.
const NEIGHBOURS_MAX: usize = 8;

impl Clusters {
    /// Lets the remainder of a cluster with a moving part, and fragments next to moving clusters,
    /// go with these if they fit. Without evidence of their own they must not have been there
    /// before (`worn_max`).
    pub(super) fn absorb_fragments(&mut self, scans: Scans) {
        let (side, reach) = (scans.first.side, scans.scaled.fragment_distance);
        let visited = &mut ColumnSet::new();
        // Columns within reach of one that moves, kept up to date: most fragments are far from
        // those.
        let mut beside = ColumnSet::new();
        let columns = scans.first.columns();
        let moving = columns.filter(|c| is_moving(&self.of_column, &self.found, *c));
        beside.insert_all(moving.flat_map(|c| columns_near(c, reach, side)));
        self.segments.find(&scans, |c| is_static(&self.of_column, &self.found, c), |_, _| true);
        for n in 0..self.segments.len() {
            let columns = self.segments.columns(n);
            if !columns.iter().any(|c| beside.contains(*c as usize)) {
                continue;
            }
            let near = self.moving_neighbours(scans, columns, reach);
            let cluster = Cluster::new(scans, columns);
            if cluster.extent > scans.scaled.extent_max {
                continue;
            }
            if let Some(with) = self.joined(&cluster, &near, visited) {
                for c in columns.iter().map(|c| *c as usize) {
                    self.of_column[c] = with;
                    beside.insert_all(columns_near(c, reach, side));
                }
            }
        }
    }

    /// Lets whatever could move and touches a moving cluster go with it if its motion fits about as
    /// well as rest: the sides of a bus slide along themselves; only its ends show the motion. So
    /// does a wall beside someone who walks; but it was there before, and stays.
    pub(super) fn complete_bodies(
        &mut self,
        scans: Scans,
        predicted: impl Fn(usize) -> Option<Prediction> + Copy,
    ) {
        let visited = &mut ColumnSet::new();
        let could_move = |c: usize| scans.could_move(c) > scans.scaled.params.body_min;
        let part = |c: usize| could_move(c) && is_static(&self.of_column, &self.found, c);
        self.segments.find(&scans, part, |_, _| true);
        for n in 0..self.segments.len() {
            let columns = self.segments.columns(n);
            let near = self.moving_neighbours(scans, columns, 1);
            if near.is_empty() {
                continue;
            }
            let rest = Cluster::new(scans, columns);
            let static_residual = rest.seen_at_rest(None, visited).value();
            let with = near.iter().filter_map(|m| {
                let body = &self.found[*m as usize];
                let with =
                    hypothesis::along_with(&rest, static_residual, body, predicted, visited)?;
                let worn = self.worn(&scans, columns, &with.motion);
                (worn <= scans.scaled.params.worn_max).then_some(with)
            });
            let best = with.min_by(|a, b| a.cues.residual.total_cmp(&b.cues.residual));
            // If there is no room for one more, it stays static.
            if best.is_some_and(|best| self.found.push(best).is_ok()) {
                let id = self.found.len() as u32 - 1;
                columns.iter().for_each(|c| self.of_column[*c as usize] = id);
            }
        }
    }

    /// Takes columns below `could_move_min` out of moving clusters. A cluster consisting mostly of
    /// such columns keeps them if it was seen to come from elsewhere: something unlike anything
    /// learned may still move.
    pub(super) fn drop_immovable(&mut self, scans: Scans) {
        self.found.iter_mut().for_each(|f| f.similarity = 0);
        for c in scans.first.columns() {
            let found = self.found.get_mut(self.of_column[c] as usize);
            if let Some(found) = found.filter(|f| f.is_dynamic) {
                found.similarity += if scans.stays(c) { -1 } else { 1 };
            }
        }
        for c in scans.first.columns() {
            let found = self.found.get(self.of_column[c] as usize);
            if found.is_some_and(|f| f.is_dynamic && !f.may_include(&scans, c)) {
                self.of_column[c] = NONE;
            }
        }
    }

    /// Takes out of moving clusters what they pass: parts that the encoder takes for something that
    /// could not move, that fit the motion hardly better than rest and that, had they moved, would
    /// have come to where something was hit before. Someone who walks along a low wall touches it,
    /// and it slides along itself. A cluster without anything that could move is judged as a whole,
    /// by `worn_max`.
    pub(super) fn leave_behind(&mut self, scans: Scans) {
        // Nothing is known then: this saves time.
        if scans.scores.is_empty() {
            return;
        }
        let (of_column, found) = (&self.of_column, &self.found);
        let passed = |c: usize| is_moving(of_column, found, c) && !scans.could_rather_move(c);
        self.segments.find(&scans, passed, |a, b| of_column[a] == of_column[b]);
        // All are judged before any is taken out: looks at one leave out where the rest of its
        // cluster was.
        let mut left = ColumnSet::new();
        for n in 0..self.segments.len() {
            let columns = self.segments.columns(n);
            if self.is_passed(&scans, columns) {
                left.insert_all(columns.iter().map(|c| *c as usize));
            }
        }
        left.iter().for_each(|c| self.of_column[c] = NONE);
    }

    /// Whether a moving cluster only passes a part of it that could not move.
    fn is_passed(&self, scans: &Scans, columns: &[u32]) -> bool {
        let id = self.of_column[columns[0] as usize];
        let motion = &self.found[id as usize].motion;
        if self.worn(scans, columns, motion) <= scans.scaled.params.passed_worn_min {
            return false;
        }
        let [rest, moved] = Cluster::new(*scans, columns).own_residuals(motion);
        let mut of_cluster = scans.first.columns().filter(|c| self.of_column[*c] == id);
        evidence(rest, moved) <= scans.scaled.params.evidence_min
            && of_cluster.any(|c| scans.could_move(c) > 0.0)
    }

    /// Share of looks at columns that hit something else, had they moved like this
    /// ([`Scans::worn`]): neither them nor what moves alike, since a long vehicle may be in several
    /// pieces.
    fn worn(&self, scans: &Scans, columns: &[u32], motion: &Motion) -> f32 {
        let spacing = scans.scaled.start_spacing;
        scans.worn(columns, motion, |c| {
            let found = self.found.get(self.of_column[c] as usize);
            found.is_some_and(|f| f.is_dynamic && f.motion.is_near(motion, spacing))
        })
    }

    /// Lets the ground below a moving cluster, where nothing else stands, go with it, unless the
    /// encoder takes it for road beside the cluster.
    pub(super) fn include_ground(&mut self, scans: Scans) {
        let (side, margin) = (scans.first.side, scans.scaled.footprint_margin);
        for c in scans.first.columns() {
            let found = self.found.get_mut(self.of_column[c] as usize);
            let Some(found) = found.filter(|f| f.is_dynamic) else { continue };
            let returns = scans.first.column(c).map(|n| scans.first.sample(n).at);
            returns.for_each(|[x, y, _]| found.footprint.add([x, y]));
        }
        for (n, found) in self.found.iter().enumerate().filter(|(_, f)| f.is_dynamic) {
            let [rows, columns] = found.footprint.cells(margin, side);
            for (i, j) in rows.flat_map(|i| columns.clone().map(move |j| (i, j))) {
                let column = i * side + j;
                let of_column = &mut self.of_column[column];
                let at = [i as f32 + 0.5, j as f32 + 0.5];
                if *of_column == NONE
                    && found.footprint.holds(at, margin)
                    && scans.could_rather_move(column)
                {
                    *of_column = n as u32;
                }
            }
        }
    }

    /// Which of the nearby moving clusters a fragment goes with.
    fn joined(&self, fragment: &Cluster, near: &[u32], visited: &mut ColumnSet) -> Option<u32> {
        let params = &fragment.scans.scaled.params;
        let at_rest = fragment.seen_at_rest(None, visited);
        let (rest, visible) = (at_rest.value(), at_rest.visible());
        let parent = self.of_column[fragment.columns[0] as usize];
        let extent_min = params.remainder_ratio * self.found[parent as usize].extent;
        let mut best = (1.0, None);
        for m in near {
            let found = &self.found[*m as usize];
            let Some(residual) = fragment.residual_below(best.0, &found.motion, visited) else {
                continue;
            };
            let is_remainder = found.parent == parent && found.extent > extent_min;
            let hidden = visible < params.visible_ratio && residual < params.residual_bad;
            let worn = || self.worn(&fragment.scans, fragment.columns, &found.motion);
            let joins = evidence(rest, residual)
                > params.evidence_min * params.evidence_prior_ratio
                || (hidden || is_remainder && residual < rest + params.remainder_residual)
                    && worn() <= params.worn_max;
            if joins {
                best = (residual, Some(*m));
            }
        }
        best.1
    }

    /// Moving clusters that have columns within `reach` columns of those of a fragment.
    fn moving_neighbours(
        &self,
        scans: Scans,
        columns: &[u32],
        reach: usize,
    ) -> heapless::Vec<u32, NEIGHBOURS_MAX> {
        let side = scans.first.side;
        let mut near = heapless::Vec::new();
        for c in columns.iter().flat_map(|c| columns_near(*c as usize, reach, side)) {
            let other = self.of_column[c];
            if is_moving(&self.of_column, &self.found, c) && !near.contains(&other) {
                // Beyond the capacity: the first ones are enough.
                let _ = near.push(other);
            }
        }
        near
    }
}
