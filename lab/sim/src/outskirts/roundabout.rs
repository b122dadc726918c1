//! A roundabout: traffic circles a planted mound, arrives and leaves on its arms; cyclists go
//! around.

use super::crowd::{Crowd, Model};
use super::site::{Site, away};
use super::{Layout, VIEW_M};
use crate::bend::Bend;
use crate::ground::Ground;
use crate::models;
use crate::object::{Class, Surface};
use crate::path::{EASE_S, Path, State};
use crate::relief::{Relief, Term};
use crate::rng::Rng;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Distance of a lane's centre from the middle of an arm, m.
const LANE_M: f64 = 1.8;
/// Half width of an arm, m.
const ARM_M: f64 = 3.7;
/// How much longer than a drive a path lasts, s.
const CONTINUATION_S: f64 = 20.0;

pub(super) struct Roundabout {
    /// Radii of the mound, the middle of the ring and its outer edge, m.
    radii: [f64; 3],
    height: f64,
    /// Headings of the arms, outwards, rad.
    arms: Vec<f64>,
    wave: [f64; 3],
    /// The vehicle's course, its speed and the angle at which it begins.
    vehicle: (Course, f64, f64),
}

#[derive(Clone, Copy)]
enum Course {
    /// Round and round.
    Circles,
    /// Arrives on an arm and stops before the ring.
    Yields,
    /// Arrives on an arm and enters the ring.
    Enters,
}

/// Time along an arc of this angle and radius.
fn arc_s(angle: f64, radius: f64, speed: f64) -> f64 {
    angle * radius / speed
}

/// A place at this angle and distance from the middle.
fn around_middle(angle: f64, far: f64) -> [f64; 2] {
    away([0.0; 2], angle, far)
}

impl Roundabout {
    pub(super) fn drawn(rng: &mut Rng) -> Roundabout {
        let mound = rng.range(6.0, 13.0);
        let wide = rng.range(5.5, 7.5);
        let count = if rng.chance(0.4) { 3 } else { 4 };
        let first = rng.range(0.0, TAU);
        let arm = |n: u32| first + TAU * f64::from(n) / f64::from(count);
        let arms: Vec<f64> = (0..count).map(|n| arm(n) + rng.range(-0.15, 0.15)).collect();
        let course = match (rng.unit() * 5.0) as u32 {
            0 | 1 => Course::Circles,
            2 => Course::Yields,
            _ => Course::Enters,
        };
        let begin = match course {
            Course::Circles => rng.range(0.0, TAU),
            _ => arms[0],
        };
        Roundabout {
            radii: [mound, mound + 0.5 * wide, mound + wide],
            height: rng.range(0.7, 2.2),
            arms,
            wave: [rng.range(0.0, 0.4), rng.range(60.0, 150.0), rng.range(0.0, TAU)],
            vehicle: (course, rng.range(4.5, 7.5), begin),
        }
    }

    /// A place on an arm: this far out, and this far to the left when looking outwards.
    fn on_arm(&self, arm: f64, out: f64, left: f64) -> [f64; 2] {
        let (s, c) = arm.sin_cos();
        [out * c - left * s, out * s + left * c]
    }

    /// Counter-clockwise around the middle for this long.
    fn circling(&self, angle: f64, away: f64, speed: f64, long_s: f64) -> Path {
        let [x, y] = around_middle(angle, away);
        let start = State { x, y, yaw: angle + FRAC_PI_2, speed };
        Path::from(start).then(long_s, 0.0, 1.0 / away)
    }

    /// Radius of the curves into and out of the ring, m; the distance out at which they meet the
    /// arm's lane, and the angle around the middle that they span.
    fn bend(&self) -> (f64, f64, f64) {
        let (radius, aside) = (12.0, LANE_M + 12.0);
        let out = ((self.radii[1] + radius).powi(2) - aside * aside).max(1.0).sqrt();
        (radius, out, aside.atan2(out))
    }

    /// In on an arm, which it follows for `wait_s`, and around.
    fn entering(&self, arm: f64, speed: f64, wait_s: f64, round_s: f64, eased: bool) -> Path {
        let (radius, out, about) = self.bend();
        let [x, y] = self.on_arm(arm, out + speed * wait_s, LANE_M);
        let start = Path::from(State { x, y, yaw: arm + PI, speed }).then(wait_s, 0.0, 0.0);
        let angle = FRAC_PI_2 - about;
        let round = 1.0 / self.radii[1];
        match eased {
            true => start.then_turn(-angle, radius, EASE_S).then_turn(
                speed * round_s * round,
                self.radii[1],
                EASE_S,
            ),
            false => start
                .then(arc_s(angle, radius, speed), 0.0, -1.0 / radius)
                .then(round_s, 0.0, round),
        }
    }

