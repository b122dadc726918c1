//! A house and its front: plain, or with windows one can see into, and whatever protrudes from it.

use super::Yard;
use crate::object::{Class, Surface};

impl Yard<'_> {
    /// A house of this length (along x), depth and height whose front lies at a distance `front`
    /// from the road's centre line.
    pub(super) fn house(&mut self, middle: f64, side: f64, front: f64, size: [f64; 3]) {
        let [length, depth, height] = size;
        let wall = Surface::matt(self.rng.range(0.25, 0.6));
        let open = if self.rng.chance(0.6) { self.rng.range(1.5, 4.0) } else { 0.0 };
        let core = [middle, side * (front + 0.5 * (open + depth))];
        self.cuboid(Class::Building, core, [length, depth - open, height], 0.0, wall);
        if open > 0.0 {
            self.windows(middle, side * front, [length, open, height], wall);
        }
        self.front(middle, side, front, [length, height], wall);
    }

    /// A front with a row of windows, through which some rays reach the room behind: bands of wall
    /// below and above, piers in between, panes, and the contents of the room.
    fn windows(&mut self, middle: f64, front: f64, size: [f64; 3], wall: Surface) {
        let [length, room, height] = size;
        let (sill, head) = (self.rng.range(0.1, 1.1), self.rng.range(2.0, 2.8));
        let thick = self.rng.range(0.2, 0.5);
        let place = |z: f64, back: f64| [middle, front + front.signum() * back, z];
        let band = |z: f64, tall: f64| (place(z, 0.5 * thick), [length, thick, tall]);
        for (at, size) in [band(-0.5, sill + 0.5), band(head, height - head)] {
            self.raised(Class::Building, at, size, 0.0, wall);
        }
        let pane = Surface { porosity: self.rng.range(0.3, 0.8), ..Surface::glass(0.3) };
        let at = place(sill, 0.6 * thick);
        self.raised(Class::Building, at, [length, 0.04, head - sill], 0.0, pane);
        let things = Surface::porous(0.3, self.rng.range(0.4, 0.9));
        let within = [length - 1.0, room - thick - 0.1, 1.9];
        self.raised(Class::Building, place(0.0, 0.5 * (room + thick)), within, 0.0, things);
        let (step, width) = (self.rng.range(1.4, 4.0), self.rng.range(0.3, 1.2));
        let mut x = middle - 0.5 * length + 0.5 * width;
        let out = self.rng.range(0.0, 0.25);
        while x < middle + 0.5 * length {
            let at = [x, front + front.signum() * 0.5 * (thick - out)];
            self.cuboid(Class::Building, at, [width, thick + out, height], 0.0, wall);
            x += width + step;
        }
        // The side walls of the room.
        for end in [-0.5, 0.5] {
            let at = [middle + end * (length - 0.2), place(0.0, 0.5 * room)[1]];
            self.cuboid(Class::Building, at, [0.2, room, height], 0.0, wall);
        }
    }

    /// Whatever protrudes from a front: bays, porches, stairs, balconies, downpipes, awnings, so
    /// that walls are not all planes.
    fn front(&mut self, middle: f64, side: f64, front: f64, size: [f64; 2], wall: Surface) {
        let [length, height] = size;
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
}
