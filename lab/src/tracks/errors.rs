//! Errors of a track: of stationary objects about the track's own mean, of moving ones against the
//! truth at the same point of the body.

use super::object::{Moment, moment_at};
use crate::labels::turn;
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_PI_2;

/// A constant transform in the frame of the body. No return determines where on a body a tracker's
/// frame lies, and which way it faces: this is chosen once per track, by least squares, and in the
/// same way for every tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// Position of the true origin in the tracker's frame, m.
    pub offset: DVec3,
    /// True heading minus the tracker's, -pi to pi, rad.
    pub heading: f64,
}

impl Alignment {
    /// Finds the alignment that brings a track closest to the truth.
    ///
    /// # Panics
    /// If the truth is empty.
    pub fn fit(track: &[Moment], truth: &[Moment]) -> Alignment {
        let (mut offset, mut way) = (DVec3::ZERO, DVec2::ZERO);
        for moment in track {
            let really = moment_at(truth, moment.time_s);
            offset += moment.project(really.position);
            way += DVec2::from_angle(really.heading - moment.heading);
        }
        Alignment { offset: offset / track.len().max(1) as f64, heading: way.y.atan2(way.x) }
    }

    /// Transforms a point from the tracker's frame to the true one.
    pub fn to_true_frame(self, at: DVec3) -> DVec3 {
        let off = at - self.offset;
        DVec2::from_angle(-self.heading).rotate(off.truncate()).extend(off.z)
    }

    /// The same motion at the true origin.
    pub fn apply(&self, moment: &Moment) -> Moment {
        let turned = DVec2::from_angle(moment.heading).rotate(self.offset.truncate());
        let arm = turned.extend(self.offset.z);
        Moment {
            position: moment.position + arm,
            heading: moment.heading + self.heading,
            velocity: moment.velocity + (moment.turn_rate * turned.perp()).extend(0.0),
            ..*moment
        }
    }
}

/// Sums of squared errors of one track or of many.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    pub count: usize,
    /// Along x and y, m².
    pub ground: f64,
    /// Along z, m².
    pub height: f64,
    /// m²/s².
    pub velocity: f64,
    /// rad².
    pub heading: f64,
    /// rad²/s².
    pub turn_rate: f64,
    /// Number of times that the heading jumps by more than a right angle, or is that far from the
    /// truth over the whole track.
    pub flips: usize,
}

/// Root mean square errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rmse {
    /// Along x, y and z, m.
    pub position: f64,
    /// Along x and y, m.
    pub ground: f64,
    /// Along z, m.
    pub height: f64,
    /// m/s.
    pub velocity: f64,
    /// rad.
    pub heading: f64,
    /// rad/s.
    pub turn_rate: f64,
}

impl Errors {
    /// Errors of a stationary object: position and heading about their means, velocity and turn
    /// rate from zero.
    pub fn stationary(track: &[Moment]) -> Errors {
        let n = track.len().max(1) as f64;
        let position = track.iter().map(|m| m.position).sum::<DVec3>() / n;
        let way: DVec2 = track.iter().map(|m| DVec2::from_angle(m.heading)).sum();
        let heading = way.y.atan2(way.x);
        let still = Moment { position, heading, ..Moment::default() };
        let mut errors = Errors { flips: heading_jumps(track, |_| 0.0), ..Errors::default() };
        track.iter().for_each(|m| errors.add(m, &still));
        errors
    }

    /// Errors of a moving object, after [`Alignment`].
    pub fn moving(track: &[Moment], truth: &[Moment]) -> Errors {
        let alignment = Alignment::fit(track, truth);
        let backwards = alignment.heading.abs() > FRAC_PI_2;
        let heading = |t: f64| moment_at(truth, t).heading;
        let flips = heading_jumps(track, heading) + usize::from(backwards);
        let mut errors = Errors { flips, ..Errors::default() };
        for moment in track {
            errors.add(&alignment.apply(moment), &moment_at(truth, moment.time_s));
        }
        errors
    }

    fn add(&mut self, moment: &Moment, really: &Moment) {
        let off = moment.position - really.position;
        self.count += 1;
        self.ground += off.truncate().length_squared();
        self.height += off.z * off.z;
        self.velocity += (moment.velocity - really.velocity).length_squared();
        self.heading += turn(really.heading, moment.heading).powi(2);
        self.turn_rate += (moment.turn_rate - really.turn_rate).powi(2);
    }

    /// Adds those of another track.
    pub fn merge(&mut self, other: &Errors) {
        self.count += other.count;
        self.ground += other.ground;
        self.height += other.height;
        self.velocity += other.velocity;
        self.heading += other.heading;
        self.turn_rate += other.turn_rate;
        self.flips += other.flips;
    }

    /// Root mean squares; NaN without moments.
    pub fn rmse(&self) -> Rmse {
        let root = |sum: f64| (sum / self.count as f64).sqrt();
        Rmse {
            position: root(self.ground + self.height),
            ground: root(self.ground),
            height: root(self.height),
            velocity: root(self.velocity),
            heading: root(self.heading),
            turn_rate: root(self.turn_rate),
        }
    }
}

