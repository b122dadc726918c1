//! Planar motion in closed form: legs of constant acceleration and constant curvature.

/// Where something is and how it moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// m, street frame.
    pub x: f64,
    /// m, street frame.
    pub y: f64,
    /// rad, about +z from the street's x.
    pub yaw: f64,
    /// m/s along the heading.
    pub speed: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Leg {
    start_s: f64,
    from: State,
    acceleration: f64,
    curvature: f64,
}

/// A motion for all times: the first leg reaches back without end, and after the last leg it goes
/// straight on at constant speed.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    legs: Vec<Leg>,
}

impl Leg {
    fn at(&self, t: f64) -> State {
        let dt = t - self.start_s;
        let along = self.from.speed * dt + 0.5 * self.acceleration * dt * dt;
        let turned = self.curvature * along;
        // Chord of the arc: sin(a/2)/(a/2) long, half way between the headings.
        let half = 0.5 * turned;
        let chord = if half.abs() < 1e-9 { along } else { along * half.sin() / half };
        let (s, c) = (self.from.yaw + half).sin_cos();
        State {
            x: self.from.x + chord * c,
            y: self.from.y + chord * s,
            yaw: self.from.yaw + turned,
            speed: self.from.speed + self.acceleration * dt,
        }
    }
}

impl Path {
    /// Straight on for ever, from this state at time 0.
    pub fn from(state: State) -> Path {
        Path::starting(0.0, state)
    }

    /// Straight on for ever, from this state at a time, s.
    pub fn starting(start_s: f64, state: State) -> Path {
        Path { legs: vec![Leg { start_s, from: state, acceleration: 0.0, curvature: 0.0 }] }
    }

    /// Standing still at this place.
    pub fn standing(x: f64, y: f64, yaw: f64) -> Path {
        Path::from(State { x, y, yaw, speed: 0.0 })
    }

    /// Appends a leg of this duration (s), acceleration (m/s^2) and curvature (1/m, left
    /// positive).
    pub fn then(mut self, duration: f64, acceleration: f64, curvature: f64) -> Path {
        if let Some(leg) = self.legs.last_mut() {
            leg.acceleration = acceleration;
            leg.curvature = curvature;
            let start_s = leg.start_s + duration;
            let from = leg.at(start_s);
            self.legs.push(Leg { start_s, from, acceleration: 0.0, curvature: 0.0 });
        }
        self
    }

    /// Appends a leg along which the speed changes to `speed` (m/s) at `rate` (m/s^2 > 0).
    pub fn then_to_speed(self, speed: f64, rate: f64) -> Path {
        let change = speed - self.end().speed;
        let mut path = self.then(change.abs() / rate, rate.copysign(change), 0.0);
        // Free of rounding, so that a stop is a stop.
        if let Some(leg) = path.legs.last_mut() {
            leg.from.speed = speed;
        }
        path
    }

    /// Appends a turn by `angle` (rad, left positive) of this radius (m) at constant speed, which
    /// must not be zero.
    pub fn then_turn(self, angle: f64, radius: f64) -> Path {
        let speed = self.end().speed;
        self.then(angle.abs() * radius / speed, 0.0, 1.0f64.copysign(angle) / radius)
    }

    /// Appends a change of lane by `aside` (m, left positive) over `length` (m) of road at constant
    /// speed, which must not be zero: two arcs, after which the heading is as before.
    pub fn then_shift(self, aside: f64, length: f64) -> Path {
        let angle = 2.0 * (aside / length).atan();
        let radius = 0.5 * length / angle.abs().sin();
        self.then_turn(angle, radius).then_turn(-angle, radius)
    }

    /// State when the last leg begins.
    pub fn end(&self) -> State {
        self.legs.last().map_or(State::default(), |leg| leg.from)
    }

    /// State at a time, s.
    pub fn at(&self, t: f64) -> State {
        let later = self.legs.iter().rev().find(|leg| leg.start_s <= t);
        later.or(self.legs.first()).map_or(State::default(), |leg| leg.at(t))
    }

    /// The same path moved by (x, y), m.
    pub fn moved(mut self, x: f64, y: f64) -> Path {
        for leg in &mut self.legs {
            leg.from.x += x;
            leg.from.y += y;
        }
        self
    }

    /// Whether it never moves.
    pub fn is_still(&self) -> bool {
        self.legs.iter().all(|leg| leg.from.speed == 0.0 && leg.acceleration == 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn brakes_turns_and_goes_on() {
        let start = State { x: 1.0, y: 2.0, yaw: 0.0, speed: 10.0 };
        let path =
            Path::from(start).then(1.0, 0.0, 0.0).then_to_speed(5.0, 2.5).then_turn(FRAC_PI_2, 8.0);
        assert_eq!(path.at(-1.0).x, -9.0);
        assert_eq!(path.at(1.0).x, 11.0);
        // Braking from 10 to 5 m/s at 2.5 m/s^2 takes 2 s and 15 m.
        assert!((path.at(3.0).x - 26.0).abs() < 1e-12);
        let end = path.end();
        assert!((end.x - 34.0).abs() < 1e-9 && (end.y - 10.0).abs() < 1e-9);
        assert!((end.yaw - FRAC_PI_2).abs() < 1e-12 && end.speed == 5.0);
    }

    #[test]
    fn changes_lane() {
        let start = State { x: 3.0, y: -1.75, speed: 12.0, ..State::default() };
        let path = Path::starting(-2.0, start).then(1.0, 0.0, 0.0).then_shift(3.5, 24.0);
        assert_eq!(path.at(-2.0), start);
        let end = path.end();
        assert!((end.x - 39.0).abs() < 1e-9 && (end.y - 1.75).abs() < 1e-9);
        assert!(end.yaw.abs() < 1e-12 && end.speed == 12.0);
    }

    #[test]
    fn heading_and_speed_are_the_derivative() {
        let start = State { speed: 6.0, ..State::default() };
        let path = Path::from(start).then(4.0, 1.0, -0.05);
        let (h, t) = (1e-5, 2.3);
        let (a, b, m) = (path.at(t - h), path.at(t + h), path.at(t));
        let (vx, vy) = ((b.x - a.x) / (2.0 * h), (b.y - a.y) / (2.0 * h));
        assert!((vx - m.speed * m.yaw.cos()).abs() < 1e-8);
        assert!((vy - m.speed * m.yaw.sin()).abs() < 1e-8);
        assert!(((b.yaw - a.yaw) / (2.0 * h) + 0.05 * m.speed).abs() < 1e-8);
    }
}
