//! The street's background: buildings with gaps, poles, trees, hedges, fences and clutter.

use crate::ground::{CROSS_HALF, ROAD_HALF};
use crate::object::{Class, Surface};
use crate::path::Path;
use crate::rng::Rng;
use crate::scene::Scene;
use crate::shape::Shape;
use glam::{DQuat, DVec3};
use raywake_core::pose::Pose;

/// Width of a sidewalk, m.
pub(crate) const SIDEWALK: f64 = 4.3;
/// How far around the vehicle's path there is something to see, m.
const VIEW: f64 = 125.0;

/// Part of the street frame that is furnished: minimum and maximum, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Extent {
    pub(crate) x: [f64; 2],
    pub(crate) y: [f64; 2],
}

impl Extent {
    pub(crate) fn around(path: &Path, duration_s: f64) -> Extent {
        let mut extent = Extent { x: [0.0; 2], y: [0.0; 2] };
        let steps = (duration_s * 4.0).ceil() as u32;
        for i in 0..=steps {
            let s = path.at(f64::from(i) * 0.25);
            extent.x = [extent.x[0].min(s.x), extent.x[1].max(s.x)];
            extent.y = [extent.y[0].min(s.y), extent.y[1].max(s.y)];
        }
        let widen = |v: [f64; 2]| [v[0] - VIEW, v[1] + VIEW];
        Extent { x: widen(extent.x), y: widen(extent.y) }
    }
}

/// Builds the background into the scene.
pub(crate) fn build(scene: &mut Scene, extent: Extent, crossing: f64, rng: &mut Rng) {
    let mut yard = Yard { scene, crossing, rng };
    for side in [-1.0, 1.0] {
        yard.houses_along_road(extent.x, side);
        yard.houses_along_crossing(extent.y, side);
        yard.kerb_side(extent.x, side);
        yard.house_side(extent.x, side);
    }
}

struct Yard<'a> {
    scene: &'a mut Scene,
    crossing: f64,
    rng: &'a mut Rng,
}

