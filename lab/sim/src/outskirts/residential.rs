//! Houses in gardens: chain-link fences, hedges, terraces and stairs, garden walls, garages.

use super::Layout;
use super::crowd::{Crowd, Model};
use super::site::{Site, every};
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
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// Width of a footpath beside the road, m.
const PATH_M: f64 = 1.6;
/// How much longer than a drive a path lasts, s.
const CONTINUATION_S: f64 = 20.0;
/// Longer than any drive, s.
const LONG_S: f64 = 1e4;
/// Width of a garage's driveway, m.
const DRIVE_M: f64 = 3.4;

pub(super) struct Residential {
    axis: Bend,
    /// Half width of the road, m.
    half: f64,
    /// Speed of the vehicle, m/s.
    speed: f64,
    stops: bool,
    /// Height of the gardens above the road, right and left, m.
    gardens: [f64; 2],
    wave: [f64; 3],
    stations: [f64; 2],
    /// Station and side of every plot's driveway.
    drives: Vec<[f64; 2]>,
    plots: Vec<Plot>,
}

/// A plot by the road.
#[derive(Clone, Copy)]
struct Plot {
    side: f64,
    from: f64,
    to: f64,
    /// Distance from the footpath to the house, m.
    garden: f64,
}

impl Residential {
    pub(super) fn drawn(rng: &mut Rng, duration_s: f64) -> Residential {
        let speed = if rng.chance(0.15) { 0.0 } else { rng.range(3.0, 9.0) };
        let end = speed * duration_s + 100.0;
        let sharpest = (1.0 / 90.0f64).min(1.5 / (end + 100.0));
        let stops = speed > 0.0 && rng.chance(0.35);
        let curvature = if stops { 0.0 } else { rng.range(-sharpest, sharpest) };
        let mut road = Residential {
            axis: Bend { curvature },
            half: rng.range(2.6, 3.3),
            speed,
            stops,
            gardens: [rng.range(-0.6, 1.2), rng.range(-0.6, 1.2)],
            wave: [rng.range(0.0, 1.0), rng.range(80.0, 200.0), rng.range(0.0, TAU)],
            stations: [-90.0, end],
            drives: Vec::new(),
            plots: Vec::new(),
        };
        for side in [-1.0, 1.0] {
            let mut from = road.stations[0];
            while from < end {
                let to = from + rng.range(14.0, 24.0);
                road.plots.push(Plot { side, from, to, garden: rng.range(4.0, 9.0) });
                road.drives.push([to - 0.5 * DRIVE_M - 0.6, side]);
                from = to;
            }
        }
        road
    }

    /// Offset of the footpath's outer edge on a side.
    fn edge(&self, side: f64) -> f64 {
        side * (self.half + PATH_M)
    }

    fn at(&self, station: f64, side: f64, out: f64) -> [f64; 3] {
        self.axis.at(station, self.edge(side) + side * out)
    }

    /// Whatever separates a garden from the footpath, with a gap for the driveway.
    fn border(&self, site: &mut Site, plot: Plot) {
        let stretch = [plot.from, plot.to - DRIVE_M - 1.2];
        match site.count(0, 10) {
            0..4 => self.chain_link(site, plot.side, stretch),
            4..6 => self.hedge(site, plot.side, stretch),
            6..8 => self.wall(site, plot.side, stretch),
            _ => self.bushes(site, plot.side, stretch),
        }
    }

    fn hedge(&self, site: &mut Site, side: f64, stretch: [f64; 2]) {
        let (wide, high) = (site.rng.range(0.5, 1.0), site.rng.range(0.8, 2.0));
        self.pieces(stretch, 2.5, |middle, long| {
            site.trimmed_hedge(self.at(middle, side, 0.6), [long, wide, high]);
        });
    }

    fn wall(&self, site: &mut Site, side: f64, stretch: [f64; 2]) {
        let (high, stone) = (site.rng.range(0.4, 1.6), Surface::matt(0.4));
        self.pieces(stretch, 2.5, |middle, long| {
            site.block(Class::Fixture, self.at(middle, side, 0.2), [long, 0.3, high], stone);
        });
    }

    fn bushes(&self, site: &mut Site, side: f64, [from, to]: [f64; 2]) {
        let mut station = from;
        while station < to {
            let [x, y, _] = self.at(station, side, 0.9);
            site.spread_bush([x, y]);
            station += site.rng.range(1.0, 3.5);
        }
    }

