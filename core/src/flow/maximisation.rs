//! Maximisation (section 3.5.2.2): every target keeps the claimant of least energy, the first in
//! column order among equals; all others lose their flow.
//!
//! By scatter, in three passes over the foreground, because an energy and a rank do not fit one
//! 32-bit word together: least energy per target, then least rank among the equal, then the rest.

use super::target;
use crate::record::{Flow, Proposal, Step, flow_displacement};

/// Least energy per target. `target_energy` must start as [`crate::record::NONE`].
pub fn claim(step: &Step, foreground: &[u32], proposal: &[Proposal], target_energy: &mut [u32]) {
    for (&column, &[flow, energy]) in foreground.iter().zip(proposal) {
        if flow != 0 {
            let t = &mut target_energy[target(step, column, flow_displacement(flow))];
            *t = energy.min(*t);
        }
    }
}

/// Least rank among the claimants of least energy. `target_rank` must start as
/// [`crate::record::NONE`].
pub fn rank(
    step: &Step,
    foreground: &[u32],
    proposal: &[Proposal],
    target_energy: &[u32],
    target_rank: &mut [u32],
) {
    for (n, (&column, &[flow, energy])) in foreground.iter().zip(proposal).enumerate() {
        if flow != 0 {
            let t = target(step, column, flow_displacement(flow));
            if energy == target_energy[t] {
                target_rank[t] = target_rank[t].min(n as u32);
            }
        }
    }
}

/// Keeps the winners' flows in `state` and clears the others'.
pub fn settle(
    step: &Step,
    foreground: &[u32],
    proposal: &[Proposal],
    target_rank: &[u32],
    state: &mut [Flow],
) {
    for (n, (&column, &[flow, _])) in foreground.iter().zip(proposal).enumerate() {
        let won =
            flow != 0 && target_rank[target(step, column, flow_displacement(flow))] == n as u32;
        state[column as usize] = if won { flow } else { 0 };
    }
}
