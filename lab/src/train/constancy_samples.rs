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

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_core::record::Step;

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
    fn one_true_pair_and_others_from_where_they_are_sought() {
        // Every column is as unlike any other as 14 levels allow.
        let mark = |n: u32| [(n & 0x3fff) | (!n & 0x3fff) << 16, 1];
        let columns: Vec<Column> = (0..61 * 61).map(mark).collect();
        let matches = vec![
            Match { source: 30 * 61 + 30, displacement: [4, -3], moving: true },
            Match { source: 0, displacement: [0, 0], moving: false },
        ];
        let step = Step { side: 61, levels: 14, ..Default::default() };
        let pair = Pair { step, before: columns.clone(), now: columns, matches };
        let mut found = Vec::new();
        samples(&pair, &mut Rng::new(1), &mut found);
        let first = found.iter().position(|s| !s.moving).unwrap();
        let truth = features(mark(30 * 61 + 30), mark(34 * 61 + 27));
        assert_eq!(found[0], Sample { features: truth, same: true, moving: true });
        assert_eq!(first, 1 + EVEN + NEAR);
        assert!(found[1..first].iter().all(|s| !s.same && s.features != truth));
        // In the corner most others lie outside the window, and are left out.
        assert!(found[first].same && found.len() < 2 * first);
    }

    #[test]
    fn others_keep_to_their_square() {
        let m = Match { source: 0, displacement: [1, 1], moving: false };
        let mut rng = Rng::new(2);
        let drawn: Vec<_> = (0..2000).map(|_| other(&m, [0, 2], 2, &mut rng)).collect();
        let distinct: std::collections::HashSet<_> = drawn.iter().collect();
        assert_eq!(distinct.len(), 24);
        assert!(drawn.iter().all(|d| d[0].abs() <= 2 && (d[1] - 2).abs() <= 2 && *d != [1, 1]));
    }
}
