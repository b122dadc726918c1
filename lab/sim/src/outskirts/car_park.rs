//! A car park: rows of parked cars, trolley shelters, manoeuvring cars, people in between.

use super::crowd::{Crowd, Model};
use super::site::{Site, every};
use super::{Layout, VIEW_M};
use crate::bend::Bend;
use crate::ground::Ground;
use crate::models;
use crate::object::{Class, Surface};
use crate::path::{EASE_S, Path, State};
use crate::relief::{Relief, Term};
use crate::rng::Rng;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Length of a bay, m.
const BAY_M: f64 = 5.2;
/// Number of aisles on either side of the vehicle's.
const AISLES: i32 = 3;
/// Width of the bed or path between the heads of two rows, m.
const BED_M: f64 = 1.6;

pub(super) struct CarPark {
    /// Widths of an aisle and of a bay, m.
    aisle: f64,
    bay: f64,
    /// Share of the bays that are taken.
    full: f64,
    /// Speed of the vehicle, m/s.
    speed: f64,
    course: Course,
    wave: [f64; 3],
    /// Extent of the rows, m.
    x: [f64; 2],
    /// x of the middle of the cross aisle, which separates two groups of bays, m.
    across: f64,
}

#[derive(Clone, Copy, PartialEq)]
enum Course {
    Straight,
    Stops,
    /// Into the cross aisle.
    Turns,
}

impl CarPark {
    pub(super) fn drawn(rng: &mut Rng, duration_s: f64) -> CarPark {
        let courses = [Course::Straight, Course::Stops, Course::Turns];
        let (course, speed) = (courses[(rng.unit() * 3.0) as usize], rng.range(1.5, 5.0));
        let turning = course == Course::Turns;
        CarPark {
            aisle: rng.range(6.0, 7.5),
            bay: rng.range(2.5, 3.0),
            full: rng.range(0.35, 0.85),
            speed,
            course,
            wave: [rng.range(0.05, 0.25), rng.range(45.0, 90.0), rng.range(0.0, TAU)],
            x: [-45.0, speed * duration_s + 55.0],
            across: if turning { 3.0 * speed + 6.0 } else { rng.range(20.0, 40.0) },
        }
    }

    /// Distance between the middles of two aisles.
    fn pitch(&self) -> f64 {
        self.aisle + 2.0 * BAY_M + BED_M
    }

    fn middle(&self, aisle: i32) -> f64 {
        f64::from(aisle) * self.pitch()
    }

    /// Whether bays at this x would lie in the cross aisle.
    fn crossed(&self, x: f64) -> bool {
        (x - self.across).abs() < 0.5 * self.aisle + 1.5
    }

    /// Centre of every bay and its inward heading (rad), row by row.
    fn bays(&self) -> Vec<[f64; 3]> {
        let count = ((self.x[1] - self.x[0]) / self.bay) as u32;
        let mut bays = Vec::new();
        for aisle in -AISLES..=AISLES {
            for side in [-1.0, 1.0] {
                let y = self.middle(aisle) + side * 0.5 * (self.aisle + BAY_M);
                let xs = (0..count).map(|n| self.x[0] + self.bay * (f64::from(n) + 0.5));
                bays.extend(xs.filter(|&x| !self.crossed(x)).map(|x| [x, y, side * FRAC_PI_2]));
            }
        }
        bays
    }

    /// Places trees, lamps, kerbs and low hedges in the beds between the rows.
    fn beds(&self, site: &mut Site) {
        for aisle in -AISLES..AISLES {
            let y = self.middle(aisle) + 0.5 * self.pitch();
            let (mut x, planted) = (self.x[0], site.rng.chance(0.6));
            while x < self.x[1] {
                if !self.crossed(x) {
                    bed(site, [x, y], planted);
                }
                x += site.rng.range(2.0, 5.0);
            }
        }
    }

    /// A shelter over two bays: posts, a roof, panes on three sides, and rows of trolleys.
    fn shelter(&self, site: &mut Site, bay: [f64; 3]) {
        let (long, wide) = (BAY_M - 0.6, 2.0 * self.bay - 0.8);
        for along in [-0.5 * long, 0.0, 0.5 * long] {
            for aside in [-0.5 * wide, 0.5 * wide] {
                let [x, y, _] = within(bay, along, aside);
                site.post(Class::Fixture, [x, y], [0.04, 2.1]);
            }
        }
        site.raised(Class::Fixture, bay, [long, wide, 0.08], 2.15, Surface::matt(0.3));
        for aside in [-0.5 * wide, 0.5 * wide] {
            site.pane(within(bay, 0.0, aside), [long, 1.5], 0.3);
        }
        let [x, y, yaw] = within(bay, 0.5 * long, 0.0);
        site.pane([x, y, yaw + FRAC_PI_2], [wide, 1.5], 0.3);
        for aside in [-0.28 * wide, 0.0, 0.28 * wide] {
            let filled = site.rng.range(0.3, 0.9) * long;
            trolleys(site, within(bay, 0.5 * (long - filled) - 0.2, aside), filled);
        }
    }

