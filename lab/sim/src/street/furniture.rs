//! Objects on the sidewalks: lamps, signs, bins, bollards, benches, bicycles, shelters, and the
//! borders of plots.

use super::Yard;
use crate::dimensions::CROSS_HALF;
use crate::object::{Class, Surface};
use crate::shape::Shape;
use glam::{DQuat, DVec3};
use raywake_core::pose::Pose;
use std::f64::consts::FRAC_PI_2;

impl Yard<'_> {
    /// Objects between the kerb and the walkers.
    pub(super) fn kerb_side(&mut self, x: [f64; 2], side: f64) {
        let mut at = x[0] + self.rng.range(0.0, 8.0);
        while at < x[1] {
            let y = side * (self.kerb() + self.rng.range(0.45, 0.8));
            if !self.in_crossing(at, 1.0) {
                match self.count(0, 20) {
                    0..6 => self.street_tree(at, y),
                    6..9 => self.lamp(at, y),
                    9..12 => self.sign(at, y),
                    12 => self.bin(at, y),
                    13 | 14 => self.cabinet(at, y),
                    15 | 16 => self.bollards(at, y),
                    17 => self.bench(at, y, side),
                    _ => self.bicycles(at, y),
                }
            }
            at += self.rng.range(3.5, 11.0);
        }
    }

    /// Objects at the far edge of the sidewalk, `gaps` apart (m). Some are the size of cars, which
    /// a background filter has to distinguish.
    pub(super) fn house_side(&mut self, x: [f64; 2], side: f64, gaps: [f64; 2]) {
        let mut at = x[0] + self.rng.range(0.0, 10.0);
        while at < x[1] {
            let length = self.rng.range(1.5, 9.0);
            let y = side * (self.edge() - self.rng.range(0.2, 0.5));
            if !self.in_crossing(at, 0.5 * length + 0.5) {
                match self.count(0, 10) {
                    0..4 => self.border(at, y, length),
                    4 => self.bush(at, y + 0.7 * side),
                    5 => self.bed(at, y + 2.2 * side),
                    6 => self.bicycles(at, y),
                    7 => self.containers(at, y),
                    8 => self.shelter(at, side),
                    _ => {
                        let size = [length, 0.3, self.rng.range(0.5, 1.8)];
                        self.cuboid(Class::Fixture, [at, y], size, 0.0, Surface::matt(0.35));
                    }
                }
            }
            at += 0.5 * length + self.rng.range(gaps[0], gaps[1]);
        }
    }

    /// A hedge, a fence with posts, or a low wall, along x.
    pub(super) fn border(&mut self, x: f64, y: f64, length: f64) {
        match self.count(0, 10) {
            0..5 => self.hedge(x, y, length),
            5..8 => self.fence(x, y, length),
            _ => {
                let size = [length, 0.25, self.rng.range(0.4, 1.3)];
                self.cuboid(Class::Fixture, [x, y], size, 0.0, Surface::matt(0.4));
            }
        }
    }

    fn fence(&mut self, x: f64, y: f64, length: f64) {
        let (height, porosity) = (self.rng.range(0.8, 1.8), self.rng.range(0.2, 0.8));
        let size = [length, 0.05, height];
        self.cuboid(Class::Fixture, [x, y], size, 0.0, Surface::porous(0.4, porosity));
        let mut at = x - 0.5 * length;
        while at <= x + 0.5 * length {
            self.pole(at, y, 0.04, height + 0.1);
            at += 2.5;
        }
    }

    fn lamp(&mut self, x: f64, y: f64) {
        let height = self.rng.range(5.0, 9.0);
        self.pole(x, y, 0.1, height);
        let arm = [x, y - y.signum() * 0.6, height - 0.2];
        self.raised(Class::Pole, arm, [0.3, 1.2, 0.15], 0.0, Surface::matt(0.4));
    }

    fn sign(&mut self, x: f64, y: f64) {
        let (height, yaw) = (self.rng.range(2.2, 3.0), self.rng.range(-0.2, 0.2));
        self.pole(x, y, 0.035, height);
        let at = [x, y, height - 0.6];
        self.raised(Class::Pole, at, [0.04, 0.6, 0.6], yaw, Surface::matt(1.0));
    }

    fn bin(&mut self, x: f64, y: f64) {
        let shape = Shape::cylinder(0.28, 1.0);
        self.put(Class::Fixture, shape, [x, y, 0.0], 1.0, 0.0, Surface::matt(0.25));
    }

    fn cabinet(&mut self, x: f64, y: f64) {
        let size = [self.rng.range(0.6, 1.4), 0.4, self.rng.range(0.9, 1.5)];
        self.cuboid(Class::Fixture, [x, y], size, 0.0, Surface::matt(0.4));
    }

    fn bollards(&mut self, x: f64, y: f64) {
        for i in 0..self.count(2, 6) {
            self.pole(x + 1.5 * f64::from(i), y, 0.06, 0.9);
        }
    }

    fn bench(&mut self, x: f64, y: f64, side: f64) {
        let wood = Surface::porous(0.4, 0.15);
        self.raised(Class::Fixture, [x, y, 0.35], [1.7, 0.45, 0.1], 0.0, wood);
        self.raised(Class::Fixture, [x, y - side * 0.2, 0.45], [1.7, 0.06, 0.45], 0.0, wood);
        for end in [-0.7, 0.7] {
            self.cuboid(Class::Fixture, [x + end, y], [0.08, 0.4, 0.4], 0.0, Surface::matt(0.3));
        }
    }

    /// Bicycles parked side by side, with nobody on them.
    fn bicycles(&mut self, x: f64, y: f64) {
        let (count, lean) = (self.count(1, 7), self.rng.range(-0.15, 0.15));
        let across = count > 2;
        for i in 0..count {
            let yaw = if across { FRAC_PI_2 } else { 0.0 } + self.rng.range(-0.15, 0.15);
            let step = if across { 0.55 } else { 1.9 };
            let inward = if across { y.signum() * 0.25 } else { 0.0 };
            self.bicycle([x + step * f64::from(i), y + inward], yaw, lean);
        }
    }

    fn bicycle(&mut self, [x, y]: [f64; 2], yaw: f64, lean: f64) {
        let (spokes, metal) = (Surface::porous(0.2, 0.6), Surface::porous(0.3, 0.35));
        let turn = DQuat::from_rotation_z(yaw) * DQuat::from_rotation_x(lean);
        let foot = DVec3::new(x, y, self.ground.height(x, y));
        let mut put = |shape: Shape, at: DVec3, own: DQuat, surface: Surface| {
            let pose = Pose::new(turn * own, foot + turn * at);
            self.fix(Class::Fixture, shape, pose, surface);
        };
        let axle = DQuat::from_rotation_x(FRAC_PI_2);
        for end in [-0.52, 0.52] {
            put(Shape::cylinder(0.34, 0.04), DVec3::new(end, 0.0, 0.34), axle, spokes);
        }
        let level = DQuat::IDENTITY;
        put(Shape::cuboid(0.8, 0.05, 0.4), DVec3::new(0.0, 0.0, 0.6), level, metal);
        put(Shape::cuboid(0.06, 0.5, 0.06), DVec3::new(0.42, 0.0, 1.0), level, metal);
        put(Shape::cuboid(0.24, 0.14, 0.08), DVec3::new(-0.2, 0.0, 0.92), level, metal);
    }

    /// Waste containers in a row.
    fn containers(&mut self, x: f64, y: f64) {
        for i in 0..self.count(1, 4) {
            let size =
                [self.rng.range(0.6, 1.3), self.rng.range(0.6, 0.9), self.rng.range(0.9, 1.4)];
            let at = [x + 1.4 * f64::from(i), y];
            self.cuboid(Class::Fixture, at, size, 0.0, Surface::matt(0.3));
        }
    }

    /// A shelter at a stop: posts, a roof, panes at the back.
    fn shelter(&mut self, x: f64, side: f64) {
        let (length, y) = (self.rng.range(3.0, 5.0), side * (self.edge() + 0.2));
        let pane = Surface::glass(0.4);
        self.raised(Class::Fixture, [x, y, 2.3], [length, 1.4, 0.12], 0.0, Surface::matt(0.4));
        let back = y + side * 0.6;
        self.raised(Class::Fixture, [x, back, 0.2], [length, 0.04, 2.0], 0.0, pane);
        for end in [-0.5, 0.5] {
            self.pole(x + end * length, back, 0.05, 2.3);
        }
    }

    /// Signals and signs at the four corners of the crossing.
    pub(super) fn signals(&mut self) {
        for (along, side) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            let x = self.crossing + along * (CROSS_HALF + 0.7);
            let y = side * (self.kerb() + 0.7);
            let height = self.rng.range(2.6, 3.8);
            self.pole(x, y, 0.07, height);
            let at = [x, y, height - 0.9];
            self.raised(Class::Pole, at, [0.3, 0.3, 0.9], 0.0, Surface::matt(0.1));
        }
    }
}
