//! Expectation (section 3.5.2.1): the feasible displacement of least energy for every column.
//!
//! Smoothing over `n` valid neighbours with displacements `s` collapses to
//! `w_p (S2 + n |d|² - 2 d.S1)` with `S1`, `S2` the sums of `s` and `|s|²`. A column without valid
//! neighbours looks at every displacement, and so learns the least it can pay anywhere, and where:
//! should it be without neighbours again, that displacement wins if it is feasible. With
//! neighbours, that least plus the smoothing term, a paraboloid around their mean, excludes all but
//! a few: rings around the rounded mean are visited until no farther ring can win or tie.

use crate::params::{LINE, REACH, ROW};
use crate::record::{Flow, Least, NONE, Proposal, Step, VALID, flow, flow_displacement};
use crate::window::outside_cost;

/// Best found so far; ties go to the lower index in scan order.
struct Best {
    energy: i32,
    index: i32,
}

/// Proposes a flow for every column of `foreground`. `matching` holds a row of
/// [`ROW`] costs, `least` and `proposal` one element per foreground column; `least` must start as
/// [`NONE`] and is found in the first round, when no column has a valid neighbour.
pub fn expectation(
    step: &Step,
    foreground: &[u32],
    matching: &[u16],
    state: &[Flow],
    target_energy: &[u32],
    least: &mut [Least],
    proposal: &mut [Proposal],
) {
    for (n, &column) in foreground.iter().enumerate() {
        let around = Neighbours::of(step, state, column);
        let search = Search {
            step,
            row: &matching[n * ROW..][..ROW],
            target_energy,
            own: state[column as usize],
            column,
            i: column as i32 / step.side,
            j: column as i32 % step.side,
        };
        let outside = outside_cost(step, column as usize);
        let mut best = Best { energy: i32::MAX, index: i32::MAX };
        if around.count == 0 {
            let [energy, index] = least[n];
            if index != NONE {
                search.consider(index as i32, energy as i32, &mut best);
            }
            if best.index == i32::MAX {
                least[n] = search.everywhere(outside, &mut best);
            }
        } else {
            search.rings(outside, least[n][0] as i32, &around, &mut best);
        }
        proposal[n] = match best.index {
            i32::MAX => [0, NONE],
            index => [flow(displacement(index)), best.energy as u32],
        };
    }
}

/// Displacement at an index of a row.
#[inline]
fn displacement(index: i32) -> [i32; 2] {
    [index / LINE as i32 - REACH, index % LINE as i32 - REACH]
}

/// Sums over the valid flows of the 24 columns around one.
struct Neighbours {
    count: i32,
    sum: [i32; 2],
    squares: i32,
}

impl Neighbours {
    fn of(step: &Step, state: &[Flow], column: u32) -> Neighbours {
        let side = step.side;
        let (i, j) = (column as i32 / side, column as i32 % side);
        let mut n = Neighbours { count: 0, sum: [0; 2], squares: 0 };
        let (from, to) = ((j - 2).max(0), (j + 2).min(side - 1));
        for ni in (i - 2).max(0)..=(i + 2).min(side - 1) {
            for c in ni * side + from..=ni * side + to {
                let flow = state[c as usize];
                if flow & VALID != 0 && c != column as i32 {
                    let s = flow_displacement(flow);
                    n.count += 1;
                    n.sum = [n.sum[0] + s[0], n.sum[1] + s[1]];
                    n.squares += s[0] * s[0] + s[1] * s[1];
                }
            }
        }
        n
    }
}

/// One column's view of its candidates.
struct Search<'a> {
    step: &'a Step,
    row: &'a [u16],
    target_energy: &'a [u32],
    own: Flow,
    column: u32,
    i: i32,
    j: i32,
}

impl Search<'_> {
    /// Takes the candidate at `index` if it is feasible and better, or as good and earlier.
    #[inline]
    fn consider(&self, index: i32, energy: i32, best: &mut Best) {
        if energy > best.energy || energy == best.energy && index > best.index {
            return;
        }
        let d = displacement(index);
        let target = super::target(self.step, self.column, d);
        // Energies are never negative: unsigned order is theirs, and NONE is above all.
        if (energy as u32) < self.target_energy[target] || self.own == flow(d) {
            *best = Best { energy, index };
        }
    }

    /// Rows and columns of the search that lie inside the window.
    fn reach(&self, at: i32) -> core::ops::RangeInclusive<i32> {
        (-REACH).max(-at)..=REACH.min(self.step.side - 1 - at)
    }

    /// Every displacement, without smoothing. Returns the least energy, feasible or not, and where.
    fn everywhere(&self, outside: i32, best: &mut Best) -> Least {
        let cost = self.step.displacement_cost;
        let mut least = [NONE; 2];
        for du in self.reach(self.i) {
            let line = (du + REACH) * LINE as i32 + REACH;
            let energy = |dv: i32| {
                self.row[(line + dv) as usize] as i32 + cost * (du * du + dv * dv) + outside
            };
            let least_of_line = self.reach(self.j).map(energy).min().unwrap_or(i32::MAX);
            if (least_of_line as u32) < least[0] {
                let first = self.reach(self.j).find(|dv| energy(*dv) == least_of_line);
                least = [least_of_line as u32, (line + first.unwrap_or(0)) as u32];
            }
            // A whole line above the best cannot win; candidates come in scan order, so neither
            // can one that only ties.
            if least_of_line < best.energy {
                self.reach(self.j).for_each(|dv| self.consider(line + dv, energy(dv), best));
            }
        }
        least
    }

    /// Rings of growing distance around the mean of the neighbours' flows.
    fn rings(&self, outside: i32, least: i32, around: &Neighbours, best: &mut Best) {
        let (n, [su, sv], smoothing) = (around.count, around.sum, self.step.smoothing);
        let mean = [round_div(su, n), round_div(sv, n)];
        // |s - mean|² summed: what the smoothing costs at the mean itself, rounded down.
        let spread = (n * around.squares - su * su - sv * sv) / n;
        for ring in 0..=2 * REACH {
            // On a ring some component lies at least ring - 1/2 from the mean.
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
                        let square = u * u + v * v;
                        let smooth = around.squares + n * square - 2 * (u * su + v * sv);
                        let index = (u + REACH) * LINE as i32 + v + REACH;
                        let energy = self.row[index as usize] as i32
                            + outside
                            + self.step.displacement_cost * square
                            + smoothing * smooth;
                        self.consider(index, energy, best);
                    }
                    dv += stride;
                }
            }
        }
    }
}

/// `a / n` to the nearest integer, halves upwards; `n` is positive.
#[inline]
fn round_div(a: i32, n: i32) -> i32 {
    (2 * a + n).div_euclid(2 * n)
}
