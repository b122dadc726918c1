//! Traffic: parked and moving cars and vans, cyclists and pedestrians, on paths that keep clear
//! of each other and of the vehicle that carries the sensor.

use crate::ego::{LANE, Plan};
use crate::ground::{CROSS_HALF, ROAD_HALF};
use crate::models;
use crate::object::{Fixture, Object};
use crate::path::{Path, State};
use crate::rng::Rng;
use crate::scene::Scene;
use crate::shape::Shape;
use crate::street::Extent;
use std::f64::consts::{FRAC_PI_2, PI};

type Model = fn(u32, Path, &mut Rng) -> Object;

/// Times at which paths are compared, s apart.
const CHECK_S: f64 = 0.2;
/// Tries to find a clear path for somebody.
const TRIES: u32 = 12;

/// Fills the scene with traffic; `density` 1 is a busy street.
pub(crate) fn fill(
    scene: &mut Scene,
    extent: Extent,
    plan: &Plan,
    duration_s: f64,
    density: f64,
    rng: &mut Rng,
) {
    let mut taken = vec![Footprint::new(&plan.path, 4.6, 1.9, duration_s)];
    taken.extend(scene.fixtures.iter().filter_map(|fixture| obstacle(fixture, duration_s)));
    let mut fill = Fill { scene, plan, duration_s, taken, rng };
    fill.park(extent.x, density);
    let amount =
        |fixed: f64, per_second: f64| (density * (fixed + per_second * duration_s)).round() as u32;
    for _ in 0..amount(12.0, 0.7) {
        let model: Model = if fill.rng.chance(0.75) { models::car } else { models::van };
        fill.mover(model, Fill::driver);
    }
    for _ in 0..amount(4.0, 0.2) {
        fill.mover(models::cyclist, Fill::rider);
    }
    for _ in 0..amount(15.0, 0.5) {
        fill.mover(models::pedestrian, Fill::walker);
    }
}

/// Footprint of what somebody could walk into: poles, bins and cabinets. Whatever is longer stands
/// where no path leads, and crowns hang above.
fn obstacle(fixture: &Fixture, duration_s: f64) -> Option<Footprint> {
    let width = match fixture.shape {
        Shape::Cylinder { radius, .. } => 2.0 * radius,
        Shape::Cuboid { half } if half.x < 1.0 => 2.0 * half.y,
        _ => return None,
    };
    let length = if let Shape::Cuboid { half } = fixture.shape { 2.0 * half.x } else { width };
    let at = fixture.pose.translation;
    Some(Footprint::new(&Path::standing(at.x, at.y, 0.0), length, width, duration_s))
}

/// Discs that cover an object over time.
struct Footprint {
    /// Centres per time, then along the object, m.
    centres: Vec<Vec<[f64; 2]>>,
    radius: f64,
}

impl Footprint {
    fn new(path: &Path, length: f64, width: f64, duration_s: f64) -> Footprint {
        let count = (length / width).ceil().max(1.0);
        let discs = |t: f64| {
            let state = path.at(t);
            let (s, c) = state.yaw.sin_cos();
            let along = |i: u32| (f64::from(i) + 0.5) / count * length - 0.5 * length;
            (0..count as u32).map(|i| [state.x + c * along(i), state.y + s * along(i)]).collect()
        };
        let steps = (duration_s / CHECK_S).ceil() as u32 + 1;
        let centres = (0..steps).map(|i| discs(f64::from(i) * CHECK_S)).collect();
        Footprint { centres, radius: 0.5 * width + 0.15 }
    }

    fn touches(&self, other: &Footprint) -> bool {
        let apart = (self.radius + other.radius).powi(2);
        let near =
            |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) < apart;
        let mut times = self.centres.iter().zip(&other.centres);
        times.any(|(a, b)| a.iter().any(|p| b.iter().any(|q| near(p, q))))
    }
}

struct Fill<'a> {
    scene: &'a mut Scene,
    plan: &'a Plan,
    duration_s: f64,
    taken: Vec<Footprint>,
    rng: &'a mut Rng,
}

