//! What real streets have and the plain one lacks, and what makes static structure appear to move:
//! apparent edges that are not real ones. Picket and mesh fences with things behind them, bushes
//! with gaps, walls seen through slots, banks, posts behind parked cars, flat sides half hidden.

use super::Yard;
use crate::object::{Class, Surface};
use crate::shape::Shape;
use glam::{DQuat, DVec3};
use raywake_core::pose::Pose;

impl Yard<'_> {
    /// Clutters both sides of the main road.
    pub(super) fn clutter(&mut self, x: [f64; 2]) {
        for side in [-1.0, 1.0] {
            self.edge_of_sidewalk(x, side);
            self.posts_behind_cars(x, side);
        }
    }

    /// Walkers keep to the inner part of the sidewalk: beyond this distance from the road's middle
    /// nothing is in anyone's way, m.
    fn free(&self) -> f64 {
        self.edge() - 0.4
    }

    /// One kind of border after another, with gaps in between.
    fn edge_of_sidewalk(&mut self, x: [f64; 2], side: f64) {
        let mut from = x[0] + self.rng.range(0.0, 6.0);
        while from < x[1] {
            let to = from + self.rng.range(5.0, 18.0);
            let y = side * (self.free() + self.rng.range(0.1, 0.5));
            if !self.in_crossing(0.5 * (from + to), 0.5 * (to - from) + 0.5) {
                self.gappy_border([from, to], y);
            }
            from = to + self.rng.range(0.5, 8.0);
        }
    }

    /// A border that has gaps, edges that are none, or a slope.
    pub(super) fn gappy_border(&mut self, stretch: [f64; 2], y: f64) {
        match self.count(0, 9) {
            0 | 1 => self.pickets(stretch, y),
            2 | 3 => self.mesh(stretch, y),
            4 => self.loose_bushes(stretch, y),
            5 => self.slotted_wall(stretch, y),
            6 => self.pillars(stretch, y),
            7 => self.bank(stretch, y.signum()),
            _ => self.half_hidden(stretch, y),
        }
    }

    /// Pickets on two rails, about a hand's breadth apart.
    fn pickets(&mut self, [from, to]: [f64; 2], y: f64) {
        let (height, wide) = (self.rng.range(0.8, 1.5), self.rng.range(0.05, 0.12));
        let (step, wood) = (wide + self.rng.range(0.04, 0.14), Surface::matt(0.5));
        let mut at = from;
        while at < to {
            self.raised(Class::Fixture, [at, y, 0.05], [wide, 0.02, height], 0.0, wood);
            at += step;
        }
        for lift in [0.2, 0.75 * height] {
            let rail = [0.5 * (from + to), y + 0.03 * y.signum(), lift];
            self.raised(Class::Fixture, rail, [to - from, 0.04, 0.08], 0.0, wood);
        }
        self.things_behind([from, to], y);
    }

    /// Mesh between posts, through which objects behind are visible.
    fn mesh(&mut self, [from, to]: [f64; 2], y: f64) {
        let (height, porosity) = (self.rng.range(1.0, 2.2), self.rng.range(0.5, 0.9));
        let middle = 0.5 * (from + to);
        let wire = Surface::porous(0.35, porosity);
        self.raised(Class::Fixture, [middle, y, 0.05], [to - from, 0.02, height], 0.0, wire);
        let mut at = from;
        while at <= to {
            self.pole(at, y, 0.03, height + 0.1);
            at += 2.2;
        }
        self.things_behind([from, to], y);
    }

    /// Boxes, stacks and shrubs at some distance behind a fence.
    fn things_behind(&mut self, [from, to]: [f64; 2], y: f64) {
        for _ in 0..self.count(1, 6) {
            let x = self.rng.range(from, to);
            let back = y + y.signum() * self.rng.range(0.5, 3.5);
            if self.rng.chance(0.5) {
                let size =
                    [self.rng.range(0.4, 2.5), self.rng.range(0.3, 1.2), self.rng.range(0.4, 1.6)];
                let yaw = self.rng.range(-0.5, 0.5);
                self.cuboid(Class::Fixture, [x, back], size, yaw, Surface::matt(0.4));
            } else {
                let size = [self.rng.range(0.5, 1.5), 0.8, self.rng.range(0.6, 1.8)];
                let porosity = self.rng.range(0.3, 0.8);
                self.leaves([x, back, -0.1], size, porosity);
            }
        }
    }

    /// Bushes in a row, with gaps between them and within each.
    fn loose_bushes(&mut self, [from, to]: [f64; 2], y: f64) {
        let mut at = from;
        while at < to {
            let tall = self.rng.range(0.5, 1.7);
            for _ in 0..self.count(2, 6) {
                let [dx, dy] = [0; 2].map(|_| self.rng.range(0.0, 0.5));
                let size = [self.rng.range(0.25, 0.7), 0.4, tall * self.rng.range(0.3, 0.8)];
                let lift = tall * self.rng.range(0.0, 0.5);
                let porosity = self.rng.range(0.2, 0.8);
                self.leaves([at + dx, y + y.signum() * dy, lift], size, porosity);
            }
            at += self.rng.range(0.7, 2.6);
        }
    }

    /// Boards or sections of wall with slots in between, and a wall a few metres behind.
    fn slotted_wall(&mut self, [from, to]: [f64; 2], y: f64) {
        let (height, stone) = (self.rng.range(1.4, 3.0), Surface::matt(self.rng.range(0.25, 0.6)));
        let mut at = from;
        while at < to {
            let long = self.rng.range(0.3, 2.0);
            self.cuboid(Class::Building, [at, y], [long, 0.15, height], 0.0, stone);
            at += long + self.rng.range(0.1, 1.2);
        }
        let back = y + y.signum() * self.rng.range(1.0, 6.0);
        let size = [to - from + 6.0, 0.3, height + 1.5];
        self.cuboid(Class::Building, [0.5 * (from + to), back], size, 0.0, stone);
    }

    /// Pillars in front of whatever flat surface lies behind.
    fn pillars(&mut self, [from, to]: [f64; 2], y: f64) {
        let (step, wide) = (self.rng.range(1.2, 3.5), self.rng.range(0.2, 0.6));
        let (height, round) = (self.rng.range(2.5, 4.0), self.rng.chance(0.5));
        let mut at = from;
        while at < to {
            match round {
                true => self.pole(at, y, 0.5 * wide, height),
                false => {
                    let size = [wide, wide, height];
                    self.cuboid(Class::Building, [at, y], size, 0.0, Surface::matt(0.45));
                }
            }
            at += step;
        }
        let beam = [0.5 * (from + to), y, height];
        self.raised(Class::Building, beam, [to - from, wide, 0.4], 0.0, Surface::matt(0.45));
    }

    /// A bank rising from the sidewalk's edge: a tilted slab of earth.
    fn bank(&mut self, [from, to]: [f64; 2], side: f64) {
        let (slope, out) = (self.rng.range(0.15, 0.7), self.rng.range(2.0, 5.0));
        let (x, y) = (0.5 * (from + to), side * (self.free() + 0.5 * out));
        let thick = 1.0;
        let middle = 0.5 * out * slope.tan() - 0.5 * thick / slope.cos();
        let z = self.ground.height(x, side * self.free()) + middle;
        let turn = DQuat::from_rotation_x(side * slope);
        let shape = Shape::cuboid(to - from, out / slope.cos(), thick);
        let pose = Pose::new(turn, DVec3::new(x, y, z));
        self.fix(Class::Ground, shape, pose, Surface::matt(0.3));
    }

    /// Large boxes with flat sides, each half hidden by a post, a bush or another box.
    fn half_hidden(&mut self, [from, to]: [f64; 2], y: f64) {
        let mut at = from + 1.0;
        while at < to {
            let size = [self.rng.range(1.2, 3.5), 1.2, self.rng.range(1.2, 2.6)];
            let back = y + y.signum() * self.rng.range(0.9, 1.6);
            let yaw = self.rng.range(-0.15, 0.15);
            self.cuboid(Class::Fixture, [at, back], size, yaw, Surface::matt(0.4));
            let before = at + self.rng.range(-0.5, 0.5) * size[0];
            match self.count(0, 3) {
                0 => self.pole(before, y, 0.1, 3.0),
                1 => self.leaves([before, y, -0.1], [0.9, 0.5, 1.3], 0.3),
                _ => {
                    let small = [0.7, 0.4, self.rng.range(0.7, 1.4)];
                    self.cuboid(Class::Fixture, [before, y], small, 0.0, Surface::matt(0.3));
                }
            }
            at += size[0] + self.rng.range(0.4, 3.0);
        }
    }

    /// Posts at the kerb, visible over and between parked cars.
    fn posts_behind_cars(&mut self, x: [f64; 2], side: f64) {
        let mut at = x[0] + self.rng.range(0.0, 10.0);
        while at < x[1] {
            let (step, height) = (self.rng.range(1.2, 3.0), self.rng.range(0.9, 2.6));
            for _ in 0..self.count(3, 12) {
                if !self.in_crossing(at, 0.5) {
                    let radius = self.rng.range(0.03, 0.09);
                    self.pole(at, side * (self.kerb() + 0.5), radius, height);
                }
                at += step;
            }
            at += self.rng.range(2.0, 20.0);
        }
    }
}
