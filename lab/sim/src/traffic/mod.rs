//! Traffic: vehicles of all kinds, parked and moving, and pedestrians, on paths that keep clear of
//! each other and of the vehicle that carries the sensors.

mod footprint;
mod routes;

use crate::dimensions::{CROSS_HALF, Section, VEHICLE};
use crate::ego::{Pace, Plan};
use crate::models;
use crate::object::Object;
use crate::path::Path;
use crate::rng::Rng;
use crate::street::{Background, Extent};
use footprint::{Footprint, obstacle};
use routes::{GROUP_M, Routes};
use std::f64::consts::PI;

type Model = fn(u32, Path, &mut Rng) -> Object;

/// Attempts at finding a clear path for an object.
const TRIES: u32 = 12;

/// Kinds of drivers: share of all drivers, model, and whether it is short enough to turn.
const DRIVERS: [(f64, Model, bool); 6] = [
    (0.62, models::car, true),
    (0.12, models::van, true),
    (0.07, models::motorcycle, true),
    (0.09, models::truck, false),
    (0.05, models::bus, false),
    (0.05, models::tram, false),
];

/// Traffic on this street, by ascending id from 1; `density` 1 is a busy street.
pub(crate) fn fill(
    street: &Background,
    extent: Extent,
    plan: &Plan,
    duration_s: f64,
    density: f64,
    rng: &mut Rng,
) -> Vec<Object> {
    let mut taken = vec![Footprint::new(&plan.path, VEHICLE[0], VEHICLE[1], duration_s)];
    taken.extend(street.fixtures.iter().filter_map(obstacle));
    let mut fill = Fill { objects: Vec::new(), plan, duration_s, taken, rng };
    fill.park(extent.x, density);
    fill.park_beside_houses(&street.driveways, density);
    let amount =
        |fixed: f64, per_second: f64| (density * (fixed + per_second * duration_s)).round() as u32;
    // Those that need the most room first.
    for _ in 0..amount(2.0, 0.2) {
        fill.overtaking();
    }
    for _ in 0..amount(12.0, 0.8) {
        fill.driver();
    }
    for _ in 0..amount(5.0, 0.2) {
        fill.mover(models::cyclist, |r| r.rider());
    }
    if plan.pace == Pace::Crowd {
        for _ in 0..amount(40.0, 1.0) {
            fill.group();
        }
        return fill.objects;
    }
    let slow = plan.pace == Pace::Slow;
    let people = if slow { amount(24.0, 0.8) } else { amount(16.0, 0.5) };
    for _ in 0..people {
        let walker = fill.mover(models::pedestrian, |r| r.walker());
        if let Some(path) = walker.filter(|_| slow) {
            fill.companion(path);
        }
    }
    fill.objects
}

struct Fill<'a> {
    objects: Vec<Object>,
    plan: &'a Plan,
    duration_s: f64,
    taken: Vec<Footprint>,
    rng: &'a mut Rng,
}

impl Fill<'_> {
    /// Adds the object if its path is clear.
    fn try_add(&mut self, model: Model, path: Path) -> bool {
        let object = model(self.objects.len() as u32 + 1, path, self.rng);
        let footprint =
            Footprint::new(&object.path, object.size[0], object.size[1], self.duration_s);
        if self.taken.iter().any(|other| footprint.touches(other)) {
            return false;
        }
        self.taken.push(footprint);
        self.objects.push(object);
        true
    }

    fn routes(&mut self) -> Routes<'_> {
        Routes { plan: self.plan, duration_s: self.duration_s, rng: self.rng }
    }

    /// Tries paths until one is clear; returns that one, if any.
    fn mover(&mut self, model: Model, route: impl Fn(&mut Routes) -> Path) -> Option<Path> {
        (0..TRIES).find_map(|_| {
            let path = route(&mut self.routes());
            self.try_add(model, path.clone()).then_some(path)
        })
    }

    /// Someone walking with another, half a metre to a metre to the side, if there is room.
    fn companion(&mut self, path: Path) {
        let beside = self.rng.sign() * self.rng.range(0.55, 1.0);
        self.try_add(models::pedestrian, path.moved(0.0, beside));
    }

    /// People who stand or stroll together, or one alone, if there is room.
    fn group(&mut self) {
        let Some(path) = self.mover(models::pedestrian, |r| r.stroller()) else { return };
        for _ in 0..(self.rng.unit() * 5.0) as u32 {
            let [x, y] = [0; 2].map(|_| self.rng.range(-GROUP_M, GROUP_M));
            self.try_add(models::pedestrian, path.clone().moved(x, y));
        }
    }

    /// One of [`DRIVERS`].
    fn draw(&mut self) -> (Model, bool) {
        let mut left = self.rng.unit();
        let drawn = DRIVERS.iter().find(|(share, ..)| {
            left -= share;
            left < 0.0
        });
        drawn.map_or((models::car, true), |(_, model, nimble)| (*model, *nimble))
    }

    /// A vehicle on the main road, on the crossing road, or between the two.
    fn driver(&mut self) {
        let (model, nimble) = self.draw();
        self.mover(model, |r| r.driver(nimble));
    }

    /// A slow vehicle and a car that passes it; in one case in three the slow one is the vehicle
    /// that carries the sensors, if that is in the outer lane.
    fn overtaking(&mut self) {
        let is_outer = self.plan.lane == self.plan.section.outer_lane();
        let slow = if self.rng.chance(0.33) && is_outer {
            Some(self.plan.path.clone())
        } else {
            let (model, _) = self.draw();
            self.mover(model, |r| r.along(r.plan.section.outer_lane(), 2.5, 6.5))
        };
        if let Some(slow) = slow {
            self.mover(models::car, |r| r.past(&slow));
        }
    }

    /// Cars in some of these places.
    fn park_beside_houses(&mut self, driveways: &[Path], density: f64) {
        for place in driveways {
            if self.rng.chance(0.6 * density) {
                self.try_add(models::car, place.clone());
            }
        }
    }

    /// Parked vehicles on both parking strips, away from the crossing; where there are none, a few
    /// stand half on the sidewalk.
    fn park(&mut self, x: [f64; 2], density: f64) {
        let section = self.plan.section;
        let (share, aside) = if section == Section::WIDE { (0.5, 1.1) } else { (0.1, 0.5) };
        for side in [-1.0, 1.0] {
            let mut at = x[0];
            while at < x[1] {
                at += self.rng.range(5.4, 7.5);
                if !self.rng.chance(share * density)
                    || (at - self.plan.crossing).abs() < CROSS_HALF + 8.0
                {
                    continue;
                }
                let against = if self.rng.chance(0.15) { PI } else { 0.0 };
                let yaw = if side < 0.0 { 0.0 } else { PI } + against + 0.03 * self.rng.bell();
                let y = side * (section.road_half - aside + self.rng.range(-0.08, 0.08));
                let model: Model = match (self.rng.unit() * 20.0) as u32 {
                    0..16 => models::car,
                    16..19 => models::van,
                    _ => models::truck,
                };
                self.try_add(model, Path::stationary(at, y, yaw));
            }
        }
    }
}

#[cfg(test)]
mod tests;
