//! Traffic participants, each built from a few solids.

mod cars;
mod heavy;
mod people;

pub use cars::{car, van};
pub use heavy::{bus, tram, truck};
pub use people::{cyclist, motorcycle, pedestrian};

use crate::object::{Part, Surface};
use crate::shape::Shape;
use glam::{DQuat, DVec3};
use raywake_core::pose::Pose;
use std::f64::consts::FRAC_PI_2;

/// A part whose centre lies at (x, y) and `z` above the ground, in an object `height` tall.
fn part(shape: Shape, at: [f64; 3], height: f64, surface: Surface) -> Part {
    let translation = DVec3::new(at[0], at[1], at[2] - 0.5 * height);
    Part { shape, rest: Pose { rotation: DQuat::IDENTITY, translation }, surface, swing: None }
}

/// A box from `x[0]` to `x[1]` lengthwise and from `z[0]` to `z[1]` above the ground, `width` wide.
fn block(x: [f64; 2], width: f64, z: [f64; 2], height: f64, surface: Surface) -> Part {
    let shape = Shape::cuboid(x[1] - x[0], width, z[1] - z[0]);
    part(shape, [0.5 * (x[0] + x[1]), 0.0, 0.5 * (z[0] + z[1])], height, surface)
}

/// A wheel on the ground at (x, y), its axle across.
fn wheel(x: f64, y: f64, [radius, width]: [f64; 2], height: f64, surface: Surface) -> Part {
    let mut wheel = part(Shape::cylinder(radius, width), [x, y, radius], height, surface);
    wheel.rest.rotation = DQuat::from_rotation_x(FRAC_PI_2);
    wheel
}

/// Two wheels on an axle at x, `track` apart.
fn axle(x: f64, track: f64, radius: f64, height: f64) -> [Part; 2] {
    let rubber = Surface::matt(0.08);
    [0.5, -0.5].map(|side| wheel(x, side * track, [radius, 0.2], height, rubber))
}

/// Mirrors that extend to the sides of the box, at x and `z` above the ground.
fn mirrors(x: f64, width: f64, z: f64, height: f64, surface: Surface) -> [Part; 2] {
    let (out, shape) = (0.1, Shape::ellipsoid(0.09, 0.1, 0.1));
    [1.0, -1.0].map(|side| part(shape, [x, side * (0.5 * width - out), z], height, surface))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::Ground;
    use crate::object::{Class, Object};
    use crate::path::Path;
    use crate::rng::Rng;
    use crate::target::Target;

    type Model = fn(u32, Path, &mut Rng) -> Object;

    /// Every model with its class and its minimum and maximum length, m.
    const ALL: [(Model, Class, [f64; 2]); 8] = [
        (car, Class::Car, [3.5, 5.0]),
        (van, Class::Van, [4.5, 6.5]),
        (truck, Class::Truck, [6.0, 16.5]),
        (bus, Class::Bus, [10.0, 18.5]),
        (tram, Class::Tram, [20.0, 37.0]),
        (motorcycle, Class::Motorcycle, [1.9, 2.3]),
        (cyclist, Class::Cyclist, [1.6, 1.9]),
        (pedestrian, Class::Pedestrian, [0.4, 0.7]),
    ];

    #[test]
    fn parts_stay_in_the_box() {
        let mut rng = Rng::new(3);
        for (model, class, length) in (0..20).flat_map(|_| ALL) {
            let object = model(1, Path::stationary(0.0, 0.0, 0.0), &mut rng);
            assert_eq!(object.class, class);
            assert!((length[0]..=length[1]).contains(&object.size[0]), "{object:?}");
            let box_half = DVec3::from_array(object.size) * 0.5;
            for (p, part) in object.parts.iter().enumerate() {
                let solid = Target::of_part(0, &object, p, part.rest, false);
                let out = (solid.centre.abs() + solid.half() - box_half).max_element();
                assert!(out < 0.1, "{class:?}: part {p} is {out} m out");
            }
            let pose = object.pose(&Ground::flat(), 0.0);
            assert!((pose.translation.z - 0.5 * object.size[2]).abs() < 1e-12);
            let reach = object.reach() / box_half.length();
            assert!((0.8..1.4).contains(&reach), "{class:?}: {reach}");
            assert!(object.is_static());
        }
    }
}