    /// Around for this long, then out on an arm.
    fn leaving(&self, arm: f64, speed: f64, round_s: f64) -> Path {
        let (radius, _, about) = self.bend();
        let angle = arm - about - round_s * speed / self.radii[1];
        self.circling(angle, self.radii[1], speed, round_s).then(
            arc_s(FRAC_PI_2 - about, radius, speed),
            0.0,
            -1.0 / radius,
        )
    }

    /// In on an arm, slowing down to wait before the ring.
    fn yielding(&self, arm: f64, speed: f64, before_s: f64, rate: f64) -> Path {
        let stop = self.radii[2] + 4.5;
        let braking = 0.5 * speed * speed / rate + 0.5 * speed * EASE_S;
        let [x, y] = self.on_arm(arm, stop + braking + speed * before_s, LANE_M);
        let start = Path::from(State { x, y, yaw: arm + PI, speed });
        start.then(before_s, 0.0, 0.0).then_to_speed(0.0, rate, EASE_S)
    }

    /// Plants and objects on the mound.
    fn island(&self, site: &mut Site) {
        for _ in 0..site.count(4, 22) {
            let far = (self.radii[0] - 1.5) * site.rng.unit().sqrt();
            let at = around_middle(site.rng.range(0.0, TAU), far);
            match site.count(0, 6) {
                0 => site.forked_tree(at),
                1 => site.column_tree(at),
                _ => site.spread_bush(at),
            }
        }
        if site.rng.chance(0.5) {
            self.sculpture(site);
        }
    }

    /// A few slanting slabs.
    fn sculpture(&self, site: &mut Site) {
        for n in 0..site.count(2, 5) {
            let [x, y] = around_middle(f64::from(n) * 2.1, 1.2);
            let (size, yaw) = ([0.3, 1.2, site.rng.range(1.5, 4.0)], site.rng.range(0.0, PI));
            site.block(Class::Fixture, [x, y, yaw], size, Surface::matt(0.5));
        }
    }

    /// Signs showing the way around, facing each arm.
    fn signs(&self, site: &mut Site) {
        for &arm in &self.arms {
            let [x, y] = around_middle(arm, self.radii[0] - 0.6);
            site.post(Class::Pole, [x, y], [0.04, 1.0]);
            site.raised(Class::Pole, [x, y, arm], [0.05, 0.7, 0.7], 0.9, Surface::matt(1.0));
        }
    }

    /// Kerb stones around the ring, where no arm meets it.
    fn kerbs(&self, site: &mut Site) {
        for away in [self.radii[0] - 0.2, self.radii[2] + 0.3] {
            let count = (TAU * away).round() as u32;
            for n in 0..count {
                let angle = TAU * f64::from(n) / f64::from(count);
                let gap = self.off_arm(angle, away);
                if away < self.radii[1] || gap > ARM_M + 2.5 {
                    let [x, y] = around_middle(angle, away);
                    let at = [x, y, angle + FRAC_PI_2];
                    site.block(Class::Ground, at, [1.0, 0.25, 0.11], Surface::matt(0.4));
                }
            }
        }
    }

    /// Distance of a place from the nearest arm's middle, m.
    fn off_arm(&self, angle: f64, away: f64) -> f64 {
        let aside = |arm: &f64| {
            let turned = angle - arm;
            if turned.cos() > 0.0 { away * turned.sin().abs() } else { f64::INFINITY }
        };
        self.arms.iter().map(aside).fold(f64::INFINITY, f64::min)
    }

    /// Railings, houses, hedges and lamps between the arms.
    fn corners(&self, site: &mut Site) {
        for _ in 0..140 {
            let angle = site.rng.range(0.0, TAU);
            let away = self.radii[2] + 6.5 + 75.0 * site.rng.unit();
            let aside = self.off_arm(angle, away);
            let [x, y] = around_middle(angle, away);
            match site.count(0, 12) {
                0..3 if aside > ARM_M + 3.5 => site.forked_tree([x, y]),
                3..6 if aside > ARM_M + 3.0 => site.spread_bush([x, y]),
                6 | 7 if aside > ARM_M + 4.5 => {
                    let size = [site.rng.range(3.0, 9.0), 0.9, site.rng.range(0.8, 1.9)];
                    site.trimmed_hedge([x, y, angle + FRAC_PI_2], size);
                }
                8 | 9 if aside > ARM_M + 16.0 && away > self.radii[2] + 18.0 => {
                    let size = [site.rng.range(8.0, 14.0), 11.0, site.rng.range(4.0, 12.0)];
                    let wall = Surface::matt(site.rng.range(0.25, 0.6));
                    site.block(Class::Building, [x, y, angle], size, wall);
                }
                _ => {}
            }
        }
    }

