//! The labelled objects of every sweep, with their motion to the next.

use crate::labels::{Footprint, Kind, Labels, Motion, trajectories};
use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_io::source::Source;
use std::collections::HashMap;

/// An object in one sweep.
#[derive(Clone, Debug)]
pub struct Present {
    /// Index of the track.
    pub track: u32,
    /// Id in the truth of a simulated drive's returns.
    pub id: Option<u32>,
    /// Kind of the object.
    pub kind: Kind,
    /// Seen from above, vehicle frame.
    pub footprint: Footprint,
    /// The box's frame is centred in it.
    pub vehicle_from_box: Pose,
    /// Length, width and height, m.
    pub size: [f64; 3],
    /// Its motion over the track.
    pub motion: Motion,
    /// Motion to the next sweep; `None` if the object has no box there.
    pub step: Option<Step>,
}

impl Present {
    /// Distance from a point of the vehicle frame to the nearest box of a moving object, seen from
    /// above, m; infinite if nothing moves.
    pub fn mover_m(all: &[Present], at: DVec3) -> f32 {
        let movers = all.iter().filter(|p| p.motion == Motion::Moving);
        movers.map(|p| p.footprint.distance_m(at)).fold(f64::INFINITY, f64::min) as f32
    }

    /// Whether a point of the vehicle frame lies in the box, or within `margin_m` of it.
    pub fn holds(&self, at: DVec3, margin_m: f64) -> bool {
        self.footprint.holds(at, margin_m)
            && (at.z - self.vehicle_from_box.translation.z).abs() <= 0.5 * self.size[2] + margin_m
    }
}

/// Motion of an object from a sweep to the next, as transforms of points of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// By the labels as given.
    pub raw: Pose,
    /// By the smoothed labels; the identity for parked objects.
    pub smooth: Pose,
}

/// The objects of a drive by frame.
pub struct Objects(HashMap<u64, Vec<Present>>);

impl Objects {
    /// From labels, with the poses of the drive.
    pub fn new(labels: &Labels, source: &dyn Source) -> Objects {
        let mut frames: HashMap<u64, Vec<Present>> = HashMap::new();
        let all = trajectories(labels, source);
        for (index, (track, trajectory)) in labels.tracks.iter().zip(&all).enumerate() {
            // Parts of a track that was cut are named after the whole.
            let id = track.id.split('/').next().filter(|_| labels.exact);
            let id = id.and_then(|id| id.parse().ok());
            let states = trajectory.states();
            for (n, state) in states.iter().enumerate() {
                let now = track.boxes[&state.frame];
                let step = trajectory.step(state.frame).map(|smooth| {
                    let next = &states[n + 1];
                    let there = next.world_from_vehicle * track.boxes[&next.frame];
                    let raw = there * (state.world_from_vehicle * now).inverse();
                    Step { raw, smooth }
                });
                frames.entry(state.frame).or_default().push(Present {
                    track: index as u32,
                    id,
                    kind: track.kind,
                    footprint: Footprint::new(now, track.size[0], track.size[1]),
                    vehicle_from_box: now,
                    size: track.size,
                    motion: state.motion,
                    step,
                });
            }
        }
        Objects(frames)
    }

    /// Objects in the sweep of `frame`, in the order of the labels.
    pub fn at(&self, frame: u64) -> &[Present] {
        self.0.get(&frame).map_or(&[], Vec::as_slice)
    }
}
