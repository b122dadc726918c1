//! Cyclists, motorcyclists and people on foot.

use super::{part, wheel};
use crate::object::{Class, Object, Part, Surface, Swing};
use crate::path::Path;
use crate::rng::Rng;
use crate::shape::Shape;
use glam::{DQuat, DVec3};
use std::f64::consts::{PI, TAU};

/// A limb that hangs `length` down from `pivot` (given by its height above the ground) and swings.
fn limb(
    radius: f64,
    length: f64,
    pivot: [f64; 3],
    height: f64,
    cloth: Surface,
    swing: [f64; 3],
) -> Part {
    let at = [pivot[0], pivot[1], pivot[2] - 0.5 * length];
    let mut limb = part(Shape::cylinder(radius, length), at, height, cloth);
    let [amplitude, rate, phase] = swing;
    let pivot = DVec3::new(pivot[0], pivot[1], pivot[2] - 0.5 * height);
    // The limbs of someone standing do not swing, so that nothing of them moves.
    limb.swing = (rate > 0.0).then_some(Swing { pivot, amplitude, rate, phase });
    limb
}

/// A part leaning forward by `lean`, rad.
fn leaning(mut part: Part, lean: f64) -> Part {
    part.rest.rotation = DQuat::from_rotation_y(lean);
    part
}

/// A cyclist: two wheels, frame, rider leaning forward, pedalling legs.
pub fn cyclist(id: u32, path: Path, rng: &mut Rng) -> Object {
    let h = rng.range(1.6, 1.85);
    let cloth = Surface::matt(rng.range(0.15, 0.6));
    let (metal, spokes) = (Surface::matt(0.3), Surface::porous(0.2, 0.6));
    let frame = Surface { porosity: 0.3, ..metal };
    let mut parts = vec![
        part(Shape::cuboid(0.95, 0.05, 0.4), [0.0, 0.0, 0.62], h, frame),
        part(Shape::cuboid(0.06, 0.55, 0.06), [0.42, 0.0, 1.0], h, metal),
        leaning(part(Shape::cylinder(0.19, 0.6), [0.05, 0.0, h - 0.54], h, cloth), 0.4),
        part(Shape::ellipsoid(0.12, 0.1, 0.13), [0.22, 0.0, h - 0.13], h, cloth),
    ];
    parts.extend([-0.53, 0.53].map(|x| wheel(x, 0.0, [0.34, 0.04], h, spokes)));
    let speed = path.at(0.0).speed;
    let (rate, phase) = (0.25 * TAU * speed, rng.range(0.0, TAU));
    for (y, lag) in [(0.12, 0.0), (-0.12, PI)] {
        let hip = [-0.1, y, h - 0.8];
        parts.push(limb(0.08, 0.7, hip, h, cloth, [0.4, rate, phase + lag]));
    }
    Object { id, class: Class::Cyclist, size: [1.74, 0.56, h], base: [0.0; 2], path, parts }
}

/// A motorcycle or scooter with its rider.
pub fn motorcycle(id: u32, path: Path, rng: &mut Rng) -> Object {
    let (l, h) = (rng.range(1.95, 2.25), rng.range(1.4, 1.6));
    let (paint, cloth) = (Surface::matt(rng.range(0.1, 0.6)), Surface::matt(rng.range(0.05, 0.4)));
    let (rubber, metal) = (Surface::matt(0.1), Surface::matt(0.3));
    let end = 0.5 * l - 0.31;
    let mut parts = vec![
        part(Shape::cuboid(2.0 * end - 0.3, 0.3, 0.45), [0.0, 0.0, 0.55], h, metal),
        part(Shape::cuboid(0.8, 0.32, 0.16), [-0.3, 0.0, 0.8], h, paint),
        part(Shape::ellipsoid(0.3, 0.22, 0.3), [end - 0.25, 0.0, 0.85], h, paint),
        part(Shape::cuboid(0.08, 0.72, 0.08), [end - 0.35, 0.0, 1.05], h, metal),
        leaning(part(Shape::ellipsoid(0.17, 0.24, 0.36), [-0.2, 0.0, h - 0.5], h, cloth), 0.35),
        part(Shape::ellipsoid(0.14, 0.13, 0.15), [0.0, 0.0, h - 0.15], h, paint),
    ];
    parts.extend([-end, end].map(|x| wheel(x, 0.0, [0.31, 0.14], h, rubber)));
    for y in [0.22, -0.22] {
        parts.push(leaning(part(Shape::cylinder(0.09, 0.55), [0.05, y, 0.55], h, cloth), -0.5));
    }
    Object { id, class: Class::Motorcycle, size: [l, 0.76, h], base: [0.0; 2], path, parts }
}

/// A person on foot: torso, head, and legs and arms that swing with the pace.
pub fn pedestrian(id: u32, path: Path, rng: &mut Rng) -> Object {
    let h = rng.range(1.5, 1.92);
    let cloth = Surface::matt(rng.range(0.1, 0.6));
    let (hip, shoulder) = (0.5 * h, 0.81 * h);
    let torso = Shape::ellipsoid(0.14, 0.22, 0.5 * (shoulder - hip) + 0.06);
    let mut parts = vec![
        part(torso, [0.0, 0.0, 0.5 * (hip + shoulder)], h, cloth),
        part(Shape::ellipsoid(0.11, 0.09, 0.13), [0.0, 0.0, h - 0.13], h, Surface::matt(0.4)),
    ];
    let speed = path.at(0.0).speed;
    // A double step covers about 1.4 m.
    let (rate, phase) = (TAU * speed / 1.4, rng.range(0.0, TAU));
    for (y, lag) in [(0.1, 0.0), (-0.1, PI)] {
        parts.push(limb(0.08, hip, [0.0, y, hip], h, cloth, [0.4, rate, phase + lag]));
        let arm = [0.0, 2.4 * y, shoulder];
        parts.push(limb(0.05, 0.38 * h, arm, h, cloth, [0.35, rate, phase + lag + PI]));
    }
    Object { id, class: Class::Pedestrian, size: [0.6, 0.58, h], base: [0.0; 2], path, parts }
}
