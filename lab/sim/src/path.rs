//! Planar motion, leg by leg: acceleration and curvature are constant or change linearly, the
//! former with time, the latter with distance (clothoids, on which real vehicles enter a curve).

/// Time over which a vehicle's turn or braking builds up and fades, s: its yaw rate and
/// acceleration do not jump, and the twist at a sweep's stamp represents the whole sweep.
pub(crate) const EASE_S: f64 = 1.0;

/// Iterations for finding the angle of a lane change.
const SHIFT_STEPS: u32 = 8;

/// Place and motion at one time.
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

/// Motion of a leg.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Course {
    /// m/s^2, at its start.
    acceleration: f64,
    /// m/s^3.
    jerk: f64,
    /// 1/m, left positive, at its start.
    curvature: f64,
    /// Change of curvature per distance, 1/m^2.
    sharpness: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Leg {
    start_s: f64,
    from: State,
    course: Course,
}

/// Abscissae and weights of Gauss-Legendre quadrature over 0 to 1: more accurate than a micrometre
/// if a clothoid turns by less than a right angle.
const QUADRATURE: [[f64; 2]; 5] = [
    [0.046_910_077_030_668, 0.118_463_442_528_095],
    [0.230_765_344_947_158, 0.239_314_335_249_683],
    [0.5, 0.284_444_444_444_444],
    [0.769_234_655_052_842, 0.239_314_335_249_683],
    [0.953_089_922_969_332, 0.118_463_442_528_095],
];

/// A motion for all times: the first leg extends back indefinitely, and after the last leg the
/// motion continues straight on at constant speed.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    legs: Vec<Leg>,
}

impl Leg {
    fn at(&self, t: f64) -> State {
        let dt = t - self.start_s;
        let Course { acceleration, jerk, curvature, sharpness } = self.course;
        let along = self.from.speed * dt + 0.5 * acceleration * dt * dt + jerk * dt * dt * dt / 6.0;
        let heading = |along: f64| curvature * along + 0.5 * sharpness * along * along;
        let (dx, dy) = if sharpness == 0.0 {
            // Chord of the arc: sin(a/2)/(a/2) times its length, halfway between the headings.
            let half = 0.5 * heading(along);
            let chord = if half.abs() < 1e-9 { along } else { along * half.sin() / half };
            let (s, c) = (self.from.yaw + half).sin_cos();
            (chord * c, chord * s)
        } else {
            QUADRATURE.iter().fold((0.0, 0.0), |(x, y), [at, weight]| {
                let (s, c) = (self.from.yaw + heading(at * along)).sin_cos();
                (x + weight * along * c, y + weight * along * s)
            })
        };
        State {
            x: self.from.x + dx,
            y: self.from.y + dy,
            yaw: self.from.yaw + heading(along),
            speed: self.from.speed + acceleration * dt + 0.5 * jerk * dt * dt,
        }
    }
}

impl Path {
    /// Straight on for ever, with this state at time 0.
    pub fn from(state: State) -> Path {
        Path::starting(0.0, state)
    }

    /// Straight on for ever, with this state at time `start_s`, s.
    pub fn starting(start_s: f64, state: State) -> Path {
        Path { legs: vec![Leg { start_s, from: state, course: Course::default() }] }
    }

    /// Standing still at this place.
    pub fn stationary(x: f64, y: f64, yaw: f64) -> Path {
        Path::from(State { x, y, yaw, speed: 0.0 })
    }

    /// Appends a leg of this duration (s), acceleration (m/s^2) and curvature (1/m, left
    /// positive).
    pub fn then(self, duration: f64, acceleration: f64, curvature: f64) -> Path {
        self.follow(duration, Course { acceleration, curvature, ..Course::default() })
    }

    /// Appends a leg of this duration, s.
    fn follow(mut self, duration: f64, course: Course) -> Path {
        if let Some(leg) = self.legs.last_mut() {
            leg.course = course;
            let start_s = leg.start_s + duration;
            let from = leg.at(start_s);
            self.legs.push(Leg { start_s, from, course: Course::default() });
        }
        self
    }

