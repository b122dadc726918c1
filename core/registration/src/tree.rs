//! Nearest neighbours among points in k-d tree order (Bentley 1975).
//!
//! The tree is balanced and merely an order of the points: the median of a range splits it, along
//! the axis in which the range is widest.

use crate::point::OrientedPoint;
use core::ops::Range;
use glam::DVec3;

/// Maximum number of points that are compared one by one. Not tuned separately.
const LEAF: usize = 8;

/// Brings finite points into tree order, in which neighbours in space are close together.
pub fn build(points: &mut [OrientedPoint]) {
    if points.len() <= LEAF {
        return;
    }
    let low = points.iter().fold(DVec3::INFINITY, |a, p| a.min(p.position));
    let high = points.iter().fold(DVec3::NEG_INFINITY, |a, p| a.max(p.position));
    let axis = (high - low).max_position();
    let middle = points.len() / 2;
    let along = |p: &OrientedPoint| p.position[axis];
    points.select_nth_unstable_by(middle, |a, b| along(a).total_cmp(&along(b)));
    points[middle].axis = axis as u8;
    let (below, above) = points.split_at_mut(middle);
    build(below);
    build(&mut above[1..]);
}

/// Index of the point nearest to `query` with a squared distance below `within2`, m^2.
pub fn nearest(points: &[OrientedPoint], query: DVec3, within2: f64) -> Option<usize> {
    let mut best = None;
    let mut bound2 = within2;
    visit(points, 0..points.len(), query, &mut bound2, &mut |index, d2| {
        best = Some(index);
        d2
    });
    best
}

/// The up to `N` points nearest to `query` with squared distances below `within2`, m^2: squared
/// distance and index, nearest first.
pub fn k_nearest<const N: usize>(
    points: &[OrientedPoint],
    query: DVec3,
    within2: f64,
) -> heapless::Vec<(f64, usize), N> {
    let mut found = heapless::Vec::<(f64, usize), N>::new();
    let mut bound2 = within2;
    visit(points, 0..points.len(), query, &mut bound2, &mut |index, d2| {
        if found.is_full() {
            found.pop();
        }
        let at = found.partition_point(|f| f.0 <= d2);
        // There is room: a full list has just lost its farthest point.
        let _ = found.insert(at, (d2, index));
        if found.is_full() { found[N - 1].0 } else { within2 }
    });
    found
}

/// Calls `accept(index, d2)` for each point of a range nearer than the bound, and makes the result
/// the new bound.
fn visit(
    points: &[OrientedPoint],
    range: Range<usize>,
    query: DVec3,
    bound2: &mut f64,
    accept: &mut impl FnMut(usize, f64) -> f64,
) {
    let mut look = |indices: Range<usize>, bound2: &mut f64| {
        for index in indices {
            let d2 = points[index].position.distance_squared(query);
            if d2 < *bound2 {
                *bound2 = accept(index, d2);
            }
        }
    };
    if range.len() <= LEAF {
        return look(range, bound2);
    }
    let middle = range.start + range.len() / 2;
    let axis = points[middle].axis as usize;
    let beyond = query[axis] - points[middle].position[axis];
    look(middle..middle + 1, bound2);
    let (below, above) = (range.start..middle, middle + 1..range.end);
    let (near, far) = if beyond < 0.0 { (below, above) } else { (above, below) };
    visit(points, near, query, bound2, accept);
    if beyond * beyond < *bound2 {
        visit(points, far, query, bound2, accept);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_sim::Rng;
    use std::vec::Vec;

    const COUNT: usize = 6;

    fn cloud(rng: &mut Rng, count: usize) -> Vec<OrientedPoint> {
        let mut at = || rng.range(-5.0, 5.0);
        (0..count).map(|_| DVec3::new(at(), at(), 0.1 * at()).into()).collect()
    }

    #[test]
    fn equals_brute_force() {
        let mut rng = Rng::new(3);
        for count in [0, 1, 7, 8, 9, 500] {
            let mut points = cloud(&mut rng, count);
            build(&mut points);
            for query in cloud(&mut rng, 200).iter().map(|p| p.position) {
                let distance2 = |p: &OrientedPoint| p.position.distance_squared(query);
                let mut all: Vec<f64> = points.iter().map(distance2).collect();
                all.sort_by(f64::total_cmp);
                all.retain(|d2| *d2 < 4.0);
                let found = nearest(&points, query, 4.0).map(|n| distance2(&points[n]));
                assert_eq!(found, all.first().copied());
                let few = k_nearest::<COUNT>(&points, query, 4.0);
                let distances: Vec<f64> = few.iter().map(|f| f.0).collect();
                assert_eq!(distances, all[..all.len().min(COUNT)]);
                assert!(few.iter().all(|(d2, n)| distance2(&points[*n]) == *d2));
            }
        }
    }

    #[test]
    fn equal_points_are_handled() {
        let mut points = std::vec![OrientedPoint::from(DVec3::ONE); 10_000];
        build(&mut points);
        let few = k_nearest::<5>(&points, DVec3::ONE, 1.0);
        assert_eq!((few.len(), few[4].0), (5, 0.0));
        assert_eq!(nearest(&points, DVec3::ZERO, 1.0), None);
    }
}
