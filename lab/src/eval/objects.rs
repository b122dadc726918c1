//! The labelled objects of every sweep, with their motion.

use super::row::class_of;
use crate::labels::{Footprint, Labels};
use glam::DVec3;
use raywake::source::Source;
use raywake_core::pose::Pose;
use std::collections::HashMap;

/// From this speed over ground on something moves, m/s.
pub const MOVING_MPS: f64 = 0.5;

/// An object in one sweep.
#[derive(Clone, Debug)]
pub struct Present {
    /// Index of the track.
    pub track: u32,
    /// Index in [`super::row::CLASSES`].
    pub class: u8,
    /// From above, vehicle frame.
    pub footprint: Footprint,
    /// Height of the box's centre in the vehicle frame, m.
    pub height_m: f64,
    /// Whether it moves over ground.
    pub moving: bool,
    /// World motion to the next sweep by the labels as they are; none where the object has no box
    /// there.
    pub raw: Option<Pose>,
    /// Centre in the world, m.
    centre: DVec3,
    /// Smoothed velocity over ground of the centre, m/s.
    linear: DVec3,
    /// Smoothed rate of turn, rad/s.
    turn_radps: f64,
}

impl Present {
    /// Smoothed velocity over ground of a point (world frame) of the object, m/s; zero where it is
    /// parked.
    pub fn velocity(&self, world: DVec3) -> DVec3 {
        if !self.moving {
            return DVec3::ZERO;
        }
        let arm = world - self.centre;
        self.linear + DVec3::new(-arm.y, arm.x, 0.0) * self.turn_radps
    }
}

/// Where the objects of a drive are.
pub struct Objects {
    /// By frame.
    frames: HashMap<u64, Vec<Present>>,
    /// What did not fit.
    pub notes: Vec<String>,
}

impl Objects {
    /// Of labels and poses.
    pub fn new(labels: &Labels, source: &dyn Source) -> Objects {
        let stamps: Vec<(u64, f64, Pose)> = (0..source.len())
            .map(|n| (source.frame(n), source.stamp_s(n), source.pose(n)))
            .collect();
        let mut frames: HashMap<u64, Vec<Present>> = HashMap::new();
        for pair in stamps.windows(2) {
            let ((frame, t0, from), (then, t1, to)) = (pair[0], pair[1]);
            for (index, track) in labels.tracks.iter().enumerate() {
                let Some(now) = track.boxes.get(&frame) else { continue };
                let here = from * *now;
                let next = track.boxes.get(&then).map(|b| to * *b);
                let linear =
                    next.map_or(DVec3::ZERO, |n| (n.translation - here.translation) / (t1 - t0));
                frames.entry(frame).or_default().push(Present {
                    track: index as u32,
                    class: class_of(track.kind),
                    footprint: Footprint::new(*now, track.size[0], track.size[1]),
                    height_m: now.translation.z,
                    moving: linear.length() > MOVING_MPS,
                    raw: next.map(|n| n * here.inverse()),
                    centre: here.translation,
                    linear,
                    turn_radps: 0.0,
                });
            }
        }
        Objects { frames, notes: Vec::new() }
    }

    /// Objects in the sweep of `frame`, in the order of the labels.
    pub fn at(&self, frame: u64) -> &[Present] {
        self.frames.get(&frame).map_or(&[], Vec::as_slice)
    }
}