    /// Appends legs along which the speed changes to `speed` (m/s), which must differ from the one
    /// before: the acceleration builds up to `rate` (m/s^2 > 0) and fades again over `ease_s` each
    /// (> 0).
    pub fn then_to_speed(self, speed: f64, rate: f64, ease_s: f64) -> Path {
        let change = speed - self.end().speed;
        let (time, rate) = (change.abs() / rate, rate.copysign(change));
        let ease_s = ease_s.min(time);
        let jerk = rate / ease_s;
        self.follow(ease_s, Course { jerk, ..Course::default() })
            .then(time - ease_s, rate, 0.0)
            .follow(ease_s, Course { acceleration: rate, jerk: -jerk, ..Course::default() })
            .at_speed(speed)
    }

    /// Removes rounding errors from the speed at the end, so that a stop is really a stop.
    fn at_speed(mut self, speed: f64) -> Path {
        if let Some(leg) = self.legs.last_mut() {
            leg.from.speed = speed;
        }
        self
    }

    /// Appends a turn by `angle` (rad, left positive) at constant speed, which must not be zero:
    /// the curvature builds up to that of the radius (m) and fades again over `ease_s` each, > 0.
    pub fn then_turn(self, angle: f64, radius: f64, ease_s: f64) -> Path {
        let speed = self.end().speed;
        let whole_m = angle.abs() * radius;
        let ease_m = (speed * ease_s).min(whole_m);
        let curvature = 1.0f64.copysign(angle) / radius;
        let sharpness = curvature / ease_m;
        self.follow(ease_m / speed, Course { sharpness, ..Course::default() })
            .then((whole_m - ease_m) / speed, 0.0, curvature)
            .follow(
                ease_m / speed,
                Course { curvature, sharpness: -sharpness, ..Course::default() },
            )
    }

    /// Appends a lane change by `aside` (m, left positive, not zero) in this time (s) at constant
    /// speed, which must not be zero: two turns whose curvature builds up and fades all the way,
    /// after which the heading is the same as before.
    pub fn then_shift(self, aside: f64, duration: f64) -> Path {
        let start = self.end();
        let length = start.speed * duration;
        let turns = |path: Path, angle: f64| {
            let radius = 0.25 * length / angle.abs();
            path.then_turn(angle, radius, duration).then_turn(-angle, radius, duration)
        };
        let straight = State { speed: start.speed, ..State::default() };
        let mut angle = 2.0 * aside / length;
        // The sine of small angles is nearly linear: each step leaves a hundredth of the error.
        for _ in 0..SHIFT_STEPS {
            angle *= aside / turns(Path::from(straight), angle).end().y;
        }
        turns(self, angle)
    }

    /// State at the start of the last leg.
    pub fn end(&self) -> State {
        self.legs.last().map_or(State::default(), |leg| leg.from)
    }

    /// State at a time, s.
    pub fn at(&self, t: f64) -> State {
        let later = self.legs.iter().rev().find(|leg| leg.start_s <= t);
        later.or(self.legs.first()).map_or(State::default(), |leg| leg.at(t))
    }

    /// The same path translated by (x, y), m.
    pub fn moved(mut self, x: f64, y: f64) -> Path {
        for leg in &mut self.legs {
            leg.from.x += x;
            leg.from.y += y;
        }
        self
    }

