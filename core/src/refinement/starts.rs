//! Starts of a registration: the displacements that the columns of a cluster voted for, and those
//! of traffic.

use super::cues::Prediction;
use crate::params::{REACH, SIDE};

/// Maximum number of displacements of traffic. On motorways (`raywake-lab sim --scenery motorway`)
/// 8 are no better.
pub const TRAFFIC_MAX: usize = 4;

/// Displacements by whole cells, counted.
pub struct Votes([[u16; SIDE]; SIDE]);

impl Votes {
    /// Counts displacements; those beyond reach are left out.
    pub fn new(displacements: impl Iterator<Item = [i32; 2]>) -> Votes {
        let mut votes = [[0u16; SIDE]; SIDE];
        for [u, v] in displacements.map(|by| by.map(|d| d.saturating_add(REACH) as usize)) {
            if let Some(count) = votes.get_mut(u).and_then(|line| line.get_mut(v)) {
                *count = count.saturating_add(1);
            }
        }
        Votes(votes)
    }

    /// The mean of the most frequent displacement and its neighbours, which are then removed.
    pub fn take_mode(&mut self) -> Option<[f32; 2]> {
        let mut top = (0, 0, 0);
        for (u, line) in self.0.iter().enumerate() {
            for (v, &count) in line.iter().enumerate() {
                if count > top.0 {
                    top = (count, u, v);
                }
            }
        }
        let (_, u, v) = (top.0 > 0).then_some(top)?;
        let (mut sum, mut at) = (0.0, [0.0; 2]);
        for a in u.saturating_sub(1)..(u + 2).min(SIDE) {
            for b in v.saturating_sub(1)..(v + 2).min(SIDE) {
                let count = core::mem::take(&mut self.0[a][b]) as f32;
                sum += count;
                at[0] += count * (a as i32 - REACH) as f32;
                at[1] += count * (b as i32 - REACH) as f32;
            }
        }
        Some(at.map(|v| v / sum))
    }
}

/// The most frequent displacements other than rest that tracklets predict: what drives in a lane
/// moves alike.
pub fn traffic(
    predictions: impl Iterator<Item = Prediction>,
) -> heapless::Vec<[f32; 2], TRAFFIC_MAX> {
    let whole = predictions.map(|p| p.by.map(|d| libm::roundf(d) as i32));
    let mut votes = Votes::new(whole.filter(|by| *by != [0; 2]));
    core::iter::from_fn(|| votes.take_mode()).take(TRAFFIC_MAX).collect()
}
