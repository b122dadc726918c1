//! A country road: banks, ditches, dense and gappy hedges, wooden fences, single trees, reflectors.

use super::crowd::{Crowd, Model};
use super::site::{Site, away, every};
use super::{Layout, VIEW_M};
use crate::bend::Bend;
use crate::ground::Ground;
use crate::models;
use crate::object::{Class, Surface};
use crate::path::{EASE_S, Path};
use crate::relief::{Relief, Term};
use crate::rng::Rng;
use std::f64::consts::{FRAC_PI_2, TAU};

/// How much longer than a drive a path continues along the road, s.
const CONTINUATION_S: f64 = 20.0;

pub(super) struct Country {
    axis: Bend,
    /// Half the road's width, m.
    half: f64,
    /// Profiles of the right and the left side: distance from the road's edge and height, m.
    sides: [Vec<[f64; 2]>; 2],
    wave: [f64; 3],
    /// Speed of the vehicle, m/s.
    speed: f64,
    /// The vehicle brakes sharply rather than keeping its speed.
    stops: bool,
    stations: [f64; 2],
}

/// A verge, perhaps a ditch, and a bank up, down or none.
fn side(rng: &mut Rng) -> Vec<[f64; 2]> {
    let mut at = [rng.range(0.8, 2.2), -0.06];
    let mut points = vec![at];
    let mut go = |out: f64, up: f64| {
        at = [at[0] + out, at[1] + up];
        points.push(at);
    };
    if rng.chance(0.6) {
        let (wide, deep) = (rng.range(0.6, 1.2), rng.range(0.35, 0.8));
        go(wide, -deep);
        go(rng.range(0.3, 0.6), 0.0);
        go(wide, deep);
        go(rng.range(0.4, 1.5), 0.0);
    }
    let rise = if rng.chance(0.3) { rng.range(-2.5, -0.6) } else { rng.range(0.3, 3.5) };
    if rng.chance(0.75) {
        go(rise.abs() * rng.range(1.6, 3.0), rise);
    }
    go(60.0, rng.range(-3.0, 3.0));
    points
}

impl Country {
    pub(super) fn drawn(rng: &mut Rng, duration_s: f64) -> Country {
        let speed = if rng.chance(0.1) { 0.0 } else { rng.range(9.0, 22.0) };
        let end = speed * duration_s + VIEW_M;
        // No road here turns by more than 1.5 radians.
        let sharpest = (1.0 / 140.0f64).min(1.5 / (end + VIEW_M));
        let curvature = if rng.chance(0.25) { 0.0 } else { rng.range(-sharpest, sharpest) };
        Country {
            axis: Bend { curvature },
            half: rng.range(2.7, 3.4),
            sides: [side(rng), side(rng)],
            wave: [rng.range(0.2, 1.4), rng.range(110.0, 260.0), rng.range(0.0, TAU)],
            stops: speed > 0.0 && curvature == 0.0 && rng.chance(0.5),
            speed,
            stations: [-VIEW_M, end],
        }
    }

    /// Offset of a place `out` metres beyond the road's edge on this side.
    fn beyond(&self, side: f64, out: f64) -> f64 {
        side * (self.half + out)
    }

    /// Distance of the end of a side's bank from the road's edge, m.
    fn foot(&self, side: f64) -> f64 {
        let points = &self.sides[usize::from(side > 0.0)];
        points[points.len() - 2][0]
    }

    fn reflectors(&self, site: &mut Site) {
        every(self.stations, site.rng.range(25.0, 50.0), |station| {
            for side in [-1.0, 1.0] {
                let at = self.axis.at(station, self.beyond(side, 0.5));
                site.block(Class::Pole, at, [0.12, 0.1, 0.95], Surface::matt(0.7));
            }
        });
    }

    /// Stretches of hedge, fence or nothing along the top of the bank or the edge of the verge.
    fn borders(&self, site: &mut Site, side: f64) {
        let mut station = self.stations[0];
        while station < self.stations[1] {
            let end = station + site.rng.range(14.0, 55.0);
            let near = site.rng.chance(0.3);
            let out = if near { 0.9 } else { self.foot(side) + site.rng.range(0.6, 3.0) };
            let (from, offset) = ([station, end], self.beyond(side, out));
            match site.count(0, 10) {
                0..2 => self.dense_hedge(site, from, self.beyond(side, out + 0.8)),
                2..5 => self.gappy_hedge(site, from, self.beyond(side, out + 0.8)),
                5..8 => self.wooden_fence(site, from, offset),
                _ => self.wire_fence(site, from, offset),
            }
            station = end + site.rng.range(0.0, 12.0);
        }
    }