    /// Splits a stretch into pieces about `step` long; passes on their middle and length.
    fn pieces(&self, [from, to]: [f64; 2], step: f64, mut put: impl FnMut(f64, f64)) {
        let count = ((to - from) / step).ceil().max(1.0);
        let long = (to - from) / count;
        (0..count as u32).for_each(|n| put(from + long * (f64::from(n) + 0.5), long));
    }

    /// Posts and mesh that most rays pass through.
    fn chain_link(&self, site: &mut Site, side: f64, stretch: [f64; 2]) {
        let (high, mesh) = (site.rng.range(0.9, 1.9), site.rng.range(0.6, 0.9));
        self.pieces(stretch, 2.5, |middle, long| {
            let at = self.at(middle, side, 0.25);
            let wire = Surface::porous(0.35, mesh);
            site.raised(Class::Fixture, at, [long, 0.02, high], 0.03, wire);
            let [x, y, _] = self.at(middle - 0.5 * long, side, 0.25);
            site.post(Class::Fixture, [x, y], [0.03, high + 0.1]);
        });
    }

    /// A house with a pitched roof, stairs to its door, a terrace.
    fn house(&self, site: &mut Site, plot: Plot) {
        let long = plot.to - plot.from - DRIVE_M - site.rng.range(2.0, 4.0);
        let (deep, high) = (site.rng.range(7.0, 11.0), site.rng.range(2.8, 6.0));
        let middle = plot.from + 0.5 * long + 0.6;
        let wall = Surface::matt(site.rng.range(0.25, 0.65));
        let at = self.at(middle, plot.side, plot.garden + 0.5 * deep);
        site.block(Class::Building, at, [long, deep, high], wall);
        roof(site, at, [long, deep, high]);
        self.windows(site, plot, middle, long);
        let door = middle + site.rng.range(-0.3, 0.3) * long;
        self.stairs(site, plot, door);
        if site.rng.chance(0.5) {
            self.terrace(site, plot, middle - 0.2 * long, 0.4 * long);
        }
    }

    fn windows(&self, site: &mut Site, plot: Plot, middle: f64, long: f64) {
        for _ in 0..site.count(2, 6) {
            let station = middle + site.rng.range(-0.42, 0.42) * long;
            let at = self.at(station, plot.side, plot.garden + 0.02);
            let size = [site.rng.range(0.8, 1.8), 0.16, 1.3];
            site.raised(Class::Building, at, size, 0.9, Surface::glass(0.35));
        }
    }

    /// A terrace in front of the house, with a rail.
    fn terrace(&self, site: &mut Site, plot: Plot, station: f64, long: f64) {
        let high = site.rng.range(0.3, 1.0);
        let at = self.at(station, plot.side, plot.garden - 1.2);
        site.block(Class::Fixture, at, [long, 2.4, high], Surface::matt(0.4));
        let rail = self.at(station, plot.side, plot.garden - 2.35);
        site.raised(Class::Fixture, rail, [long, 0.05, 0.9], high, Surface::porous(0.4, 0.6));
    }

    /// Steps up to a door.
    fn stairs(&self, site: &mut Site, plot: Plot, station: f64) {
        let steps = site.count(2, 7);
        for n in 0..steps {
            let out = plot.garden - 0.9 - 0.3 * f64::from(steps - n);
            let at = self.at(station, plot.side, out + 0.15);
            let size = [1.4, 0.3, 0.17 * f64::from(n + 1)];
            site.block(Class::Fixture, at, size, Surface::matt(0.4));
        }
        let at = self.at(station, plot.side, plot.garden - 0.45);
        let top = 0.17 * f64::from(steps);
        site.block(Class::Fixture, at, [1.6, 0.9, top], Surface::matt(0.4));
        for side in [-0.75, 0.75] {
            let a = self.at(station + side, plot.side, plot.garden - 1.0 - 0.3 * f64::from(steps));
            let b = self.at(station + side, plot.side, plot.garden - 0.9);
            let ends = [[a[0], a[1], 0.9], [b[0], b[1], top + 0.9]];
            site.bar(Class::Fixture, ends, 0.025, Surface::matt(0.4));
        }
    }

