//! A market street: house fronts with rooms behind, stalls, scaffolds, and a crowd.

use super::crowd::Crowd;
use super::openings::Front;
use super::site::Site;
use super::{Layout, VIEW_M};
use crate::bend::Bend;
use crate::ground::Ground;
use crate::models;
use crate::object::{Class, Surface};
use crate::path::{EASE_S, Path, State};
use crate::relief::{Relief, Term};
use crate::rng::Rng;
use crate::shape::Shape;
use glam::{DQuat, DVec3};
use raywake_core::pose::Pose;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Half width of the strip kept free for walking and deliveries, m.
const FREE_M: f64 = 2.2;

pub(super) struct Market {
    /// Distance from the middle to the fronts, m.
    half: f64,
    /// Speed of the vehicle, m/s.
    speed: f64,
    stops: bool,
    x: [f64; 2],
    wave: [f64; 3],
}

impl Market {
    pub(super) fn drawn(rng: &mut Rng, duration_s: f64) -> Market {
        let speed = if rng.chance(0.25) { 0.0 } else { rng.range(1.0, 4.0) };
        Market {
            half: rng.range(6.0, 9.5),
            speed,
            stops: speed > 0.0 && rng.chance(0.4),
            x: [-70.0, speed * duration_s + 80.0],
            wave: [rng.range(0.0, 0.6), rng.range(80.0, 160.0), rng.range(0.0, TAU)],
        }
    }

    fn fronts(&self, site: &mut Site, side: f64) {
        let mut x = self.x[0];
        while x < self.x[1] {
            let long = site.rng.range(5.0, 13.0);
            let y = side * (self.half + site.rng.range(0.0, 0.7));
            site.open_house(Front { x: [x, x + long], y });
            if site.rng.chance(0.2) {
                self.scaffold(site, [x, x + long], side);
            }
            x += long;
            if site.rng.chance(0.15) {
                // An alley, with a wall across its far end.
                let wide = site.rng.range(1.5, 4.0);
                let back = [x + 0.5 * wide, y + side * site.rng.range(9.0, 25.0), 0.0];
                site.block(Class::Building, back, [wide + 6.0, 0.4, 6.0], Surface::matt(0.4));
                x += wide;
            }
        }
    }

    /// Standards in two rows, boards on every lift, guard rails, braces, an occasional net.
    fn scaffold(&self, site: &mut Site, [from, to]: [f64; 2], side: f64) {
        let (step, lift, steel) = (2.5, 2.0, Surface::matt(0.4));
        let rows = [self.half - 0.35, self.half - 1.25].map(|y| side * y);
        let lifts = site.count(2, 4);
        let height = lift * f64::from(lifts) + 1.0;
        let mut x = from;
        while x < to {
            rows.iter().for_each(|&y| site.post(Class::Fixture, [x, y], [0.03, height]));
            for n in 1..=lifts {
                let up = lift * f64::from(n);
                let boards = [x + 0.5 * step, 0.5 * (rows[0] + rows[1]), 0.0];
                site.raised(Class::Fixture, boards, [step, 0.75, 0.06], up, Surface::matt(0.35));
                let ends = [[x, rows[1], up + 1.0], [x + step, rows[1], up + 1.0]];
                site.bar(Class::Fixture, ends, 0.025, steel);
            }
            let brace = [[x, rows[1], 0.2], [x + step, rows[1], lift]];
            site.bar(Class::Fixture, brace, 0.025, steel);
            if site.rng.chance(0.3) {
                let net = Surface::porous(0.4, site.rng.range(0.4, 0.8));
                let at = [x + 0.5 * step, rows[1] - side * 0.06, 0.0];
                site.raised(Class::Fixture, at, [step, 0.02, height - 2.2], 2.1, net);
            }
            x += step;
        }
    }