    fn dense_hedge(&self, site: &mut Site, [from, to]: [f64; 2], offset: f64) {
        let (wide, high) = (site.rng.range(0.7, 1.4), site.rng.range(1.0, 2.4));
        let mut station = from;
        while station < to {
            let long = site.rng.range(2.0, 4.0);
            let size = [long + 0.2, wide, high * site.rng.range(0.9, 1.1)];
            site.trimmed_hedge(self.axis.at(station + 0.5 * long, offset), size);
            station += long;
        }
    }

    fn gappy_hedge(&self, site: &mut Site, [from, to]: [f64; 2], offset: f64) {
        let mut station = from;
        while station < to {
            let [x, y, _] = self.axis.at(station, offset + site.rng.range(-0.3, 0.3));
            site.spread_bush([x, y]);
            station += site.rng.range(0.7, 3.2);
        }
    }

    /// Posts and two or three rails.
    fn wooden_fence(&self, site: &mut Site, stretch: [f64; 2], offset: f64) {
        let (step, rails) = (site.rng.range(1.8, 3.0), site.count(2, 4));
        every(stretch, step, |station| {
            let [a, b] = [station, station + step].map(|s| self.axis.at(s, offset));
            site.post(Class::Fixture, [a[0], a[1]], [0.06, 1.25]);
            for rail in 1..=rails {
                let up = 1.15 * f64::from(rail) / f64::from(rails);
                let ends = [[a[0], a[1], up], [b[0], b[1], up]];
                site.bar(Class::Fixture, ends, 0.045, Surface::matt(0.35));
            }
        });
    }

    /// Thin posts with wire in between, which few rays hit.
    fn wire_fence(&self, site: &mut Site, stretch: [f64; 2], offset: f64) {
        let (step, wire) = (site.rng.range(2.5, 4.0), Surface::porous(0.3, 0.93));
        every(stretch, step, |station| {
            let [x, y, _] = self.axis.at(station, offset);
            site.post(Class::Fixture, [x, y], [0.04, 1.2]);
            let middle = self.axis.at(station + 0.5 * step, offset);
            site.raised(Class::Fixture, middle, [step, 0.03, 1.0], 0.15, wire);
        });
    }

    /// Trees by the road, in the fields and in woods.
    fn trees(&self, site: &mut Site, side: f64) {
        let [from, to] = self.stations;
        for _ in 0..((to - from) * site.rng.range(0.05, 0.3)) as u32 {
            let back = site.rng.unit();
            let out = self.foot(side) + 1.5 + 45.0 * back * back;
            let station = site.rng.range(from, to);
            let [x, y, _] = self.axis.at(station, self.beyond(side, out));
            match site.count(0, 4) {
                0 => site.column_tree([x, y]),
                1 => site.spread_bush([x, y]),
                _ => site.forked_tree([x, y]),
            }
        }
    }

    /// A barn or a row of bales here and there.
    fn farms(&self, site: &mut Site, side: f64) {
        let mut station = self.stations[0] + site.rng.range(0.0, 60.0);
        while station < self.stations[1] {
            let out = self.foot(side) + site.rng.range(8.0, 35.0);
            let [x, y, yaw] = self.axis.at(station, self.beyond(side, out));
            let at = [x, y, yaw + site.rng.range(-0.6, 0.6)];
            if site.rng.chance(0.4) {
                let size = [site.rng.range(9.0, 24.0), 10.0, site.rng.range(3.5, 7.0)];
                site.block(Class::Building, at, size, Surface::matt(0.4));
            } else {
                bales(site, at);
            }
            station += site.rng.range(40.0, 150.0);
        }
    }

    /// Poles that carry a power line along one side.
    fn line(&self, site: &mut Site) {
        let offset = self.beyond(1.0, self.foot(1.0) + 4.0);
        every(self.stations, site.rng.range(35.0, 55.0), |station| {
            let [x, y, _] = self.axis.at(station, offset);
            site.post(Class::Pole, [x, y], [0.13, 8.0]);
        });
    }

