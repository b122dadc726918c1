//! Expectation (section 3.5.2.1): the feasible displacement of minimum energy for every column.

use crate::params::{LINE, REACH, ROW, SIDE};
use crate::record::{
    Flow, MinCost, NONE, Proposal, SweepUniform, VALID, flow_displacement, pack_flow,
};
use crate::stages::window::{Costs, WindowCosts, outside_cost};

/// Proposes a flow for every column of `foreground`: the displacement of minimum energy (3.14)
/// among those that are feasible, the first in scan order among equals.
///
/// `pair_cost` holds a row of [`ROW`] costs for each of them, `min_cost` and `proposal` an element.
/// A displacement is feasible if it would win its target, or is the column's present one.
/// `min_cost`, as [`window`](super::super::window::window) leaves it, is for implementations that
/// do not examine everything; the formula does.
#[expect(clippy::too_many_arguments, reason = "one for every buffer")]
pub fn expectation(
    sweep: &SweepUniform,
    foreground: &[u32],
    foreground_index: &[u32],
    pair_cost: &[u16],
    flow: &[Flow],
    target_energy: &[u32],
    _min_cost: &[MinCost],
    proposal: &mut [Proposal],
) {
    let mut row = [0; ROW];
    for (&column, proposal) in foreground.iter().zip(proposal) {
        WindowCosts::of(sweep, foreground_index, pair_cost, column).fill_row(&mut row);
        let outside = outside_cost(sweep, column as usize);
        let around: heapless::Vec<[i32; 2], 24> = neighbours(sweep, flow, column).collect();
        *proposal = [0, NONE];
        for index in (0..ROW).filter(|index| index % LINE < SIDE) {
            let d = displacement(index as i32);
            let Some(target) = inside(sweep, column, d) else { continue };
            // Energies are never negative, so their unsigned order is the same, and NONE is above
            // all.
            let energy = (row[index] as i32 + outside + prior(sweep, &around, d)) as u32;
            let feasible = energy < target_energy[target] || flow[column as usize] == pack_flow(d);
            if feasible && energy < proposal[1] {
                *proposal = [pack_flow(d), energy];
            }
        }
    }
}

/// Energy of a displacement regardless of costs: from its length, and from how far it is from those
/// around it.
fn prior(sweep: &SweepUniform, around: &[[i32; 2]], d: [i32; 2]) -> i32 {
    let square = |d: [i32; 2]| d[0] * d[0] + d[1] * d[1];
    let smoothing = around.iter().map(|s| square([d[0] - s[0], d[1] - s[1]]));
    sweep.displacement_cost * square(d) + sweep.smoothing * smoothing.sum::<i32>()
}

/// The target of a displacement, if that is in the window.
fn inside(sweep: &SweepUniform, column: u32, d: [i32; 2]) -> Option<usize> {
    let (side, column) = (sweep.side, column as i32);
    let (i, j) = (column / side + d[0], column % side + d[1]);
    ((0..side).contains(&i) && (0..side).contains(&j)).then(|| (i * side + j) as usize)
}

/// Valid flows of the 24 columns around one.
fn neighbours<'a>(
    sweep: &SweepUniform,
    flow: &'a [Flow],
    column: u32,
) -> impl Iterator<Item = [i32; 2]> + use<'a> {
    let (side, column) = (sweep.side, column as i32);
    let (i, j) = (column / side, column % side);
    let columns = move |ni: i32| ni * side + (j - 2).max(0)..=ni * side + (j + 2).min(side - 1);
    ((i - 2).max(0)..=(i + 2).min(side - 1))
        .flat_map(columns)
        .filter(move |c| *c != column)
        .map(|c| flow[c as usize])
        .filter(|f| f & VALID != 0)
        .map(flow_displacement)
}

/// Displacement at an index of a row.
#[inline]
pub(super) fn displacement(index: i32) -> [i32; 2] {
    [index / LINE as i32 - REACH, index % LINE as i32 - REACH]
}
