//! Clouds ready for registration: points in k-d tree order, with normals.
//!
//! The normal of a point is the direction in which its nearest neighbours vary least (principal
//! components: Hoppe et al. 1992); a point whose neighbours are not flat has none.

use crate::moments::PointMoments;
use crate::point::OrientedPoint;
use crate::{compact, tree};
use core::ops::RangeInclusive;
use glam::DVec3;

/// Number of neighbours that give a normal, and the maximum distance of the farthest, m. Not tuned
/// separately.
const NEIGHBOURS: RangeInclusive<usize> = 5..=12;
const NEIGHBOUR_M: f64 = 1.5;
/// Coordinates beyond this are not measurements, m; their squares stay finite.
const REACH_M: f64 = 1e4;

/// Points, with normals where their surroundings are flat.
#[derive(Clone, Copy, Debug)]
pub struct OrientedCloud<'a> {
    points: &'a [OrientedPoint],
    flat: usize,
}

impl<'a> OrientedCloud<'a> {
    /// Orders the points and finds their normals. Points that are not finite or farther than 10 km
    /// from the origin are left out.
    pub fn new(points: &'a mut [OrientedPoint]) -> OrientedCloud<'a> {
        let sane =
            |p: &OrientedPoint| p.position.is_finite() && p.position.abs().max_element() < REACH_M;
        let count = compact(points, sane);
        let points = &mut points[..count];
        tree::build(points);
        for index in 0..count {
            points[index].normal = normal(points, points[index].position);
        }
        let flat = points.iter().filter(|p| p.is_flat()).count();
        OrientedCloud { points, flat }
    }

    /// All points, in tree order.
    pub fn points(&self) -> &'a [OrientedPoint] {
        self.points
    }

    /// Number of points with a normal.
    pub fn normal_count(&self) -> usize {
        self.flat
    }
}

/// Normal of the flat patch around a place, or zero if there is none.
fn normal(points: &[OrientedPoint], at: DVec3) -> DVec3 {
    let near = tree::k_nearest::<{ *NEIGHBOURS.end() }>(points, at, NEIGHBOUR_M * NEIGHBOUR_M);
    if near.len() < *NEIGHBOURS.start() {
        return DVec3::ZERO;
    }
    // Relative to the place, so that the difference of squares loses no precision.
    let mut moments = PointMoments::NONE;
    near.iter().for_each(|(_, index)| moments.add(points[*index].position - at));
    moments.normal().map_or(DVec3::ZERO, |(normal, _)| normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;
    use std::vec::Vec;

    #[test]
    fn normals_of_planes_alone() {
        let at = |n: usize| ((n % 20) as f64 * 0.3, (n / 20) as f64 * 0.3);
        let plane = |(u, v)| OrientedPoint::from(DVec3::new(u, v, 0.5 * u));
        let mut slope: Vec<_> = (0..400).map(at).map(plane).collect();
        let cloud = OrientedCloud::new(&mut slope);
        let expected = DVec3::new(-0.5, 0.0, 1.0).normalize();
        assert_eq!(cloud.normal_count(), 400);
        assert!(cloud.points().iter().all(|p| p.normal.dot(expected).abs() > 1.0 - 1e-12));
        let mut line: Vec<_> =
            (0..400).map(|n| OrientedPoint::from(DVec3::new(0.1 * n as f64, 0.0, 0.0))).collect();
        let line = OrientedCloud::new(&mut line);
        assert_eq!((line.points().len(), line.normal_count()), (400, 0));
    }

    #[test]
    fn bad_points() {
        let mut bad = [DVec3::NAN, DVec3::INFINITY, DVec3::splat(1e300)].map(OrientedPoint::from);
        assert!(OrientedCloud::new(&mut bad).points().is_empty());
        let mut same = vec![OrientedPoint::from(DVec3::ONE); 100];
        assert_eq!(OrientedCloud::new(&mut same).normal_count(), 0);
    }
}
