//! Expectation by rings: run by the scalar backend, and by devices that are CPUs.

use super::expectation::displacement;
use crate::neighbours::rows_near;
use crate::params::{LINE, REACH, ROW};
use crate::record::{
    Flow, MinCost, NONE, Proposal, SweepUniform, VALID, flow_displacement, pack_flow,
};
use crate::stages::window::{Costs, WindowCosts, outside_cost};

/// [`expectation`](super::expectation::expectation) without examining everything: see [`propose`].
#[expect(clippy::too_many_arguments, reason = "one for every buffer")]
#[inline(always)]
pub fn expectation_by_rings(
    sweep: &SweepUniform,
    foreground: &[u32],
    foreground_index: &[u32],
    pair_cost: &[u16],
    flow: &[Flow],
    target_energy: &[u32],
    min_cost: &[MinCost],
    proposal: &mut [Proposal],
) {
    for ((&column, &least), proposal) in foreground.iter().zip(min_cost).zip(proposal) {
        let costs = WindowCosts::of(sweep, foreground_index, pair_cost, column);
        *proposal = propose(sweep, column, &costs, least, flow, target_energy);
    }
}

/// The proposal of a column, from one to nine candidates instead of 961.
///
/// `least` is the minimum energy of the column over all displacements, without smoothing, and its
/// place. Smoothing over `n` valid neighbours with displacements `s` collapses to
/// `w_p (S2 + n |d|² - 2 d.S1)` with `S1`, `S2` the sums of `s` and `|s|²`. A column without valid
/// neighbours takes `least` if that is feasible, and otherwise examines everything. With
/// neighbours, `least` plus the smoothing term, a paraboloid around their mean, excludes all but a
/// few: rings around the rounded mean are visited until no farther ring can win or tie.
#[inline(always)]
pub fn propose(
    sweep: &SweepUniform,
    column: u32,
    costs: &impl Costs,
    least: MinCost,
    flow: &[Flow],
    target_energy: &[u32],
) -> Proposal {
    let search = Search {
        sweep,
        costs,
        target_energy,
        own: flow[column as usize],
        column,
        i: column as i32 / sweep.side,
        j: column as i32 % sweep.side,
        outside: outside_cost(sweep, column as usize),
    };
    let best = search.best(&Sums::of(sweep, flow, column), least);
    best.map_or([0, NONE], |b| [pack_flow(displacement(b.index)), b.energy as u32])
}

/// Best found so far; ties go to the lower index in scan order.
struct Best {
    energy: i32,
    index: i32,
}

/// Sums over the valid flows of the 24 columns around one.
struct Sums {
    count: i32,
    sum: [i32; 2],
    squares: i32,
}

impl Sums {
    /// Without a branch per flow.
    #[inline(always)]
    fn of(sweep: &SweepUniform, flow: &[Flow], column: u32) -> Sums {
        let mut n = Sums { count: 0, sum: [0; 2], squares: 0 };
        for row in rows_near(column, 2, sweep.side as u32) {
            let around = &flow[row];
            // Mostly five: a loop of known length is unrolled.
            match around.as_array::<5>() {
                Some(five) => five.iter().for_each(|f| n.add(*f, 1)),
                None => around.iter().for_each(|f| n.add(*f, 1)),
            }
        }
        n.add(flow[column as usize], -1);
        n
    }

    /// Adds a flow the given number of times if it is valid.
    #[inline(always)]
    fn add(&mut self, flow: Flow, times: i32) {
        let times = if flow & VALID != 0 { times } else { 0 };
        let [u, v] = flow_displacement(flow);
        self.count += times;
        self.sum = [self.sum[0] + times * u, self.sum[1] + times * v];
        self.squares += times * (u * u + v * v);
    }
}

/// One column's view of its candidates.
struct Search<'a, C> {
    sweep: &'a SweepUniform,
    costs: &'a C,
    target_energy: &'a [u32],
    own: Flow,
    column: u32,
    i: i32,
    j: i32,
    /// Cost of its window neighbours outside the grid.
    outside: i32,
}

impl<C: Costs> Search<'_, C> {
    /// The best feasible candidate.
    #[inline(always)]
    fn best(&self, around: &Sums, [energy, index]: MinCost) -> Option<Best> {
        let mut best = Best { energy: i32::MAX, index: i32::MAX };
        if around.count > 0 {
            self.rings(energy as i32, around, &mut best);
        } else {
            self.consider(index as i32, energy as i32, &mut best);
            if best.index == i32::MAX {
                self.everywhere(&mut best);
            }
        }
        (best.index != i32::MAX).then_some(best)
    }

    /// Takes the candidate at `index` if it is feasible and better, or as good and earlier.
    #[inline]
    fn consider(&self, index: i32, energy: i32, best: &mut Best) {
        if energy > best.energy || energy == best.energy && index > best.index {
            return;
        }
        let d = displacement(index);
        let target = super::maximisation::target(self.sweep, self.column, d);
        // Energies are never negative, so their unsigned order is the same, and NONE is above all.
        if (energy as u32) < self.target_energy[target] || self.own == pack_flow(d) {
            *best = Best { energy, index };
        }
    }

    /// Displacements along an axis that stay inside the window.
    fn reach(&self, at: i32) -> core::ops::RangeInclusive<i32> {
        (-REACH).max(-at)..=REACH.min(self.sweep.side - 1 - at)
    }

    /// Every displacement, without smoothing.
    fn everywhere(&self, best: &mut Best) {
        let (cost, mut row) = (self.sweep.displacement_cost, [0; ROW]);
        self.costs.fill_row(&mut row);
        for du in self.reach(self.i) {
            let line = (du + REACH) * LINE as i32 + REACH;
            for dv in self.reach(self.j) {
                let square = du * du + dv * dv;
                let energy = row[(line + dv) as usize] as i32 + cost * square + self.outside;
                self.consider(line + dv, energy, best);
            }
        }
    }

    /// Rings of growing distance around the mean of the neighbours' flows.
    #[inline(always)]
    fn rings(&self, least: i32, around: &Sums, best: &mut Best) {
        let (n, [su, sv], smoothing) = (around.count, around.sum, self.sweep.smoothing);
        let mean = [round_div(su, n), round_div(sv, n)];
        let costs = |u: i32, v: i32| {
            let square = u * u + v * v;
            let smooth = around.squares + n * square - 2 * (u * su + v * sv);
            self.outside + self.sweep.displacement_cost * square + smoothing * smooth
        };
        // Sum of |s - mean|²: the smoothing cost at the mean itself, rounded down.
        let spread = (n * around.squares - su * su - sv * sv) / n;
        for ring in 0..=2 * REACH {
            // On a ring some component is at least ring - 1/2 from the mean.
            let near = (2 * ring - 1).max(0);
            if least.saturating_add(smoothing * (n * near * near / 4 + spread)) > best.energy {
                break;
            }
            for du in -ring..=ring {
                let u = mean[0] + du;
                let stride = if du.abs() == ring { 1 } else { 2 * ring.max(1) };
                let mut dv = -ring;
                while dv <= ring {
                    let v = mean[1] + dv;
                    if self.reach(self.i).contains(&u) && self.reach(self.j).contains(&v) {
                        let index = (u + REACH) * LINE as i32 + v + REACH;
                        let energy = self.costs.at(index as usize) as i32 + costs(u, v);
                        self.consider(index, energy, best);
                    }
                    dv += stride;
                }
            }
        }
    }
}

/// `a / n` rounded to the nearest integer, halves upwards; `n` is positive.
#[inline]
fn round_div(a: i32, n: i32) -> i32 {
    (2 * a + n).div_euclid(2 * n)
}
