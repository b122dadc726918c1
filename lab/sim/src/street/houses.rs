//! Houses: in closed rows, behind gardens, and what sticks out of their fronts.

use super::{EDGE, Yard};
use crate::ground::CROSS_HALF;
use crate::object::{Class, Surface};

impl Yard<'_> {
    /// A row with a gap here and there, at or a little behind the sidewalk.
    pub(super) fn row_of_houses(&mut self, x: [f64; 2], side: f64) {
        let mut at = x[0];
        while at < x[1] {
            let length = self.rng.range(8.0, 26.0).min((x[1] - at).max(6.0));
            let middle = at + 0.5 * length;
            at += length;
            if self.in_crossing(middle, 0.5 * length) {
                // Step on in small strides so that the corner houses stand near the corner.
                at += 2.0 - length;
                continue;
            }
            let front = EDGE + self.rng.range(0.0, 3.0);
            if self.rng.chance(0.2) {
                at += self.rng.range(3.0, 8.0);
                self.gap(middle, side * (front + 4.0));
                continue;
            }
            let depth = self.rng.range(8.0, 13.0);
            let size = [length, depth, self.rng.range(4.0, 18.0)];
            let wall = Surface::matt(self.rng.range(0.25, 0.6));
            self.cuboid(Class::Building, [middle, side * (front + 0.5 * depth)], size, 0.0, wall);
            self.front(middle, side, front, [length, size[2]], wall);
        }
    }

    /// What sticks out of a front: bays, porches, stairs, balconies, downpipes, awnings, so that
    /// walls are not all planes.
    fn front(&mut self, middle: f64, side: f64, front: f64, size: [f64; 2], wall: Surface) {
        let [length, height] = size;
        if self.rng.chance(0.5) {
            self.piers([middle - 0.5 * length, middle + 0.5 * length], side * front, height, wall);
        }
        for _ in 0..self.count(1, 3 + (length / 3.0) as u32) {
            let x = middle + self.rng.range(-0.45, 0.45) * length;
            let out = self.rng.range(0.15, 0.6);
            match self.count(0, 8) {
                0..3 => {
                    let size = [self.rng.range(0.8, 3.0), 2.0 * out, self.rng.range(0.4, 4.0)];
                    self.cuboid(Class::Building, [x, side * front], size, 0.0, wall);
                }
                3 => self.pole(x, side * (front - 0.08), 0.06, height.min(8.0)),
                4 => self.balcony(x, side, front, height, wall),
                5 => {
                    // An awning or a sign.
                    let out = self.rng.range(0.4, 1.4);
                    let at = [x, side * (front - 0.5 * out), self.rng.range(2.3, 3.2)];
                    let size = [self.rng.range(1.0, 4.0), out, self.rng.range(0.1, 0.6)];
                    self.raised(Class::Building, at, size, 0.0, Surface::matt(0.5));
                }
                6 => {
                    // Plants along the wall.
                    let at = [x, side * (front - 0.2), 0.0];
                    let size = [self.rng.range(0.6, 1.6), 0.6, self.rng.range(0.6, 2.6)];
                    let porosity = self.rng.range(0.2, 0.6);
                    self.leaves(at, size, porosity);
                }
                _ => {
                    // A frame around a window or door.
                    let at = [x, side * front, self.rng.range(0.0, 1.0)];
                    let size = [self.rng.range(0.9, 1.8), 0.16, self.rng.range(1.2, 2.1)];
                    self.raised(Class::Building, at, size, 0.0, Surface::glass(0.4));
                }
            }
        }
    }

    /// Regular strips of wall before a front, with panes between some of them.
    fn piers(&mut self, x: [f64; 2], front: f64, height: f64, wall: Surface) {
        let (step, width) = (self.rng.range(1.8, 4.0), self.rng.range(0.4, 1.1));
        let (out, panes) = (self.rng.range(0.12, 0.4), self.rng.chance(0.5));
        let mut at = x[0] + 0.5 * width;
        while at < x[1] {
            self.cuboid(Class::Building, [at, front], [width, 2.0 * out, height], 0.0, wall);
            if panes && at + step < x[1] {
                let size = [step - width, 0.1, self.rng.range(1.5, 2.6)];
                let middle = [at + 0.5 * step, front, self.rng.range(0.1, 0.9)];
                self.raised(Class::Building, middle, size, 0.0, Surface::glass(0.3));
            }
            at += step;
        }
    }

    fn balcony(&mut self, x: f64, side: f64, front: f64, height: f64, wall: Surface) {
        if height < 6.0 {
            return;
        }
        let (width, out) = (self.rng.range(2.0, 4.0), self.rng.range(0.9, 1.6));
        let mut z = self.rng.range(2.7, 3.3);
        while z + 2.5 < height {
            let y = side * (front - 0.5 * out);
            self.raised(Class::Building, [x, y, z], [width, out, 0.2], 0.0, wall);
            let rail = side * (front - out);
            let bars = Surface::porous(0.3, 0.4);
            self.raised(Class::Building, [x, rail, z + 0.2], [width, 0.05, 0.9], 0.0, bars);
            z += 3.0;
        }
    }

    /// A gap between houses: a tree, something farther back.
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

    /// Detached houses behind gardens, which a hedge, fence or wall parts from the sidewalk.
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
            let front = EDGE + self.rng.range(3.5, 9.0);
            let length = plot - self.rng.range(3.0, 6.0);
            let depth = self.rng.range(8.0, 12.0);
            let size = [length, depth, self.rng.range(3.5, 9.0)];
            let wall = Surface::matt(self.rng.range(0.25, 0.6));
            self.cuboid(Class::Building, [middle, side * (front + 0.5 * depth)], size, 0.0, wall);
            self.front(middle, side, front, [length, size[2]], wall);
            let closed = plot - self.rng.range(0.5, 4.0);
            self.border(middle, side * (EDGE + 0.3), closed);
            for _ in 0..self.count(1, 7) {
                let x = middle + self.rng.range(-0.5, 0.5) * plot;
                let y = side * self.rng.range(EDGE + 1.0, front - 0.5);
                match self.count(0, 8) {
                    0 | 1 => self.tree(x, y),
                    2 => self.bed(x, y),
                    _ => self.bush(x, y),
                }
            }
        }
    }

    pub(super) fn houses_along_crossing(&mut self, y: [f64; 2], side: f64) {
        for (sign, end) in [(-1.0, -y[0]), (1.0, y[1])] {
            let mut at = 27.0;
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
