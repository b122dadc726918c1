//! The labelled objects of every sweep, with their motion to the next.

use crate::labels::trajectory::State;
use crate::labels::{Footprint, Kind, Labels, Motion, Trajectory, trajectories};
use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_io::source::Source;
use std::collections::HashMap;

/// How long before its first box and after its last one a moving object is taken to move on as it
/// does there, s. A car of `kitti_raw_0005` is in the camera's view, and reported, for 0.4 s before
/// its first box. Precision there if 0.5 m around movers are forgiven, and false columns a sweep
/// farther than 2 m: 98.2 % and 0.71, without this 97.0 % and 1.23.
pub const CONTINUED_S: f64 = 0.5;

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
pub struct Objects {
    frames: HashMap<u64, Vec<Present>>,
    /// Where something moves shortly before its first box and after its last one, seen from above,
    /// vehicle frame; nothing if the labels are exact: others may begin late.
    continued: HashMap<u64, Vec<Footprint>>,
}

impl Objects {
    /// From labels, with the poses of the drive.
    pub fn new(labels: &Labels, source: &dyn Source) -> Objects {
        let mut frames: HashMap<u64, Vec<Present>> = HashMap::new();
        let mut beyond: HashMap<u64, Vec<Footprint>> = HashMap::new();
        let all = trajectories(labels, source);
        for (index, (track, trajectory)) in labels.tracks.iter().zip(&all).enumerate() {
            // Parts of a track that was cut are named after the whole.
            let id = track.id.split('/').next().filter(|_| labels.exact);
            let id = id.and_then(|id| id.parse().ok());
            let states = trajectory.states();
            if !labels.exact {
                for (frame, vehicle_from_box) in continued(trajectory, source) {
                    let footprint = Footprint::new(vehicle_from_box, track.size[0], track.size[1]);
                    beyond.entry(frame).or_default().push(footprint);
                }
            }
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
        Objects { frames, continued: beyond }
    }

    /// Objects in the sweep of `frame`, in the order of the labels.
    pub fn at(&self, frame: u64) -> &[Present] {
        self.frames.get(&frame).map_or(&[], Vec::as_slice)
    }

    /// Distance from a point of the vehicle frame of a sweep to the nearest moving object, seen
    /// from above, m; infinite if nothing moves.
    pub fn mover_m(&self, frame: u64, at: DVec3) -> f32 {
        let movers = self.at(frame).iter().filter(|p| p.motion == Motion::Moving);
        let continued = self.continued.get(&frame).into_iter().flatten();
        let movers = movers.map(|p| &p.footprint).chain(continued);
        movers.map(|footprint| footprint.distance_m(at)).fold(f64::INFINITY, f64::min) as f32
    }
}

/// Where an object that moves at its first or last box was up to [`CONTINUED_S`] before or will be
/// after it: the sweep's frame, and the box in its vehicle frame.
fn continued(trajectory: &Trajectory, source: &dyn Source) -> Vec<(u64, Pose)> {
    let [Some(first), Some(last)] = [trajectory.states().first(), trajectory.states().last()]
    else {
        return Vec::new();
    };
    let before = (0..first.index).map(|index| (first, index));
    let after = (last.index + 1..source.len()).map(|index| (last, index));
    let placed = |(state, index): (&State, usize)| {
        let since_s = source.stamp_s(index) - state.stamp_s;
        let counts = state.motion == Motion::Moving && since_s.abs() <= CONTINUED_S;
        counts.then(|| {
            let Pose { rotation, translation } = state.world_from_box;
            let there = Pose::new(rotation, translation + state.velocity * since_s);
            (source.frame(index), source.pose(index).inverse() * there)
        })
    };
    before.chain(after).filter_map(placed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::tests::{Road, labels_of, track};

    /// How far from what moves a place is that is `ahead` of the middle of a car, in a frame. The
    /// car is labelled in frames 10 to 15 only, and drives at `speed`.
    fn mover_m(frame: u64, ahead: f64, speed: f64, exact: bool) -> f32 {
        let moments = (0..30).map(|n| 0.1 * f64::from(n));
        let road = Road::of(moments.map(|t| (t, Pose::planar(2.0 * t, 0.0, 0.0, 0.0))));
        let at = |frame: u64| {
            let (t, pose) = road.moment(frame as usize);
            pose.inverse() * Pose::planar(10.0, speed * t, 0.0, 1.5)
        };
        let car = track("a", (10..16).map(|frame| (frame, at(frame))));
        let objects = Objects::new(&Labels { exact, ..labels_of([car]) }, &road);
        objects.mover_m(frame, at(frame).translation + ahead * DVec3::Y)
    }

    #[test]
    fn movers_go_on_beyond_their_boxes_for_a_moment() {
        for frame in 5..=20 {
            // The car is 4 m long.
            for end in [-1.0, 1.0] {
                assert_eq!(mover_m(frame, 1.9 * end, 5.0, false), 0.0, "{frame}");
                assert!(mover_m(frame, 2.1 * end, 5.0, false) > 0.0, "{frame}");
            }
        }
        for frame in [4, 21] {
            assert_eq!(mover_m(frame, 0.0, 5.0, false), f32::INFINITY, "{frame}");
        }
        // Exact boxes begin when they do, and what is parked does not move before.
        let exact = |frame| mover_m(frame, 0.0, 5.0, true);
        assert_eq!((exact(12), exact(8)), (0.0, f32::INFINITY));
        assert_eq!(mover_m(8, 0.0, 0.0, false), f32::INFINITY);
    }
}
