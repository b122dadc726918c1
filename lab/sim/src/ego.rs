//! Driving behaviour of the vehicle that carries the sensor.

use crate::dimensions::{LANE, Section};
use crate::path::{EASE_S, Path, State};
use crate::rng::Rng;
use std::f64::consts::FRAC_PI_2;

/// What the vehicle does during a drive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Ego {
    /// One of the others, chosen by the seed.
    #[default]
    Any,
    /// Stands still in the right lane.
    Standing,
    /// Drives straight on at constant speed.
    Straight {
        /// m/s, up to 14.
        speed: f64,
    },
    /// Drives straight on, brakes to a stop, waits a second and starts again.
    StopAndGo {
        /// m/s before and after the stop, > 0.
        speed: f64,
    },
    /// Turns into the crossing road after about a second.
    Turn {
        /// To the left, across the oncoming lane.
        left: bool,
        /// m/s, > 0; drivers typically do 5.
        speed: f64,
    },
}

/// How fast the other traffic is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pace {
    /// As in town.
    Town,
    /// As on a road out of town: vehicles at 15 to 36 m/s.
    Fast,
    /// Vehicles that creep, at up to 4 m/s unless they overtake, and many people strolling, alone
    /// or in pairs.
    Slow,
    /// Vehicles that creep, and crowds of people, also on the road.
    Crowd,
}

/// A planned drive.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Plan {
    /// Path of the vehicle, street frame.
    pub(crate) path: Path,
    /// x of the crossing road's centre line, m.
    pub(crate) crossing: f64,
    /// Cross-section of the main road.
    pub(crate) section: Section,
    /// Distance of the vehicle's lane from the road's centre line, m.
    pub(crate) lane: f64,
    /// Pace of the other traffic.
    pub(crate) pace: Pace,
}

impl Plan {
    /// The same in any of the lanes of a road of this section that lead the same way.
    pub(crate) fn on(self, section: Section, rng: &mut Rng) -> Plan {
        let lane = section.drawn_lane(rng);
        Plan { path: self.path.moved(0.0, self.lane - lane), section, lane, ..self }
    }
}

impl Ego {
    /// Plans the path, from the street frame's x = 0 at time 0, with the crossing road where the
    /// path needs it.
    pub(crate) fn plan(self, seed: u64, duration_s: f64) -> Plan {
        let mut rng = Rng::split(seed, 0);
        let crossing = rng.sign() * rng.range(18.0, 60.0);
        let start = |speed: f64| Path::from(State { x: 0.0, y: -LANE, yaw: 0.0, speed });
        let on = |path, crossing| Plan {
            path,
            crossing,
            section: Section::WIDE,
            lane: LANE,
            pace: Pace::Town,
        };
        match self {
            Ego::Any => Ego::drawn(&mut rng).plan(seed, duration_s),
            Ego::Standing => on(Path::stationary(0.0, -LANE, 0.0), crossing),
            Ego::Straight { speed } => on(start(speed), crossing),
            Ego::StopAndGo { speed } => {
                let path = start(speed).then(0.1 * duration_s, 0.0, 0.0);
                let path = path.then_to_speed(0.0, 3.0, EASE_S).then(1.0, 0.0, 0.0);
                on(path.then_to_speed(speed, 2.0, EASE_S), crossing)
            }
            Ego::Turn { left, speed } => {
                let before = (0.25 * duration_s).min(1.0);
                let (radius, angle) = if left { (11.0, FRAC_PI_2) } else { (8.0, -FRAC_PI_2) };
                let path = start(speed).then(before, 0.0, 0.0);
                let path = path.then_turn(angle, radius, EASE_S);
                // The turn ends in the right lane of the crossing road.
                let crossing = path.end().x - LANE.copysign(angle);
                on(path, crossing)
            }
        }
    }

    /// On a road out of town a random ego drives straight on, or stands still in one case in six.
    pub(crate) fn out_of_town(self, seed: u64) -> Ego {
        let mut rng = Rng::split(seed, 10);
        let (stands, speed) = (rng.chance(1.0 / 6.0), rng.range(15.0, 30.0));
        let drawn = if stands { Ego::Standing } else { Ego::Straight { speed } };
        if self == Ego::Any { drawn } else { self }
    }

    fn drawn(rng: &mut Rng) -> Ego {
        match (rng.unit() * 8.0) as u32 {
            0 => Ego::Standing,
            1..4 => Ego::straight(rng),
            4 => Ego::stop_and_go(rng),
            _ => Ego::turn(rng),
        }
    }

    /// Drives straight on at a city speed.
    pub fn straight(rng: &mut Rng) -> Ego {
        Ego::Straight { speed: rng.range(2.0, 14.0) }
    }

    /// Stops from a city speed.
    pub fn stop_and_go(rng: &mut Rng) -> Ego {
        Ego::StopAndGo { speed: rng.range(4.0, 10.0) }
    }

    /// Turns to either side.
    pub fn turn(rng: &mut Rng) -> Ego {
        Ego::Turn { left: rng.chance(0.5), speed: rng.range(3.5, 6.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_end_in_the_right_lane() {
        for (left, yaw) in [(true, FRAC_PI_2), (false, -FRAC_PI_2)] {
            let plan = Ego::Turn { left, speed: 5.0 }.plan(3, 6.0);
            let end = plan.path.end();
            // Right of the direction of travel: +x when heading to +y.
            assert!((end.x - plan.crossing - if left { LANE } else { -LANE }).abs() < 1e-9);
            assert!((end.yaw - yaw).abs() < 1e-9);
        }
    }
}