    /// A garage at the end of a driveway: walls, a roof, its door shut or open.
    fn garage(&self, site: &mut Site, [station, side]: [f64; 2], garden: f64) {
        let (deep, high, wall) = (5.8, 2.4, Surface::matt(0.45));
        let out = garden + 1.5;
        for aside in [-0.5 * DRIVE_M, 0.5 * DRIVE_M] {
            let at = self.at(station + aside, side, out + 0.5 * deep);
            site.block(Class::Building, at, [0.15, deep, high], wall);
        }
        let back = self.at(station, side, out + deep);
        site.block(Class::Building, back, [DRIVE_M, 0.15, high], wall);
        let middle = self.at(station, side, out + 0.5 * deep);
        site.raised(Class::Building, middle, [DRIVE_M + 0.2, deep + 0.3, 0.2], high, wall);
        if site.rng.chance(0.5) {
            let door = self.at(station, side, out);
            site.block(Class::Building, door, [DRIVE_M, 0.08, high], Surface::matt(0.5));
        }
    }

    /// Trees, bushes, swings and stacked wood behind the border, bins in front of it.
    fn garden(&self, site: &mut Site, plot: Plot) {
        for _ in 0..site.count(2, 8) {
            let station = site.rng.range(plot.from, plot.to - DRIVE_M - 1.5);
            let out = site.rng.range(1.5, plot.garden - 0.8);
            let at = self.at(station, plot.side, out);
            in_garden(site, at);
        }
        let station = plot.to - DRIVE_M - 1.0;
        for n in 0..site.count(0, 4) {
            let at = self.at(station - 0.7 * f64::from(n), plot.side, -0.3);
            site.block(Class::Fixture, at, [0.55, 0.6, 1.05], Surface::matt(0.25));
        }
    }

    fn lamps(&self, site: &mut Site) {
        let (step, side) = (site.rng.range(25.0, 40.0), site.rng.sign());
        every(self.stations, step, |station| {
            let [x, y, _] = self.at(station, side, -0.15);
            site.post(Class::Pole, [x, y], [0.06, 4.5]);
        });
    }

    fn driving(&self, rng: &mut Rng, long_s: f64, beside: f64, speeds: [f64; 2]) -> Path {
        let (sign, speed) = (rng.sign(), rng.range(speeds[0], speeds[1]));
        let (t, ahead) = (rng.range(0.0, long_s), rng.range(-40.0, 45.0));
        let station = self.speed * t + ahead - sign * speed * t;
        self.axis.follow([station, -sign * beside], sign, speed, long_s + CONTINUATION_S)
    }

    /// On the footpath of either side, in either direction.
    fn walking(&self, rng: &mut Rng, long_s: f64) -> Path {
        let path = self.half + rng.range(0.4, PATH_M - 0.3);
        let beside = path * rng.sign();
        self.driving(rng, long_s, beside, [0.8, 1.8])
    }

    /// A car on a driveway, and one by the road.
    fn parked(&self, crowd: &mut Crowd, [station, side]: [f64; 2]) {
        let out = if crowd.rng.chance(0.4) { 0.0 } else { PI };
        let [x, y, yaw] = self.at(station, side, crowd.rng.range(2.6, 3.2));
        if crowd.rng.chance(0.6) {
            crowd.park(models::car, Path::stationary(x, y, yaw + side * FRAC_PI_2 + out));
        }
        if crowd.rng.chance(0.4) {
            let [x, y, yaw] = self.axis.at(station - 8.0, side * (self.half + 0.1));
            crowd.park(models::car, Path::stationary(x, y, yaw));
        }
    }

    /// Out of a driveway in reverse, a stop on the road, and off.
    fn backing(&self, rng: &mut Rng, long_s: f64) -> Path {
        let near = |d: &&[f64; 2]| (d[0] - 0.5 * self.speed * long_s).abs() < 35.0;
        let drives: Vec<_> = self.drives.iter().filter(near).collect();
        let [station, side] = *drives[(rng.unit() * drives.len() as f64) as usize];
        let [x, y, yaw] = self.at(station, side, 3.0);
        let (speed, sign) = (rng.range(1.0, 2.0), rng.sign());
        let begin = rng.range(-3.0, 0.6 * long_s);
        let state = State { x, y, yaw: yaw + side * FRAC_PI_2, speed: 0.0 };
        let path = Path::starting(begin, state).then(1.0, -speed, 0.0);
        let path = path.then(rng.range(2.0, 3.5) / speed, 0.0, 0.0);
        let path = path.then(FRAC_PI_2 * 4.5 / speed, 0.0, sign / 4.5);
        path.then(1.0, speed, 0.0).then(1.0, 0.0, 0.0).then(2.5, 1.5, 0.0)
    }
}