    /// A table with goods under an awning on four posts, a cloth behind it.
    fn stall(&self, site: &mut Site, x: f64, side: f64) {
        let (long, deep) = (site.rng.range(2.0, 3.6), site.rng.range(1.2, 1.8));
        let y = side * (FREE_M + 0.35 + 0.5 * deep);
        let wood = Surface::matt(0.4);
        site.raised(Class::Fixture, [x, y, 0.0], [long, deep, 0.07], 0.8, wood);
        let drape = [x, y - side * 0.5 * deep, 0.0];
        site.raised(Class::Fixture, drape, [long, 0.03, 0.7], 0.1, Surface::matt(0.5));
        goods(site, [x, y], [long, deep]);
        let heights = [site.rng.range(1.95, 2.2), site.rng.range(2.3, 2.7)];
        for end in [-0.5, 0.5] {
            for (row, up) in [-0.5, 0.5].into_iter().zip(heights) {
                site.post(Class::Pole, [x + end * long, y + side * row * deep], [0.025, up]);
            }
        }
        self.awning(site, [x, y, side], [long, deep], heights);
        if site.rng.chance(0.6) {
            let at = [x, y + side * 0.5 * deep, 0.0];
            let cloth = Surface::porous(0.5, site.rng.range(0.0, 0.6));
            site.raised(Class::Fixture, at, [long, 0.03, heights[1] - 0.2], 0.1, cloth);
        }
    }

    /// A sheet that slopes down towards the middle of the street, from `heights[1]` to
    /// `heights[0]`.
    fn awning(&self, site: &mut Site, at: [f64; 3], size: [f64; 2], heights: [f64; 2]) {
        let [x, y, side] = at;
        let slope = side * (heights[1] - heights[0]).atan2(size[1]);
        let z = site.ground.height(x, y) + 0.5 * (heights[0] + heights[1]) + 0.05;
        let pose = Pose::new(DQuat::from_rotation_x(slope), DVec3::new(x, y, z));
        let shape = Shape::cuboid(size[0] + 0.4, size[1] + 0.5, 0.02);
        let cloth = Surface::matt(site.rng.range(0.3, 0.8));
        site.fix(Class::Fixture, shape, pose, cloth);
    }

    /// Tables with chairs and a sunshade.
    fn cafe(&self, site: &mut Site, x: f64, side: f64) {
        let y = side * (FREE_M + 1.3);
        site.post(Class::Fixture, [x, y], [0.04, 2.3]);
        let shade = Shape::ellipsoid(1.4, 1.4, 0.25);
        let z = site.ground.height(x, y) + 2.4;
        site.fix(Class::Fixture, shade, Pose::planar(x, y, z, 0.0), Surface::matt(0.6));
        site.raised(Class::Fixture, [x, y, 0.0], [0.8, 0.8, 0.05], 0.7, Surface::matt(0.5));
        for n in 0..4 {
            let turn = FRAC_PI_2 * f64::from(n) + site.rng.range(-0.3, 0.3);
            let at = [x + 0.75 * turn.cos(), y + 0.75 * turn.sin(), turn];
            site.raised(Class::Fixture, at, [0.42, 0.42, 0.05], 0.42, Surface::matt(0.4));
            let back = [x + 0.95 * turn.cos(), y + 0.95 * turn.sin(), turn];
            site.raised(Class::Fixture, back, [0.04, 0.4, 0.45], 0.42, Surface::porous(0.4, 0.4));
        }
    }

    fn along(&self, site: &mut Site, side: f64) {
        let mut x = self.x[0];
        while x < self.x[1] {
            match site.count(0, 12) {
                0..5 => self.stall(site, x, side),
                5 | 6 => self.cafe(site, x, side),
                7 => site.post(Class::Pole, [x, side * (FREE_M + 0.4)], [0.07, 4.5]),
                8 => site.forked_tree([x, side * (FREE_M + 0.8)]),
                9 => self.planter(site, x, side),
                10 => menu(site, [x, side * (FREE_M + 0.5)]),
                _ => {}
            }
            x += site.rng.range(2.4, 6.0);
        }
    }

