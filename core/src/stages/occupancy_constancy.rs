//! Occupancy constancy (section 3.5.1): how well two columns agree.
//!
//! Three binary features per level say whether both columns are free, both occupied, or one of each
//! (3.8-3.10); a logistic classifier weighs them (3.11, 3.12). Free and occupied are mutually
//! exclusive, so with the source fixed the score is linear in the target's mask bits.
//!
//! Costs are negative log-probabilities in thousandths of a nat, so that sums over the window
//! (3.13) and energies are integers on every machine. They are unsigned costs rather than scores:
//! the sum of nine fits in 16 bits, `atomicMin` finds the winners, and the largest number can
//! represent "none yet" ([`NONE`](crate::record::NONE)).

use crate::params::{Frame, LEVELS_MAX, LINE, REACH, ROW, SIDE, SIDE_MAX};
use crate::record::{Column, SweepUniform};
use crate::weights::{Weights, WeightsError};
use core::ops::Range;

/// Maximum entries of the table of log-sigmoids: sums of weights, bias included.
pub const SCORES_MAX: usize = 8192;
/// Words of the weights on the device: free, occupied, mixed per level, then the bias.
pub const WEIGHT_WORDS: usize = 3 * LEVELS_MAX + 1;
/// Largest cost of a pair: the sum of nine fits in 16 bits.
pub const COST_MAX: u32 = u16::MAX as u32 / 9;

/// The range of the classifier's scores.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Scores {
    /// Minimum sum of weights.
    pub min: i32,
    /// Number of possible sums.
    pub count: i32,
}

impl Scores {
    /// Each level contributes one of its three weights or nothing.
    fn of(weights: &[i32]) -> Scores {
        let bias = weights[3 * LEVELS_MAX];
        let (mut min, mut max) = (bias, bias);
        for k in 0..LEVELS_MAX {
            let of_level = [weights[k], weights[LEVELS_MAX + k], weights[2 * LEVELS_MAX + k]];
            min += of_level.into_iter().min().unwrap_or(0).min(0);
            max += of_level.into_iter().max().unwrap_or(0).max(0);
        }
        Scores { min, count: max - min + 1 }
    }
}

/// Reads a weights file of kind `constancy`, shape (3 for free, occupied, mixed; levels).
///
/// `weights` must hold [`WEIGHT_WORDS`] elements, `costs` [`SCORES_MAX`]; `costs[s - min]` becomes
/// the cost of score `s`.
pub fn load(
    text: &str,
    levels: usize,
    weights: &mut [i32],
    costs: &mut [u32],
) -> Result<Scores, WeightsError> {
    assert!(weights.len() == WEIGHT_WORDS && costs.len() == SCORES_MAX && levels <= LEVELS_MAX);
    let file = Weights::parse(text, "constancy", &[3, levels], 1)?;
    weights.fill(0);
    for (n, value) in file.values().enumerate() {
        let at = if n < 3 * levels { n / levels * LEVELS_MAX + n % levels } else { 3 * LEVELS_MAX };
        weights[at] = value;
    }
    let scores = Scores::of(weights);
    if scores.count as usize > SCORES_MAX {
        return Err(WeightsError::Range);
    }
    for (score, cost) in (scores.min..).zip(costs) {
        *cost = cost_of(score as f64 / file.scale as f64);
    }
    Ok(scores)
}

/// -log sigmoid(x) = log(1 + exp(-x)), rounded.
fn cost_of(x: f64) -> u32 {
    let nats = libm::log1p(libm::exp(-x));
    (libm::floor(nats * MILLINATS + 0.5) as u32).min(COST_MAX)
}

/// Units of cost in a nat.
const MILLINATS: f64 = 1000.0;

/// What each mask bit of a target adds to the score of `source`: free in the low half, occupied in
/// the high half.
pub fn bit_weights(source: Column, weights: &[i32]) -> [i32; 32] {
    let mut bits = [0; 32];
    for k in 0..LEVELS_MAX {
        let (free, occupied, mixed) =
            (weights[k], weights[LEVELS_MAX + k], weights[2 * LEVELS_MAX + k]);
        if source[0] >> k & 1 == 1 {
            (bits[k], bits[16 + k]) = (free, mixed);
        } else if source[0] >> (16 + k) & 1 == 1 {
            (bits[k], bits[16 + k]) = (mixed, occupied);
        }
    }
    bits
}

