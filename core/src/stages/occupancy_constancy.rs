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

use crate::params::{Frame, LEVELS_MAX, LINE, REACH, ROW, SIDE};
use crate::record::{Column, SweepUniform};
use crate::stages::background_filter::fill_byte_table;
use crate::weights::{Weights, WeightsError};

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

/// [`occupancy_constancy`] for the scalar backend: four byte lookups score a pair.
pub fn occupancy_constancy_by_bytes(
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
    let unknown = constancy_costs[offset as usize] as u16;
    let mut bytes = [[0; 256]; 4];
    for (&source, row) in foreground.iter().zip(pair_cost.chunks_exact_mut(ROW)) {
        let bits = bit_weights(columns_before[source as usize], constancy_weights);
        for (bits, bytes) in bits.chunks_exact(8).zip(&mut bytes) {
            fill_byte_table(bits, bytes);
        }
        let (i, j) = (source as i32 / side, source as i32 % side);
        for (du, row) in (-REACH..).zip(row.chunks_exact_mut(LINE)) {
            row.fill(unknown);
            if !(0..side).contains(&(i + du)) {
                continue;
            }
            let (from, to) = ((j - REACH).max(0), (j + REACH).min(side - 1));
            let line = (i + du) * side;
            let targets = &columns_now[(line + from) as usize..=(line + to) as usize];
            for (target, cost) in targets.iter().zip(&mut row[(from - j + REACH) as usize..]) {
                let [a, b, c, d] = target[0].to_le_bytes().map(usize::from);
                let score = bytes[0][a] + bytes[1][b] + bytes[2][c] + bytes[3][d];
                *cost = constancy_costs[(score + offset) as usize] as u16;
            }
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
        occupancy_constancy_by_bytes(&sweep, w, c, &foreground, &before, &now, &mut fast);
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
