//! Cars made of two boxes, seen by spinning sensors on a passing vehicle: only what faces a sensor
//! is seen.

extern crate std;

use crate::random::Random;
use crate::{ObjectReturn, ObjectState};
use std::vec::Vec;

/// Body, then cabin: minimum and maximum corner, m.
type Boxes = [([f64; 3], [f64; 3]); 2];

fn boxes(length: f64, width: f64, height: f64) -> Boxes {
    let (l, w) = (length / 2.0, width / 2.0);
    let waist = 0.6 * height;
    [([-l, -w, 0.3], [l, w, waist]), ([-0.8 * l, -0.9 * w, waist], [0.35 * l, 0.9 * w, height])]
}

/// Distance along a ray to the nearest box that it hits.
fn hit(boxes: &Boxes, from: [f64; 3], along: [f64; 3]) -> Option<f64> {
    let mut best = f64::MAX;
    for (low, high) in boxes {
        let (mut enter, mut leave) = (0f64, f64::MAX);
        for axis in 0..3 {
            let a = (low[axis] - from[axis]) / along[axis];
            let b = (high[axis] - from[axis]) / along[axis];
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        if enter < leave {
            best = best.min(enter);
        }
    }
    (best < f64::MAX).then_some(best)
}

pub struct Drive {
    pub returns: Vec<ObjectReturn>,
    pub history: Vec<ObjectState>,
    /// At the middle of each sweep in which it is seen.
    pub truth: Vec<ObjectState>,
    /// Number of returns up to the end of each sweep.
    pub until: Vec<usize>,
    pub plan: Plan,
}

impl Drive {
    pub fn truth_at(&self, time: f64) -> ObjectState {
        path(&self.plan)(time)
    }
}

#[derive(Clone, Copy)]
pub struct Plan {
    pub seed: u64,
    pub seconds: f64,
    /// Of the object at the start.
    pub speed: f64,
    pub acceleration: f64,
    /// Amplitude and period of its turning rate.
    pub turn_rate: f64,
    pub period: f64,
    pub heading: f64,
    pub position: [f64; 2],
    /// Of the vehicle along x.
    pub vehicle_mps: f64,
    pub length: f64,
    pub width: f64,
    pub height: f64,
}

/// A parked car that the vehicle passes.
pub fn parked(seed: u64) -> Plan {
    let mut r = Random(seed * 7919 + 1);
    let vehicle_mps = f64::from(r.between(6.0, 11.0));
    let seconds = f64::from(r.between(5.0, 7.0));
    let side = if r.uniform() < 0.5 { -1.0 } else { 1.0 };
    let turned = if r.uniform() < 0.5 { 0.0 } else { std::f64::consts::PI };
    Plan {
        seed,
        seconds,
        speed: 0.0,
        acceleration: 0.0,
        turn_rate: 0.0,
        period: 1.0,
        heading: turned + 0.08 * r.normal(),
        position: [
            vehicle_mps * seconds * f64::from(r.between(0.4, 0.75)),
            side * f64::from(r.between(2.8, 6.5)),
        ],
        vehicle_mps,
        length: f64::from(r.between(3.6, 5.2)),
        width: f64::from(r.between(1.6, 2.0)),
        height: f64::from(r.between(1.4, 1.9)),
    }
}

/// A moving car: ahead, overtaken or oncoming, turning.
pub fn moving(seed: u64) -> Plan {
    let mut r = Random(seed * 104729 + 5);
    let still = parked(seed + 1000);
    let oncoming = r.uniform() < 0.35;
    let speed = f64::from(r.between(3.0, 12.0));
    let relative = still.vehicle_mps - if oncoming { -speed } else { speed };
    let ahead = relative * still.seconds * f64::from(r.between(0.2, 0.8));
    let side = if oncoming { 1.0 } else { r.normal().signum() };
    Plan {
        speed,
        acceleration: 0.5 * r.normal(),
        turn_rate: 0.15 * r.normal(),
        period: f64::from(r.between(4.0, 8.0)),
        heading: if oncoming { std::f64::consts::PI } else { 0.0 } + 0.05 * r.normal(),
        position: [ahead + f64::from(r.between(-8.0, 8.0)), side * f64::from(r.between(3.2, 7.0))],
        ..still
    }
}

const SWEEP_S: f64 = 0.1;
const AZIMUTHS: usize = 600;

pub fn drive(plan: Plan) -> Drive {
    let mut random = Random(plan.seed + 99);
    let truth_at = path(&plan);
    let boxes = boxes(plan.length, plan.width, plan.height);
    let mounts = [[0.8, 0.7, 1.7], [0.8, -0.7, 1.7], [-0.6, 0.7, 1.7], [-0.6, -0.7, 1.7]];
    let sweeps = (plan.seconds / SWEEP_S) as usize;
    let mut out = Drive {
        returns: Vec::new(),
        history: Vec::new(),
        truth: Vec::new(),
        until: Vec::new(),
        plan,
    };
    let mut tracker = None;
    let anchor = plan.position;
    for sweep in 0..sweeps {
        let before = out.returns.len();
        for (sensor, mount) in mounts.iter().enumerate() {
            for step in 0..AZIMUTHS {
                let turn = step as f64 / AZIMUTHS as f64;
                let time = (sweep as f64 + turn) * SWEEP_S;
                let azimuth = (turn + 0.25 * sensor as f64) * std::f64::consts::TAU;
                let state = truth_at(time);
                let from = [
                    plan.vehicle_mps * time + mount[0] - anchor[0],
                    mount[1] - anchor[1],
                    mount[2],
                ];
                let to = [state.position[0] - from[0], state.position[1] - from[1]];
                let (s, c) = azimuth.sin_cos();
                let ahead = to[0] * c + to[1] * s;
                if ahead < 0.0 || (to[0] * s - to[1] * c).abs() > 3.2 {
                    continue;
                }
                let (hs, hc) = state.heading.sin_cos();
                let local = [-(to[0] * hc + to[1] * hs), -(to[1] * hc - to[0] * hs), from[2]];
                for beam in 0..32 {
                    let elevation = (-30.67 + 1.333 * beam as f64 + 0.1).to_radians();
                    let (es, ec) = elevation.sin_cos();
                    let ray = |azimuth: f64| {
                        let (s, c) = azimuth.sin_cos();
                        [ec * (c * hc + s * hs), ec * (s * hc - c * hs), es]
                    };
                    let Some(range) = hit(&boxes, local, ray(azimuth)) else { continue };
                    let step = std::f64::consts::TAU / AZIMUTHS as f64;
                    let passes =
                        |side: f64| hit(&boxes, local, ray(azimuth + side * step)).is_none();
                    let range = range + 0.015 * random.normal();
                    let at = [ec * c * range, ec * s * range, es * range];
                    out.returns.push(ObjectReturn {
                        position: [0, 1, 2].map(|i| (from[i] + at[i]) as f32),
                        origin: from.map(|v| v as f32),
                        time_s: time as f32,
                        sensor: sensor as u8,
                        passed: [1.0, -1.0].map(passes),
                    });
                }
            }
        }
        let time_s = (sweep + 1) as f64 * SWEEP_S;
        let seen = &out.returns[before..];
        if !seen.is_empty() {
            let mut mean = [0.0; 3];
            for one in seen {
                for (sum, value) in mean.iter_mut().zip(one.position) {
                    *sum += f64::from(value) / seen.len() as f64;
                }
            }
            follow(&mut tracker, mean, time_s - 0.05);
            out.history.push(history_of(tracker.as_ref().unwrap()));
            out.truth.push(truth_at(time_s - 0.05));
        }
        out.until.push(out.returns.len());
    }
    out
}

/// The path as a function of time, finely integrated once.
fn path(plan: &Plan) -> impl Fn(f64) -> ObjectState + use<> {
    let plan = *plan;
    const STEP: f64 = 0.001;
    let mut states = Vec::new();
    let (mut x, mut y, mut heading) = (0.0, 0.0, plan.heading);
    for i in 0..(plan.seconds / STEP) as usize + 200 {
        let time_s = i as f64 * STEP;
        let speed = (plan.speed + plan.acceleration * time_s).max(0.0);
        let turn_rate = plan.turn_rate * (time_s * std::f64::consts::TAU / plan.period).sin();
        states.push(ObjectState {
            time_s,
            position: [x, y, 0.0],
            heading,
            speed,
            climb: 0.0,
            turn_rate,
        });
        x += STEP * speed * heading.cos();
        y += STEP * speed * heading.sin();
        heading += STEP * turn_rate;
    }
    move |time| {
        let at = (time / STEP).clamp(0.0, (states.len() - 2) as f64);
        let (i, u) = (at as usize, at.fract());
        let (a, b) = (states[i], states[i + 1]);
        ObjectState {
            time_s: time,
            position: [0, 1, 2].map(|d| a.position[d] + u * (b.position[d] - a.position[d])),
            heading: a.heading + u * (b.heading - a.heading),
            ..a
        }
    }
}

/// A filter of the centroid, each axis separately: position and velocity.
type Tracker = ([f64; 3], [f64; 3], f64, f64, f64);

fn follow(tracker: &mut Option<Tracker>, mean: [f64; 3], time: f64) {
    let Some((place, velocity, last, turned, count)) = tracker else {
        *tracker = Some((mean, [0.0; 3], time, 0.0, 1.0));
        return;
    };
    *count += 1.0;
    // Gains of a growing memory, down to steady ones.
    let both = *count * (*count + 1.0);
    let (alpha, beta) = ((2.0 * (2.0 * *count - 1.0) / both).max(0.5), (6.0 / both).max(0.15));
    let dt = time - *last;
    for axis in 0..3 {
        let predicted = place[axis] + dt * velocity[axis];
        let off = mean[axis] - predicted;
        place[axis] = predicted + alpha * off;
        velocity[axis] += beta * off / dt;
    }
    *turned = velocity[1].atan2(velocity[0]);
    *last = time;
}

fn history_of((place, velocity, time, heading, _): &Tracker) -> ObjectState {
    ObjectState {
        time_s: *time,
        position: *place,
        heading: *heading,
        speed: velocity[0].hypot(velocity[1]),
        climb: velocity[2],
        turn_rate: 0.0,
    }
}

/// Root mean square errors: position, velocity, heading, turn rate.
pub type Errors = [f64; 4];

/// Errors after a transform in the body's frame that is the same for the whole track.
pub fn errors(truth: &[ObjectState], estimate: impl Fn(f64) -> ObjectState) -> Errors {
    let states: Vec<ObjectState> = truth.iter().map(|t| estimate(t.time_s)).collect();
    let n = truth.len() as f64;
    // Mean difference of headings, as an angle.
    let (mut s, mut c) = (0.0, 0.0);
    for (t, e) in truth.iter().zip(&states) {
        let off = t.heading - e.heading;
        s += off.sin();
        c += off.cos();
    }
    let off = s.atan2(c);
    // Mean position of the true origin in the estimate's frame.
    let mut lever = [0.0; 3];
    for (t, e) in truth.iter().zip(&states) {
        let d = [0, 1, 2].map(|i| t.position[i] - e.position[i]);
        let (s, c) = e.heading.sin_cos();
        for (sum, value) in lever.iter_mut().zip([c * d[0] + s * d[1], c * d[1] - s * d[0], d[2]]) {
            *sum += value / n;
        }
    }
    let mut sums = [0.0; 4];
    for (t, e) in truth.iter().zip(&states) {
        let (s, c) = e.heading.sin_cos();
        let arm = [c * lever[0] - s * lever[1], s * lever[0] + c * lever[1], lever[2]];
        let d = [0, 1, 2].map(|i| e.position[i] + arm[i] - t.position[i]);
        sums[0] += d.iter().map(|v| v * v).sum::<f64>();
        // Velocity of the same point of the body.
        let (ts, tc) = t.heading.sin_cos();
        let v = [
            e.speed * c - e.turn_rate * arm[1] - t.speed * tc,
            e.speed * s + e.turn_rate * arm[0] - t.speed * ts,
            e.climb - t.climb,
        ];
        sums[1] += v.iter().map(|v| v * v).sum::<f64>();
        let turned = crate::wrap_angle(e.heading + off - t.heading);
        sums[2] += turned * turned;
        sums[3] += (e.turn_rate - t.turn_rate) * (e.turn_rate - t.turn_rate);
    }
    sums.map(|sum| (sum / n).sqrt())
}

/// The same for a history, at its own times.
pub fn history_errors(drive: &Drive) -> Errors {
    errors(&drive.truth, |time| {
        *drive
            .history
            .iter()
            .min_by(|a, b| (a.time_s - time).abs().total_cmp(&(b.time_s - time).abs()))
            .unwrap()
    })
}

/// A tram that comes towards the vehicle and passes it.
pub fn tram(seed: u64, speed: f64) -> Plan {
    Plan {
        seconds: 6.0,
        speed,
        heading: core::f64::consts::PI,
        position: [3.0 * (speed + 6.0), 4.5],
        vehicle_mps: 6.0,
        length: 30.0,
        width: 2.6,
        height: 3.4,
        ..parked(seed)
    }
}