impl Fill<'_> {
    /// Adds the object if its path is clear.
    fn offer(&mut self, model: Model, path: Path) -> bool {
        let object = model(self.scene.objects.len() as u32 + 1, path, self.rng);
        let footprint =
            Footprint::new(&object.path, object.size[0], object.size[1], self.duration_s);
        if self.taken.iter().any(|other| footprint.touches(other)) {
            return false;
        }
        self.taken.push(footprint);
        self.scene.objects.push(object);
        true
    }

    fn mover(&mut self, model: Model, path: fn(&mut Self) -> Path) {
        for _ in 0..TRIES {
            let path = path(self);
            if self.offer(model, path) {
                return;
            }
        }
    }

    /// Parked vehicles on both parking strips, away from the crossing.
    fn park(&mut self, x: [f64; 2], density: f64) {
        for side in [-1.0, 1.0] {
            let mut at = x[0];
            while at < x[1] {
                at += self.rng.range(5.4, 7.5);
                if !self.rng.chance(0.5 * density)
                    || (at - self.plan.crossing).abs() < CROSS_HALF + 8.0
                {
                    continue;
                }
                let against = if self.rng.chance(0.15) { PI } else { 0.0 };
                let yaw = if side < 0.0 { 0.0 } else { PI } + against + 0.03 * self.rng.bell();
                let y = side * (ROAD_HALF - 1.1 + self.rng.range(-0.08, 0.08));
                let model: Model = if self.rng.chance(0.8) { models::car } else { models::van };
                self.offer(model, Path::standing(at, y, yaw));
            }
        }
    }

    /// A time during the drive and a place abeam of the vehicle's then.
    fn meeting(&mut self) -> (f64, f64) {
        let t = self.rng.range(0.0, self.duration_s);
        let reach = 20.0 + 45.0 * self.rng.unit();
        (t, self.plan.path.at(t).x + self.rng.range(-reach, reach))
    }

    /// A vehicle in either lane of the main road, on the crossing road, or turning.
    fn driver(&mut self) -> Path {
        match (self.rng.unit() * 20.0) as u32 {
            0..10 => self.along(LANE, 2.0, 18.0),
            10..14 => self.changing(),
            14..17 => self.turning(),
            _ => self.crossing(LANE, 4.0, 12.0),
        }
    }

    fn rider(&mut self) -> Path {
        if self.rng.chance(0.75) { self.along(3.1, 3.0, 6.0) } else { self.crossing(3.2, 3.0, 6.0) }
    }

    /// Straight along the main road, `beside` its centre line.
    fn along(&mut self, beside: f64, slow: f64, fast: f64) -> Path {
        let (t, x) = self.meeting();
        let (way, speed) = (self.rng.sign(), self.rng.range(slow, fast));
        Path::from(State { x: x - way * speed * t, ..lane(way, beside, speed) })
    }

    /// Brakes or speeds up, beginning when it meets the vehicle.
    fn changing(&mut self) -> Path {
        let (t, x) = self.meeting();
        let (way, speed) = (self.rng.sign(), self.rng.range(3.0, 14.0));
        let later = if self.rng.chance(0.6) {
            self.rng.range(0.0, 0.6 * speed)
        } else {
            self.rng.range(speed, 15.0f64.max(speed))
        };
        let rate = self.rng.range(1.0, 4.0);
        let start = State { x: x - way * speed * t, ..lane(way, LANE, speed) };
        // Half begin before the drive does.
        let begin = (t - self.rng.range(0.0, 2.0)).max(0.0);
        let path = Path::from(start).then(begin, 0.0, 0.0);
        path.then_to_speed(if later < 0.8 { 0.0 } else { later }, rate)
    }

    /// From the main road into the crossing road, at constant yaw rate.
    fn turning(&mut self) -> Path {
        let (way, speed) = (self.rng.sign(), self.rng.range(3.5, 6.5));
        let left = self.rng.chance(0.4);
        let (radius, angle) = if left { (11.0, FRAC_PI_2) } else { (8.0, -FRAC_PI_2) };
        let before = self.rng.range(0.0, self.duration_s.max(2.0));
        // Relative to the crossing and along the way: where the turn begins so that it ends in
        // the right lane.
        let begin = if left { LANE - radius } else { -LANE - radius };
        let x = self.plan.crossing + way * (begin - speed * before);
        let start = State { x, ..lane(way, LANE, speed) };
        Path::from(start).then(before, 0.0, 0.0).then_turn(angle, radius)
    }

    /// Along the crossing road.
    fn crossing(&mut self, beside: f64, slow: f64, fast: f64) -> Path {
        let (way, speed) = (self.rng.sign(), self.rng.range(slow, fast));
        let t = self.rng.range(-2.0, self.duration_s + 2.0);
        let state = State {
            x: self.plan.crossing + way * beside,
            y: -way * speed * t,
            yaw: way * FRAC_PI_2,
            speed,
        };
        Path::from(state)
    }

    /// On a sidewalk, standing there, or crossing the main road.
    fn walker(&mut self) -> Path {
        let (t, x) = self.meeting();
        let (way, side) = (self.rng.sign(), self.rng.sign());
        let speed = self.rng.range(0.8, 2.0);
        let y = side * (ROAD_HALF + self.rng.range(1.4, 3.2));
        let yaw = if way > 0.0 { 0.0 } else { PI };
        match (self.rng.unit() * 10.0) as u32 {
            0 => Path::standing(x, y, self.rng.range(-PI, PI)),
            1..4 => {
                let before = t * self.rng.unit();
                let start = State { x: x - way * speed * before, y, yaw, speed };
                // Left or right by a quarter onto the road, back along the other sidewalk.
                let quarter = -side * way * FRAC_PI_2;
                let path = Path::from(start).then(before, 0.0, 0.0).then_turn(quarter, 0.8);
                let over = 2.0 * (y.abs() - 0.8);
                path.then(over / speed, 0.0, 0.0).then_turn(-quarter, 0.8)
            }
            _ => Path::from(State { x: x - way * speed * t, y, yaw, speed }),
        }
    }
}

/// Start in a lane of the main road, heading along +x or -x, on the right side of it.
fn lane(way: f64, beside: f64, speed: f64) -> State {
    State { x: 0.0, y: -way * beside, yaw: if way > 0.0 { 0.0 } else { PI }, speed }
}
