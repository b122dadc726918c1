//! Trucks, buses and trams: each a single rigid body, however long.

use super::{axle, block, mirrors};
use crate::object::{Class, Object, Part, Surface};
use crate::path::Path;
use crate::rng::Rng;

/// Length of a wheel arch, m.
const ARCH: f64 = 1.25;

/// Width of the posts between panes, m.
const POST: f64 = 0.12;

/// How far panes are recessed behind their posts, m: they are set in rubber.
const INSET: f64 = 0.03;

/// Panes about `pane` m long from `x[0]` to `x[1]`, with posts between them and at both ends.
fn windows(
    x: [f64; 2],
    width: f64,
    z: [f64; 2],
    height: f64,
    pane: f64,
    paint: Surface,
) -> Vec<Part> {
    let within = [x[0] + 0.5 * POST, x[1] - 0.5 * POST];
    let mut parts = vec![block(within, width - 2.0 * INSET, z, height, Surface::glass(0.4))];
    let count = ((x[1] - x[0] - POST) / pane).round().max(1.0);
    let step = (x[1] - x[0] - POST) / count;
    parts.extend((0..=count as u32).map(|i| {
        let from = x[0] + step * f64::from(i);
        block([from, from + POST], width, z, height, paint)
    }));
    parts
}

/// A truck: cab, a gap, the load on a chassis; a third are semi-trailers.
pub fn truck(id: u32, path: Path, rng: &mut Rng) -> Object {
    let long = rng.chance(0.33);
    let l = if long { rng.range(12.0, 16.5) } else { rng.range(6.2, 10.0) };
    let (w, h) = (rng.range(2.3, 2.55), rng.range(3.0, 4.0));
    let paint = Surface::matt(rng.range(0.1, 0.7));
    let load = Surface::matt(rng.range(0.2, 0.75));
    let (front, rear) = (0.5 * l, -0.5 * l);
    let cab = front - rng.range(1.7, 2.3);
    let behind = cab - rng.range(0.25, 0.7);
    let (bed, roof) = (1.05, rng.range(2.6, 3.0f64.min(h)));
    // A third carry nothing, or a low load.
    let top = if rng.chance(0.33) { rng.range(1.3, 2.2) } else { h };
    let size = [l, w, top.max(roof)];
    let h = size[2];
    let mut parts = vec![
        block([cab, front], 0.96 * w, [0.4, 1.5], h, paint),
        block([cab, front - 0.1], 0.94 * w, [1.5, 2.2], h, Surface::glass(0.3)),
        block([cab, front - 0.2], 0.94 * w, [2.2, roof], h, paint),
        block([rear, behind], w, [bed, top], h, load),
        block([rear + 0.4, cab], 0.35 * w, [0.6, bed], h, Surface::matt(0.15)),
    ];
    let mut axles = vec![front - 1.3, rear + 1.6];
    axles.extend(long.then_some([rear + 2.9, rear + 4.2, front - 4.6]).into_iter().flatten());
    for x in axles {
        parts.extend(axle(x, w - 0.35, 0.5, h));
    }
    Object { id, class: Class::Truck, size, base: [0.6 * l, w - 0.35], path, parts }
}

/// A bus, articulated in a quarter of cases: panels between the wheel arches, a band of windows, a
/// roof, a slightly narrower front and rear, mirrors.
pub fn bus(id: u32, path: Path, rng: &mut Rng) -> Object {
    let long = rng.chance(0.25);
    let l = if long { rng.range(17.5, 18.4) } else { rng.range(10.4, 13.0) };
    let (w, h) = (rng.range(2.5, 2.55), rng.range(2.9, 3.2));
    let paint = Surface::matt(rng.range(0.2, 0.75));
    let (front, rear) = (0.5 * l, -0.5 * l);
    let (sill, top) = (rng.range(1.0, 1.3), h - rng.range(0.45, 0.7));
    let (pane, nose, tail) = (rng.range(1.2, 1.9), rng.range(0.2, 0.5), rng.range(0.08, 0.2));
    let side = [rear + tail, front - nose];
    let mut parts = vec![
        block([rear, side[0]], 0.94 * w, [0.35, h - 0.15], h, paint),
        block([side[1], front], 0.9 * w, [0.3, sill], h, paint),
        block([side[1], front - 0.05], 0.9 * w, [sill, top], h, Surface::glass(0.4)),
        block([side[1], front], 0.9 * w, [top, h - 0.15], h, paint),
        // Visible through the arches.
        block(side, w - 0.7, [0.35, sill], h, Surface::matt(0.1)),
        block(side, w, [0.95, sill], h, paint),
        block(side, w, [top, h - 0.1], h, paint),
        block([rear + 1.0, rear + 0.4 * l], 0.7 * w, [h - 0.1, h], h, paint),
    ];
    parts.extend(windows(side, w, [sill, top], h, pane, paint));
    parts.extend(mirrors(front - 0.12, w, h - 0.9, h, paint));
    let middle = long.then_some(front - 8.5);
    let mut from = side[0];
    for x in [rear + 3.3].into_iter().chain(middle).chain([front - 2.7]) {
        parts.extend(axle(x, w - 0.32, 0.48, h));
        parts.push(block([from, x - 0.5 * ARCH], w, [0.28, 0.95], h, paint));
        from = x + 0.5 * ARCH;
    }
    parts.push(block([from, side[1]], w, [0.28, 0.95], h, paint));
    Object { id, class: Class::Bus, size: [l, w, h], base: [0.5 * l, w - 0.32], path, parts }
}

/// A tram of several sections in a straight line, with bellows between them and equipment on the
/// roof.
pub fn tram(id: u32, path: Path, rng: &mut Rng) -> Object {
    let count = 3 + (3.0 * rng.unit()) as u32;
    let section = rng.range(6.8, 7.3);
    let l = section * f64::from(count);
    let (w, h) = (rng.range(2.3, 2.5), rng.range(3.3, 3.6));
    let paint = Surface::matt(rng.range(0.2, 0.75));
    let (sill, top, pane) = (rng.range(0.9, 1.2), h - 0.9, rng.range(1.0, 1.7));
    let mut parts = vec![block([-0.5 * l + 0.4, 0.5 * l - 0.4], w - 0.4, [0.4, h - 0.4], h, paint)];
    for i in 0..count {
        let rear = -0.5 * l + section * f64::from(i) + 0.25;
        let front = rear + section - 0.5;
        parts.push(block([rear, front], w, [0.15, sill], h, paint));
        parts.extend(windows([rear, front], w, [sill, top], h, pane, paint));
        parts.push(block([rear, front], w, [top, h - 0.4], h, paint));
        parts.push(block([rear + 1.5, front - 1.5], 0.6 * w, [h - 0.4, h], h, Surface::matt(0.3)));
    }
    // The ends are rounded off in steps.
    for sign in [-1.0, 1.0] {
        let mut x = [sign * (0.5 * l - 0.25), sign * 0.5 * l];
        x.sort_by(f64::total_cmp);
        parts.push(block(x, 0.8 * w, [0.2, h - 0.6], h, paint));
    }
    Object { id, class: Class::Tram, size: [l, w, h], base: [0.6 * l, 1.5], path, parts }
}
