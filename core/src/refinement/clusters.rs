//! The clusters of a pair's first sweep: columns that touch, then their moving parts, then what
//! those take along.

use super::cluster::{Cluster, VisitedColumns};
use super::cues::{ColumnCues, Cues, Looks, Prediction};
use super::history::History;
use super::hypothesis::{self, Hypothesis, evidence};
use super::motion::Motion;
use super::scans::Scans;
use super::segments::Segments;
use crate::params::{CLUSTERS_MAX, COLUMNS_MAX};
use crate::record::{Flow, NONE, VALID};
use crate::team::{Team, fill, share};

/// Maximum number of moving clusters near a fragment that are tried; the first ones are enough.
const NEIGHBOURS_MAX: usize = 8;

/// The clusters and what was found about each.
pub struct Clusters {
    segments: Segments,
    /// Cluster of each column of the first sweep's window.
    of_column: [u32; COLUMNS_MAX],
    found: heapless::Vec<Hypothesis, CLUSTERS_MAX>,
    column_cues: [ColumnCues; COLUMNS_MAX],
    /// Number of columns in clusters that there was no room for.
    pub beyond: usize,
    /// Columns that may be part of something that moves, one bit each.
    suspects: [u64; COLUMNS_MAX.div_ceil(64)],
}

impl Clusters {
    pub const fn new() -> Clusters {
        Clusters {
            segments: Segments::new(),
            of_column: [0; COLUMNS_MAX],
            found: heapless::Vec::new(),
            column_cues: [ColumnCues::NONE; COLUMNS_MAX],
            beyond: 0,
            suspects: [0; COLUMNS_MAX.div_ceil(64)],
        }
    }

    pub fn clear(&mut self) {
        self.found.clear();
        self.beyond = 0;
        self.of_column.fill(NONE);
    }

    /// What was found about the cluster of a column.
    pub fn of(&self, column: usize) -> Option<&Hypothesis> {
        self.found.get(*self.of_column.get(column)? as usize)
    }

    /// The cues to whether a column moves.
    pub fn cues(&self, column: usize) -> Cues {
        let of_column = self.column_cues.get(column).unwrap_or(&ColumnCues::NONE);
        match self.of(column) {
            Some(found) if found.is_dynamic => found.cues.with(*of_column),
            Some(found) => Cues::stationary(found.cues.share, of_column.could_move),
            None => Cues::stationary(0.0, 0.0),
        }
    }

    /// Whether a column belongs to a cluster that was seen to come from elsewhere.
    pub fn came(&self, column: usize) -> bool {
        self.of(column).is_some_and(|f| f.is_dynamic && f.came())
    }

    /// What was found about all of them.
    #[cfg(test)]
    pub fn found(&self) -> &[Hypothesis] {
        &self.found
    }

    /// Finds the clusters and their motion. `flow` gives the match of a column, `predicted` what
    /// its tracklet predicts.
    pub fn find(
        &mut self,
        team: &impl Team,
        scans: Scans,
        history: &History,
        flow: impl Fn(usize) -> Flow + Copy + Sync,
        predicted: impl Fn(usize) -> Option<Prediction> + Copy + Sync,
    ) {
        self.segments.find(&scans, |_| true, flow);
        self.test_segments(team, scans, flow, predicted);
        for (n, found) in self.found.iter_mut().enumerate() {
            let columns = self.segments.columns(n);
            columns.iter().for_each(|c| self.of_column[*c as usize] = n as u32);
            found.parent = n as u32;
        }
        let params = &scans.scaled.params;
        self.find_moving_parts(team, scans, flow, predicted, 0.0, |c| {
            flow(c) & VALID != 0
                && scans.column_residual(c, |s| scans.static_residual(s)) > params.column_residual
        });
        // Someone walking beside a wall moves by less than a column from sweep to sweep.
        self.find_moving_parts(team, scans, flow, predicted, params.part_since_margin, |c| {
            !scans.stays(c) && history.is_new(scans.first, c, params.part_since_s)
        });
        self.find_earlier_hits(scans, history);
        for found in &mut self.found {
            found.is_dynamic &= found.cues.worn <= params.worn_max;
        }
        self.absorb_fragments(scans);
        self.complete_bodies(scans, predicted);
        self.drop_immovable(scans);
        self.include_ground(scans);
        self.find_earlier_hits(scans, history);
        self.found.iter_mut().for_each(|f| f.cues.no_history = history.is_short());
        let (of_column, found) = (&self.of_column, &self.found);
        let cues = |c: usize| {
            let found = found.get(of_column[c] as usize);
            // A cluster that neither moves nor did before provides no cues.
            let found = found.filter(|f| f.is_dynamic || f.cues.share > 0.0);
            found.map_or(ColumnCues::NONE, |f| ColumnCues {
                misfit: scans.misfit(c, &f.motion),
                could_move: f.could_move(&scans, c),
            })
        };
        let side = scans.first.side;
        share(team, 1, 0..side, &mut self.column_cues[..side * side], side, &|rows, out| {
            let columns = rows.start * side..rows.end * side;
            columns.zip(out).for_each(|(c, out)| *out = cues(c));
        });
    }

