//! A motorway: guard rails, a concrete barrier in the middle, noise walls, gantries, fast traffic.

use super::crowd::{Crowd, Model};
use super::site::{Site, every};
use super::{Layout, VIEW_M};
use crate::bend::Bend;
use crate::ground::Ground;
use crate::models;
use crate::object::{Class, Surface};
use crate::path::Path;
use crate::relief::{Relief, Term};
use crate::rng::Rng;
use std::f64::consts::TAU;

/// Width of a lane, m.
const LANE_M: f64 = 3.6;
/// Distance between the middle and the first lane, m.
const INNER_M: f64 = 2.0;
/// Width of the hard shoulder, m.
const SHOULDER_M: f64 = 2.8;
/// How much longer than a drive a path continues along the road, s.
const CONTINUATION_S: f64 = 20.0;

pub(super) struct Motorway {
    axis: Bend,
    /// Lanes each way.
    lanes: u32,
    /// The vehicle's lane, counted from the outer one.
    lane: u32,
    /// Speed of the vehicle, m/s.
    speed: f64,
    wave: [f64; 3],
    /// Height of the land beyond the shoulders relative to the road, right and left, m.
    land: [f64; 2],
    stations: [f64; 2],
}

/// What lies beyond the guard rail.
#[derive(Clone, Copy)]
enum Border {
    NoiseWall,
    Bushes,
    Open,
}

impl Motorway {
    pub(super) fn drawn(rng: &mut Rng, duration_s: f64) -> Motorway {
        let speed = rng.range(20.0, 28.0);
        let end = speed * duration_s + VIEW_M;
        let sharpest = (1.0 / 600.0f64).min(1.5 / (end + VIEW_M));
        let lanes = if rng.chance(0.5) { 2 } else { 3 };
        Motorway {
            axis: Bend { curvature: rng.range(-sharpest, sharpest) },
            lanes,
            lane: if speed < 25.0 { 0 } else { 1 },
            speed,
            wave: [rng.range(0.0, 2.5), rng.range(400.0, 800.0), rng.range(0.0, TAU)],
            land: [rng.range(-4.0, 4.0), rng.range(-4.0, 4.0)],
            stations: [-VIEW_M, end],
        }
    }

    /// Distance of a lane's middle from the axis; lane 0 is the outer one.
    fn lane(&self, lane: u32) -> f64 {
        INNER_M + LANE_M * (f64::from(self.lanes - lane) - 0.5)
    }

    /// Distance of the shoulder's outer edge from the axis, m.
    fn edge(&self) -> f64 {
        INNER_M + LANE_M * f64::from(self.lanes) + SHOULDER_M
    }

    /// Posts and a rail with two corrugations.
    fn guard_rail(&self, site: &mut Site, offset: f64) {
        let (step, steel) = (2.0, Surface::matt(0.55));
        every(self.stations, step, |station| {
            let [x, y, yaw] = self.axis.at(station, offset);
            let back = 0.12 * offset.signum();
            let post = self.axis.at(station, offset + back);
            site.block(Class::Fixture, post, [0.1, 0.06, 0.7], steel);
            for lift in [0.45, 0.62] {
                site.raised(Class::Fixture, [x, y, yaw], [step + 0.02, 0.05, 0.13], lift, steel);
            }
            site.raised(Class::Fixture, [x, y, yaw], [step, 0.02, 0.05], 0.575, steel);
        });
    }

    /// A concrete barrier with a wide foot.
    fn barrier(&self, site: &mut Site) {
        let (long, concrete) = (6.0, Surface::matt(0.45));
        let height = site.rng.range(0.8, 1.1);
        every(self.stations, long, |station| {
            let at = self.axis.at(station, 0.0);
            site.block(Class::Fixture, at, [long, 0.6, 0.25], concrete);
            site.block(Class::Fixture, at, [long, 0.2, height], concrete);
        });
        if site.rng.chance(0.4) {
            every(self.stations, 40.0, |station| {
                let [x, y, _] = self.axis.at(station, 0.0);
                site.post(Class::Pole, [x, y], [0.1, 10.0]);
            });
        }
    }

    fn borders(&self, site: &mut Site, side: f64) {
        let mut station = self.stations[0];
        while station < self.stations[1] {
            let end = station + site.rng.range(50.0, 140.0);
            let kinds = [Border::NoiseWall, Border::Bushes, Border::Open];
            let kind = kinds[site.count(0, 3) as usize];
            match kind {
                Border::NoiseWall => self.noise_wall(site, [station, end], side),
                Border::Bushes => self.planted(site, [station, end], side, 0.5),
                Border::Open => self.planted(site, [station, end], side, 0.06),
            }
            station = end;
        }
    }

    /// Panels between steel posts, some with glass on top.
    fn noise_wall(&self, site: &mut Site, stretch: [f64; 2], side: f64) {
        let (step, height) = (site.rng.range(3.5, 5.0), site.rng.range(2.5, 5.0));
        let offset = side * (self.edge() + site.rng.range(1.2, 2.2));
        let panel = Surface::matt(site.rng.range(0.25, 0.5));
        let glazed = site.rng.range(0.0, 0.4);
        every(stretch, step, |station| {
            let post = self.axis.at(station, offset);
            site.block(Class::Fixture, post, [0.2, 0.22, height + 0.1], Surface::matt(0.5));
            let middle = self.axis.at(station + 0.5 * step, offset);
            let low = height * if site.rng.chance(glazed) { 0.35 } else { 1.0 };
            site.block(Class::Building, middle, [step, 0.14, low], panel);
            if low < height {
                let size = [step, 0.03, height - low];
                site.raised(Class::Building, middle, size, low, Surface::glass(0.3));
            }
        });
    }

