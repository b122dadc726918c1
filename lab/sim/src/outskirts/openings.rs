//! House fronts with openings that give a view into rooms: walls behind walls.

use super::site::Site;
use crate::object::{Class, Surface};

/// Thickness of a front, m.
const THICK_M: f64 = 0.35;

/// A front along x: its ends, the plane it lies in and the side on which its rooms lie.
#[derive(Clone, Copy)]
pub(super) struct Front {
    /// x of both ends, m.
    pub(super) x: [f64; 2],
    /// y of its face, m; rooms lie where |y| is larger.
    pub(super) y: f64,
}

/// Openings of a storey: the heights above its floor where they begin and end, their width and the
/// width of the piers between them, m.
struct Openings {
    from: f64,
    to: f64,
    wide: f64,
    pier: f64,
}

impl Front {
    fn length(&self) -> f64 {
        self.x[1] - self.x[0]
    }

    /// A place at x, this far behind the face.
    fn behind(&self, x: f64, back: f64) -> [f64; 3] {
        [x, self.y + self.y.signum() * back, 0.0]
    }
}

impl Site<'_> {
    /// A house: two storeys with rooms, a block above, a solid block behind.
    pub(super) fn open_house(&mut self, front: Front) {
        let wall = Surface::matt(self.rng.range(0.2, 0.65));
        let (storey, storeys) = (self.rng.range(2.9, 3.8), self.count(2, 5));
        let deep = self.rng.range(3.0, 7.0);
        for level in 0..2 {
            let openings = self.openings(level == 0, storey);
            self.storey(front, f64::from(level) * storey, storey, &openings, wall);
            self.room(front, f64::from(level) * storey, [deep, storey], wall);
        }
        let middle = 0.5 * (front.x[0] + front.x[1]);
        let above = storey * f64::from(storeys.saturating_sub(2));
        if above > 0.0 {
            let at = front.behind(middle, 0.5 * deep);
            let size = [front.length(), deep, above];
            self.raised(Class::Building, at, size, 2.0 * storey, wall);
        }
        let back = front.behind(middle, deep + 2.0);
        self.block(Class::Building, back, [front.length(), 4.0, 2.0 * storey + above], wall);
    }

    /// Shop windows on the ground floor, ordinary windows above.
    fn openings(&mut self, shop: bool, storey: f64) -> Openings {
        let head = storey - self.rng.range(0.35, 0.7);
        if shop {
            let (from, wide) = (self.rng.range(0.0, 0.6), self.rng.range(1.6, 4.0));
            return Openings { from, to: head, wide, pier: self.rng.range(0.25, 0.8) };
        }
        let (from, wide) = (self.rng.range(0.5, 1.0), self.rng.range(0.9, 1.6));
        Openings { from, to: head, wide, pier: self.rng.range(0.6, 1.6) }
    }

    /// The front of one storey: a band below, a band above, piers, and whatever fills the openings.
    fn storey(&mut self, front: Front, floor: f64, tall: f64, o: &Openings, wall: Surface) {
        let middle = front.behind(0.5 * (front.x[0] + front.x[1]), 0.5 * THICK_M);
        let sunk = if floor == 0.0 { 0.4 } else { 0.0 };
        let below = [front.length(), THICK_M, o.from + sunk];
        self.raised(Class::Building, middle, below, floor - sunk, wall);
        let above = [front.length(), THICK_M, tall - o.to];
        self.raised(Class::Building, middle, above, floor + o.to, wall);
        let count = ((front.length() - o.pier) / (o.wide + o.pier)).floor().max(1.0);
        let step = (front.length() - o.pier) / count;
        for n in 0..=count as u32 {
            let x = front.x[0] + 0.5 * o.pier + step * f64::from(n);
            let pier = [o.pier, THICK_M, o.to - o.from];
            self.raised(
                Class::Building,
                front.behind(x, 0.5 * THICK_M),
                pier,
                floor + o.from,
                wall,
            );
            if f64::from(n) < count {
                let size = [step - o.pier, o.to - o.from];
                self.filling(front, x + 0.5 * step, size, floor + o.from);
            }
        }
    }

    /// A recessed pane; a door or shutter; or nothing.
    fn filling(&mut self, front: Front, x: f64, [wide, tall]: [f64; 2], lift: f64) {
        let back = self.rng.range(0.06, 0.25);
        let at = front.behind(x, back);
        match self.count(0, 10) {
            0..2 => {}
            2 => self.raised(Class::Building, at, [wide, 0.05, tall], lift, Surface::matt(0.4)),
            _ => {
                // Most rays pass through clean glass; some return, some are lost.
                let through = self.rng.range(0.4, 0.85);
                let pane = Surface { porosity: through, ..Surface::glass(0.3) };
                self.raised(Class::Building, at, [wide, 0.03, tall], lift, pane);
                let frame = Surface::matt(0.5);
                self.raised(Class::Building, at, [0.07, 0.07, tall], lift, frame);
            }
        }
    }

    /// Floor, ceiling, side walls, curtains, shelves and tables.
    fn room(&mut self, front: Front, floor: f64, [deep, tall]: [f64; 2], wall: Surface) {
        let x = 0.5 * (front.x[0] + front.x[1]);
        let slab = [front.length(), deep - THICK_M, 0.2];
        let at = front.behind(x, 0.5 * (deep + THICK_M));
        self.raised(Class::Building, at, slab, floor - 0.1, wall);
        self.raised(Class::Building, at, slab, floor + tall - 0.2, wall);
        let mut side = front.x[0] + 0.1;
        while side < front.x[1] {
            let at = front.behind(side, 0.5 * deep);
            self.raised(Class::Building, at, [0.15, deep, tall], floor, wall);
            side += self.rng.range(3.5, 9.0).min((front.x[1] - 0.1 - side).max(0.5));
        }
        for _ in 0..(front.length() * 0.6) as u32 {
            let x = self.rng.range(front.x[0] + 0.7, front.x[1] - 0.7);
            let back = self.rng.range(0.9, deep - 0.4);
            let yaw = self.rng.range(-0.3, 0.3);
            let size =
                [self.rng.range(0.4, 1.6), self.rng.range(0.3, 0.8), self.rng.range(0.5, 2.0)];
            let [x, y, _] = front.behind(x, back);
            let thing = Surface::matt(self.rng.range(0.15, 0.6));
            self.raised(Class::Fixture, [x, y, yaw], size, floor + 0.1, thing);
        }
        for _ in 0..self.count(0, 3) {
            let x = self.rng.range(front.x[0] + 1.0, front.x[1] - 1.0);
            let cloth = Surface::porous(0.5, self.rng.range(0.2, 0.7));
            let at = front.behind(x, 0.55);
            self.raised(Class::Building, at, [1.2, 0.05, tall - 0.7], floor + 0.2, cloth);
        }
    }
}
