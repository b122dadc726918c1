//! Starts of a registration: the displacements that the columns of a cluster voted for.

use crate::params::{REACH, SIDE};
use crate::record::{Flow, VALID, flow_displacement};

/// Displacements of matched columns, counted.
pub struct Votes([[u16; SIDE]; SIDE]);

impl Votes {
    pub fn new(flows: impl Iterator<Item = Flow>) -> Votes {
        let mut votes = [[0u16; SIDE]; SIDE];
        for flow in flows.filter(|f| f & VALID != 0) {
            let [u, v] = flow_displacement(flow).map(|d| (d + REACH) as usize);
            votes[u][v] = votes[u][v].saturating_add(1);
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
