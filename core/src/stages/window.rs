//! The window that promotes spatial smoothness (3.13).

use crate::params::{COST_UNKNOWN, ROW};
use crate::record::{NONE, SweepUniform};

/// Sums costs over the 3x3 window that moves with the source (3.13, as the author programmed it):
/// row `n` of `window_cost` becomes the sum of the rows of the foreground neighbours of
/// `foreground[n]`, itself included, plus [`COST_UNKNOWN`] for each neighbour inside the window
/// that is empty or filtered. Neighbours outside are [`outside_cost`], a constant of the column.
pub fn window(
    sweep: &SweepUniform,
    foreground: &[u32],
    foreground_index: &[u32],
    pair_cost: &[u16],
    window_cost: &mut [u16],
) {
    for (&source, sum) in foreground.iter().zip(window_cost.chunks_exact_mut(ROW)) {
        sum.fill(0);
        let mut unknown = 0;
        for neighbour in neighbours(sweep, source as usize).into_iter().flatten() {
            match foreground_index[neighbour] {
                NONE => unknown += COST_UNKNOWN as u16,
                n => {
                    let row = &pair_cost[n as usize * ROW..][..ROW];
                    sum.iter_mut().zip(row).for_each(|(sum, cost)| *sum += cost);
                }
            }
        }
        sum.iter_mut().for_each(|sum| *sum += unknown);
    }
}

/// Cost of the window neighbours of a column that lie outside the grid.
pub fn outside_cost(sweep: &SweepUniform, column: usize) -> i32 {
    let missing = neighbours(sweep, column).iter().filter(|n| n.is_none()).count();
    missing as i32 * sweep.outside_cost
}

/// The 3x3 columns around one, [`None`] outside the window.
fn neighbours(sweep: &SweepUniform, column: usize) -> [Option<usize>; 9] {
    let side = sweep.side;
    let (i, j) = (column as i32 / side, column as i32 % side);
    core::array::from_fn(|n| {
        let (i, j) = (i + n as i32 / 3 - 1, j + n as i32 % 3 - 1);
        let inside = (0..side).contains(&i) && (0..side).contains(&j);
        inside.then_some((i * side + j) as usize)
    })
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec;
    use std::vec::Vec;

    #[test]
    fn the_window_adds_what_each_neighbour_says() {
        let sweep = SweepUniform { side: 33, outside_cost: 693, ..Default::default() };
        let foreground: Vec<u32> = (0..33 * 33).filter(|n| n % 4 != 0).collect();
        let mut rank = vec![NONE; 33 * 33];
        foreground.iter().enumerate().for_each(|(n, c)| rank[*c as usize] = n as u32);
        let cost: Vec<u16> = (0..foreground.len() * ROW).map(|n| (n * 31 % 5379) as u16).collect();
        let mut matching = vec![0; foreground.len() * ROW];
        window(&sweep, &foreground, &rank, &cost, &mut matching);
        for (n, source) in foreground.iter().enumerate().step_by(7) {
            let (i, j) = (*source as i32 / 33, *source as i32 % 33);
            for d in [0, 480, 990] {
                let mut sum = 0;
                for w in 0..9 {
                    let (i, j) = (i + w / 3 - 1, j + w % 3 - 1);
                    let inside = (0..33).contains(&i) && (0..33).contains(&j);
                    let r = if inside { rank[(i * 33 + j) as usize] } else { NONE };
                    sum += if r == NONE { 693 } else { cost[r as usize * ROW + d] as u32 };
                }
                let outside = outside_cost(&sweep, *source as usize) as u32;
                assert_eq!(matching[n * ROW + d] as u32 + outside, sum);
            }
        }
    }
}
