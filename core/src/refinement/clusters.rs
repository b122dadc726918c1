//! The clusters of a pair's first sweep: columns that touch, then their moving parts, then what
//! goes with those (`bodies.rs`).

use super::cluster::Cluster;
use super::cues::{ColumnCues, Cues, Looks, Prediction};
use super::hypothesis::{self, Hypothesis};
use super::motion::Motion;
use super::scans::Scans;
use super::segments::{Segments, agree};
use crate::column_set::ColumnSet;
use crate::neighbours::columns_near;
use crate::params::{CLUSTERS_MAX, COLUMNS_MAX};
use crate::record::{Flow, NONE, VALID};
use crate::team::{Team, fill, share};

/// The clusters and what was found about each.
pub struct Clusters {
    pub(super) segments: Segments,
    /// Cluster of each column of the first sweep's window.
    pub(super) of_column: [u32; COLUMNS_MAX],
    pub(super) found: heapless::Vec<Hypothesis, CLUSTERS_MAX>,
    column_cues: [ColumnCues; COLUMNS_MAX],
    /// Number of columns in clusters that there was no room for.
    pub beyond: usize,
    /// Columns that may be part of something that moves.
    suspects: ColumnSet,
}

impl Clusters {
    pub const fn new() -> Clusters {
        Clusters {
            segments: Segments::new(),
            of_column: [0; COLUMNS_MAX],
            found: heapless::Vec::new(),
            column_cues: [ColumnCues::NONE; COLUMNS_MAX],
            beyond: 0,
            suspects: ColumnSet::new(),
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
            Some(found) => Cues::stationary(&found.cues, of_column.could_move),
            None => Cues::stationary(&Cues::NONE, 0.0),
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
        flow: impl Fn(usize) -> Flow + Copy + Sync,
        predicted: impl Fn(usize) -> Option<Prediction> + Copy + Sync,
    ) {
        self.segments.find(&scans, |_| true, |a, b| agree(&scans, flow(a), flow(b)));
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
        // Someone walking beside a wall moves by less than a column from sweep to sweep: in the
        // earliest sweep it fits badly, or nothing was there.
        let margin = params.part_since_margin;
        self.find_moving_parts(team, scans, flow, predicted, margin, |c| {
            flow(c) & VALID != 0
                && !scans.stays(c)
                && scans.early_residual(c) > params.column_residual
        });
        self.find_moving_parts(team, scans, flow, predicted, margin, |c| {
            !scans.stays(c) && scans.history.is_new(scans.first, c, params.part_since_s)
        });
        self.find_earlier_hits(scans);
        for found in &mut self.found {
            found.is_dynamic &= found.cues.worn <= params.worn_max;
        }
        self.absorb_fragments(scans);
        self.complete_bodies(scans, predicted);
        self.leave_behind(scans);
        self.drop_immovable(scans);
        self.include_ground(scans);
        self.find_earlier_hits(scans);
        self.found.iter_mut().for_each(|f| f.cues.no_history = scans.history.is_short());
        let (of_column, found, most) = (&self.of_column, &self.found, params.could_move_max);
        let cues = |c: usize| {
            let found = found.get(of_column[c] as usize);
            // A cluster that neither moves nor did before provides no cues.
            let found = found.filter(|f| f.is_dynamic || f.cues.share > 0.0);
            found.map_or(ColumnCues::NONE, |f| ColumnCues {
                misfit: scans.misfit(c, &f.motion),
                could_move: f.could_move(&scans, c).clamp(-most, most),
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
            hypothesis::test(cluster, flow, predicted, &mut ColumnSet::new())
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
        let columns = scans.first.columns().end;
        fill(team, 0, &mut self.suspects.words()[..columns.div_ceil(64)], &|word| {
            let bits = (64 * word..columns.min(64 * (word + 1))).enumerate();
            bits.fold(0, |bits, (n, c)| bits | u64::from(suspect(c)) << n)
        });
        let suspects = &self.suspects;
        self.segments.find(&scans, |c| suspects.contains(c), |_, _| true);
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
                grow(scans, columns, &found.motion, [parent, id], &mut self.of_column);
                self.found[kept] = Hypothesis { parent, ..found };
                kept += 1;
            }
        }
        self.found.truncate(kept);
    }

    /// Finds what was hit before at the places that moving clusters came to.
    fn find_earlier_hits(&mut self, scans: Scans) {
        self.found.iter_mut().for_each(|f| f.looks = Looks::default());
        for c in scans.first.columns() {
            if is_moving(&self.of_column, &self.found, c) {
                let looks = self.looks(&scans, c);
                self.found[self.of_column[c] as usize].looks += looks;
            }
        }
        for found in self.found.iter_mut().filter(|f| f.is_dynamic) {
            found.cues.worn = found.looks.worn();
            found.cues.fresh = found.looks.fresh();
        }
    }

    /// The looks at a column of a moving cluster.
    fn looks(&self, scans: &Scans, column: usize) -> Looks {
        let (first, n) = (scans.first, self.of_column[column]);
        let by = self.found[n as usize].motion.of(first.centre_of(column));
        // A car may have pulled out a moment ago; a wall cannot have.
        let could_start = scans.could_rather_move(column);
        let acceleration = could_start.then(|| scans.scaled.acceleration(scans.span_s));
        let is_part = |c: usize| self.of_column[c] == n;
        scans.history.looks(first, column, by, scans.span_s, acceleration, is_part)
    }
}

/// Whether a column is part of a static cluster.
pub fn is_static(of_column: &[u32], found: &[Hypothesis], column: usize) -> bool {
    found.get(of_column[column] as usize).is_some_and(|f| !f.is_dynamic)
}

/// Whether a column is part of a dynamic cluster.
pub fn is_moving(of_column: &[u32], found: &[Hypothesis], column: usize) -> bool {
    found.get(of_column[column] as usize).is_some_and(|f| f.is_dynamic)
}

/// Gives columns of the `parent` next to those of its moving part to that part if their returns fit
/// its motion about as well as rest, and they were not there before.
fn grow(
    scans: Scans,
    columns: &[u32],
    motion: &Motion,
    [parent, part]: [u32; 2],
    of_column: &mut [u32],
) {
    let (side, target) = (scans.first.side, &scans.targets[0]);
    let worn_max = scans.scaled.params.worn_max;
    let fits = |c: usize| {
        let moved = scans.column_residual(c, |s| Some(scans.dynamic_residual(s, motion, target)));
        let rest = scans.column_residual(c, |s| scans.static_residual(s));
        moved < rest + scans.scaled.params.growth_residual
    };
    // Given only in the end: looks leave out where the part alone was, in whatever order.
    let mut given = ColumnSet::new();
    for beside in columns.iter().flat_map(|c| columns_near(*c as usize, 1, side)) {
        let worn = |c| scans.worn(&[c as u32], motion, |c| of_column[c] == part);
        let open = of_column[beside] == parent && !given.contains(beside);
        if open && fits(beside) && worn(beside) <= worn_max {
            given.insert(beside);
        }
    }
    given.iter().for_each(|c| of_column[c] = part);
}