    /// Someone in a lane who is somewhere near the vehicle at some time.
    fn driving(&self, rng: &mut Rng, long_s: f64, beside: f64, speeds: [f64; 2]) -> Path {
        let (sign, speed) = (rng.sign(), rng.range(speeds[0], speeds[1]));
        let (t, ahead) = (rng.range(0.0, long_s), rng.range(-60.0, 60.0));
        let station = self.speed * t + ahead - sign * speed * t;
        let place = [station, -sign * beside];
        match speed > 6.0 && rng.chance(0.25) {
            true => self.changing(rng, place, sign, [speed, t], long_s),
            false => self.axis.follow(place, sign, speed, long_s + CONTINUATION_S),
        }
    }

    /// Brakes or accelerates from a certain time on.
    fn changing(
        &self,
        rng: &mut Rng,
        place: [f64; 2],
        sign: f64,
        [speed, from_s]: [f64; 2],
        long_s: f64,
    ) -> Path {
        let (later, turn) = (speed * rng.range(0.5, 1.3), self.axis.turn(place[1], sign));
        let rate = 2.0f64.copysign(later - speed);
        Path::from(self.axis.state(place, sign, speed))
            .then(from_s, 0.0, turn)
            .then((later - speed) / rate, rate, turn)
            .then(long_s + CONTINUATION_S, 0.0, turn)
    }
}

/// Bales of straw side by side.
fn bales(site: &mut Site, [x, y, yaw]: [f64; 3]) {
    for n in 0..site.count(2, 7) {
        let [x, y] = away([x, y], yaw, 1.7 * f64::from(n));
        site.block(Class::Fixture, [x, y, yaw + FRAC_PI_2], [1.3, 1.4, 1.3], Surface::matt(0.45));
    }
}

impl Layout for Country {
    fn ground(&self) -> Ground {
        let outward = |side: &[[f64; 2]], sign: f64| -> Vec<[f64; 2]> {
            side.iter().map(|p| [sign * (self.half + p[0]), p[1]]).collect()
        };
        let mut points = outward(&self.sides[0], -1.0);
        points.reverse();
        points.extend([[-self.half, 0.0], [self.half, 0.0]]);
        points.extend(outward(&self.sides[1], 1.0));
        let terms = vec![Term::Banks(self.axis, points), Term::Wave(self.wave)];
        Ground::of(Relief { terms, paved: (self.axis, self.half) })
    }

    fn vehicle(&self) -> Path {
        let lane = -0.5 * self.half;
        match self.stops {
            true => {
                let start = Path::from(self.axis.state([0.0, lane], 1.0, self.speed));
                start.then(1.5, 0.0, 0.0).then_to_speed(0.35 * self.speed, 3.0, EASE_S)
            }
            false => {
                let long_s = (self.stations[1] - VIEW_M) / self.speed.max(1.0);
                self.axis.follow([0.0, lane], 1.0, self.speed, long_s + CONTINUATION_S)
            }
        }
    }

    fn furnish(&self, site: &mut Site) {
        self.reflectors(site);
        self.line(site);
        for side in [-1.0, 1.0] {
            self.borders(site, side);
            self.trees(site, side);
            self.farms(site, side);
        }
    }

    fn populate(&self, crowd: &mut Crowd) {
        let lane = 0.5 * self.half;
        let drivers: [(f64, Model, [f64; 2]); 6] = [
            (1.0, models::truck, [6.0, 18.0]),
            (7.0, models::car, [10.0, 27.0]),
            (2.0, models::van, [8.0, 22.0]),
            (1.0, models::motorcycle, [10.0, 28.0]),
            (3.0, models::car, [5.0, 12.0]),
            (1.0, models::bus, [8.0, 18.0]),
        ];
        for (amount, model, speeds) in drivers {
            crowd.add(amount, model, |r, t| self.driving(r, t, lane, speeds));
        }
        let edge = self.half - 0.5;
        crowd.add(4.0, models::cyclist, |r, t| self.driving(r, t, edge, [3.0, 8.0]));
        crowd.add(3.0, models::pedestrian, |r, t| self.driving(r, t, self.half + 0.35, [0.9, 1.7]));
        crowd.add(2.0, models::car, |r, _| {
            let place = [r.range(-40.0, self.stations[1]), -self.half - 0.6];
            self.axis.follow(place, 1.0, 0.0, CONTINUATION_S)
        });
    }
}