impl Yard<'_> {
    /// Puts a solid `height` tall with its foot at (x, y), `lift` above the ground.
    fn put(
        &mut self,
        class: Class,
        shape: Shape,
        at: [f64; 3],
        height: f64,
        yaw: f64,
        surface: Surface,
    ) {
        let z = self.scene.ground.height(at[0], at[1]) + at[2] + 0.5 * height;
        self.scene.put(class, shape, Pose::planar(at[0], at[1], z, yaw), surface);
    }

    fn cuboid(&mut self, class: Class, at: [f64; 2], size: [f64; 3], yaw: f64, surface: Surface) {
        // Sunk a little, so that no ray passes beneath where the ground slopes.
        let height = size[2] + 0.5;
        let shape = Shape::cuboid(size[0], size[1], height);
        self.put(class, shape, [at[0], at[1], -0.5], height, yaw, surface);
    }

    /// Whether (a stretch around) x lies where the crossing road or its sidewalks are.
    fn in_crossing(&self, x: f64, half: f64) -> bool {
        (x - self.crossing).abs() < CROSS_HALF + 3.0 + half
    }

    fn houses_along_road(&mut self, x: [f64; 2], side: f64) {
        let mut at = x[0];
        while at < x[1] {
            let length = self.rng.range(8.0, 26.0);
            let middle = at + 0.5 * length;
            at += length;
            if self.in_crossing(middle, 0.5 * length) {
                // Step on in small strides so that the corner houses stand near the corner.
                at += 2.0 - length;
                continue;
            }
            let front = ROAD_HALF + SIDEWALK + self.rng.range(0.0, 3.0);
            if self.rng.chance(0.25) {
                at += self.rng.range(3.0, 8.0);
                self.gap(middle, side * (front + 4.0));
                continue;
            }
            let depth = self.rng.range(8.0, 13.0);
            let size = [length, depth, self.rng.range(4.0, 18.0)];
            let wall = Surface::matt(self.rng.range(0.25, 0.6));
            self.cuboid(Class::Building, [middle, side * (front + 0.5 * depth)], size, 0.0, wall);
            self.front(middle, side, front, length, wall);
        }
    }

    /// What sticks out of a front: bays, porches and stairs, so that walls are not all planes.
    fn front(&mut self, middle: f64, side: f64, front: f64, length: f64, wall: Surface) {
        let count = (self.rng.unit() * 4.0) as u32;
        for _ in 0..count {
            let x = middle + self.rng.range(-0.42, 0.42) * length;
            let out = self.rng.range(0.15, 0.6);
            let size = [self.rng.range(0.8, 3.0), 2.0 * out, self.rng.range(0.4, 4.0)];
            self.cuboid(Class::Building, [x, side * front], size, 0.0, wall);
        }
    }

    /// A gap between houses: a wall or hedge, a tree behind it, something farther back.
    fn gap(&mut self, x: f64, y: f64) {
        if self.rng.chance(0.6) {
            let aside = self.rng.range(-2.0, 2.0);
            self.tree(x + aside, y);
        }
        if self.rng.chance(0.6) {
            let size =
                [self.rng.range(8.0, 20.0), self.rng.range(6.0, 12.0), self.rng.range(3.0, 10.0)];
            let yaw = self.rng.range(-0.5, 0.5);
            let back = y + y.signum() * self.rng.range(22.0, 40.0);
            self.cuboid(Class::Building, [x, back], size, yaw, Surface::matt(0.4));
        }
    }

    fn houses_along_crossing(&mut self, y: [f64; 2], side: f64) {
        for (sign, end) in [(-1.0, -y[0]), (1.0, y[1])] {
            let mut at = 27.0;
            while at < end {
                let length = self.rng.range(8.0, 22.0);
                let front = CROSS_HALF + 3.0 + self.rng.range(0.0, 3.0);
                let depth = self.rng.range(8.0, 12.0);
                let size = [depth, length, self.rng.range(4.0, 16.0)];
                let place =
                    [self.crossing + side * (front + 0.5 * depth), sign * (at + 0.5 * length)];
                let wall = Surface::matt(self.rng.range(0.25, 0.6));
                self.cuboid(Class::Building, place, size, 0.0, wall);
                at += length + if self.rng.chance(0.3) { self.rng.range(3.0, 9.0) } else { 0.0 };
            }
        }
    }

    /// Lamp posts, trees, signs and bins between kerb and walkers.
    fn kerb_side(&mut self, x: [f64; 2], side: f64) {
        let mut at = x[0] + self.rng.range(0.0, 8.0);
        while at < x[1] {
            let y = side * (ROAD_HALF + self.rng.range(0.45, 0.8));
            if !self.in_crossing(at, 1.0) {
                match (self.rng.unit() * 10.0) as u32 {
                    0..4 => self.tree(at, y),
                    4..6 => self.lamp(at, y),
                    6..8 => self.sign(at, y),
                    8 => self.bin(at, y),
                    _ => self.cabinet(at, y),
                }
            }
            at += self.rng.range(5.0, 13.0);
        }
    }

    fn lamp(&mut self, x: f64, y: f64) {
        let height = self.rng.range(6.0, 9.0);
        self.pole(x, y, 0.1, height);
    }

    fn pole(&mut self, x: f64, y: f64, radius: f64, height: f64) {
        let shape = Shape::cylinder(radius, height + 0.2);
        self.put(Class::Pole, shape, [x, y, -0.2], height + 0.2, 0.0, Surface::matt(0.4));
    }

    fn sign(&mut self, x: f64, y: f64) {
        let (height, yaw) = (self.rng.range(2.2, 3.0), self.rng.range(-0.2, 0.2));
        self.pole(x, y, 0.035, height);
        let face = Surface::matt(1.0);
        self.put(Class::Pole, Shape::cuboid(0.04, 0.6, 0.6), [x, y, height - 0.6], 0.6, yaw, face);
    }

    fn bin(&mut self, x: f64, y: f64) {
        self.put(
            Class::Fixture,
            Shape::cylinder(0.28, 1.0),
            [x, y, 0.0],
            1.0,
            0.0,
            Surface::matt(0.25),
        );
    }

    fn cabinet(&mut self, x: f64, y: f64) {
        let size = [self.rng.range(0.6, 1.4), 0.4, self.rng.range(0.9, 1.5)];
        self.cuboid(Class::Fixture, [x, y], size, 0.0, Surface::matt(0.4));
    }

    fn tree(&mut self, x: f64, y: f64) {
        let trunk = self.rng.range(2.0, 3.2);
        let radius = self.rng.range(0.1, 0.24);
        self.pole(x, y, radius, trunk + 0.8);
        let count = 2 + (self.rng.unit() * 3.0) as u32;
        for _ in 0..count {
            let spread = self.rng.range(0.9, 1.9);
            let height = 2.0 * self.rng.range(0.7, 1.6);
            let at = [
                x + self.rng.range(-0.8, 0.8),
                y + self.rng.range(-0.8, 0.8),
                trunk + self.rng.range(-0.2, 1.4),
            ];
            let crown = Shape::ellipsoid(spread, spread * self.rng.range(0.8, 1.2), 0.5 * height);
            let leaves = Surface::porous(self.rng.range(0.3, 0.6), self.rng.range(0.3, 0.65));
            self.put(Class::Vegetation, crown, at, height, 0.0, leaves);
        }
    }

    /// Hedges, fences, walls and bushes at the far edge of the sidewalk. Some are the size of
    /// cars, which is what a background filter has to tell apart.
    fn house_side(&mut self, x: [f64; 2], side: f64) {
        let mut at = x[0] + self.rng.range(0.0, 10.0);
        while at < x[1] {
            let length = self.rng.range(1.5, 9.0);
            let y = side * (ROAD_HALF + SIDEWALK - self.rng.range(0.2, 0.5));
            if !self.in_crossing(at, 0.5 * length + 0.5) {
                match (self.rng.unit() * 5.0) as u32 {
                    0 | 1 => self.hedge(at, y, length),
                    2 => self.fence(at, y, length),
                    3 => self.bush(at, y),
                    _ => {
                        let size = [length, 0.3, self.rng.range(0.5, 1.8)];
                        self.cuboid(Class::Fixture, [at, y], size, 0.0, Surface::matt(0.35));
                    }
                }
            }
            at += 0.5 * length + self.rng.range(4.0, 22.0);
        }
    }

    fn hedge(&mut self, x: f64, y: f64, length: f64) {
        let leaves = Surface::porous(0.45, 0.2);
        let size = [length, self.rng.range(0.4, 0.7), self.rng.range(0.7, 1.7)];
        let yaw = self.rng.range(-0.03, 0.03);
        self.cuboid(Class::Vegetation, [x, y], size, yaw, leaves);
    }

    fn fence(&mut self, x: f64, y: f64, length: f64) {
        let size = [length, 0.05, self.rng.range(0.9, 1.6)];
        self.cuboid(Class::Fixture, [x, y], size, 0.0, Surface::porous(0.4, 0.5));
    }

    fn bush(&mut self, x: f64, y: f64) {
        let (r, h) = (self.rng.range(0.4, 0.9), self.rng.range(0.8, 1.8));
        let tilt = DQuat::from_rotation_y(self.rng.range(-0.2, 0.2));
        let z = self.scene.ground.height(x, y) + 0.4 * h;
        let pose = Pose::new(tilt, DVec3::new(x, y, z));
        let shape = Shape::ellipsoid(1.2 * r, r, 0.5 * h);
        self.scene.put(Class::Vegetation, shape, pose, Surface::porous(0.45, 0.3));
    }
}
