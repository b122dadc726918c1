//! What people stand around on a shopping street, on the sidewalks and where cars would park:
//! tables under parasols, racks, crates, boards, planters, barriers, pillars as thick as a person.
//!
//! Below head height it is made of cylinders, and of boxes shorter than 2 m: walkers keep clear of
//! these alone ([`crate::traffic`]).

use super::Yard;
use crate::object::{Class, Surface};
use crate::shape::Shape;
use glam::{DQuat, DVec3};
use raywake_core::pose::Pose;

impl Yard<'_> {
    /// Rows of such things on both sides of the main road.
    pub(super) fn crowd(&mut self, x: [f64; 2]) {
        for side in [-1.0, 1.0] {
            self.row(x, side, [self.kerb() - 1.5, self.kerb() - 0.4]);
            self.row(x, side, [self.edge() - 1.3, self.edge() - 0.4]);
        }
    }

    /// Things at these distances from the road's middle, in groups with gaps between them.
    fn row(&mut self, x: [f64; 2], side: f64, beside: [f64; 2]) {
        let mut at = x[0] + self.rng.range(0.0, 10.0);
        while at < x[1] {
            for _ in 0..self.count(1, 7) {
                let y = side * self.rng.range(beside[0], beside[1]);
                if !self.in_crossing(at, 2.5) {
                    self.thing(at, y);
                }
                at += self.rng.range(1.0, 3.0);
            }
            at += self.rng.range(1.0, 15.0);
        }
    }

    fn thing(&mut self, x: f64, y: f64) {
        match self.count(0, 9) {
            0 | 1 => self.table(x, y),
            2 => self.rack(x, y),
            3 | 4 => self.crates(x, y),
            5 => self.board(x, y),
            6 => self.planter(x, y),
            7 => self.barrier(x, y),
            _ => self.pillar(x, y),
        }
    }

    /// A table with chairs; on a sidewalk, where no lorry passes, perhaps under a parasol.
    fn table(&mut self, x: f64, y: f64) {
        let wide = self.rng.range(0.3, 0.5);
        self.round(x, y, [wide, 0.05], 0.72);
        self.pole(x, y, 0.04, 0.72);
        for n in 0..self.count(1, 5) {
            let around = f64::from(n) * 1.6 + self.rng.range(-0.4, 0.4);
            self.chair([x, y], wide + 0.3, around);
        }
        if y.abs() > self.kerb() && self.rng.chance(0.5) {
            self.parasol(x, y);
        }
    }

    /// A chair this far from a place, in this direction, facing it.
    fn chair(&mut self, [x, y]: [f64; 2], away: f64, around: f64) {
        let [dx, dy] = [around.cos(), around.sin()].map(|a| away * a);
        let (seat, back) = ([x + dx, y + dy, 0.4], [x + 1.3 * dx, y + 1.3 * dy, 0.45]);
        self.raised(Class::Fixture, seat, [0.4, 0.4, 0.06], around, Surface::porous(0.4, 0.2));
        self.raised(Class::Fixture, back, [0.05, 0.4, 0.45], around, Surface::matt(0.4));
    }

    fn parasol(&mut self, x: f64, y: f64) {
        self.pole(x, y, 0.03, 2.5);
        let pose = Pose::planar(x, y, self.ground.height(x, y) + 2.35, 0.0);
        let shape = Shape::ellipsoid(self.rng.range(1.0, 1.5), self.rng.range(1.0, 1.5), 0.12);
        self.fix(Class::Fixture, shape, pose, Surface::matt(0.5));
    }

    /// Clothes on a rail.
    fn rack(&mut self, x: f64, y: f64) {
        let (long, yaw) = (self.rng.range(0.9, 1.8), self.rng.range(-0.6, 0.6));
        let height = self.rng.range(1.2, 1.7);
        let size = [long, self.rng.range(0.3, 0.5), height - 0.4];
        let cloth = Surface::porous(self.rng.range(0.1, 0.6), self.rng.range(0.0, 0.4));
        self.raised(Class::Fixture, [x, y, 0.35], size, yaw, cloth);
        self.posts([x, y], [long, yaw], [0.02, height]);
    }

    /// Posts at both ends of a bar of this length and heading.
    fn posts(&mut self, [x, y]: [f64; 2], [long, yaw]: [f64; 2], [radius, height]: [f64; 2]) {
        let [dx, dy] = [yaw.cos(), yaw.sin()].map(|a| 0.5 * long * a);
        self.pole(x + dx, y + dy, radius, height);
        self.pole(x - dx, y - dy, radius, height);
    }

    /// Crates in steps, or a stack of them.
    fn crates(&mut self, x: f64, y: f64) {
        let mut at = x;
        for _ in 0..self.count(1, 4) {
            let [long, wide] = [self.rng.range(0.35, 0.8), self.rng.range(0.3, 0.7)];
            let size = [long, wide, self.rng.range(0.25, 1.6)];
            let yaw = self.rng.range(-0.3, 0.3);
            self.cuboid(Class::Fixture, [at, y], size, yaw, Surface::matt(0.4));
            at += long;
        }
    }

    /// Two boards that lean against each other.
    fn board(&mut self, x: f64, y: f64) {
        let (yaw, height) = (self.rng.range(-1.6, 1.6), self.rng.range(0.9, 1.4));
        for lean in [-0.2, 0.2] {
            let turn = DQuat::from_rotation_z(yaw) * DQuat::from_rotation_y(lean);
            let [dx, dy] = [yaw.cos(), yaw.sin()].map(|a| -0.5 * height * f64::sin(lean) * a);
            let z = self.ground.height(x, y) + 0.5 * height;
            let pose = Pose::new(turn, DVec3::new(x + dx, y + dy, z));
            self.fix(Class::Fixture, Shape::cuboid(0.02, 0.7, height), pose, Surface::matt(0.6));
        }
    }

    /// A tub with something growing in it.
    fn planter(&mut self, x: f64, y: f64) {
        let (wide, height) = (self.rng.range(0.4, 1.2), self.rng.range(0.3, 0.8));
        self.round(x, y, [0.5 * wide, height], 0.0);
        let (tall, porosity) = (self.rng.range(0.3, 1.4), self.rng.range(0.2, 0.7));
        self.leaves([x, y, height - 0.1], [wide, wide, tall], porosity);
    }

    /// Two bars between posts.
    fn barrier(&mut self, x: f64, y: f64) {
        let (long, yaw) = (self.rng.range(1.2, 1.9), self.rng.range(-0.3, 0.3));
        self.posts([x, y], [long, yaw], [0.03, 1.05]);
        for lift in [0.5, 0.95] {
            let size = [long, 0.04, 0.08];
            self.raised(Class::Fixture, [x, y, lift], size, yaw, Surface::matt(0.5));
        }
    }

    /// A pillar as thick as a person, or up to twice that.
    fn pillar(&mut self, x: f64, y: f64) {
        let size = [self.rng.range(0.15, 0.6), self.rng.range(1.2, 2.8)];
        self.round(x, y, size, 0.0);
    }

    /// A disc or cylinder of this radius and height, `lift` above the ground.
    fn round(&mut self, x: f64, y: f64, [radius, height]: [f64; 2], lift: f64) {
        let shape = Shape::cylinder(radius, height);
        self.put(Class::Fixture, shape, [x, y, lift], height, 0.0, Surface::matt(0.4));
    }
}
