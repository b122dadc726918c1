//! Pairs of columns, true ones and others, for the constancy classifier.

use super::features::LEVELS;
use super::pairs::{Match, Pair};
use raywake_core::params::REACH;
use raywake_core::record::Column;
use raywake_sim::Rng;

/// Features of a pair: both free, both occupied, one of each (3.8-3.10), per level.
pub const WIDTH: usize = 3 * LEVELS;

/// Features of a pair of columns.
pub fn features(source: Column, target: Column) -> [u8; WIDTH] {
    let (free, occupied) = (|c: Column| c[0] & 0xffff, |c: Column| c[0] >> 16);
    let masks = [
        free(source) & free(target),
        occupied(source) & occupied(target),
        free(source) & occupied(target) | occupied(source) & free(target),
    ];
    std::array::from_fn(|n| (masks[n / LEVELS] >> (n % LEVELS) & 1) as u8)
}

/// One pair of columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// What the classifier sees.
    pub features: [u8; WIDTH],
    /// Whether the one went to where the other is.
    pub same: bool,
    /// Whether the object moves.
    pub moving: bool,
}

/// Other columns drawn per match: evenly from the search neighbourhood about the source, and near
/// the true column.
#[derive(Clone, Copy, Debug)]
pub struct Draw {
    pub even: usize,
    pub near: usize,
    pub about_truth: usize,
    pub radius: i32,
}

pub const DRAW: Draw = Draw { even: 4, near: 4, about_truth: 0, radius: 3 };

/// For every match of a pair the true column and some others, as far as they lie in the window.
pub fn samples(pair: &Pair, draw: Draw, rng: &mut Rng, into: &mut Vec<Sample>) {
    for m in &pair.matches {
        let mut push = |displacement: [i32; 2], same: bool| {
            if let Some(target) = target(pair.step.side, m.source, displacement) {
                let features = features(pair.before[m.source], pair.now[target]);
                into.push(Sample { features, same, moving: m.moving });
            }
        };
        push(m.displacement, true);
        for (count, about, reach) in [(draw.even, [0; 2], REACH), (draw.near, m.displacement, draw.radius), (draw.about_truth, m.displacement, REACH)] {
            for _ in 0..count {
                push(other(m, about, reach, rng), false);
            }
        }
    }
}

/// A displacement at most `reach` from `about` along either axis that is not the true one.
fn other(m: &Match, about: [i32; 2], reach: i32, rng: &mut Rng) -> [i32; 2] {
    loop {
        let displacement = about.map(|c| {
            c + rng.range(f64::from(-reach), f64::from(reach + 1)).floor() as i32
        });
        if displacement != m.displacement {
            return displacement;
        }
    }
}

/// The column a displacement leads to, if it lies in the window.
fn target(side: i32, source: usize, [du, dv]: [i32; 2]) -> Option<usize> {
    let (i, j) = (source as i32 / side + du, source as i32 % side + dv);
    let inside = (0..side).contains(&i) && (0..side).contains(&j);
    inside.then_some((i * side + j) as usize)
}
