//! Cars and vans: no side is a single plane, so that a piece of it reveals how far it has moved.

use super::{axle, block, mirrors};
use crate::object::{Class, Object, Surface};
use crate::path::Path;
use crate::rng::Rng;

/// How far the body is inset from the mirrors on each side, m.
const MIRROR: f64 = 0.07;

/// A car: a body that narrows towards both ends, a glazed cabin that narrows towards its roof,
/// mirrors, wheels that protrude a little.
pub fn car(id: u32, path: Path, rng: &mut Rng) -> Object {
    let (l, w, h) = (rng.range(3.7, 4.9), rng.range(1.7, 1.95), rng.range(1.4, 1.65));
    let paint = Surface::matt(rng.range(0.05, 0.7));
    let glass = Surface::glass(paint.reflectivity);
    let (body, waist) = (w - 2.0 * MIRROR, rng.range(0.56, 0.62) * h);
    let (bonnet, nose) = (rng.range(0.8, 0.92) * waist, rng.range(0.62, 0.75) * waist);
    // Hatchbacks end with their cabin, others with a boot.
    let tail = if rng.chance(0.5) { waist } else { rng.range(0.85, 0.95) * waist };
    let cabin = 0.5 * rng.range(0.48, 0.6) * l;
    let middle = -rng.range(0.02, 0.09) * l;
    let ledge = waist + rng.range(0.35, 0.55) * (h - waist);
    let (rear, front) = (middle - cabin, middle + cabin);
    let mut parts = vec![
        block([-0.34 * l, 0.32 * l], body, [0.22, waist], h, paint),
        block([-0.46 * l, -0.34 * l], 0.96 * body, [0.24, tail], h, paint),
        block([-0.5 * l, -0.46 * l], 0.86 * body, [0.3, 0.8 * tail], h, paint),
        block([0.32 * l, 0.45 * l], 0.96 * body, [0.22, bonnet], h, paint),
        block([0.45 * l, 0.5 * l], 0.84 * body, [0.25, nose], h, paint),
        block([rear, front], 0.92 * body, [waist, ledge], h, glass),
        block([rear + 0.1 * cabin, front - 0.3 * cabin], 0.82 * body, [ledge, h - 0.05], h, glass),
        block([rear + 0.15 * cabin, front - 0.4 * cabin], 0.8 * body, [h - 0.05, h], h, paint),
    ];
    parts.extend(mirrors(front - 0.25 * cabin, w, waist + 0.05, h, paint));
    let base = [0.6 * l, w - 0.26];
    for x in [0.5, -0.5] {
        parts.extend(axle(x * base[0], base[1], 0.32, h));
    }
    Object { id, class: Class::Car, size: [l, w, h], base, path, parts }
}

/// A van: cargo box, windscreen, lower nose, mirrors, wheels.
pub fn van(id: u32, path: Path, rng: &mut Rng) -> Object {
    let (l, w, h) = (rng.range(4.7, 6.4), rng.range(1.95, 2.15), rng.range(1.95, 2.7));
    let paint = Surface::matt(rng.range(0.1, 0.75));
    let glass = Surface::glass(paint.reflectivity);
    let body = w - 2.0 * MIRROR;
    let front = 0.5 * l - rng.range(0.16, 0.24) * l;
    let (waist, bonnet) = (rng.range(0.48, 0.56) * h, rng.range(0.4, 0.5) * h);
    let step = 0.5 * (front + 0.5 * l);
    let mut parts = vec![
        block([-0.48 * l, front - 0.5], body, [0.3, h], h, paint),
        block([-0.5 * l, -0.48 * l], 0.9 * body, [0.4, 0.95 * h], h, paint),
        block([front - 0.5, front], 0.97 * body, [0.3, waist], h, paint),
        block([front - 0.5, front - 0.1], 0.92 * body, [waist, 0.94 * h], h, glass),
        block([front, step], 0.96 * body, [0.3, bonnet], h, paint),
        block([step, 0.5 * l], 0.88 * body, [0.32, 0.85 * bonnet], h, paint),
    ];
    parts.extend(mirrors(front - 0.1, w, waist + 0.15, h, paint));
    let base = [0.58 * l, w - 0.26];
    for x in [0.5, -0.5] {
        parts.extend(axle(x * base[0], base[1], 0.34, h));
    }
    Object { id, class: Class::Van, size: [l, w, h], base, path, parts }
}