    /// Railings beside the arms and lamps along them.
    fn arm_sides(&self, site: &mut Site, arm: f64) {
        for side in [-1.0, 1.0] {
            let beside = side * (ARM_M + 3.4);
            let mut out = self.radii[2] + 7.0;
            let end = out + site.rng.range(6.0, 30.0);
            while out < end {
                let [x, y] = self.on_arm(arm, out, beside);
                site.post(Class::Fixture, [x, y], [0.03, 1.0]);
                for lift in [0.5, 0.95] {
                    let [x, y] = self.on_arm(arm, out + 0.75, beside);
                    let at = [x, y, arm];
                    site.raised(Class::Fixture, at, [1.5, 0.05, 0.05], lift, Surface::matt(0.5));
                }
                out += 1.5;
            }
            let [x, y] = self.on_arm(arm, self.radii[2] + 12.0, beside + side);
            site.post(Class::Pole, [x, y], [0.1, 8.0]);
        }
    }
}

impl Roundabout {
    fn any_arm(&self, rng: &mut Rng) -> f64 {
        self.arms[(rng.unit() * self.arms.len() as f64) as usize]
    }

    /// Vehicles on the ring, arriving, leaving and waiting. All on the ring are as fast as the
    /// vehicle, so that none catches up with another.
    fn driving(&self, crowd: &mut Crowd, amount: f64, model: Model) {
        let (speed, on_s) = (self.vehicle.1, crowd.duration_s + CONTINUATION_S);
        crowd.add(0.5 * amount, model, |r, _| {
            self.circling(r.range(0.0, TAU), self.radii[1], speed, on_s)
        });
        crowd.add(amount, model, |r, t| {
            self.entering(self.any_arm(r), speed, r.range(0.0, t.max(3.0)), on_s, false)
        });
        crowd.add(amount, model, |r, t| {
            self.leaving(self.any_arm(r), speed, r.range(0.0, t.max(3.0)))
        });
        crowd.add(0.7 * amount, model, |r, t| {
            self.yielding(self.any_arm(r), r.range(4.0, 10.0), r.range(0.0, 0.5 * t), 2.5)
        });
    }

    /// Along an arm, or across it.
    fn walking(&self, rng: &mut Rng, duration_s: f64) -> Path {
        let (arm, speed, sign) = (self.any_arm(rng), rng.range(0.8, 1.9), rng.sign());
        let gone = speed * rng.range(0.0, duration_s);
        let (out, left, yaw) = match rng.chance(0.5) {
            true => (rng.range(25.0, 60.0) - sign * gone, rng.sign() * (ARM_M + 2.0), 0.0),
            false => (self.radii[2] + 5.5, -sign * gone, FRAC_PI_2),
        };
        let [x, y] = self.on_arm(arm, out, left);
        let yaw = arm + yaw + if sign < 0.0 { PI } else { 0.0 };
        Path::from(State { x, y, yaw, speed })
    }
}

impl Layout for Roundabout {
    fn ground(&self) -> Ground {
        let [mound, ..] = self.radii;
        let terms = vec![Term::Mound([0.0; 2], mound - 0.4, self.height), Term::Wave(self.wave)];
        // Rough nowhere: the mound is covered with plants.
        Ground::of(Relief { terms, paved: (Bend { curvature: 0.0 }, VIEW_M) })
    }

    fn vehicle(&self) -> Path {
        let (course, speed, begin) = self.vehicle;
        match course {
            Course::Circles => self.circling(begin, self.radii[1], speed, 1e4),
            Course::Yields => self.yielding(begin, speed, 1.0, 2.0),
            Course::Enters => self.entering(begin, speed, 1.5, 1e4, true),
        }
    }

    fn furnish(&self, site: &mut Site) {
        self.island(site);
        self.signs(site);
        self.kerbs(site);
        self.corners(site);
        for &arm in &self.arms {
            self.arm_sides(site, arm);
        }
    }

    fn populate(&self, crowd: &mut Crowd) {
        let kinds: [(f64, Model); 4] =
            [(1.0, models::bus), (5.0, models::car), (2.0, models::van), (1.0, models::motorcycle)];
        kinds.iter().for_each(|&(amount, model)| self.driving(crowd, amount, model));
        let on_s = crowd.duration_s + CONTINUATION_S;
        crowd.add(6.0, models::cyclist, |r, _| {
            let (angle, away) = (r.range(0.0, TAU), self.radii[2] + r.range(1.4, 2.4));
            self.circling(angle, away, r.range(2.5, 5.0), on_s)
        });
        crowd.add(12.0, models::pedestrian, |r, t| self.walking(r, t));
    }
}
