//! A broad road with several lanes each way: guard rails, noise walls and borders along it and
//! perhaps on its median, open land behind them; or houses behind gardens.

use super::Yard;
use crate::object::{Class, Surface};

impl Yard<'_> {
    /// One side of the road, in stretches of one kind each.
    pub(super) fn roadside(&mut self, x: [f64; 2], side: f64) {
        let mut at = x[0];
        while at < x[1] {
            let end = at + self.rng.range(30.0, 100.0);
            let (stretch, y) = ([at, end], side * (self.edge() + self.rng.range(0.2, 0.5)));
            at = end;
            match self.count(0, 10) {
                0..2 => {}
                2..4 => self.guard_rail(stretch, y),
                4..6 => self.noise_wall(stretch, y),
                // A trimmed hedge is up to 0.9 m wide.
                6 => self.along(stretch, |yard, x, long| yard.border(x, y + 0.5 * side, long)),
                // Some of these are longer than they are told.
                7 => self.along(stretch, |yard, x, long| {
                    yard.gappy_border([x - 0.5 * long + 3.0, x + 0.5 * long - 3.0], y)
                }),
                _ => {
                    self.gardens(stretch, side);
                    continue;
                }
            }
            self.open_land(stretch, side);
        }
    }

    /// What stands on the median.
    pub(super) fn median(&mut self, x: [f64; 2]) {
        let mut at = x[0];
        while at < x[1] {
            let end = at + self.rng.range(40.0, 120.0);
            match self.count(0, 5) {
                0 | 1 => self.guard_rail([at, end], 0.0),
                2 => self.along([at, end], |yard, x, long| yard.hedge(x, 0.0, long)),
                3 => {
                    let height = self.rng.range(0.6, 1.1);
                    self.wall([at, end], 0.0, [0.4, height], Surface::matt(0.45));
                }
                _ => {}
            }
            at = end;
        }
    }

    /// Calls `build` with the middle and the length of every piece of a stretch, about 20 m long,
    /// that keeps clear of the crossing.
    fn along(&mut self, [from, to]: [f64; 2], mut build: impl FnMut(&mut Self, f64, f64)) {
        let pieces = ((to - from) / 20.0).ceil();
        let long = (to - from) / pieces;
        for n in 0..pieces as u32 {
            let middle = from + (f64::from(n) + 0.5) * long;
            if !self.in_crossing(middle, 0.5 * long) {
                build(self, middle, long);
            }
        }
    }

    /// A guard rail on posts.
    fn guard_rail(&mut self, stretch: [f64; 2], y: f64) {
        let steel = Surface::matt(self.rng.range(0.4, 0.7));
        let lift = self.rng.range(0.3, 0.5);
        self.along(stretch, |yard, x, long| {
            yard.raised(Class::Fixture, [x, y, lift], [long, 0.06, 0.32], 0.0, steel);
            for post in 0..(long / 2.5) as u32 {
                let at = x - 0.5 * long + 2.5 * f64::from(post);
                yard.cuboid(Class::Fixture, [at, y], [0.1, 0.1, lift + 0.3], 0.0, steel);
            }
        });
    }

    /// A noise wall of one height.
    fn noise_wall(&mut self, stretch: [f64; 2], y: f64) {
        let size = [self.rng.range(0.12, 0.3), self.rng.range(2.0, 5.0)];
        let panels = Surface::matt(self.rng.range(0.25, 0.6));
        self.wall(stretch, y, size, panels);
    }

    /// A wall of this thickness and height.
    fn wall(&mut self, stretch: [f64; 2], y: f64, [thick, tall]: [f64; 2], surface: Surface) {
        self.along(stretch, |yard, x, long| {
            yard.cuboid(Class::Fixture, [x, y], [long, thick, tall], 0.0, surface);
        });
    }

    /// Up to one tree, bush or post a metre, up to 30 m behind the sidewalk.
    fn open_land(&mut self, [from, to]: [f64; 2], side: f64) {
        let dense = self.rng.unit() * self.rng.unit();
        for _ in 0..((to - from) * dense) as u32 {
            let (x, back) = (self.rng.range(from, to), self.rng.unit());
            let y = side * (self.edge() + 2.5 + 28.0 * back * back);
            if self.in_crossing(x, 3.0) {
                continue;
            }
            match self.count(0, 8) {
                0 => self.pole(x, y, 0.1, 8.0),
                _ => self.plant(x, y),
            }
        }
    }
}
