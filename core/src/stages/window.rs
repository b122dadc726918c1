//! The window that promotes spatial smoothness (3.13): sums of costs over the 3x3 columns around
//! the source, as the author programmed it. They are computed on demand and never stored: a table
//! of them would be as large as that of the pairs.

use crate::neighbours::rows_near;
use crate::params::{COST_UNKNOWN, LINE, REACH, ROW, SIDE};
use crate::record::{MinCost, NONE, SweepUniform};

/// Costs of a column at its displacements, ordered as in [`ROW`].
pub trait Costs {
    /// The cost at one displacement.
    fn at(&self, index: usize) -> u16;
    /// Fills a row with the costs at all displacements.
    fn fill_row(&self, row: &mut [u16; ROW]);
}

/// Stored costs.
impl Costs for [u16; ROW] {
    fn at(&self, index: usize) -> u16 {
        self[index]
    }

    fn fill_row(&self, row: &mut [u16; ROW]) {
        *row = *self;
    }
}

/// Sums of costs over the columns of the grid around one, itself included: from `pair_cost` for
/// those of the foreground, [`COST_UNKNOWN`] for each that is empty or filtered out. Neighbours
/// outside cost [`outside_cost`], a constant of the column.
pub struct WindowCosts<'a> {
    rows: heapless::Vec<&'a [u16; ROW], 9>,
    unknown: u16,
}

impl<'a> WindowCosts<'a> {
    /// The costs around `column`. Row `n` of `pair_cost` belongs to the column whose
    /// `foreground_index` is `n`; columns with [`NONE`] have no row.
    #[inline(always)]
    pub fn of(
        sweep: &SweepUniform,
        foreground_index: &[u32],
        pair_cost: &'a [u16],
        column: u32,
    ) -> WindowCosts<'a> {
        let (rows_of_pairs, _) = pair_cost.as_chunks::<ROW>();
        let mut costs = WindowCosts { rows: heapless::Vec::new(), unknown: 0 };
        let mut add = |index: u32| match index {
            NONE => costs.unknown += COST_UNKNOWN as u16,
            n => {
                // There is room for all nine.
                let _ = costs.rows.push(&rows_of_pairs[n as usize]);
            }
        };
        for row in rows_near(column, 1, sweep.side as u32) {
            foreground_index[row].iter().for_each(|index| add(*index));
        }
        costs
    }
}

impl Costs for WindowCosts<'_> {
    #[inline(always)]
    fn at(&self, index: usize) -> u16 {
        self.rows.iter().fold(self.unknown, |sum, row| sum + row[index])
    }

    #[inline(always)]
    fn fill_row(&self, row: &mut [u16; ROW]) {
        row.fill(self.unknown);
        for costs in &self.rows {
            row.iter_mut().zip(*costs).for_each(|(sum, cost)| *sum += cost);
        }
    }
}

/// The minimum energy of every column of `foreground` over all displacements, without smoothing,
/// and its place: a lower bound of what a column pays, whatever its neighbours do.
#[inline(always)]
pub fn window(
    sweep: &SweepUniform,
    foreground: &[u32],
    foreground_index: &[u32],
    pair_cost: &[u16],
    min_cost: &mut [MinCost],
) {
    let mut row = [0; ROW];
    for (&column, min_cost) in foreground.iter().zip(min_cost) {
        WindowCosts::of(sweep, foreground_index, pair_cost, column).fill_row(&mut row);
        *min_cost = least(sweep, column, &row);
    }
}

