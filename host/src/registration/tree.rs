//! Nearest neighbours in three dimensions.

use glam::DVec3;
use std::ops::Range;

/// Points that are compared one by one.
const LEAF: usize = 8;

/// A balanced k-d tree that is nothing but an order of the points: the middle one of a range splits
/// it, along the axis in which the range is widest.
pub struct Tree {
    points: Vec<DVec3>,
    /// Axis of the split at each middle.
    axes: Vec<u8>,
}

impl Tree {
    /// Of finite points in any order, none included.
    pub fn new(mut points: Vec<DVec3>) -> Tree {
        let mut axes = vec![0; points.len()];
        split(&mut points, &mut axes);
        Tree { points, axes }
    }

    /// The points in the tree's order, in which neighbours in space are close.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// The point nearest to `q` with a squared distance below `within2`: its place in
    /// [`Tree::points`] and the squared distance.
    pub fn nearest(&self, q: DVec3, within2: f64) -> Option<(usize, f64)> {
        let mut best = None;
        self.visit(q, within2, &mut |place, d2| {
            best = Some((place, d2));
            d2
        });
        best
    }

    /// The up to `count` points nearest to `q` with squared distances below `within2`, nearest
    /// first, into `found`.
    pub fn nearest_few(&self, q: DVec3, count: usize, within2: f64, found: &mut Vec<(f64, usize)>) {
        found.clear();
        self.visit(q, within2, &mut |place, d2| {
            if found.len() == count {
                found.pop();
            }
            let at = found.partition_point(|f| f.0 <= d2);
            found.insert(at, (d2, place));
            if found.len() == count { found[count - 1].0 } else { within2 }
        });
    }

    /// Calls `accept(place, d2)` for points nearer than the bound, which is what it returned last.
    fn visit(&self, q: DVec3, within2: f64, accept: &mut impl FnMut(usize, f64) -> f64) {
        let mut bound2 = within2;
        self.descend(0..self.points.len(), q, &mut bound2, accept);
    }

    fn descend(
        &self,
        range: Range<usize>,
        q: DVec3,
        bound2: &mut f64,
        accept: &mut impl FnMut(usize, f64) -> f64,
    ) {
        let mut look = |places: Range<usize>, bound2: &mut f64| {
            for place in places {
                let d2 = self.points[place].distance_squared(q);
                if d2 < *bound2 {
                    *bound2 = accept(place, d2);
                }
            }
        };
        if range.len() <= LEAF {
            return look(range, bound2);
        }
        let middle = range.start + range.len() / 2;
        let axis = self.axes[middle] as usize;
        let beyond = q[axis] - self.points[middle][axis];
        look(middle..middle + 1, bound2);
        let (below, above) = (range.start..middle, middle + 1..range.end);
        let (near, far) = if beyond < 0.0 { (below, above) } else { (above, below) };
        self.descend(near, q, bound2, accept);
        if beyond * beyond < *bound2 {
            self.descend(far, q, bound2, accept);
        }
    }
}

/// Orders a range and those it splits into.
fn split(points: &mut [DVec3], axes: &mut [u8]) {
    if points.len() <= LEAF {
        return;
    }
    let low = points.iter().fold(DVec3::INFINITY, |a, p| a.min(*p));
    let high = points.iter().fold(DVec3::NEG_INFINITY, |a, p| a.max(*p));
    let extent = high - low;
    let axis = if extent.x >= extent.y && extent.x >= extent.z {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    };
    let middle = points.len() / 2;
    points.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
    axes[middle] = axis as u8;
    let (below, above) = points.split_at_mut(middle);
    let (axes_below, axes_above) = axes.split_at_mut(middle);
    split(below, axes_below);
    split(&mut above[1..], &mut axes_above[1..]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_sim::Rng;

    fn cloud(rng: &mut Rng, count: usize) -> Vec<DVec3> {
        let mut at = || rng.range(-5.0, 5.0);
        (0..count).map(|_| DVec3::new(at(), at(), 0.1 * at())).collect()
    }

    #[test]
    fn equals_brute_force() {
        let mut rng = Rng::new(3);
        for count in [0, 1, 7, 8, 9, 500] {
            let tree = Tree::new(cloud(&mut rng, count));
            assert_eq!(tree.points().len(), count);
            for q in cloud(&mut rng, 200) {
                let mut all: Vec<f64> =
                    tree.points().iter().map(|p| p.distance_squared(q)).collect();
                all.sort_by(f64::total_cmp);
                all.retain(|d2| *d2 < 4.0);
                let nearest = tree.nearest(q, 4.0);
                assert_eq!(nearest.map(|n| n.1), all.first().copied());
                assert!(nearest.is_none_or(|(p, d2)| tree.points()[p].distance_squared(q) == d2));
                let mut few = Vec::new();
                tree.nearest_few(q, 6, 4.0, &mut few);
                let distances: Vec<f64> = few.iter().map(|f| f.0).collect();
                assert_eq!(distances, all[..all.len().min(6)]);
            }
        }
    }

    #[test]
    fn equal_points_are_no_trap() {
        let tree = Tree::new(vec![DVec3::ONE; 10_000]);
        let mut few = Vec::new();
        tree.nearest_few(DVec3::ONE, 5, 1.0, &mut few);
        assert_eq!((few.len(), few[4].0), (5, 0.0));
        assert_eq!(tree.nearest(DVec3::ZERO, 1.0), None);
    }
}