    /// Returns whether it never moves.
    pub fn is_static(&self) -> bool {
        let rests = |c: &Course| c.acceleration == 0.0 && c.jerk == 0.0;
        self.legs.iter().all(|leg| leg.from.speed == 0.0 && rests(&leg.course))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn brakes_turns_and_continues() {
        let start = State { x: 1.0, y: 2.0, yaw: 0.0, speed: 10.0 };
        let path = Path::from(start).then(1.0, 0.0, 0.0).then(2.0, -2.5, 0.0);
        let path = path.then(8.0 * FRAC_PI_2 / 5.0, 0.0, 0.125);
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
        let path = Path::starting(-2.0, start).then(1.0, 0.0, 0.0).then_shift(3.5, 3.0);
        assert_eq!(path.at(-2.0), start);
        let end = path.end();
        assert!((end.y - 1.75).abs() < 1e-9 && end.yaw.abs() < 1e-12 && end.speed == 12.0);
        // Halfway after half of the 36 m along it, which is a little longer than the road.
        assert!(path.at(0.5).y.abs() < 1e-9 && (50.4..51.0).contains(&end.x), "{end:?}");
    }

    /// Checks that heading and speed are the derivative of the position at a time.
    fn check_derivative(path: &Path, t: f64) {
        let h = 1e-5;
        let (a, b, m) = (path.at(t - h), path.at(t + h), path.at(t));
        let (vx, vy) = ((b.x - a.x) / (2.0 * h), (b.y - a.y) / (2.0 * h));
        assert!((vx - m.speed * m.yaw.cos()).abs() < 1e-7, "{t}: {vx}, {m:?}");
        assert!((vy - m.speed * m.yaw.sin()).abs() < 1e-7, "{t}: {vy}, {m:?}");
    }

    #[test]
    fn heading_and_speed_are_the_derivative() {
        let start = State { speed: 6.0, ..State::default() };
        let path = Path::from(start).then(4.0, 1.0, -0.05);
        check_derivative(&path, 2.3);
        let (h, t) = (1e-5, 2.3);
        let turned = (path.at(t + h).yaw - path.at(t - h).yaw) / (2.0 * h);
        assert!((turned + 0.05 * path.at(t).speed).abs() < 1e-8);
    }

    /// Acceleration and turn rate at a time, m/s^2 and rad/s.
    fn rates(path: &Path, t: f64) -> [f64; 2] {
        let h = 1e-4;
        let [a, b] = [path.at(t - h), path.at(t + h)];
        [(b.speed - a.speed) / (2.0 * h), (b.yaw - a.yaw) / (2.0 * h)]
    }

    #[test]
    fn eased_motion_has_no_jolts() {
        let start = State { speed: 6.0, ..State::default() };
        let path = Path::from(start)
            .then(0.5, 0.0, 0.0)
            .then_turn(-FRAC_PI_2, 8.0, 1.0)
            .then_to_speed(0.0, 3.0, 0.5)
            .then(1.0, 0.0, 0.0)
            .then_to_speed(6.0, 2.0, 0.5);
        let times: Vec<f64> = (0..900).map(|i| 0.01 * f64::from(i)).collect();
        let (mut most, mut before) = ([0.0f64; 2], [0.0; 2]);
        for &t in &times {
            check_derivative(&path, t);
            let now = rates(&path, t);
            // 3 m/s^2 build up in half a second, the yaw rate of 6 m/s on 8 m in one second.
            for (n, limit) in [6.0, 0.75].into_iter().enumerate() {
                assert!((now[n] - before[n]).abs() < 1.01 * limit * 0.01, "{t}: {now:?}");
                most[n] = most[n].max(now[n].abs());
            }
            before = now;
        }
        assert!((most[0] - 3.0).abs() < 1e-6 && (most[1] - 0.75).abs() < 1e-6, "{most:?}");
        let end = path.end();
        assert!((end.yaw + FRAC_PI_2).abs() < 1e-12 && end.speed == 6.0);
        // Braking at 3 m/s^2 takes 2 s plus half a second, the turn 1 s more than its arc.
        let stopped = 0.5 + (8.0 * FRAC_PI_2) / 6.0 + 1.0 + 2.5;
        assert_eq!((path.at(stopped).speed, path.at(stopped + 0.9).speed), (0.0, 0.0));
        assert!(path.at(stopped - 0.1).speed > 0.0 && path.at(stopped + 1.1).speed > 0.0);
        assert!(!path.is_static());
    }

    #[test]
    fn short_changes_are_eased_all_the_way() {
        let start = State { speed: 10.0, ..State::default() };
        let turned = Path::from(start).then_turn(0.2, 20.0, 1.0).end();
        assert!((turned.yaw - 0.2).abs() < 1e-12);
        // Curvature builds up and fades over 4 m each: half of the turn lies on either side.
        let half = Path::from(start).then_turn(0.2, 20.0, 1.0).at(0.4);
        assert!((half.yaw - 0.1).abs() < 1e-12);
        let slower = Path::from(start).then_to_speed(9.5, 2.0, 1.0);
        assert_eq!(slower.end().speed, 9.5);
        assert!((slower.at(0.25).speed - 9.75).abs() < 1e-12);
    }
}
