//! Clouds ready for registration: thinned points, their order for neighbour search, normals.

use super::eigen;
use super::tree::Tree;
use glam::DVec3;
use std::collections::HashSet;

/// Neighbours that tell a normal, and the farthest of them, m.
const NEIGHBOURS: usize = 12;
const NEIGHBOUR_M: f64 = 1.5;
/// Fewest neighbours that tell a normal.
const NEIGHBOURS_MIN: usize = 5;
/// A patch is flat where its least variance is below this share of the middle one.
const FLAT: f64 = 0.1;
/// A patch is no line where its middle variance is above this share of the largest one; along a
/// line, as a single beam leaves it on the ground, the normal is arbitrary.
const WIDE: f64 = 0.05;
/// Coordinates beyond are no measurements, m; their squares stay finite.
const REACH_M: f64 = 1e4;

/// Points with normals where their surroundings are flat.
pub struct Cloud {
    pub(super) tree: Tree,
    /// Unit normals, either way round, in the order of the tree; zero where there is none.
    pub(super) normals: Vec<DVec3>,
    /// Places of the points that have one.
    pub(super) flat: Vec<usize>,
}

impl Cloud {
    /// From points (m, any frame) as they are. Points that are not finite or farther than 10 km
    /// from the origin are left out.
    pub fn new(points: impl IntoIterator<Item = DVec3>) -> Cloud {
        let sane = points.into_iter().filter(|p| p.is_finite() && p.abs().max_element() < REACH_M);
        let tree = Tree::new(sane.collect());
        let mut near = Vec::with_capacity(NEIGHBOURS);
        let normals: Vec<DVec3> =
            tree.points().iter().map(|p| normal(&tree, *p, &mut near)).collect();
        let flat = (0..normals.len()).filter(|n| normals[*n] != DVec3::ZERO).collect();
        Cloud { tree, normals, flat }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.normals.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.normals.is_empty()
    }
}

/// Indices of the first point in every voxel of a side of `voxel_m`, in the points' order. Points
/// that are not finite are left out.
///
/// One point and not the mean: it keeps its time, and lies on a surface.
pub fn thin(points: impl IntoIterator<Item = DVec3>, voxel_m: f64) -> Vec<usize> {
    let mut seen = HashSet::new();
    let mut kept = Vec::new();
    for (n, p) in points.into_iter().enumerate() {
        let voxel = (p / voxel_m).floor().to_array().map(|c| c as i64);
        if p.is_finite() && seen.insert(voxel) {
            kept.push(n);
        }
    }
    kept
}

/// Normal of the flat patch around a point, or zero.
fn normal(tree: &Tree, at: DVec3, near: &mut Vec<(f64, usize)>) -> DVec3 {
    tree.nearest_few(at, NEIGHBOURS, NEIGHBOUR_M * NEIGHBOUR_M, near);
    if near.len() < NEIGHBOURS_MIN {
        return DVec3::ZERO;
    }
    // Relative to the point, so that the difference of squares loses nothing.
    let (mut sum, mut squares) = (DVec3::ZERO, [[0.0; 3]; 3]);
    for (_, place) in near.iter() {
        let d = tree.points()[*place] - at;
        sum += d;
        for (i, row) in squares.iter_mut().enumerate() {
            for (j, cell) in row.iter_mut().enumerate() {
                *cell += d[i] * d[j];
            }
        }
    }
    let share = 1.0 / near.len() as f64;
    let mean = sum * share;
    let covariance =
        std::array::from_fn(|i| std::array::from_fn(|j| squares[i][j] * share - mean[i] * mean[j]));
    let (values, vectors) = eigen::symmetric::<3>(covariance);
    let planar = values[0] < FLAT * values[1] && values[1] > WIDE * values[2];
    if planar { DVec3::from_array(vectors[0]).normalize_or_zero() } else { DVec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(map: impl Fn(f64, f64) -> DVec3) -> Vec<DVec3> {
        (0..400).map(|n| map((n % 20) as f64 * 0.3, (n / 20) as f64 * 0.3)).collect()
    }

    #[test]
    fn normals_of_planes_alone() {
        let cloud = Cloud::new(grid(|u, v| DVec3::new(u, v, 0.5 * u)));
        let expected = DVec3::new(-0.5, 0.0, 1.0).normalize();
        assert_eq!(cloud.flat.len(), 400);
        assert!(cloud.normals.iter().all(|n| n.dot(expected).abs() > 1.0 - 1e-12));
        let line = Cloud::new((0..400).map(|n| DVec3::new(0.1 * n as f64, 0.0, 0.0)));
        assert_eq!((line.len(), line.flat.len()), (400, 0));
    }

    #[test]
    fn bad_points() {
        let bad = [DVec3::NAN, DVec3::INFINITY, DVec3::splat(1e300)];
        assert!(Cloud::new(bad).is_empty());
        assert_eq!(Cloud::new(vec![DVec3::ONE; 100]).flat.len(), 0);
        assert_eq!(thin(bad.into_iter().chain([DVec3::ZERO, DVec3::splat(0.1)]), 0.5), [2, 3]);
    }
}