    fn planter(&self, site: &mut Site, x: f64, side: f64) {
        let y = side * (self.half - site.rng.range(0.6, 1.4));
        site.block(Class::Fixture, [x, y, 0.0], [1.2, 0.5, 0.5], Surface::matt(0.4));
        site.leaves([x, y], [1.2, 0.7, 0.8], 0.4, 0.4);
    }

    /// Someone walking up or down the street near the vehicle, perhaps with a turn.
    fn walking(&self, rng: &mut Rng, duration_s: f64) -> Path {
        let (sign, speed) = (rng.sign(), rng.range(0.5, 1.6));
        let t = rng.range(0.0, duration_s);
        let x = self.speed * t + rng.range(-30.0, 30.0) - sign * speed * t;
        let y = rng.range(-1.0, 1.0) * (self.half - 0.5);
        let yaw = if sign > 0.0 { 0.0 } else { PI };
        let path = Path::from(State { x, y, yaw: yaw + rng.range(-0.15, 0.15), speed });
        match rng.chance(0.35) {
            true => path.then(t, 0.0, 0.0).then_turn(rng.range(-1.6, 1.6), 0.8, 0.4),
            false => path,
        }
    }

    fn standing(&self, rng: &mut Rng, duration_s: f64) -> Path {
        let x = 0.5 * self.speed * duration_s + rng.range(-30.0, 30.0);
        let y = rng.sign() * rng.range(1.4, self.half - 0.4);
        Path::stationary(x, y, rng.range(-PI, PI))
    }
}

/// Boxes on a table of this length and depth.
fn goods(site: &mut Site, [x, y]: [f64; 2], [long, deep]: [f64; 2]) {
    for _ in 0..site.count(4, 12) {
        let [dx, dy] = [0.45 * long, 0.4 * deep].map(|far| site.rng.range(-far, far));
        let at = [x + dx, y + dy, site.rng.range(0.0, PI)];
        let size = [0.5, 0.35, site.rng.range(0.1, 0.45)];
        site.raised(Class::Fixture, at, size, 0.87, Surface::matt(0.5));
    }
}

/// A menu board.
fn menu(site: &mut Site, [x, y]: [f64; 2]) {
    let yaw = site.rng.range(0.0, PI);
    site.block(Class::Fixture, [x, y, yaw], [0.05, 0.7, 1.1], Surface::matt(0.3));
}

impl Layout for Market {
    fn ground(&self) -> Ground {
        let level = Bend { curvature: 0.0 };
        // A gutter in the middle.
        let (half, gutter) = (self.half, 0.3);
        let points = vec![[-half, 0.12], [-gutter, -0.02], [gutter, -0.02], [half, 0.12]];
        let terms = vec![Term::Banks(level, points), Term::Wave(self.wave)];
        Ground::of(Relief { terms, paved: (level, VIEW_M) })
    }

    fn vehicle(&self) -> Path {
        let start = Path::from(State { speed: self.speed, ..State::default() });
        match self.stops {
            true => start
                .then(1.5, 0.0, 0.0)
                .then_to_speed(0.0, 1.0, 0.5 * EASE_S)
                .then(2.0, 0.0, 0.0)
                .then_to_speed(self.speed, 0.8, 0.5 * EASE_S),
            false => start,
        }
    }

    fn furnish(&self, site: &mut Site) {
        for side in [-1.0, 1.0] {
            self.fronts(site, side);
            self.along(site, side);
        }
    }

    fn populate(&self, crowd: &mut Crowd) {
        crowd.add(2.0, models::van, |r, t| {
            let x = 0.5 * self.speed * t + r.range(-40.0, 50.0);
            Path::stationary(x, r.sign() * (self.half - 1.4), 0.0)
        });
        crowd.add(3.0, models::cyclist, |r, t| {
            let path = self.walking(r, t);
            let start = path.at(0.0);
            Path::from(State { speed: r.range(2.0, 4.0), y: start.y.clamp(-2.0, 2.0), ..start })
        });
        crowd.add(45.0, models::pedestrian, |r, t| self.walking(r, t));
        crowd.add(30.0, models::pedestrian, |r, t| self.standing(r, t));
    }
}