/// Costs of every foreground column at every displacement: row `n` of `pair_cost` belongs to
/// `foreground[n]`, its elements are ordered as in [`ROW`]. Targets outside the window, and the
/// padding, are unknown. `pair_cost` must hold [`ROW`] elements per foreground column.
pub fn occupancy_constancy(
    sweep: &SweepUniform,
    constancy_weights: &[i32],
    constancy_costs: &[u32],
    foreground: &[u32],
    columns_before: &[Column],
    columns_now: &[Column],
    pair_cost: &mut [u16],
) {
    let side = sweep.side;
    let offset = constancy_weights[3 * LEVELS_MAX] - sweep.score_min;
    for (&source, row) in foreground.iter().zip(pair_cost.chunks_exact_mut(ROW)) {
        let bits = bit_weights(columns_before[source as usize], constancy_weights);
        let (i, j) = (source as i32 / side - REACH, source as i32 % side - REACH);
        for (n, cost) in row.iter_mut().enumerate() {
            let (ti, tj) = (i + (n / LINE) as i32, j + (n % LINE) as i32);
            let inside = n % LINE < SIDE && (0..side).contains(&ti) && (0..side).contains(&tj);
            let target = if inside { columns_now[(ti * side + tj) as usize][0] } else { 0 };
            let of_bit = |(k, weight): (usize, &i32)| weight * (target >> k & 1) as i32;
            let score: i32 = bits.iter().enumerate().map(of_bit).sum();
            *cost = constancy_costs[(score + offset) as usize] as u16;
        }
    }
}

/// Room for the lines of the grid that a source's targets lie on: a power of two, so that the
/// remainder is right for lines before the grid, too.
const LINES: usize = SIDE.next_power_of_two();
/// Columns of such a line: those outside the grid on either side are unknown.
const WIDTH: usize = SIDE_MAX + LINE;

/// Free and occupied levels of the columns of consecutive lines, one bit each: targets next to each
/// other lie next to each other in memory.
struct TargetLines {
    /// Line `n` of the grid is at `n % LINES`, its column `j` at `j + REACH`.
    masks: [[[u16; WIDTH]; 2]; LINES],
    /// The lines that are held.
    held: Range<i32>,
}

impl TargetLines {
    const NONE: TargetLines = TargetLines { masks: [[[0; WIDTH]; 2]; LINES], held: 0..0 };

    /// Holds these lines, at most [`LINES`]; those outside the grid are unknown.
    #[inline(always)]
    fn hold(&mut self, lines: Range<i32>, side: i32, columns: &[Column]) {
        let known = self.held.contains(&lines.start);
        let from = if known { self.held.end } else { lines.start };
        for line in from..lines.end {
            let [free, occupied] = &mut self.masks[line as usize % LINES];
            if !(0..side).contains(&line) {
                free.fill(0);
                occupied.fill(0);
                continue;
            }
            let columns = &columns[(line * side) as usize..][..side as usize];
            let held = free[REACH as usize..].iter_mut().zip(&mut occupied[REACH as usize..]);
            for ((free, occupied), [masks, _]) in held.zip(columns) {
                (*free, *occupied) = (*masks as u16, (masks >> 16) as u16);
            }
        }
        self.held = lines;
    }

    /// Masks of the columns of a line from this one less [`REACH`] on.
    #[inline(always)]
    fn around(&self, line: i32, column: i32) -> [&[u16; LINE]; 2] {
        let masks = &self.masks[line as usize % LINES];
        masks.each_ref().map(|m| m[column as usize..].first_chunk().expect("a margin"))
    }
}

/// A level that a source knows: its bit, and what a free and an occupied target add to the score.
type KnownLevel = (u16, [i16; 2]);

/// The levels that a source knows.
#[inline(always)]
fn known_levels(source: Column, weights: &[i32]) -> heapless::Vec<KnownLevel, LEVELS_MAX> {
    let bits = bit_weights(source, weights);
    let known = (source[0] | source[0] >> 16) as u16;
    let levels = (0..LEVELS_MAX).filter(|k| known >> k & 1 != 0);
    // They fit: no sum of them spans more than `SCORES_MAX`.
    levels.map(|k| (1 << k, [bits[k], bits[16 + k]].map(|weight| weight as i16))).collect()
}

/// Scores of the targets with these masks, all at once: `none` is that of an unknown one.
#[inline(always)]
fn line_scores(levels: &[KnownLevel], masks: [&[u16; LINE]; 2], none: i16) -> [i16; LINE] {
    let [free, occupied] = masks.map(|masks| *masks);
    let mut scores = [none; LINE];
    for &(bit, [of_free, of_occupied]) in levels {
        for n in 0..LINE {
            let if_free = if free[n] & bit != 0 { of_free } else { 0 };
            let if_occupied = if occupied[n] & bit != 0 { of_occupied } else { 0 };
            scores[n] = scores[n].wrapping_add(if_free).wrapping_add(if_occupied);
        }
    }
    scores
}

