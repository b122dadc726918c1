//! The height of the ground around a sensor: the mode of the lowest returns of cells.

use raywake_core::sweep::Point;

/// Farthest from the vertical axis that the ground is searched for, cells.
const REACH: i32 = 20;
/// Side of the cells that give one height each, m.
const CELL_M: f32 = 1.0;
/// Number of cells used, the nearest to the axis: a circle of radius 8 m if all are seen. Farther
/// away, a road rises and falls.
const CELLS_MAX: usize = 200;
/// The ground is the interval of this width, m, that contains the most heights: slopes, kerbs and
/// noise spread a plane this far.
const WIDTH_M: f32 = 0.3;
/// Minimum number of cells that make a ground.
const CELLS_MIN: usize = 20;

const SIDE: usize = 2 * REACH as usize;

/// Height of the ground around the vertical axis, m, in the cloud's frame (z up): the median of the
/// most frequent heights of the lowest returns in cells. `None` if too few cells agree.
pub fn ground_height(points: &[Point]) -> Option<f64> {
    let mut cells = lowest_returns(points);
    cells.sort_unstable_by_key(|(i, j, _)| (i * i + j * j, *i, *j));
    cells.truncate(CELLS_MAX);
    cells.sort_unstable_by(|a, b| a.2.total_cmp(&b.2));
    let heights = |from: usize| cells[from..].iter().map(|c| c.2);
    let within = |from: usize| {
        let count = heights(from).take_while(|h| *h <= cells[from].2 + WIDTH_M).count();
        (count, from)
    };
    // The lowest of several intervals that contain equally many.
    let (count, from) = (0..cells.len()).map(within).rev().max_by_key(|w| w.0)?;
    (count >= CELLS_MIN).then(|| f64::from(cells[from + count / 2].2))
}

/// Index and height of the lowest return in every cell that has one, m.
fn lowest_returns(points: &[Point]) -> heapless::Vec<(i32, i32, f32), { SIDE * SIDE }> {
    let mut lowest = [[f32::INFINITY; SIDE]; SIDE];
    for [x, y, z] in points.iter().map(|p| p.position) {
        if z.is_finite() && libm::hypotf(x, y) < REACH as f32 * CELL_M {
            let [i, j] = [x, y].map(|v| (libm::floorf(v / CELL_M) as i32 + REACH) as usize);
            lowest[i][j] = lowest[i][j].min(z);
        }
    }
    let index = |n: usize| n as i32 - REACH;
    let cells = lowest
        .iter()
        .enumerate()
        .flat_map(|(i, row)| row.iter().enumerate().map(move |(j, z)| (index(i), index(j), *z)));
    cells.filter(|c| c.2.is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn point(x: f32, y: f32, z: f32) -> Point {
        Point { position: [x, y, z], ..Point::default() }
    }

    fn plane(height: impl Fn(f32, f32) -> f32) -> Vec<Point> {
        let at = |n: i32| ((n % 60) as f32 * 0.5 - 15.0, (n / 60) as f32 * 0.5 - 15.0);
        (0..3600).map(at).map(|(x, y)| point(x, y, height(x, y))).collect()
    }

    #[test]
    fn ground_under_walls_roofs_and_strays() {
        let mut points = plane(|x, y| -1.7 + 0.003 * x + 0.01 * ((x * y) as i32 % 5) as f32);
        // A wall, a canopy covering every cell in which ground is seen, stray returns below.
        points.extend((0..2000).map(|n| point(8.0, (n % 40) as f32 * 0.5 - 10.0, n as f32 * 1e-3)));
        points.extend(plane(|_, _| 3.0));
        points.extend((0..15).map(|n| point(n as f32, 2.0, -4.0 - n as f32 * 0.02)));
        points.extend([f32::NAN, f32::INFINITY].map(|bad| point(bad, 0.0, -9.0)));
        points.extend([f32::NAN, f32::NEG_INFINITY].map(|bad| point(0.0, 0.0, bad)));
        let found = ground_height(&points).unwrap();
        assert!((found + 1.69).abs() < 0.06, "{found}");
    }

    #[test]
    fn no_ground() {
        assert_eq!(ground_height(&[]), None);
        assert_eq!(ground_height(&[point(f32::NAN, 0.0, 0.0), point(1.0, 0.0, 0.0)]), None);
        // A pole is not ground, nor is anything far away.
        let pole: Vec<_> = (0..1000).map(|n| point(3.0, 0.0, n as f32 * 0.01)).collect();
        assert_eq!(ground_height(&pole), None);
        let far: Vec<_> =
            plane(|_, _| -1.7).iter().map(|p| point(p.position[0] + 50.0, 0.0, -1.7)).collect();
        assert_eq!(ground_height(&far), None);
    }
}