    /// Bushes and trees behind the rail, `a_metre` of them per metre.
    fn planted(&self, site: &mut Site, [from, to]: [f64; 2], side: f64, a_metre: f64) {
        for _ in 0..((to - from) * a_metre) as u32 {
            let out = 1.5 + 20.0 * site.rng.unit();
            let [x, y, _] = self.axis.at(site.rng.range(from, to), side * (self.edge() + out));
            match site.count(0, 3) {
                0 if out > 5.0 => site.forked_tree([x, y]),
                _ => site.spread_bush([x, y]),
            }
        }
    }

    /// Legs, a beam across both carriageways, signs on it.
    fn gantry(&self, site: &mut Site, station: f64) {
        let (out, high, steel) = (self.edge() + 0.9, 6.2, Surface::matt(0.5));
        for side in [-1.0, 1.0] {
            let leg = self.axis.at(station, side * out);
            site.block(Class::Pole, leg, [0.4, 0.4, high + 0.6], steel);
        }
        let middle = self.axis.at(station, 0.0);
        site.raised(Class::Pole, middle, [0.35, 2.0 * out, 0.6], high, steel);
        for lane in 0..self.lanes {
            for side in [-1.0, 1.0] {
                if site.rng.chance(0.6) {
                    let at = self.axis.at(station - side * 0.3, side * self.lane(lane));
                    site.raised(Class::Pole, at, [0.1, 2.8, 2.4], high - 0.4, Surface::matt(0.9));
                }
            }
        }
    }

    /// In a lane either way, near the vehicle at some time of the drive.
    fn driving(&self, rng: &mut Rng, long_s: f64, sign: f64, lane: u32, speed: f64) -> Path {
        let (t, ahead) = (rng.range(0.0, long_s), rng.range(-70.0, 90.0));
        let station = self.speed * t + ahead - sign * speed * t;
        self.axis.follow([station, -sign * self.lane(lane)], sign, speed, long_s + CONTINUATION_S)
    }

    /// All traffic in one direction; oncoming vehicles are soon behind the vehicle, so there are
    /// more.
    fn one_way(&self, crowd: &mut Crowd, sign: f64) {
        let a_second = if sign < 0.0 { 0.2 } else { 0.03 };
        let more = 1.0 + a_second * crowd.duration_s;
        for (amount, model) in [(4.0, models::truck as Model), (1.0, models::bus)] {
            crowd.add(more * amount, model, |r, t| self.heavy(r, t, sign));
        }
        for (amount, model) in
            [(9.0, models::car as Model), (2.0, models::van), (1.0, models::motorcycle)]
        {
            crowd.add(more * amount, model, |r, t| self.car(r, t, sign));
        }
    }

    fn heavy(&self, rng: &mut Rng, long_s: f64, sign: f64) -> Path {
        let speed = rng.range(21.0, 25.0);
        self.driving(rng, long_s, sign, 0, speed)
    }

    /// Speed and lane of a car.
    fn car(&self, rng: &mut Rng, long_s: f64, sign: f64) -> Path {
        let lane = (rng.unit() * f64::from(self.lanes)) as u32;
        let slow = 23.0 + 4.0 * f64::from(lane);
        let speed = rng.range(slow, slow + 5.0).min(35.0);
        self.driving(rng, long_s, sign, lane, speed)
    }
}

impl Layout for Motorway {
    fn ground(&self) -> Ground {
        let edge = self.edge() + 1.5;
        let [right, left] = self.land;
        // Slopes with two metres of run per metre of rise.
        let points = vec![
            [-edge - 2.0 * right.abs() - 1.0, right],
            [-edge, 0.0],
            [edge, 0.0],
            [edge + 2.0 * left.abs() + 1.0, left],
        ];
        let terms = vec![Term::Banks(self.axis, points), Term::Wave(self.wave)];
        Ground::of(Relief { terms, paved: (self.axis, self.edge()) })
    }

    fn vehicle(&self) -> Path {
        let long_s = (self.stations[1] - VIEW_M) / self.speed;
        let offset = -self.lane(self.lane);
        self.axis.follow([0.0, offset], 1.0, self.speed, long_s + CONTINUATION_S)
    }

    fn furnish(&self, site: &mut Site) {
        self.barrier(site);
        for side in [-1.0, 1.0] {
            self.guard_rail(site, side * (self.edge() + 0.3));
            self.borders(site, side);
        }
        let mut station = self.stations[0] + site.rng.range(0.0, 200.0);
        while station < self.stations[1] {
            self.gantry(site, station);
            station += site.rng.range(150.0, 350.0);
        }
    }

    fn populate(&self, crowd: &mut Crowd) {
        for sign in [1.0, -1.0] {
            self.one_way(crowd, sign);
        }
        // A truck has stopped on the shoulder.
        crowd.add(1.0, models::truck, |r, _| {
            let side = r.sign();
            let place = [r.range(0.0, self.stations[1]), side * (self.edge() - 1.3)];
            self.axis.follow(place, -side, 0.0, CONTINUATION_S)
        });
    }
}