    /// Distance of the outermost rows' far end from the vehicle's aisle, m.
    fn edge(&self) -> f64 {
        self.middle(AISLES) + 0.5 * self.pitch()
    }

    /// A supermarket behind a front of glass and pillars, under a roof.
    fn market(&self, site: &mut Site) {
        let [from, to] = self.x;
        let (y, deep, high) = (self.edge() + 10.0, 30.0, site.rng.range(5.0, 8.0));
        let (x, long, wall) = (0.5 * (from + to), 0.8 * (to - from), Surface::matt(0.45));
        site.block(Class::Building, [x, y + 0.5 * deep + 6.0, 0.0], [long, deep, high], wall);
        site.raised(Class::Building, [x, y + 3.0, 0.0], [long, 6.0, 0.5], 3.2, wall);
        for n in 0..(long / 4.0) as u32 {
            let at = x - 0.5 * long + 4.0 * f64::from(n);
            site.post(Class::Building, [at, y + 0.6], [0.22, 3.2]);
            site.pane([at + 2.0, y + 5.0, 0.0], [3.9, 3.0], 0.1);
        }
    }

    /// A mesh fence on one side, trees behind it.
    fn fence(&self, site: &mut Site) {
        let (mesh, y) = (Surface::porous(0.35, site.rng.range(0.5, 0.85)), -self.edge() - 3.0);
        every(self.x, 2.5, |x| {
            site.post(Class::Fixture, [x, y], [0.03, 1.8]);
            site.raised(Class::Fixture, [x + 1.25, y, 0.0], [2.5, 0.03, 1.7], 0.1, mesh);
            if site.rng.chance(0.3) {
                let back = site.rng.range(1.5, 9.0);
                site.forked_tree([x, y - back]);
            }
        });
    }

    /// Bushes at both ends of the rows.
    fn ends(&self, site: &mut Site) {
        for x in [self.x[0] - 9.0, self.x[1] + 9.0] {
            for n in 0..30 {
                let y = self.edge() * (f64::from(n) / 15.0 - 1.0);
                let back = site.rng.range(0.0, 4.0);
                site.spread_bush([x + back.copysign(x), y]);
            }
        }
    }

    /// Out of a bay in reverse, a stop, and off along the aisle.
    fn leaving_bay(&self, rng: &mut Rng, [x, y, yaw]: [f64; 3], duration_s: f64) -> Path {
        let (speed, sign) = (rng.range(1.0, 1.9), rng.sign());
        let radius = rng.range(4.0, 5.0);
        let begin = rng.range(-4.0, 0.6 * duration_s);
        let start = Path::starting(begin, State { x, y, yaw, speed: 0.0 });
        // A metre or two straight, then the tail swings into the aisle.
        let straight = rng.range(2.2, 3.2);
        let path = start.then(1.0, -speed, 0.0).then(straight / speed, 0.0, 0.0);
        let path = path.then(FRAC_PI_2 * radius / speed, 0.0, sign / radius);
        path.then(1.0, speed, 0.0).then(rng.range(0.3, 1.5), 0.0, 0.0).then(2.0, 1.2, 0.0)
    }

    /// Cars leaving bays near the vehicle, and cars in search of one.
    fn manoeuvring(&self, crowd: &mut Crowd) {
        let here = 0.5 * self.speed * crowd.duration_s;
        let mut near = self.bays();
        near.retain(|bay| (bay[0] - here).abs() < 25.0 && bay[1].abs() < 1.2 * self.pitch());
        crowd.add(4.0, models::car, |r, t| {
            let bay = near[(r.unit() * near.len() as f64) as usize];
            self.leaving_bay(r, bay, t)
        });
        crowd.add(3.0, models::car, |r, t| self.searching(r, t));
    }

    fn parked(&self, crowd: &mut Crowd) {
        for [x, y, yaw] in self.bays() {
            if crowd.rng.chance(self.full) {
                let model: Model = match (crowd.rng.unit() * 8.0) as u32 {
                    0 => models::van,
                    1 => models::motorcycle,
                    _ => models::car,
                };
                let out = if crowd.rng.chance(0.3) { PI } else { 0.0 };
                let [dx, dy, turn] = [0.15, 0.3, 0.04].map(|far| crowd.rng.range(-far, far));
                crowd.park(model, Path::stationary(x + dx, y + dy, yaw + out + turn));
            }
        }
    }

    /// Along an aisle in search of a bay.
    fn searching(&self, rng: &mut Rng, duration_s: f64) -> Path {
        let (sign, speed) = (rng.sign(), rng.range(1.0, 3.0));
        let y = self.middle(aisle(rng)) - sign * rng.range(0.8, 1.6);
        let gone = sign * speed * rng.range(0.0, duration_s);
        let x = self.speed * 0.5 * duration_s + rng.range(-30.0, 30.0) - gone;
        Path::from(State { x, y, yaw: if sign > 0.0 { 0.0 } else { PI }, speed })
    }

    fn waiting(&self, rng: &mut Rng, duration_s: f64) -> Path {
        let State { x, y, yaw, .. } = self.walking(rng, duration_s).at(0.0);
        Path::stationary(x, y, yaw)
    }

