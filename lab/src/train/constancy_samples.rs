//! Pairs of columns, true and false ones, for the constancy classifier.

use super::features::LEVELS;
use super::pairs::Pair;
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

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    pub features: [u8; WIDTH],
    /// Whether the source moved to the target.
    pub same: bool,
}

/// How far from the true column the others are taken, cells.
///
/// The text draws them from the whole search neighbourhood around the source, the author's program
/// from one of the same size around the true column. Either way nearly all of them are somewhere
/// else entirely, free or unknown, and easily distinguished; what spoils flow is the column next to
/// the right one. The nearer they are taken, the more often the true column comes first among the
/// 31x31 on held-out drives. At one cell the remaining evidence is so weak relative to the
/// smoothing that velocities of moving objects suffer; two serves both.
const NEAR: i32 = 2;

/// Which columns the true one is to be distinguished from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Negatives {
    /// All that lie up to two cells from the true one.
    Near,
    /// One for each true one, drawn from the search neighbourhood around the source as in the text,
    /// and as many as the author's program draws.
    Search,
}

/// Adds the true column and others for every match of a pair, as far as they lie in the window.
pub fn samples(pair: &Pair, negatives: Negatives, rng: &mut Rng, into: &mut Vec<Sample>) {
    for m in &pair.matches {
        let mut add = |displacement: [i32; 2]| {
            if let Some(target) = target(pair.step.side, m.source, displacement) {
                let features = features(pair.before[m.source], pair.now[target]);
                into.push(Sample { features, same: displacement == m.displacement });
            }
        };
        match negatives {
            Negatives::Near => {
                for n in 0..(2 * NEAR + 1).pow(2) {
                    let off = [n / (2 * NEAR + 1) - NEAR, n % (2 * NEAR + 1) - NEAR];
                    add([0, 1].map(|a| m.displacement[a] + off[a]));
                }
            }
            Negatives::Search => {
                add(m.displacement);
                let width = 2 * REACH as u64 + 1;
                let other = [0; 2].map(|_| (rng.bits() % width) as i32 - REACH);
                if other != m.displacement {
                    add(other);
                }
            }
        }
    }
}

/// The column a displacement leads to, if it lies in the window.
fn target(side: i32, source: usize, [du, dv]: [i32; 2]) -> Option<usize> {
    let (i, j) = (source as i32 / side + du, source as i32 % side + dv);
    let inside = (0..side).contains(&i) && (0..side).contains(&j);
    inside.then_some((i * side + j) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::pairs::Match;
    use raywake_core::record::SweepUniform;

    #[test]
    fn features_of_two_columns() {
        let column = |free: u32, occupied: u32| [free | occupied << 16, 1];
        let f = features(column(0b0111, 0b1000), column(0b1001, 0b0110));
        assert_eq!(f[..4], [1, 0, 0, 0]);
        assert_eq!(f[LEVELS..LEVELS + 4], [0, 0, 0, 0]);
        assert_eq!(f[2 * LEVELS..2 * LEVELS + 4], [0, 1, 1, 1]);
        assert_eq!(f.iter().map(|f| u32::from(*f)).sum::<u32>(), 4);
        let same = features(column(0, 1 << 13), column(0, 1 << 13));
        assert_eq!((same[2 * LEVELS - 1], same.iter().map(|f| u32::from(*f)).sum::<u32>()), (1, 1));
    }

    #[test]
    fn the_true_column_and_those_around_it() {
        // Every column is as unlike any other as 14 levels allow.
        let mark = |n: usize| [(n as u32 & 0x3fff) | (!n as u32 & 0x3fff) << 16, 1];
        let columns: Vec<Column> = (0..61 * 61).map(mark).collect();
        let matches = vec![
            Match { source: 30 * 61 + 30, displacement: [4, -3], moving: true },
            Match { source: 0, displacement: [0, 0], moving: false },
        ];
        let step = SweepUniform { side: 61, levels: 14, ..Default::default() };
        let pair = Pair { step, before: columns.clone(), now: columns, matches };
        let sampled = |negatives| {
            let mut found = Vec::new();
            samples(&pair, negatives, &mut Rng::new(1), &mut found);
            found
        };
        let found = sampled(Negatives::Near);
        let at = |source: usize, target: usize| Sample {
            features: features(mark(source), mark(target)),
            same: target == 34 * 61 + 27 || target == 0,
        };
        let around = (32..37).flat_map(|i| (25..30).map(move |j| i * 61 + j));
        let wanted: Vec<Sample> = around.map(|t| at(30 * 61 + 30, t)).collect();
        assert_eq!(found[..25], wanted);
        // In a corner of the window about a third of them are left.
        assert_eq!(found[25..], [0, 1, 2, 61, 62, 63, 122, 123, 124].map(|t| at(0, t)));
        // The true one and another one of the search, which may lie outside the window at the
        // corner.
        let found = sampled(Negatives::Search);
        let same: Vec<bool> = found.iter().map(|s| s.same).collect();
        assert!(same[..3] == [true, false, true] && same.len() <= 4, "{same:?}");
        assert_eq!(found[0], at(30 * 61 + 30, 34 * 61 + 27));
    }
}
