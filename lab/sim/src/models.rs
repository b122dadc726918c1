//! Cars, vans, cyclists and pedestrians, put together from a few solids each.

use crate::object::{Class, Object, Part, Surface, Swing};
use crate::path::Path;
use crate::rng::Rng;
use crate::shape::Shape;
use glam::{DQuat, DVec3};
use raywake_core::pose::Pose;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A part whose centre lies at (x, y) and `z` above the ground, in an object `height` tall.
fn part(shape: Shape, at: [f64; 3], height: f64, surface: Surface) -> Part {
    let translation = DVec3::new(at[0], at[1], at[2] - 0.5 * height);
    Part { shape, rest: Pose { rotation: DQuat::IDENTITY, translation }, surface, swing: None }
}

/// Four wheels `base` apart, their centres `shift` ahead of the vehicle's.
fn wheels(base: [f64; 2], shift: f64, radius: f64, height: f64) -> impl Iterator<Item = Part> {
    let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    corners.into_iter().map(move |(along, across)| {
        let at = [shift + 0.5 * along * base[0], 0.5 * across * base[1], radius];
        let mut wheel = part(Shape::cylinder(radius, 0.2), at, height, Surface::matt(0.08));
        wheel.rest.rotation = DQuat::from_rotation_x(FRAC_PI_2);
        wheel
    })
}

/// A car: body, glazed cabin, wheels.
pub fn car(id: u32, path: Path, rng: &mut Rng) -> Object {
    let (l, w, h) = (rng.range(3.7, 4.9), rng.range(1.66, 1.9), rng.range(1.4, 1.65));
    let paint = Surface::matt(rng.range(0.05, 0.7));
    let waist = rng.range(0.56, 0.62) * h;
    let cabin = [rng.range(0.48, 0.6) * l, 0.84 * w, h - waist];
    let base = [0.6 * l, w - 0.22];
    let sill = 0.22;
    let mut parts = vec![
        part(Shape::cuboid(l, w, waist - sill), [0.0, 0.0, 0.5 * (waist + sill)], h, paint),
        part(
            Shape::cuboid(cabin[0], cabin[1], cabin[2]),
            [-rng.range(0.02, 0.09) * l, 0.0, waist + 0.5 * cabin[2]],
            h,
            Surface::glass(paint.reflectivity),
        ),
    ];
    parts.extend(wheels(base, 0.0, 0.32, h));
    Object { id, class: Class::Car, size: [l, w, h], base, path, parts }
}

/// A van: cargo box, lower nose, wheels.
pub fn van(id: u32, path: Path, rng: &mut Rng) -> Object {
    let (l, w, h) = (rng.range(4.7, 6.4), rng.range(1.9, 2.1), rng.range(1.95, 2.7));
    let paint = Surface::matt(rng.range(0.1, 0.75));
    let nose = rng.range(0.16, 0.24) * l;
    let bonnet = 0.5 * h;
    let base = [0.58 * l, w - 0.24];
    let sill = 0.3;
    let mut parts = vec![
        part(Shape::cuboid(l - nose, w, h - sill), [-0.5 * nose, 0.0, 0.5 * (h + sill)], h, paint),
        part(
            Shape::cuboid(nose, 0.96 * w, bonnet - sill),
            [0.5 * (l - nose), 0.0, 0.5 * (bonnet + sill)],
            h,
            paint,
        ),
    ];
    parts.extend(wheels(base, 0.0, 0.34, h));
    Object { id, class: Class::Van, size: [l, w, h], base, path, parts }
}

/// A limb that hangs `length` down from `pivot` (its height above the ground) and swings.
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
    // Who stands keeps the limbs still, so that nothing of them moves.
    limb.swing = (rate > 0.0).then_some(Swing { pivot, amplitude, rate, phase });
    limb
}

/// A cyclist: two wheels, frame, rider leaning forward, legs that pedal.
pub fn cyclist(id: u32, path: Path, rng: &mut Rng) -> Object {
    let h = rng.range(1.6, 1.85);
    let cloth = Surface::matt(rng.range(0.15, 0.6));
    let (metal, spokes) = (Surface::matt(0.3), Surface::porous(0.2, 0.6));
    let mut parts = vec![
        part(
            Shape::cuboid(0.95, 0.05, 0.4),
            [0.0, 0.0, 0.62],
            h,
            Surface { porosity: 0.3, ..metal },
        ),
        part(Shape::cuboid(0.06, 0.55, 0.06), [0.42, 0.0, 1.0], h, metal),
        part(Shape::cylinder(0.19, 0.6), [0.05, 0.0, h - 0.54], h, cloth),
        part(Shape::ellipsoid(0.12, 0.1, 0.13), [0.22, 0.0, h - 0.13], h, cloth),
    ];
    parts[2].rest.rotation = DQuat::from_rotation_y(0.4);
    for x in [-0.53, 0.53] {
        let mut wheel = part(Shape::cylinder(0.34, 0.04), [x, 0.0, 0.34], h, spokes);
        wheel.rest.rotation = DQuat::from_rotation_x(FRAC_PI_2);
        parts.push(wheel);
    }
    let speed = path.at(0.0).speed;
    let (rate, phase) = (0.25 * TAU * speed, rng.range(0.0, TAU));
    for (y, lag) in [(0.12, 0.0), (-0.12, PI)] {
        let hip = [-0.1, y, h - 0.8];
        parts.push(limb(0.08, 0.7, hip, h, cloth, [0.4, rate, phase + lag]));
    }
    Object { id, class: Class::Cyclist, size: [1.74, 0.56, h], base: [0.0; 2], path, parts }
}

/// Somebody on foot: torso, head, and legs and arms that swing with the pace.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::Ground;

    #[test]
    fn parts_stay_in_the_box() {
        let mut rng = Rng::new(3);
        let path = || Path::standing(0.0, 0.0, 0.0);
        for _ in 0..20 {
            let all = [
                car(1, path(), &mut rng),
                van(2, path(), &mut rng),
                cyclist(3, path(), &mut rng),
                pedestrian(4, path(), &mut rng),
            ];
            for object in all {
                let [l, w, h] = object.size.map(|v| 0.5 * v + 0.05);
                for p in &object.parts {
                    let c = p.rest.translation;
                    assert!(c.x.abs() < l && c.y.abs() < w && c.z.abs() < h, "{object:?}");
                }
                let pose = object.pose(&Ground::flat(), 0.0);
                assert!((pose.translation.z - 0.5 * object.size[2]).abs() < 1e-12);
                let half = DVec3::from_array(object.size) * 0.5;
                assert!(
                    object.reach() > 0.8 * half.length() && object.reach() < 1.4 * half.length()
                );
                assert!(object.is_still());
            }
        }
    }
}