    /// Along an aisle, between parked cars, or in any direction, sometimes with a turn.
    fn walking(&self, rng: &mut Rng, duration_s: f64) -> Path {
        let speed = rng.range(1.0, 1.6);
        let x = self.speed * 0.5 * duration_s + rng.range(-28.0, 28.0);
        let yaw = match (rng.unit() * 3.0) as u32 {
            0 => rng.range(-PI, PI),
            1 => FRAC_PI_2 * rng.sign(),
            _ => FRAC_PI_2 * (1.0 - rng.sign()) + rng.range(-0.1, 0.1),
        };
        let y = self.middle(aisle(rng)) + rng.range(-0.5, 0.5) * self.aisle;
        let before = rng.range(0.0, duration_s);
        let gone = before * speed;
        let start = State { x: x - gone * yaw.cos(), y: y - gone * yaw.sin(), yaw, speed };
        let path = Path::from(start).then(before, 0.0, 0.0);
        match rng.chance(0.4) {
            true => path.then_turn(rng.sign() * FRAC_PI_2, 0.7, 0.4),
            false => path,
        }
    }
}

/// One item in a bed, and the kerbs beside it.
fn bed(site: &mut Site, [x, y]: [f64; 2], planted: bool) {
    match site.count(0, 8) {
        0 => site.forked_tree([x, y]),
        1 => site.post(Class::Pole, [x, y], [0.09, 7.0]),
        2 | 3 if planted => site.spread_bush([x, y]),
        4 if planted => site.trimmed_hedge([x, y, 0.0], [3.0, 0.8, 0.9]),
        5 => site.post(Class::Fixture, [x, y], [0.07, 0.9]),
        _ => {}
    }
    for side in [-0.5, 0.5] {
        let at = [x, y + side * (BED_M - 0.2), 0.0];
        site.block(Class::Ground, at, [1.0, 0.15, 0.1], Surface::matt(0.4));
    }
}

/// A place in a bay, from its centre: this far in and this far to the left.
fn within([x, y, yaw]: [f64; 3], along: f64, aside: f64) -> [f64; 3] {
    let (s, c) = yaw.sin_cos();
    [x + along * c - aside * s, y + along * s + aside * c, yaw]
}

/// Trolleys pushed into one another: wire that most rays pass through, and wheels below.
fn trolleys(site: &mut Site, at: [f64; 3], long: f64) {
    let [wire, wheels] = [0.55, 0.8].map(|porosity| Surface::porous(0.4, porosity));
    site.raised(Class::Fixture, at, [long, 0.55, 0.55], 0.45, wire);
    site.raised(Class::Fixture, at, [long, 0.45, 0.3], 0.05, wheels);
}

/// One of the aisles near the vehicle's.
fn aisle(rng: &mut Rng) -> i32 {
    [0, 0, 0, 1, -1, 2, -2][(rng.unit() * 7.0) as usize]
}

impl Layout for CarPark {
    fn ground(&self) -> Ground {
        let far = self.middle(AISLES + 1);
        // It slopes to one side, for drainage.
        let level = Bend { curvature: 0.0 };
        let banks = Term::Banks(level, vec![[-far, -0.01 * far], [far, 0.01 * far]]);
        let terms = vec![banks, Term::Wave(self.wave)];
        Ground::of(Relief { terms, paved: (level, VIEW_M) })
    }

    fn vehicle(&self) -> Path {
        let start = Path::from(State { x: 0.0, y: -1.5, yaw: 0.0, speed: self.speed });
        match self.course {
            Course::Straight => start,
            Course::Stops => start
                .then(2.0, 0.0, 0.0)
                .then_to_speed(0.0, 1.5, 0.5 * EASE_S)
                .then(1.5, 0.0, 0.0)
                .then_to_speed(self.speed, 1.0, 0.5 * EASE_S),
            Course::Turns => {
                let turned = Path::from(start.at(0.0)).then_turn(-FRAC_PI_2, 6.0, EASE_S).end();
                // So that the turn ends in the cross aisle.
                let before = (self.across - 1.0 - turned.x) / self.speed;
                start.then(before.max(0.1), 0.0, 0.0).then_turn(-FRAC_PI_2, 6.0, EASE_S)
            }
        }
    }

    fn furnish(&self, site: &mut Site) {
        self.beds(site);
        self.market(site);
        self.fence(site);
        self.ends(site);
        let bays = self.bays();
        for _ in 0..4 {
            let bay = bays[site.count(0, bays.len() as u32 - 1) as usize];
            if !self.crossed(bay[0] + self.bay) {
                self.shelter(site, [bay[0] + 0.5 * self.bay, bay[1], bay[2]]);
            }
        }
    }

    fn populate(&self, crowd: &mut Crowd) {
        self.manoeuvring(crowd);
        self.parked(crowd);
        crowd.add(22.0, models::pedestrian, |r, t| self.walking(r, t));
        crowd.add(3.0, models::pedestrian, |r, t| self.waiting(r, t));
    }
}