    /// Appends the hypothesis for each segment to `found`.
    fn test_segments(
        &mut self,
        team: &impl Team,
        scans: Scans,
        flow: impl Fn(usize) -> Flow + Copy + Sync,
        predicted: impl Fn(usize) -> Option<Prediction> + Copy + Sync,
    ) {
        let before = self.found.len();
        let all = (before + self.segments.len()).min(CLUSTERS_MAX);
        let beyond = all - before..self.segments.len();
        self.beyond += beyond.map(|n| self.segments.columns(n).len()).sum::<usize>();
        let _ = self.found.resize(all, Hypothesis::default());
        fill(team, 0, &mut self.found[before..], &|n| {
            let cluster = Cluster::new(scans, self.segments.columns(n));
            hypothesis::test(cluster, flow, predicted, &mut VisitedColumns::new())
        });
    }

    /// Finds moving parts of static clusters: segments of their `suspect` columns for which the
    /// evidence exceeds what the test asks for by `margin_min`.
    fn find_moving_parts(
        &mut self,
        team: &impl Team,
        scans: Scans,
        flow: impl Fn(usize) -> Flow + Copy + Sync,
        predicted: impl Fn(usize) -> Option<Prediction> + Copy + Sync,
        margin_min: f32,
        suspect: impl Fn(usize) -> bool + Sync,
    ) {
        let suspect = |c: usize| is_static(&self.of_column, &self.found, c) && suspect(c);
        let columns = scans.first.side * scans.first.side;
        fill(team, 0, &mut self.suspects[..columns.div_ceil(64)], &|word| {
            let bits = (64 * word..columns.min(64 * (word + 1))).enumerate();
            bits.fold(0, |bits, (n, c)| bits | u64::from(suspect(c)) << n)
        });
        let suspects = &self.suspects;
        self.segments.find(&scans, |c| suspects[c / 64] >> (c % 64) & 1 != 0, |_| 0);
        let whole = self.found.len();
        self.test_segments(team, scans, flow, predicted);
        let parts = &mut self.found[whole..];
        parts.iter_mut().for_each(|f| f.is_dynamic &= f.cues.margin >= margin_min);
        self.keep_moving_parts(scans, whole);
    }

    /// Keeps and grows the parts, from index `whole` on, that move.
    fn keep_moving_parts(&mut self, scans: Scans, whole: usize) {
        let mut kept = whole;
        for n in whole..self.found.len() {
            let found = self.found[n];
            if found.is_dynamic {
                let columns = self.segments.columns(n - whole);
                let (id, parent) = (kept as u32, self.of_column[columns[0] as usize]);
                columns.iter().for_each(|c| self.of_column[*c as usize] = id);
                for &c in columns {
                    grow(scans, c as usize, &found.motion, [parent, id], &mut self.of_column);
                }
                self.found[kept] = Hypothesis { parent, ..found };
                kept += 1;
            }
        }
        self.found.truncate(kept);
    }

    /// Lets the remainder of a cluster with a moving part, and fragments next to moving clusters,
    /// go with these if they fit.
    fn absorb_fragments(&mut self, scans: Scans) {
        let visited = &mut VisitedColumns::new();
        self.segments.find(&scans, |c| is_static(&self.of_column, &self.found, c), |_| 0);
        for n in 0..self.segments.len() {
            let columns = self.segments.columns(n);
            let near = self.moving_neighbours(scans, columns, scans.scaled.fragment_distance);
            if near.is_empty() {
                continue;
            }
            let cluster = Cluster::new(scans, columns);
            if cluster.extent > scans.scaled.extent_max {
                continue;
            }
            if let Some(with) = self.joined(&cluster, &near, visited) {
                columns.iter().for_each(|c| self.of_column[*c as usize] = with);
            }
        }
    }

    /// Lets whatever could move and touches a moving cluster go with it if its motion fits about as
    /// well as rest: the sides of a bus slide along themselves; only its ends show the motion.
    fn complete_bodies(
        &mut self,
        scans: Scans,
        predicted: impl Fn(usize) -> Option<Prediction> + Copy,
    ) {
        let visited = &mut VisitedColumns::new();
        let could_move = |c: usize| scans.could_move(c) > scans.scaled.params.body_min;
        let part = |c: usize| could_move(c) && is_static(&self.of_column, &self.found, c);
        self.segments.find(&scans, part, |_| 0);
        for n in 0..self.segments.len() {
            let columns = self.segments.columns(n);
            let near = self.moving_neighbours(scans, columns, 1);
            if near.is_empty() {
                continue;
            }
            let rest = Cluster::new(scans, columns);
            let static_residual = rest.static_residual(None, visited).0;
            let with = near.iter().filter_map(|m| {
                let body = &self.found[*m as usize];
                hypothesis::along_with(&rest, static_residual, body, predicted, visited)
            });
            let best = with.min_by(|a, b| a.cues.residual.total_cmp(&b.cues.residual));
            // If there is no room for one more, it stays static.
            if best.is_some_and(|best| self.found.push(best).is_ok()) {
                let id = self.found.len() as u32 - 1;
                columns.iter().for_each(|c| self.of_column[*c as usize] = id);
            }
        }
    }

