//! Which returns of a sweep are taken if it has more than there is room for.

use crate::sweep::Point;

/// Evenly spread indices: those of the returns taken from a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Thinning {
    of: usize,
    taken: usize,
}

impl Thinning {
    /// For a sweep of `of` returns, of which at most `room` are taken.
    pub fn new(of: usize, room: usize) -> Thinning {
        Thinning { of, taken: of.min(room) }
    }

    /// Number of returns of the sweep.
    pub fn of(self) -> usize {
        self.of
    }

    /// Number of returns taken.
    pub fn taken(self) -> usize {
        self.taken
    }

    /// Index in the sweep of the `n`-th return taken.
    #[inline]
    pub fn index(self, n: usize) -> usize {
        // 64 bits: a sweep may have as many returns as a 32-bit machine has memory for.
        if self.of == self.taken {
            n
        } else {
            (n as u64 * self.of as u64 / self.taken as u64) as usize
        }
    }

    /// Rank of a return of the sweep among those taken, if it is taken.
    #[inline]
    pub fn rank(self, index: usize) -> Option<usize> {
        if self.of == self.taken {
            return (index < self.taken).then_some(index);
        }
        let rank = (index as u64 * self.taken as u64).div_ceil(self.of.max(1) as u64) as usize;
        (rank < self.taken && self.index(rank) == index).then_some(rank)
    }
}

/// The returns taken from a sweep.
#[derive(Clone, Copy, Debug)]
pub struct TakenPoints<'a> {
    all: &'a [Point],
    thinning: Thinning,
}

impl<'a> TakenPoints<'a> {
    /// At most `room` returns of a sweep, in its order.
    pub fn new(all: &'a [Point], room: usize) -> TakenPoints<'a> {
        TakenPoints { all, thinning: Thinning::new(all.len(), room) }
    }

    /// Number of returns taken.
    pub fn count(self) -> usize {
        self.thinning.taken
    }

    /// Number of returns left out.
    pub fn left_out(self) -> usize {
        self.thinning.of - self.thinning.taken
    }

    /// The `n`-th return taken.
    #[inline]
    pub fn get(self, n: usize) -> &'a Point {
        &self.all[self.thinning.index(n)]
    }

    /// All returns taken, each with its index in the sweep.
    pub fn indexed(self) -> impl Iterator<Item = (usize, &'a Point)> {
        (0..self.count()).map(move |n| (self.thinning.index(n), self.get(n)))
    }

    /// A range of them.
    pub fn range(self, range: core::ops::Range<usize>) -> impl Iterator<Item = &'a Point> {
        range.map(move |n| self.get(n))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use std::vec::Vec;

    #[test]
    fn everything_is_taken_if_it_fits() {
        for room in [7, 8, 1000] {
            let t = Thinning::new(7, room);
            assert!((0..7).all(|n| t.index(n) == n && t.rank(n) == Some(n)));
            assert_eq!((t.taken(), t.rank(7)), (7, None));
        }
        assert_eq!(Thinning::new(0, 5).rank(0), None);
    }

    #[test]
    fn the_rest_are_spread_evenly() {
        for (of, room) in [(8, 7), (11, 4), (300_000, 262_144), (1 << 20, 3)] {
            let t = Thinning::new(of, room);
            let taken: Vec<usize> = (0..room).map(|n| t.index(n)).collect();
            let gaps = taken.windows(2).map(|w| w[1] - w[0]);
            assert!(gaps.clone().max().unwrap() - gaps.min().unwrap() <= 1, "{of} {room}");
            assert!(of - taken[room - 1] <= of.div_ceil(room));
            let ranks = (0..of).filter_map(|i| t.rank(i));
            assert!(ranks.eq(0..room), "{of} {room}");
        }
    }
}
