//! Paths of traffic: along, across, turning, braking, overtaking.

use crate::dimensions::LANE;
use crate::ego::{Pace, Plan};
use crate::path::{EASE_S, Path, State};
use crate::rng::Rng;
use std::f64::consts::{FRAC_PI_2, PI};

/// Time over which a pedestrian's turn builds up and fades, s.
const WALKER_EASE_S: f64 = 0.4;

/// How far from the first of a group the others walk, along either axis, m.
pub(super) const GROUP_M: f64 = 1.5;

/// Draws paths that meet the vehicle's during a drive.
pub(super) struct Routes<'a> {
    pub(super) plan: &'a Plan,
    pub(super) duration_s: f64,
    pub(super) rng: &'a mut Rng,
}

impl Routes<'_> {
    /// A time during the drive, and an x near the vehicle's at that time.
    fn meeting(&mut self) -> (f64, f64) {
        let t = self.rng.range(0.0, self.duration_s);
        let reach = 20.0 + 45.0 * self.rng.unit();
        (t, self.plan.path.at(t).x + self.rng.range(-reach, reach))
    }

    /// Path of a driver, in a vehicle short enough to turn (`nimble`) or not.
    pub(super) fn driver(&mut self, nimble: bool) -> Path {
        match (self.plan.pace, nimble) {
            (Pace::Fast, true) => self.fast(36.0),
            (Pace::Fast, false) => self.fast(25.0),
            (Pace::Slow | Pace::Crowd, _) => self.creeping(),
            (Pace::Town, true) => self.nimble(),
            (Pace::Town, false) => self.heavy(),
        }
    }

    /// In either lane of the main road, on the crossing road, or turning.
    fn nimble(&mut self) -> Path {
        match (self.rng.unit() * 20.0) as u32 {
            0..10 => self.along(LANE, 2.0, 18.0),
            10..14 => self.changing([3.0, 14.0]),
            14..17 => self.turning(),
            _ => self.crossing(LANE, 4.0, 12.0),
        }
    }

    /// Vehicles too long to turn stay on their road.
    fn heavy(&mut self) -> Path {
        match (self.rng.unit() * 20.0) as u32 {
            0..11 => self.along(LANE, 2.0, 13.0),
            11..16 => self.changing([3.0, 14.0]),
            _ => self.crossing(LANE, 4.0, 10.0),
        }
    }

    /// At out-of-town speeds, on either road.
    fn fast(&mut self, fastest: f64) -> Path {
        if self.rng.chance(0.7) {
            let lane = self.plan.section.drawn_lane(self.rng);
            self.along(lane, 15.0, fastest)
        } else {
            self.crossing(LANE, 15.0, fastest)
        }
    }

    /// In a moving queue, on either road.
    fn creeping(&mut self) -> Path {
        match (self.rng.unit() * 10.0) as u32 {
            0..4 => self.along(LANE, 0.5, 4.0),
            4..8 => self.changing([0.5, 4.0]),
            _ => self.crossing(LANE, 0.5, 4.0),
        }
    }

    pub(super) fn rider(&mut self) -> Path {
        let section = self.plan.section;
        let beside = f64::min(section.outer_lane() + 1.35, section.road_half - 0.5);
        if self.rng.chance(0.75) {
            self.along(beside, 3.0, 6.0)
        } else {
            self.crossing(3.2, 3.0, 6.0)
        }
    }

    /// Straight along the main road, `beside` its centre line.
    pub(super) fn along(&mut self, beside: f64, slow: f64, fast: f64) -> Path {
        let (t, x) = self.meeting();
        let (sign, speed) = (self.rng.sign(), self.rng.range(slow, fast));
        Path::from(State { x: x - sign * speed * t, ..lane(sign, beside, speed) })
    }

    /// Brakes or accelerates, beginning around the time it meets the vehicle.
    fn changing(&mut self, [slow, fast]: [f64; 2]) -> Path {
        let (t, x) = self.meeting();
        let (sign, speed) = (self.rng.sign(), self.rng.range(slow, fast));
        let later = if self.rng.chance(0.6) {
            self.rng.range(0.0, 0.6 * speed)
        } else {
            self.rng.range(speed, fast + 1.0)
        };
        let rate = self.rng.range(1.0, 4.0);
        let start = State { x: x - sign * speed * t, ..lane(sign, LANE, speed) };
        // Up to two seconds earlier, but not before the drive begins.
        let begin = (t - self.rng.range(0.0, 2.0)).max(0.0);
        let path = Path::from(start).then(begin, 0.0, 0.0);
        path.then_to_speed(if later < 0.8 { 0.0 } else { later }, rate, EASE_S)
    }

    /// Past another vehicle in the outer lane of the main road and back into that lane, a few m/s
    /// faster.
    pub(super) fn past(&mut self, slow: &Path) -> Path {
        let abreast = self.rng.range(0.0, self.duration_s);
        let other = slow.at(abreast);
        let sign = if other.yaw.cos() < 0.0 { -1.0 } else { 1.0 };
        let speed = (other.speed + self.rng.range(4.0, 8.0)).max(7.0);
        let aside = self.rng.range(2.8, 3.5);
        let outer = self.plan.section.outer_lane();
        // It leaves the lane this far behind the other, and returns to it this far ahead.
        let (gap, change_s) = (self.rng.range(9.0, 14.0), self.rng.range(2.2, 3.5));
        let before = gap / (speed - other.speed) + change_s;
        let start = State { x: other.x - sign * speed * before, ..lane(sign, outer, speed) };
        // Straight until then: the first leg extends back indefinitely.
        let path = Path::starting(abreast - before, start).then(0.0, 0.0, 0.0);
        let path = path.then_shift(aside, change_s);
        path.then(2.0 * gap / (speed - other.speed), 0.0, 0.0).then_shift(-aside, change_s)
    }

    /// From the main road into the right lane of the crossing road.
    fn turning(&mut self) -> Path {
        let (sign, speed) = (self.rng.sign(), self.rng.range(3.5, 6.5));
        let left = self.rng.chance(0.4);
        let (radius, angle) = if left { (11.0, FRAC_PI_2) } else { (8.0, -FRAC_PI_2) };
        let before = self.rng.range(0.0, self.duration_s.max(2.0));
        let path = Path::from(lane(sign, LANE, speed)).then(before, 0.0, 0.0);
        let path = path.then_turn(angle, radius, EASE_S);
        let right = self.plan.crossing + sign * LANE.copysign(angle);
        let x = right - path.end().x;
        path.moved(x, 0.0)
    }

    /// Along the crossing road.
    fn crossing(&mut self, beside: f64, slow: f64, fast: f64) -> Path {
        let (sign, speed) = (self.rng.sign(), self.rng.range(slow, fast));
        let t = self.rng.range(-2.0, self.duration_s + 2.0);
        let state = State {
            x: self.plan.crossing + sign * beside,
            y: -sign * speed * t,
            yaw: sign * FRAC_PI_2,
            speed,
        };
        Path::from(state)
    }

    /// Anywhere between the houses, standing there or walking in any direction.
    pub(super) fn stroller(&mut self) -> Path {
        let reach = self.plan.section.edge() - 0.7 - GROUP_M;
        let (t, x) = self.meeting();
        let [from, to] = [0; 2].map(|_| self.rng.range(-reach, reach));
        let speed = self.rng.range(0.4, 1.8);
        if self.rng.chance(0.35) {
            return Path::stationary(x, from, self.rng.range(-PI, PI));
        }
        // At the end of the drive it is at `to`, or on the way there.
        let across = ((to - from) / self.duration_s).clamp(-0.95 * speed, 0.95 * speed);
        let turn = (across / speed).asin();
        let yaw = if self.rng.chance(0.5) { turn } else { PI - turn };
        Path::from(State { x: x - speed * yaw.cos() * t, y: from, yaw, speed })
    }

    /// On a sidewalk, standing there, or crossing the main road.
    pub(super) fn walker(&mut self) -> Path {
        let (t, x) = self.meeting();
        let (sign, side) = (self.rng.sign(), self.rng.sign());
        let ([slow, fast], aside) = match self.plan.pace {
            Pace::Slow => ([0.4, 1.4], [0.8, 3.8]),
            _ => ([0.8, 2.0], [1.4, 3.2]),
        };
        let speed = self.rng.range(slow, fast);
        let y = side * self.plan.section.on_sidewalk(self.rng.range(aside[0], aside[1]));
        let yaw = if sign > 0.0 { 0.0 } else { PI };
        match (self.rng.unit() * 10.0) as u32 {
            0 => Path::stationary(x, y, self.rng.range(-PI, PI)),
            // Nobody climbs over what stands on a median.
            1..4 if self.plan.section.median_half == 0.0 => {
                let before = t * self.rng.unit();
                let start = State { x: x - sign * speed * before, y, yaw, speed };
                // A quarter turn left or right onto the road, back along the other sidewalk.
                let quarter = -side * sign * FRAC_PI_2;
                let turn = |path: Path, angle| path.then_turn(angle, 0.8, WALKER_EASE_S);
                let path = turn(Path::from(start).then(before, 0.0, 0.0), quarter);
                let over = 2.0 * path.end().y.abs();
                turn(path.then(over / speed, 0.0, 0.0), -quarter)
            }
            _ => Path::from(State { x: x - sign * speed * t, y, yaw, speed }),
        }
    }
}

/// Start `beside` the centre line of the main road, heading along +x or -x, on the right-hand side.
fn lane(sign: f64, beside: f64, speed: f64) -> State {
    State { x: 0.0, y: -sign * beside, yaw: if sign > 0.0 { 0.0 } else { PI }, speed }
}
