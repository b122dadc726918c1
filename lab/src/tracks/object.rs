//! Objects for evaluating trackers, with all their returns and their true trajectory known.

use crate::labels::Kind;
use glam::{DVec2, DVec3};
use raywake_objects::panorama::{Panorama, PassingParams};
use raywake_objects::{ObjectReturn, ObjectState};
use std::ops::Range;

/// An object, with perfect segmentation and association.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Drive and number.
    pub name: String,
    pub kind: Kind,
    /// Length, width and height of its box, m.
    pub size: [f64; 3],
    /// Whether it is stationary, which its tracker does not know.
    pub stationary: bool,
    /// Origin of positions, m in the world.
    pub anchor: DVec3,
    /// Origin of times, s in the drive.
    pub start_s: f64,
    /// All its returns, in order of time.
    pub returns: Vec<ObjectReturn>,
    /// Returns that form one observation of the baseline, about 0.1 s of them (section 2.4); none
    /// is empty.
    pub batches: Vec<Range<usize>>,
    /// Its true motion, in order of time.
    pub truth: Vec<Moment>,
}

/// A return in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Where the ray ended, m.
    pub at: DVec3,
    /// Where it began, m.
    pub from: DVec3,
    /// When it was measured, s in the drive.
    pub time_s: f64,
    /// Index in the rig.
    pub sensor: u8,
    /// See [`ObjectReturn::passed`].
    pub passed: [bool; 2],
}

/// Finds on which sides neighbouring rays pass the wanted returns of a sweep.
pub fn mark_passed_returns(seen: &mut [Seen], wanted: impl Fn(usize) -> bool) {
    let ray = |s: &Seen| (s.sensor, [0.0; 3], (s.at - s.from).as_vec3().to_array());
    let mut panorama = raywake_alloc_guard::boxed!(Panorama, Panorama::new());
    panorama.look(&PassingParams::DEFAULT, seen, ray, wanted, |s, passed| s.passed = passed);
}

impl Seen {
    /// Converts it to a return of an object.
    pub fn of_object(&self, anchor: DVec3, start_s: f64) -> ObjectReturn {
        let local = |at: DVec3| (at - anchor).as_vec3().to_array();
        ObjectReturn {
            position: local(self.at),
            origin: local(self.from),
            time_s: (self.time_s - start_s) as f32,
            sensor: self.sensor,
            passed: self.passed,
        }
    }
}

/// An object at a time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// s after the object's start.
    pub time_s: f64,
    /// Origin of its frame, m from its anchor.
    pub position: DVec3,
    /// About +z, rad, unwrapped.
    pub heading: f64,
    /// Velocity of the origin, along the axes of the world, m/s.
    pub velocity: DVec3,
    /// rad/s.
    pub turn_rate: f64,
}

impl From<ObjectState> for Moment {
    fn from(s: ObjectState) -> Moment {
        let along = DVec2::from_angle(s.heading) * s.speed;
        Moment {
            time_s: s.time_s,
            position: DVec3::from_array(s.position),
            heading: s.heading,
            velocity: along.extend(s.climb),
            turn_rate: s.turn_rate,
        }
    }
}

impl Moment {
    /// Transforms a point of the world, m from the anchor, into the object's frame.
    pub fn project(&self, at: DVec3) -> DVec3 {
        let off = at - self.position;
        DVec2::from_angle(-self.heading).rotate(off.truncate()).extend(off.z)
    }

    fn mix(&self, next: &Moment, part: f64) -> Moment {
        let between = |a: f64, b: f64| a + (b - a) * part;
        Moment {
            time_s: between(self.time_s, next.time_s),
            position: self.position.lerp(next.position, part),
            heading: between(self.heading, next.heading),
            velocity: self.velocity.lerp(next.velocity, part),
            turn_rate: between(self.turn_rate, next.turn_rate),
        }
    }

    /// The same motion extrapolated by `dt_s`.
    fn carried(&self, dt_s: f64) -> Moment {
        Moment {
            time_s: self.time_s + dt_s,
            position: self.position + self.velocity * dt_s,
            heading: self.heading + self.turn_rate * dt_s,
            ..*self
        }
    }
}

/// The moment at a time, linearly interpolated within a history, and extrapolated by the motion of
/// its ends before and after it.
///
/// # Panics
/// If the history is empty.
pub fn moment_at(history: &[Moment], time_s: f64) -> Moment {
    let next = history.partition_point(|m| m.time_s <= time_s);
    if next == 0 || next == history.len() {
        let end = history[next.saturating_sub(1)];
        return end.carried(time_s - end.time_s);
    }
    let (a, b) = (&history[next - 1], &history[next]);
    a.mix(b, (time_s - a.time_s) / (b.time_s - a.time_s))
}

impl Object {
    pub fn batches(&self) -> impl Iterator<Item = &[ObjectReturn]> {
        self.batches.iter().map(|b| &self.returns[b.clone()])
    }

    pub fn span_s(&self) -> f64 {
        match (self.returns.first(), self.returns.last()) {
            (Some(a), Some(b)) => f64::from(b.time_s) - f64::from(a.time_s),
            _ => 0.0,
        }
    }
}

/// Mean time (s) and position (m) of returns.
pub fn centroid(batch: &[ObjectReturn]) -> (f64, DVec3) {
    let sum = batch.iter().fold((0.0, DVec3::ZERO), |(time, at), r| {
        (time + f64::from(r.time_s), at + DVec3::from_array(r.position.map(f64::from)))
    });
    let n = batch.len() as f64;
    (sum.0 / n, sum.1 / n)
}
