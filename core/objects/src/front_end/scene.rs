//! Scenes of boxes on flat ground, for tests.

extern crate std;
use super::*;
use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::{Point, Timing};
use std::boxed::Box;
use std::vec;
use std::vec::Vec;

pub const PARAMS: FrontEndParams = FrontEndParams::DEFAULT;

pub fn rig(sensors: usize, timing: Timing) -> Rig {
    let up = |n: usize| Pose::planar(0.0, n as f64, 1.7, 0.0);
    Rig {
        sensors: (0..sensors).map(up).collect(),
        timing,
        distorted: false,
        ground_m: 0.0,
        own_vehicle: None,
    }
}

pub const OFFSETS: Timing = Timing::Offset { from_s: 0.0, span_s: 0.1 };

/// A box on the ground, seen all around.
#[derive(Clone, Copy)]
pub struct SceneBox {
    pub at: [f64; 2],
    pub size: [f64; 3],
    pub velocity: [f64; 2],
}

impl SceneBox {
    pub fn car(x: f64, y: f64, velocity: [f64; 2]) -> SceneBox {
        SceneBox { at: [x, y], size: [4.0, 1.8, 1.5], velocity }
    }

    /// Points of its sides `time_s` after the start.
    pub fn points(&self, time_s: f64) -> Vec<[f64; 3]> {
        let [l, w, h] = self.size;
        let centre = [0, 1].map(|a| self.at[a] + time_s * self.velocity[a]);
        let mut points = Vec::new();
        let steps = |length: f64| (length / 0.2) as i32;
        for k in 1..=steps(h) {
            for i in 0..=steps(l) {
                for j in 0..=steps(w) {
                    if i == 0 || j == 0 || i == steps(l) || j == steps(w) {
                        let [x, y] = [i as f64 * 0.2 - 0.5 * l, j as f64 * 0.2 - 0.5 * w];
                        points.push([centre[0] + x, centre[1] + y, k as f64 * 0.2]);
                    }
                }
            }
        }
        points
    }
}

/// Points of flat ground up to 45 m away.
pub fn ground() -> Vec<[f64; 3]> {
    let at = |n: i32| n as f64 * 0.6 - 44.9;
    (0..150).flat_map(|i| (0..150).map(move |j| [at(i), at(j), 0.0])).collect()
}

/// What a sensor sees `offset_s` after the stamp.
pub fn seen(things: &[SceneBox], stamp_s: f64, offset_s: f32, sensor: u32) -> Vec<Point> {
    let places = things.iter().flat_map(|t| t.points(stamp_s + offset_s as f64));
    let point =
        |p: [f64; 3]| Point { position: p.map(|v| v as f32), intensity: 0.0, offset_s, sensor };
    ground().into_iter().chain(places).map(point).collect()
}

pub struct Run {
    pub front_end: Box<FrontEnd>,
    pub tracks: Vec<Track>,
    pub rig: Rig,
    pub place: Pose,
}

impl Run {
    pub fn new(sensors: usize, capacity: usize) -> Run {
        Run {
            front_end: raywake_alloc_guard::boxed!(FrontEnd, FrontEnd::new()),
            tracks: vec![Track::new(); capacity],
            rig: rig(sensors, OFFSETS),
            place: Pose::IDENTITY,
        }
    }

    pub fn take(&mut self, stamp_s: f64, points: &[Point], flows: Option<Flows>) {
        let sweep = Sweep { stamp_s, points, world_from_vehicle: self.place, twist: Twist::ZERO };
        self.front_end.take(&PARAMS, &self.rig, &sweep, flows);
    }

    pub fn step(&mut self) -> TrackingCounts {
        self.front_end.step(&PARAMS, None, &mut self.tracks)
    }

    pub fn see(&mut self, things: &[SceneBox], stamp_s: f64) -> TrackingCounts {
        self.take(stamp_s, &seen(things, stamp_s, 0.0, 0), None);
        self.step()
    }

    pub fn live(&self) -> Vec<&Track> {
        self.tracks.iter().filter(|t| t.status == TrackStatus::Live).collect()
    }
}