    /// Takes columns that could not move out of moving clusters. A cluster consisting mostly of
    /// such columns keeps them if it was seen to come from elsewhere: something unlike anything
    /// learned may still move.
    fn drop_immovable(&mut self, scans: Scans) {
        self.found.iter_mut().for_each(|f| f.similarity = 0);
        for c in 0..self.of_column.len() {
            let found = self.found.get_mut(self.of_column[c] as usize);
            if let Some(found) = found.filter(|f| f.is_dynamic) {
                found.similarity += if scans.stays(c) { -1 } else { 1 };
            }
        }
        for c in 0..self.of_column.len() {
            let found = self.found.get(self.of_column[c] as usize);
            if found.is_some_and(|f| f.is_dynamic && !f.may_include(&scans, c)) {
                self.of_column[c] = NONE;
            }
        }
    }

    /// Finds what was hit before at the places that moving clusters came to.
    fn find_earlier_hits(&mut self, scans: Scans, history: &History) {
        let (of_column, found) = (&self.of_column, &mut self.found);
        found.iter_mut().for_each(|f| f.looks = Looks::default());
        let acceleration = scans.scaled.acceleration(scans.span_s);
        // A car may have pulled out a moment ago; a wall cannot have.
        let could_start = |c| scans.could_rather_move(c);
        history.find(scans.first, scans.span_s, acceleration, could_start, of_column, found);
        for found in self.found.iter_mut().filter(|f| f.is_dynamic) {
            found.cues.worn = found.looks.worn();
            found.cues.fresh = found.looks.fresh();
        }
    }

    /// Lets the ground below a moving cluster, where nothing else stands, go with it, unless the
    /// encoder takes it for road beside the cluster.
    fn include_ground(&mut self, scans: Scans) {
        let (side, margin) = (scans.first.side, scans.scaled.footprint_margin);
        for c in 0..side * side {
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
    fn joined(
        &self,
        fragment: &Cluster,
        near: &[u32],
        visited: &mut VisitedColumns,
    ) -> Option<u32> {
        let params = &fragment.scans.scaled.params;
        let (rest, visible) = fragment.static_residual(None, visited);
        let parent = self.of_column[fragment.columns[0] as usize];
        let extent_min = params.remainder_ratio * self.found[parent as usize].extent;
        let mut best = (1.0, None);
        for m in near {
            let found = &self.found[*m as usize];
            let residual = fragment.residual(&found.motion, visited);
            let is_remainder = found.parent == parent && found.extent > extent_min;
            let hidden = visible < params.visible_ratio && residual < params.residual_bad;
            let joins = evidence(rest, residual)
                > params.evidence_min * params.evidence_prior_ratio
                || hidden
                || is_remainder && residual < rest + params.remainder_residual;
            if joins && residual < best.0 {
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
        for &c in columns {
            let (i, j) = (c as usize / side, c as usize % side);
            for a in i.saturating_sub(reach)..(i + reach + 1).min(side) {
                for b in j.saturating_sub(reach)..(j + reach + 1).min(side) {
                    let other = self.of_column[a * side + b];
                    let moves = self.found.get(other as usize).is_some_and(|f| f.is_dynamic);
                    if moves && !near.contains(&other) {
                        // Beyond the capacity: the first ones are enough.
                        let _ = near.push(other);
                    }
                }
            }
        }
        near
    }
}

/// Whether a column is part of a static cluster.
fn is_static(of_column: &[u32], found: &[Hypothesis], column: usize) -> bool {
    found.get(of_column[column] as usize).is_some_and(|f| !f.is_dynamic)
}

/// Gives columns of the `parent` next to a column of its moving part to that part if their returns
/// fit its motion about as well as rest.
fn grow(
    scans: Scans,
    column: usize,
    motion: &Motion,
    [parent, part]: [u32; 2],
    of_column: &mut [u32],
) {
    let (side, target) = (scans.first.side, &scans.targets[0]);
    let (i, j) = (column / side, column % side);
    for a in i.saturating_sub(1)..(i + 2).min(side) {
        for b in j.saturating_sub(1)..(j + 2).min(side) {
            let beside = a * side + b;
            if of_column[beside] == parent {
                let moved = scans
                    .column_residual(beside, |s| Some(scans.dynamic_residual(s, motion, target)));
                let rest = scans.column_residual(beside, |s| scans.static_residual(s));
                if moved < rest + scans.scaled.params.growth_residual {
                    of_column[beside] = part;
                }
            }
        }
    }
}
