//! A yard with a box that slides along a wall, as a spinning sensor sees it. Plain arithmetic, so
//! that every machine sees the same.

use raywake_core::sweep::Point;
use raywake_embed::{ReturnSource, ReturnsBy};

/// Height of the sensor above the ground, m.
pub const HEIGHT_M: f64 = 1.7;
/// Number of beams, and of returns of each.
const BEAMS: u32 = 32;
const COLUMNS: u32 = 720;
/// Returns of a sweep.
pub const RETURNS: usize = (BEAMS * COLUMNS) as usize;
/// Half the width of the yard, m.
const YARD_M: f64 = 10.0;
/// Speed of the sensor and of the box along x, m/s.
const OWN_MPS: f64 = 1.0;
const BOX_MPS: f64 = 5.0;

/// Minimum and maximum x, y and z in the world, m.
type Obstacle = [[f64; 2]; 3];

/// Returns of the sweep at a given time, in the sensor frame.
pub fn returns(time_s: f64) -> impl ReturnSource {
    let sensor = [OWN_MPS * time_s, 0.0, HEIGHT_M];
    let ahead = -4.0 + BOX_MPS * time_s;
    let sliding: Obstacle = [[ahead, ahead + 3.0], [4.0, 5.6], [0.1, 1.6]];
    let standing: Obstacle = [[-1.0, 1.5], [-6.5, -5.0], [0.0, 1.4]];
    let at = move |n| {
        let (column, beam) = (n as u32 / BEAMS, n as u32 % BEAMS);
        let ray = direction(column, beam);
        let mut range = walls(&sensor, &ray);
        for block in [&sliding, &standing] {
            range = range.min(hit(block, &sensor, &ray).unwrap_or(range));
        }
        let position = ray.map(|c| (c * range) as f32);
        Point { position, ..Point::default() }
    };
    ReturnsBy { count: RETURNS, at }
}

/// Direction of a ray. A revolution follows a square, which needs no sine.
fn direction(column: u32, beam: u32) -> [f64; 3] {
    let around = 4.0 * f64::from(column) / f64::from(COLUMNS);
    let (side, along) = (around as u32, 2.0 * (around - f64::from(around as u32)) - 1.0);
    let (x, y) = match side {
        0 => (1.0, along),
        1 => (-along, 1.0),
        2 => (-1.0, -along),
        _ => (along, -1.0),
    };
    [x, y, -0.45 + 0.5 * f64::from(beam) / f64::from(BEAMS)]
}

/// Distance to a wall or the ground, in ray lengths.
fn walls(from: &[f64; 3], ray: &[f64; 3]) -> f64 {
    let to = |axis: usize, bound: f64| {
        let ahead = (bound - from[axis]) / ray[axis];
        if ahead > 0.0 { ahead } else { f64::INFINITY }
    };
    let sides = [to(0, YARD_M), to(0, -YARD_M), to(1, YARD_M), to(1, -YARD_M), to(2, 0.0)];
    sides.into_iter().fold(f64::INFINITY, f64::min)
}

/// Distance to a block, in ray lengths, if it is hit.
fn hit(block: &Obstacle, from: &[f64; 3], ray: &[f64; 3]) -> Option<f64> {
    let (mut near, mut far) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let [a, b] = block[axis].map(|bound| (bound - from[axis]) / ray[axis]);
        (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
    }
    (near < far).then_some(near)
}