/// How often a heading jumps by more than a right angle relative to the true one.
fn heading_jumps(track: &[Moment], truth: impl Fn(f64) -> f64) -> usize {
    let off = |m: &Moment| m.heading - truth(m.time_s);
    track.windows(2).filter(|m| turn(off(&m[0]), off(&m[1])).abs() > FRAC_PI_2).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Through a bend and uphill.
    fn truth() -> Vec<Moment> {
        let (rate, speed) = (0.4, 6.0);
        let moment = |n: usize| {
            let time_s = 0.01 * n as f64;
            let heading = 2.9 + rate * time_s;
            let along = DVec2::from_angle(heading);
            Moment {
                time_s,
                position: (-(speed / rate) * along.perp()).extend(0.3 * time_s),
                heading,
                velocity: (speed * along).extend(0.3),
                turn_rate: rate,
            }
        };
        (0..=500).map(moment).collect()
    }

    /// The same motion as seen from a frame elsewhere on the body.
    fn elsewhere(offset: DVec3, heading: f64) -> Vec<Moment> {
        let shift = Alignment { offset, heading };
        truth().iter().step_by(10).map(|m| shift.apply(m)).collect()
    }

    #[test]
    fn alignment_recovers_a_transform() {
        for (offset, heading) in
            [(DVec3::new(1.3, -0.7, 0.4), 0.3), (DVec3::new(-2.0, 0.1, -1.0), -3.0)]
        {
            let track = elsewhere(offset, heading);
            let found = Alignment::fit(&track, &truth());
            assert!((found.heading + heading).abs() < 1e-9, "{found:?}");
            let back = DVec2::from_angle(-heading).rotate(-offset.truncate());
            assert!((found.offset - back.extend(-offset.z)).length() < 1e-9, "{found:?}");
            let errors = Errors::moving(&track, &truth());
            let rmse = errors.rmse();
            assert!(rmse.position < 1e-9 && rmse.heading < 1e-9 && rmse.turn_rate < 1e-9);
            assert!(rmse.velocity < 1e-9, "the body's points differ in velocity: {rmse:?}");
            assert_eq!((errors.count, errors.flips), (51, usize::from(heading.abs() > 2.0)));
        }
    }

    #[test]
    fn what_no_constant_transform_explains_is_error() {
        // Alternately to either side, by 0.1 m and 0.05 rad.
        let shake = |(n, m): (usize, &Moment)| {
            let sign = if n % 2 == 0 { 1.0 } else { -1.0 };
            let side = DVec2::from_angle(m.heading).perp().extend(0.0);
            Moment {
                position: m.position + 0.1 * sign * side,
                heading: m.heading + 0.05 * sign,
                turn_rate: m.turn_rate + 0.2,
                velocity: m.velocity + DVec3::Z,
                ..*m
            }
        };
        let track: Vec<Moment> = truth().iter().step_by(5).enumerate().map(shake).collect();
        let rmse = Errors::moving(&track, &truth()).rmse();
        let near = |a: f64, b: f64| (a - b).abs() < 0.01 * b;
        assert!(near(rmse.ground, 0.1) && near(rmse.position, 0.1) && rmse.height < 1e-9);
        assert!(near(rmse.heading, 0.05) && near(rmse.turn_rate, 0.2) && near(rmse.velocity, 1.0));
    }

    #[test]
    fn flips_are_counted() {
        let flipped = |times: &[usize]| {
            let mut track: Vec<Moment> = truth().iter().step_by(10).copied().collect();
            for &from in times {
                track[from..].iter_mut().for_each(|m| m.heading += PI);
            }
            Errors::moving(&track, &truth()).flips
        };
        assert_eq!((flipped(&[]), flipped(&[45]), flipped(&[20, 30])), (0, 1, 2));
        // Backwards throughout, and for most of the time.
        assert_eq!((flipped(&[0]), flipped(&[3])), (1, 2));
    }

    #[test]
    fn stationary_objects_are_compared_with_their_mean() {
        let moment = |n: usize| {
            let sign = if n.is_multiple_of(2) { 1.0 } else { -1.0 };
            Moment {
                time_s: 0.1 * n as f64,
                position: DVec3::new(5.0 + 0.3 * sign, 7.0, 1.0 - 0.4 * sign),
                heading: PI + 0.1 * sign,
                velocity: DVec3::new(0.6, 0.0, 0.8),
                turn_rate: -0.2,
            }
        };
        let track: Vec<Moment> = (0..40).map(moment).collect();
        let errors = Errors::stationary(&track);
        let r = errors.rmse();
        let expected = [(r.position, 0.5), (r.ground, 0.3), (r.height, 0.4), (r.velocity, 1.0)];
        for (found, expected) in expected.into_iter().chain([(r.heading, 0.1), (r.turn_rate, 0.2)])
        {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
        assert_eq!(errors.flips, 0);
        let mut both = errors;
        both.merge(&errors);
        assert_eq!((both.rmse(), both.count), (r, 80));
    }
}
