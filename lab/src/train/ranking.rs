//! Rank of the true column among all that the search compares (3.13).

use super::pairs::{Match, Pair};
use raywake::backend::Tables;
use raywake_core::params::{FOREGROUND_MAX, LINE, REACH, ROW, TILE};
use raywake_core::record::{NONE, SweepUniform};
use raywake_core::stages::COUNTERS;
use raywake_core::stages::compact::compact;
use raywake_core::stages::occupancy_constancy::occupancy_constancy_by_lines;
use raywake_core::stages::prefix_sum::prefix_sum;
use raywake_core::stages::window::{Costs, WindowCosts};
use serde::Serialize;

/// Counts over columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Ranking {
    /// Columns inspected.
    pub columns: usize,
    /// Columns whose true target costs least; a tie of n counts 1/n.
    pub first: f64,
    /// Columns whose cheapest target is at most a cell from the truth along either axis.
    pub near: f64,
}

impl Ranking {
    fn add(&mut self, (first, near): (f64, f64)) {
        self.columns += 1;
        self.first += first;
        self.near += near;
    }

    /// Shares instead of counts.
    pub fn shares(self) -> Ranking {
        let all = self.columns.max(1) as f64;
        Ranking { first: self.first / all, near: self.near / all, ..self }
    }
}

/// Storage, reused from pair to pair.
pub struct Ranker {
    rank: Vec<u32>,
    list: Vec<u32>,
    cost: Vec<u16>,
}

impl Ranker {
    /// For windows of this many columns.
    pub fn new(columns: usize) -> Ranker {
        Ranker {
            rank: vec![0; columns],
            list: vec![0; FOREGROUND_MAX],
            cost: vec![0; FOREGROUND_MAX * ROW],
        }
    }

    /// Adds the matches of a pair to the counts of stationary and of moving objects. Every solid
    /// column is foreground, so no filter is involved.
    pub fn add(&mut self, tables: &Tables, pair: &Pair, counts: &mut [Ranking; 2]) {
        let step = SweepUniform { score_min: tables.scores.min, ..pair.step };
        let marks: Vec<u32> = pair.before.iter().map(|c| (c[1] != 0) as u32).collect();
        let mut tiles = [0; TILE + 1];
        prefix_sum(&marks, &mut tiles, &mut self.rank);
        compact(&marks, &mut self.rank, &mut self.list, &mut [0; COUNTERS]);
        let count = (tiles[TILE] as usize).min(FOREGROUND_MAX);
        let solid = &self.list[..count];
        let (weights, costs) = (&tables.constancy, &tables.costs);
        let cost = &mut self.cost[..count * ROW];
        occupancy_constancy_by_lines(&step, weights, costs, solid, &pair.before, &pair.now, cost);
        let mut row = [0; ROW];
        for m in pair.matches.iter().filter(|m| self.rank[m.source] != NONE) {
            WindowCosts::of(&step, &self.rank, cost, m.source as u32).fill_row(&mut row);
            counts[m.moving as usize].add(standing(&step, m, &row));
        }
    }
}

/// Shares of first place held by the true target, and by it together with its neighbours.
fn standing(step: &SweepUniform, m: &Match, row: &[u16]) -> (f64, f64) {
    let (i, j) = (m.source as i32 / step.side, m.source as i32 % step.side);
    let inside = |c: i32| (0..step.side).contains(&c);
    let mut least = u16::MAX;
    let (mut tied, mut first, mut near) = (0.0, 0.0, 0.0);
    for (n, &cost) in row.iter().enumerate() {
        let d = [(n / LINE) as i32 - REACH, (n % LINE) as i32 - REACH];
        if d[1] > REACH || cost > least || !inside(i + d[0]) || !inside(j + d[1]) {
            continue;
        }
        if cost < least {
            (least, tied, first, near) = (cost, 0.0, 0.0, 0.0);
        }
        let off = (d[0] - m.displacement[0]).abs().max((d[1] - m.displacement[1]).abs());
        tied += 1.0;
        first += (off == 0) as u8 as f64;
        near += (off <= 1) as u8 as f64;
    }
    (first / tied, near / tied)
}