/// A roof for a house of this size: a beam that lies on one of its edges.
fn roof(site: &mut Site, [x, y, yaw]: [f64; 3], [long, deep, high]: [f64; 3]) {
    let slant = deep / 2.0f64.sqrt();
    let turn = DQuat::from_rotation_z(yaw) * DQuat::from_rotation_x(FRAC_PI_4);
    let at = DVec3::new(x, y, site.ground.height(x, y) + high);
    let shape = Shape::cuboid(long + 0.6, slant, slant);
    site.fix(Class::Building, shape, Pose::new(turn, at), Surface::matt(0.25));
}

/// A plant or an object in a garden.
fn in_garden(site: &mut Site, at: [f64; 3]) {
    let [x, y, _] = at;
    match site.count(0, 9) {
        0 | 1 => site.forked_tree([x, y]),
        2 => site.column_tree([x, y]),
        3..6 => site.spread_bush([x, y]),
        6 => site.block(Class::Fixture, at, [1.6, 0.5, 1.1], Surface::matt(0.35)),
        7 => swing(site, at),
        _ => trampoline(site, [x, y]),
    }
}

/// Two pairs of slanted legs and a beam.
fn swing(site: &mut Site, [x, y, yaw]: [f64; 3]) {
    let ((s, c), wood) = (yaw.sin_cos(), Surface::matt(0.35));
    for (end, leg) in [(-1.0, -0.6), (-1.0, 0.6), (1.0, -0.6), (1.0, 0.6)] {
        let top = [x + end * c, y + end * s, 2.0];
        let foot = [top[0] - leg * s, top[1] + leg * c, 0.0];
        site.bar(Class::Fixture, [foot, top], 0.04, wood);
    }
    site.raised(Class::Fixture, [x, y, yaw], [2.2, 0.08, 0.08], 2.0, wood);
}

/// A round net.
fn trampoline(site: &mut Site, [x, y]: [f64; 2]) {
    let z = site.ground.height(x, y) + 1.5;
    let (net, shape) = (Surface::porous(0.3, 0.75), Shape::cylinder(1.3, 1.6));
    site.fix(Class::Fixture, shape, Pose::planar(x, y, z, 0.0), net);
}

impl Layout for Residential {
    fn ground(&self) -> Ground {
        let edge = self.half + PATH_M;
        let [right, left] = self.gardens;
        // A dropped kerb, and gardens that slope behind the footpath.
        let points = vec![
            [-edge - 2.5, 0.09 + right],
            [-edge, 0.09],
            [-self.half - 0.25, 0.09],
            [-self.half, 0.0],
            [self.half, 0.0],
            [self.half + 0.25, 0.09],
            [edge, 0.09],
            [edge + 2.5, 0.09 + left],
        ];
        let terms = vec![Term::Banks(self.axis, points), Term::Wave(self.wave)];
        Ground::of(Relief { terms, paved: (self.axis, edge) })
    }

    fn vehicle(&self) -> Path {
        let lane = -0.5 * self.half;
        if !self.stops {
            return self.axis.follow([0.0, lane], 1.0, self.speed, LONG_S);
        }
        Path::from(self.axis.state([0.0, lane], 1.0, self.speed))
            .then(1.5, 0.0, 0.0)
            .then_to_speed(0.0, 2.0, EASE_S)
            .then(1.0, 0.0, 0.0)
            .then_to_speed(self.speed, 1.5, EASE_S)
    }

    fn furnish(&self, site: &mut Site) {
        self.lamps(site);
        for (plot, drive) in self.plots.iter().zip(&self.drives) {
            self.border(site, *plot);
            self.house(site, *plot);
            self.garage(site, *drive, plot.garden);
            self.garden(site, *plot);
        }
    }

    fn populate(&self, crowd: &mut Crowd) {
        let lane = 0.5 * self.half;
        crowd.add(2.0, models::car, |r, t| self.backing(r, t));
        let drivers: [(f64, Model); 4] = [
            (4.0, models::car),
            (1.0, models::van),
            (0.6, models::truck),
            (1.0, models::motorcycle),
        ];
        for (amount, model) in drivers {
            crowd.add(amount, model, |r, t| self.driving(r, t, lane, [3.0, 11.0]));
        }
        crowd.add(4.0, models::cyclist, |r, t| self.driving(r, t, self.half - 0.7, [2.5, 6.0]));
        crowd.add(10.0, models::pedestrian, |r, t| self.walking(r, t));
        for &drive in &self.drives {
            self.parked(crowd, drive);
        }
    }
}