/// [`occupancy_constancy`] for the scalar backend: the targets of a line are scored at once, by the
/// levels that the source knows.
#[inline(always)]
pub fn occupancy_constancy_by_lines(
    sweep: &SweepUniform,
    constancy_weights: &[i32],
    constancy_costs: &[u32],
    foreground: &[u32],
    columns_before: &[Column],
    columns_now: &[Column],
    pair_cost: &mut [u16],
) {
    let side = sweep.side;
    let unknown = constancy_weights[3 * LEVELS_MAX] - sweep.score_min;
    assert!((0..SCORES_MAX as i32).contains(&unknown), "the least score is that of the weights");
    let unknown = unknown as i16;
    let costs: &[u32; SCORES_MAX] = constancy_costs.first_chunk().expect("a cost of every score");
    // Every score is within the table: the remainder only says so to the compiler.
    let cost_of = |score: i16| costs[score as u16 as usize % SCORES_MAX] as u16;
    let mut targets = TargetLines::NONE;
    for (&source, row) in foreground.iter().zip(pair_cost.as_chunks_mut::<ROW>().0) {
        let levels = known_levels(columns_before[source as usize], constancy_weights);
        let (i, j) = (source as i32 / side, source as i32 % side);
        let lines = i - REACH..i + REACH + 1;
        targets.hold(lines.clone(), side, columns_now);
        for (line, row) in lines.zip(row.as_chunks_mut::<LINE>().0) {
            let scores = line_scores(&levels, targets.around(line, j), unknown);
            row.iter_mut().zip(scores).for_each(|(cost, score)| *cost = cost_of(score));
            row[SIDE..].fill(cost_of(unknown));
        }
    }
}

/// The classifier shipped with the program: see the file's provenance.
pub const SHIPPED: &str = include_str!("../../weights/constancy.txt");

/// The classifier shipped for a frame: for the lattice, ours; for the vehicle's frame, trained as
/// in section 3.5.1.
pub fn shipped(frame: Frame) -> &'static str {
    match frame {
        Frame::Lattice => SHIPPED,
        Frame::Sensor => include_str!("../../weights/constancy_as_printed.txt"),
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec;
    use std::vec::Vec;

    fn toy() -> (SweepUniform, Vec<Column>, Vec<Column>) {
        let random =
            |n: u32, s: u32| (n.wrapping_mul(2654435761) ^ s).wrapping_mul(0x2c1b_3c6d) >> 16;
        let make = |s: u32| -> Vec<Column> {
            (0..33 * 33)
                .map(|n| {
                    let (a, b) = (random(n, s), random(n, s + 1));
                    let free = a & 0x3fff;
                    [free | (b & !free & 0x3fff) << 16, (n % 4 != 0) as u32]
                })
                .collect()
        };
        (
            SweepUniform { side: 33, levels: 14, outside_cost: 693, ..Default::default() },
            make(1),
            make(7),
        )
    }

    #[test]
    fn costs_equal_the_classifier_in_floating_point() {
        let (mut sweep, before, now) = toy();
        let (mut weights, mut costs) = (vec![0; WEIGHT_WORDS], vec![0; SCORES_MAX]);
        let scores = load(SHIPPED, 14, &mut weights, &mut costs).unwrap();
        sweep.score_min = scores.min;
        let foreground = [0, 17, 33 * 16 + 16, 33 * 33 - 1];
        let mut cost = vec![0; 4 * ROW];
        occupancy_constancy(&sweep, &weights, &costs, &foreground, &before, &now, &mut cost);
        let mut fast = vec![0; 4 * ROW];
        let (w, c) = (&weights, &costs);
        occupancy_constancy_by_lines(&sweep, w, c, &foreground, &before, &now, &mut fast);
        assert!(fast == cost);
        for (n, source) in foreground.iter().enumerate() {
            let (i, j) = (*source as i32 / 33, *source as i32 % 33);
            for du in -REACH..=REACH {
                for dv in -REACH..=REACH {
                    let (ti, tj) = (i + du, j + dv);
                    let target = if (0..33).contains(&ti) && (0..33).contains(&tj) {
                        now[(ti * 33 + tj) as usize][0]
                    } else {
                        0
                    };
                    // (3.8)-(3.12) to the letter.
                    let s = before[*source as usize][0];
                    let mut x = weights[48] as f64 / 100.0;
                    for k in 0..14 {
                        let (f1, o1) = (s >> k & 1 == 1, s >> (16 + k) & 1 == 1);
                        let (f2, o2) = (target >> k & 1 == 1, target >> (16 + k) & 1 == 1);
                        x += (f1 && f2) as i32 as f64 * weights[k] as f64 / 100.0;
                        x += (o1 && o2) as i32 as f64 * weights[16 + k] as f64 / 100.0;
                        let mixed = o1 && f2 || f1 && o2;
                        x += mixed as i32 as f64 * weights[32 + k] as f64 / 100.0;
                    }
                    let nats = (1.0 + (-x).exp()).ln();
                    let found = cost[n * ROW + ((du + 15) * 32 + dv + 15) as usize];
                    assert!((found as f64 - 1000.0 * nats).abs() <= 0.5 + 1e-6);
                }
            }
        }
    }
}
