//! Houses: in closed rows, behind gardens, along the crossing road.

use super::Yard;
use crate::dimensions::{CROSS_HALF, Section};
use crate::object::{Class, Surface};

impl Yard<'_> {
    /// A row with occasional gaps, at or a little behind the sidewalk.
    pub(super) fn row_of_houses(&mut self, x: [f64; 2], side: f64) {
        let mut at = x[0];
        while at < x[1] {
            let length = self.rng.range(8.0, 26.0).min((x[1] - at).max(6.0));
            let middle = at + 0.5 * length;
            at += length;
            if self.in_crossing(middle, 0.5 * length) {
                // Advance in small steps so that the corner houses are near the corner.
                at += 2.0 - length;
                continue;
            }
            let front = self.edge() + self.rng.range(0.0, 3.0);
            if self.rng.chance(0.2) {
                at += self.rng.range(3.0, 8.0);
                self.gap(middle, side * (front + 4.0));
                continue;
            }
            let size = [length, self.rng.range(8.0, 13.0), self.rng.range(4.0, 18.0)];
            self.house(middle, side, front, size);
        }
    }

    /// A gap between houses: shrubs, a tree, a building farther back.
    fn gap(&mut self, x: f64, y: f64) {
        for _ in 0..self.count(0, 4) {
            let (aside, back) = (self.rng.range(-2.0, 2.0), self.rng.range(-3.0, 8.0));
            self.bed(x + aside, y + y.signum() * back);
        }
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

    /// Detached houses behind gardens, separated from the sidewalk by a hedge, fence or wall.
    pub(super) fn gardens(&mut self, x: [f64; 2], side: f64) {
        let mut at = x[0];
        while at < x[1] {
            let plot = self.rng.range(11.0, 18.0);
            let middle = at + 0.5 * plot;
            at += plot;
            if self.in_crossing(middle, 0.5 * plot) {
                at += 3.0 - plot;
                continue;
            }
            let front = self.edge() + self.rng.range(3.5, 9.0);
            let length = plot - self.rng.range(3.0, 6.0);
            let size = [length, self.rng.range(8.0, 12.0), self.rng.range(3.5, 9.0)];
            self.house(middle, side, front, size);
            let closed = plot - self.rng.range(0.5, 4.0);
            self.border(middle, side * (self.edge() + 0.3), closed);
            for _ in 0..self.count(3, 11) {
                let x = middle + self.rng.range(-0.5, 0.5) * plot;
                let y = side * self.rng.range(self.edge() + 1.0, front - 0.5);
                self.plant(x, y);
            }
        }
    }

    pub(super) fn houses_along_crossing(&mut self, y: [f64; 2], side: f64) {
        for (sign, end) in [(-1.0, -y[0]), (1.0, y[1])] {
            // Behind closed rows of houses along the main road.
            let mut at = self.edge().max(Section::WIDE.edge()) + 17.0;
            while at < end {
                let length = self.rng.range(8.0, 22.0);
                let front = CROSS_HALF + 3.0 + self.rng.range(0.0, 3.0);
                let depth = self.rng.range(8.0, 12.0);
                let size = [depth, length, self.rng.range(4.0, 16.0)];
                let x = self.crossing + side * (front + 0.5 * depth);
                let y = sign * (at + 0.5 * length);
                at += length;
                if self.rng.chance(0.25) {
                    self.tree(x, y);
                    self.bed(self.crossing + side * (front + 2.5), y + 2.0);
                    continue;
                }
                let wall = Surface::matt(self.rng.range(0.25, 0.6));
                self.cuboid(Class::Building, [x, y], size, 0.0, wall);
                at += if self.rng.chance(0.3) { self.rng.range(3.0, 9.0) } else { 0.0 };
            }
        }
    }
}
