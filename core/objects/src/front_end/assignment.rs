//! The assignment of segments to tracks with the least total cost (Kuhn, 1955; Munkres, 1957).

use super::{SEGMENTS_MAX, TRACKS_MAX};
use raywake_core::record::NONE;

/// Segments, and one column per track for having no segment.
const COLUMNS: usize = SEGMENTS_MAX + TRACKS_MAX;

/// Tracks are rows, segments columns; a track without a segment costs the gate. Rows are added one
/// at a time along shortest augmenting paths (Jonker and Volgenant, 1987).
pub(super) struct Assignment {
    /// Cost of a segment for a track; infinite beyond the gate.
    cost: [[f32; SEGMENTS_MAX]; TRACKS_MAX],
    /// Dual variables.
    of_row: [f64; TRACKS_MAX],
    of_column: [f64; COLUMNS],
    /// Row of each column.
    row: [u32; COLUMNS],
    /// The previous column on the path, [`NONE`] at its start, and the length of the path.
    before: [u32; COLUMNS],
    length: [f64; COLUMNS],
    visited: [bool; COLUMNS],
}

impl Assignment {
    pub const fn new() -> Assignment {
        Assignment {
            cost: [[0.0; SEGMENTS_MAX]; TRACKS_MAX],
            of_row: [0.0; TRACKS_MAX],
            of_column: [0.0; COLUMNS],
            row: [0; COLUMNS],
            before: [0; COLUMNS],
            length: [0.0; COLUMNS],
            visited: [false; COLUMNS],
        }
    }

    /// Costs of a track, all infinite until set.
    pub fn costs(&mut self, track: usize) -> &mut [f32; SEGMENTS_MAX] {
        self.cost[track].fill(f32::INFINITY);
        &mut self.cost[track]
    }

    /// Assigns the first `tracks` tracks to the first `segments` segments.
    pub fn solve(&mut self, tracks: usize, segments: usize, gate: f32) {
        let columns = segments + tracks;
        self.of_row[..tracks].fill(0.0);
        self.of_column[..columns].fill(0.0);
        self.row[..columns].fill(NONE);
        for track in 0..tracks {
            let mut end = self.nearest_free(track, segments, columns, gate);
            // Along the path every row takes the column after its own.
            loop {
                let before = self.before[end];
                if before == NONE {
                    self.row[end] = track as u32;
                    break;
                }
                self.row[end] = self.row[before as usize];
                end = before as usize;
            }
        }
    }

    /// Returns the track that a segment continues.
    pub fn track(&self, segment: usize) -> Option<usize> {
        let row = self.row[segment];
        (row != NONE).then_some(row as usize)
    }

    /// Returns the nearest column without a row to a row without a column. There always is one: the
    /// row's own.
    fn nearest_free(&mut self, track: usize, segments: usize, columns: usize, gate: f32) -> usize {
        self.length[..columns].fill(f64::INFINITY);
        self.visited[..columns].fill(false);
        let (mut row, mut at) = (track, NONE);
        loop {
            let mut nearest = (f64::INFINITY, 0);
            for column in 0..columns {
                if self.visited[column] {
                    continue;
                }
                let cost = match column.checked_sub(segments) {
                    None => self.cost[row][column],
                    Some(own) if own == row => gate,
                    Some(_) => f32::INFINITY,
                };
                let length = cost as f64 - self.of_row[row] - self.of_column[column];
                if length < self.length[column] {
                    (self.length[column], self.before[column]) = (length, at);
                }
                if self.length[column] < nearest.0 {
                    nearest = (self.length[column], column);
                }
            }
            let (step, column) = nearest;
            self.of_row[track] += step;
            for c in 0..columns {
                if self.visited[c] {
                    self.of_row[self.row[c] as usize] += step;
                    self.of_column[c] -= step;
                } else {
                    self.length[c] -= step;
                }
            }
            if self.row[column] == NONE {
                return column;
            }
            self.visited[column] = true;
            (row, at) = (self.row[column] as usize, column as u32);
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::random::Random;
    use std::vec;
    use std::vec::Vec;

    /// Least sum over all assignments of the rows from `row` on.
    fn least(costs: &[Vec<f32>], row: usize, taken: u32, gate: f32) -> f32 {
        let Some(own) = costs.get(row) else { return 0.0 };
        let alone = gate + least(costs, row + 1, taken, gate);
        let with = |(n, c): (usize, &f32)| c + least(costs, row + 1, taken | 1 << n, gate);
        let free = own.iter().enumerate().filter(|(n, _)| taken & 1 << n == 0);
        free.map(with).fold(alone, f32::min)
    }

    #[test]
    fn equals_brute_force() {
        let mut random = Random(12);
        let mut solver = raywake_alloc_guard::boxed!(Assignment, Assignment::new());
        let (mut contested, mut alone) = (0, 0);
        for _ in 0..2000 {
            let (tracks, segments) = (1 + random.below(5), random.below(6));
            let gate = 10.0;
            let costs: Vec<Vec<f32>> = (0..tracks)
                .map(|_| {
                    let cost = |r: &mut Random| match r.below(3) {
                        0 => f32::INFINITY,
                        _ => r.below(11) as f32,
                    };
                    (0..segments).map(|_| cost(&mut random)).collect()
                })
                .collect();
            for (track, row) in costs.iter().enumerate() {
                solver.costs(track)[..segments].copy_from_slice(row);
            }
            solver.solve(tracks, segments, gate);
            let mut of_track = vec![None; tracks];
            for segment in 0..segments {
                if let Some(track) = solver.track(segment) {
                    assert!(of_track[track].replace(segment).is_none(), "one segment each");
                }
            }
            let sum: f32 = of_track
                .iter()
                .zip(&costs)
                .map(|(segment, row)| segment.map_or(gate, |s: usize| row[s]))
                .sum();
            assert_eq!(sum, least(&costs, 0, 0, gate), "{costs:?}: {of_track:?}");
            let first = |row: &Vec<f32>| {
                (0..segments).filter(|s| row[*s] < gate).min_by(|a, b| row[*a].total_cmp(&row[*b]))
            };
            let differs = |(of, row): (&Option<usize>, &Vec<f32>)| first(row) != *of;
            contested += of_track.iter().zip(&costs).any(differs) as usize;
            alone += of_track.iter().any(Option::is_none) as usize;
        }
        assert!(contested > 500 && alone > 500, "{contested}, {alone}");
    }

    #[test]
    fn at_capacity() {
        let mut solver = raywake_alloc_guard::boxed!(Assignment, Assignment::new());
        // All prefer the first segment.
        for track in 0..TRACKS_MAX {
            for (segment, cost) in solver.costs(track).iter_mut().enumerate() {
                *cost = segment as f32 * 1e-3;
            }
        }
        solver.solve(TRACKS_MAX, SEGMENTS_MAX, 9.0);
        let taken = (0..SEGMENTS_MAX).filter(|s| solver.track(*s).is_some()).count();
        assert_eq!(taken, TRACKS_MAX);
        assert!((0..TRACKS_MAX).all(|s| solver.track(s).is_some()));
    }
}
