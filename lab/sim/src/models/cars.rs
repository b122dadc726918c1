//! Cars and vans.

use super::{axle, block};
use crate::object::{Class, Object, Surface};
use crate::path::Path;
use crate::rng::Rng;

/// A car: body, glazed cabin, wheels.
pub fn car(id: u32, path: Path, rng: &mut Rng) -> Object {
    let (l, w, h) = (rng.range(3.7, 4.9), rng.range(1.66, 1.9), rng.range(1.4, 1.65));
    let paint = Surface::matt(rng.range(0.05, 0.7));
    let waist = rng.range(0.56, 0.62) * h;
    let cabin = 0.5 * rng.range(0.48, 0.6) * l;
    let middle = -rng.range(0.02, 0.09) * l;
    let base = [0.6 * l, w - 0.22];
    let glass = Surface::glass(paint.reflectivity);
    let mut parts = vec![
        block([-0.5 * l, 0.5 * l], w, [0.22, waist], h, paint),
        block([middle - cabin, middle + cabin], 0.84 * w, [waist, h], h, glass),
    ];
    for x in [0.5, -0.5] {
        parts.extend(axle(x * base[0], base[1], 0.32, h));
    }
    Object { id, class: Class::Car, size: [l, w, h], base, path, parts }
}

/// A van: cargo box, lower nose, wheels.
pub fn van(id: u32, path: Path, rng: &mut Rng) -> Object {
    let (l, w, h) = (rng.range(4.7, 6.4), rng.range(1.9, 2.1), rng.range(1.95, 2.7));
    let paint = Surface::matt(rng.range(0.1, 0.75));
    let front = 0.5 * l - rng.range(0.16, 0.24) * l;
    let base = [0.58 * l, w - 0.24];
    let mut parts = vec![
        block([-0.5 * l, front], w, [0.3, h], h, paint),
        block([front, 0.5 * l], 0.96 * w, [0.3, 0.5 * h], h, paint),
    ];
    for x in [0.5, -0.5] {
        parts.extend(axle(x * base[0], base[1], 0.34, h));
    }
    Object { id, class: Class::Van, size: [l, w, h], base, path, parts }
}
