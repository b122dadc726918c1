//! Maximisation (section 3.5.2.2): every target keeps the claimant of minimum energy, the first in
//! column order among equals; all others lose their flow.
//!
//! By scatter, in three passes over the foreground, because an energy and an index do not fit
//! together in one 32-bit word: minimum energy per target, then minimum index among equals, then
//! the rest.

use crate::record::{Flow, Proposal, SweepUniform, flow_displacement};

/// Every target keeps its best claimant: `flow` of the winners becomes what they proposed, that of
/// all other foreground columns 0. `target_energy` and `target_index`, one element per column of
/// the window, must start as [`crate::record::NONE`] and become the winners' energies and indices.
pub fn maximisation(
    sweep: &SweepUniform,
    foreground: &[u32],
    proposal: &[Proposal],
    target_energy: &mut [u32],
    target_index: &mut [u32],
    flow: &mut [Flow],
) {
    claim(sweep, foreground, proposal, target_energy);
    elect(sweep, foreground, proposal, target_energy, target_index);
    settle(sweep, foreground, proposal, target_index, flow);
}

/// Finds the minimum energy per target.
pub fn claim(
    sweep: &SweepUniform,
    foreground: &[u32],
    proposal: &[Proposal],
    target_energy: &mut [u32],
) {
    for (&column, &[flow, energy]) in foreground.iter().zip(proposal) {
        if flow != 0 {
            let t = &mut target_energy[target(sweep, column, flow_displacement(flow))];
            *t = energy.min(*t);
        }
    }
}

/// Finds the minimum foreground index among the claimants of minimum energy.
pub fn elect(
    sweep: &SweepUniform,
    foreground: &[u32],
    proposal: &[Proposal],
    target_energy: &[u32],
    target_index: &mut [u32],
) {
    for (n, (&column, &[flow, energy])) in foreground.iter().zip(proposal).enumerate() {
        if flow != 0 {
            let t = target(sweep, column, flow_displacement(flow));
            if energy == target_energy[t] {
                target_index[t] = target_index[t].min(n as u32);
            }
        }
    }
}

/// Keeps the winners' proposals in `flow` and clears the others'.
pub fn settle(
    sweep: &SweepUniform,
    foreground: &[u32],
    proposal: &[Proposal],
    target_index: &[u32],
    flow: &mut [Flow],
) {
    for (n, (&column, &[proposed, _])) in foreground.iter().zip(proposal).enumerate() {
        let won = proposed != 0
            && target_index[target(sweep, column, flow_displacement(proposed))] == n as u32;
        flow[column as usize] = if won { proposed } else { 0 };
    }
}

/// The column a displacement leads to; the caller knows that it lies inside.
#[inline]
pub(super) fn target(sweep: &SweepUniform, column: u32, d: [i32; 2]) -> usize {
    (column as i32 + d[0] * sweep.side + d[1]) as usize
}
