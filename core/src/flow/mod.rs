//! Raw scene flow by energy minimisation (section 3.5.2).
//!
//! Every foreground column seeks the displacement of least energy (3.14), in whole cells and
//! thousandths of a nat; then every target keeps its best claimant. Both steps are strict: all
//! columns of a round see the state the round before left (Jacobi), ties go to the first candidate
//! in scan order and to the first column, and the energies of the targets are rebuilt each round
//! from their winners.

pub mod expectation;
pub mod maximisation;

use crate::params::FOREGROUND_MAX;
use crate::record::{Flow, Least, NONE, Proposal, Step};

/// State of the minimisation between rounds. All slices but `state` and the two of the targets
/// hold one element per foreground column; those hold one per column of the window.
pub struct Em<'a> {
    /// Current flow of every column.
    pub state: &'a mut [Flow],
    /// Energy of the winner at every target, [`NONE`] where nobody points.
    pub target_energy: &'a mut [u32],
    /// Rank of the winner at every target.
    pub target_rank: &'a mut [u32],
    /// What each foreground column proposes in this round.
    pub proposal: &'a mut [Proposal],
    /// Least each foreground column can pay at any displacement, smoothing apart.
    pub least: &'a mut [Least],
}

impl Em<'_> {
    /// Runs `rounds` rounds from the empty state.
    pub fn run(&mut self, step: &Step, rounds: u32, foreground: &[u32], matching: &[u16]) {
        assert!(foreground.len() <= FOREGROUND_MAX);
        self.state.fill(0);
        self.target_energy.fill(NONE);
        self.least[..foreground.len()].fill([NONE; 2]);
        for _ in 0..rounds {
            expectation::expectation(
                step,
                foreground,
                matching,
                self.state,
                self.target_energy,
                self.least,
                self.proposal,
            );
            self.target_energy.fill(NONE);
            self.target_rank.fill(NONE);
            let count = foreground.len();
            let proposal = &self.proposal[..count];
            maximisation::claim(step, foreground, proposal, self.target_energy);
            maximisation::rank(step, foreground, proposal, self.target_energy, self.target_rank);
            maximisation::settle(step, foreground, proposal, self.target_rank, self.state);
        }
    }
}

/// Column a displacement leads to; the caller knows that it lies inside.
#[inline]
pub(crate) fn target(step: &Step, column: u32, d: [i32; 2]) -> usize {
    (column as i32 + d[0] * step.side + d[1]) as usize
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::params::{LINE, REACH, ROW};
    use crate::random::Random;
    use crate::record::{VALID, flow, flow_displacement};
    use crate::window::outside_cost;
    use std::vec;
    use std::vec::Vec;

    /// Equation 3.14 and sections 3.5.2.1-2 by brute force: every sum written out, no bound.
    fn brute_force(step: &Step, rounds: u32, foreground: &[u32], matching: &[u16]) -> Vec<Flow> {
        let side = step.side;
        let mut flows: Vec<Option<[i32; 2]>> = vec![None; (side * side) as usize];
        let mut e_hat: Vec<Option<i64>> = vec![None; (side * side) as usize];
        for _ in 0..rounds {
            let mut chosen = Vec::new();
            for (n, &c) in foreground.iter().enumerate() {
                let (i, j) = (c as i32 / side, c as i32 % side);
                let mut best: Option<(i64, [i32; 2])> = None;
                for index in 0..ROW as i32 {
                    let d = [index / LINE as i32 - REACH, index % LINE as i32 - REACH];
                    let (ti, tj) = (i + d[0], j + d[1]);
                    if d[1] > REACH || !(0..side).contains(&ti) || !(0..side).contains(&tj) {
                        continue;
                    }
                    let mut e = matching[n * ROW + index as usize] as i64
                        + outside_cost(step, c as usize) as i64
                        + (step.displacement_cost * (d[0] * d[0] + d[1] * d[1])) as i64;
                    for pi in (i - 2).max(0)..=(i + 2).min(side - 1) {
                        for pj in (j - 2).max(0)..=(j + 2).min(side - 1) {
                            if let (true, Some(s)) =
                                ((pi, pj) != (i, j), flows[(pi * side + pj) as usize])
                            {
                                let q = (d[0] - s[0]).pow(2) + (d[1] - s[1]).pow(2);
                                e += (step.smoothing * q) as i64;
                            }
                        }
                    }
                    let feasible = e_hat[(ti * side + tj) as usize].is_none_or(|h| e < h)
                        || flows[c as usize] == Some(d);
                    if feasible && best.is_none_or(|(b, _)| e < b) {
                        best = Some((e, d));
                    }
                }
                chosen.push(best);
            }
            let mut winner: Vec<Option<(i64, usize)>> = vec![None; flows.len()];
            for (n, best) in chosen.iter().enumerate() {
                if let Some((e, d)) = best {
                    let t = &mut winner[target(step, foreground[n], *d)];
                    if t.is_none_or(|(w, _)| *e < w) {
                        *t = Some((*e, n));
                    }
                }
            }
            e_hat = winner.iter().map(|w| w.map(|w| w.0)).collect();
            flows.fill(None);
            for (_, n) in winner.iter().flatten() {
                flows[foreground[*n] as usize] = chosen[*n].map(|c| c.1);
            }
        }
        flows.iter().map(|f| f.map_or(0, flow)).collect()
    }

    #[test]
    fn equals_brute_force() {
        for (seed, share, outside) in [(1u64, 3, 693), (2, 1, 693), (3, 2, 17_289), (4, 9, 693)] {
            let mut random = Random(seed);
            let step = Step {
                side: 37,
                smoothing: 1000,
                displacement_cost: 1,
                outside_cost: outside,
                ..Default::default()
            };
            let foreground: Vec<u32> = (0..37 * 37).filter(|_| random.below(share) == 0).collect();
            // Costs of few values, so that ties are common, with a preferred displacement.
            let matching: Vec<u16> = (0..foreground.len() * ROW)
                .map(|n| {
                    let liked = n % ROW == 500 || ((n / ROW).is_multiple_of(5) && n % ROW == 333);
                    (if liked { random.below(3) * 900 } else { 2000 + random.below(12) * 700 })
                        as u16
                })
                .collect();
            let columns = 37 * 37;
            let (mut flows, mut energy) = (vec![0; columns], vec![0; columns]);
            let (mut rank, mut proposal) = (vec![0; columns], vec![[0; 2]; foreground.len()]);
            let mut least = vec![[0; 2]; foreground.len()];
            let mut em = Em {
                state: &mut flows,
                target_energy: &mut energy,
                target_rank: &mut rank,
                proposal: &mut proposal,
                least: &mut least,
            };
            for rounds in [1, 2, 6, 20] {
                em.run(&step, rounds, &foreground, &matching);
                let wanted = brute_force(&step, rounds, &foreground, &matching);
                assert!(em.state[..] == wanted[..], "seed {seed}, {rounds} rounds");
            }
            let valid = flows.iter().filter(|f| **f & VALID != 0).count();
            assert!(valid * 2 > foreground.len(), "the case says something");
            let d = flows.iter().filter(|f| **f & VALID != 0).map(|f| flow_displacement(*f));
            assert!(d.collect::<std::collections::HashSet<_>>().len() > 1);
        }
    }
}
