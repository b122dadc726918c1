//! A narrow street: plots whose fences, hedges and walls, or the houses themselves, stand right
//! beside the sidewalk, with driveways in between.

use super::Yard;
use crate::object::{Class, Surface};
use crate::path::Path;
use std::f64::consts::FRAC_PI_2;

/// Width of a driveway, m.
const DRIVEWAY_M: f64 = 3.2;

impl Yard<'_> {
    /// Plots on one side of the main road.
    pub(super) fn plots(&mut self, x: [f64; 2], side: f64) {
        let mut at = x[0] + self.rng.range(0.0, 8.0);
        while at < x[1] {
            let to = at + self.rng.range(10.0, 28.0);
            let middle = 0.5 * (at + to);
            if self.in_crossing(middle, 0.5 * (to - at) + DRIVEWAY_M) {
                at += 2.0;
                continue;
            }
            self.plot([at, to], side);
            at = to;
            if self.rng.chance(0.6) {
                self.driveway(to + 0.5 * DRIVEWAY_M, side);
                at += DRIVEWAY_M;
            }
        }
    }

    /// A house at the sidewalk, or behind a border and whatever grows there.
    fn plot(&mut self, [from, to]: [f64; 2], side: f64) {
        let (middle, long) = (0.5 * (from + to), to - from);
        let garden = if self.rng.chance(0.2) { 0.7 } else { self.rng.range(2.0, 10.0) };
        let front = self.edge() + garden;
        let length = (long - self.rng.range(0.0, 5.0)).max(5.0);
        let size = [length, self.rng.range(7.0, 12.0), self.rng.range(3.0, 10.0)];
        self.house(middle, side, front, size);
        if garden < 1.0 {
            return;
        }
        let y = side * (self.edge() + self.rng.range(0.1, 0.4));
        match self.count(0, 10) {
            // Some of these are longer than they are told.
            0..4 => self.gappy_border([from + 3.0, to - 3.0], y),
            // A hedge is up to 0.9 m wide.
            4 | 5 => self.border(middle, y + 0.5 * side, long),
            6..9 => self.garden_wall(middle, y, long),
            _ => {}
        }
        self.garden([from, to], side, front);
    }

    /// Whatever grows between a sidewalk and a house.
    fn garden(&mut self, [from, to]: [f64; 2], side: f64, front: f64) {
        for _ in 0..self.count(0, 8) {
            let x = self.rng.range(from, to);
            let y = side * self.rng.range(self.edge() + 1.2, front);
            self.plant(x, y);
        }
    }

    /// A wall that one can look over, or not.
    fn garden_wall(&mut self, x: f64, y: f64, long: f64) {
        let size = [long, self.rng.range(0.15, 0.4), self.rng.range(0.4, 2.2)];
        let stone = Surface::matt(self.rng.range(0.25, 0.6));
        self.cuboid(Class::Fixture, [x, y], size, 0.0, stone);
    }

    /// Room for a car beside a house, heading either way.
    fn driveway(&mut self, x: f64, side: f64) {
        let y = side * (self.edge() + self.rng.range(2.6, 5.0));
        let yaw = self.rng.sign() * FRAC_PI_2;
        self.driveways.push(Path::stationary(x, y, yaw));
    }
}