/// The minimum energy of a column with these costs, and its place: the first in scan order among
/// equals.
#[inline(always)]
pub fn least(sweep: &SweepUniform, column: u32, row: &[u16; ROW]) -> MinCost {
    let (outside, cost) = (outside_cost(sweep, column as usize), sweep.displacement_cost);
    let [lines, places] = [column as i32 / sweep.side, column as i32 % sweep.side]
        .map(|at| (-REACH).max(-at)..=REACH.min(sweep.side - 1 - at));
    let mut least = [NONE; 2];
    // From the middle, where displacement costs least, so that most lines are skipped by the bound.
    for n in 0..SIDE as i32 {
        let du = if n % 2 == 0 { n / 2 } else { -(n / 2) - 1 };
        if !lines.contains(&du) {
            continue;
        }
        let first = (du + REACH) * LINE as i32;
        let of_line = cost * du * du + outside;
        // No energy of the line is below this.
        if (lowest(&row[first as usize..][..LINE]) as i32 + of_line) as u32 > least[0] {
            continue;
        }
        let place = |dv: i32| first + dv + REACH;
        let energy = |dv: i32| row[place(dv) as usize] as i32 + cost * dv * dv + of_line;
        let of_line = places.clone().map(energy).min().unwrap_or(i32::MAX);
        let at = places.clone().find(|dv| energy(*dv) == of_line).unwrap_or(0);
        least = least.min([of_line as u32, place(at) as u32]);
    }
    least
}

/// The minimum cost of a line, its padding included; vectorised.
#[inline(always)]
fn lowest(line: &[u16]) -> u16 {
    line.iter().fold(u16::MAX, |least, cost| least.min(*cost))
}

/// Cost of the window neighbours of a column that lie outside the grid.
#[inline(always)]
pub fn outside_cost(sweep: &SweepUniform, column: usize) -> i32 {
    let side = sweep.side;
    let inside = |at: i32| 1 + i32::from(at > 0) + i32::from(at + 1 < side);
    (9 - inside(column as i32 / side) * inside(column as i32 % side)) * sweep.outside_cost
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec;
    use std::vec::Vec;

    #[test]
    fn the_window_adds_what_each_neighbour_says() {
        let sweep = SweepUniform {
            side: 33,
            outside_cost: 693,
            displacement_cost: 3,
            ..Default::default()
        };
        let foreground: Vec<u32> = (0..33 * 33).filter(|n| n % 4 != 1).collect();
        let mut rank = vec![NONE; 33 * 33];
        foreground.iter().enumerate().for_each(|(n, c)| rank[*c as usize] = n as u32);
        let cost: Vec<u16> = (0..foreground.len() * ROW).map(|n| (n * 31 % 5379) as u16).collect();
        let mut min_cost = vec![[0; 2]; foreground.len()];
        window(&sweep, &foreground, &rank, &cost, &mut min_cost);
        for (n, source) in foreground.iter().enumerate() {
            let (i, j) = (*source as i32 / 33, *source as i32 % 33);
            let around = WindowCosts::of(&sweep, &rank, &cost, *source);
            let mut all = [0; ROW];
            around.fill_row(&mut all);
            assert_eq!(min_cost[n], first_minimum(&sweep, [i, j], &all));
            for d in [0, 480, 990] {
                let mut sum = 0;
                for w in 0..9 {
                    let (i, j) = (i + w / 3 - 1, j + w % 3 - 1);
                    let inside = (0..33).contains(&i) && (0..33).contains(&j);
                    let r = if inside { rank[(i * 33 + j) as usize] } else { NONE };
                    sum += if r == NONE { 693 } else { cost[r as usize * ROW + d] as u32 };
                }
                let outside = outside_cost(&sweep, *source as usize) as u32;
                assert_eq!((all[d] as u32 + outside, all[d]), (sum, around.at(d)));
            }
        }
    }

    /// By examining every displacement in scan order.
    fn first_minimum(sweep: &SweepUniform, [i, j]: [i32; 2], row: &[u16; ROW]) -> MinCost {
        let outside = outside_cost(sweep, (i * sweep.side + j) as usize);
        let energies = (0..ROW as i32).filter_map(|n| {
            let d = [n / LINE as i32 - REACH, n % LINE as i32 - REACH];
            let inside = |c: i32| (0..sweep.side).contains(&c);
            let pays = row[n as usize] as i32
                + outside
                + sweep.displacement_cost * (d[0] * d[0] + d[1] * d[1]);
            let counts = d[1] <= REACH && inside(i + d[0]) && inside(j + d[1]);
            counts.then_some([pays as u32, n as u32])
        });
        energies.min().expect("the column itself")
    }
}
