//! Tracks in the world: the true motion of labelled objects.

use super::smooth::{Sample, fit, polynomial};
use super::sweeps::{Sweeps, turn};
use super::{Labels, Track};
use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_io::source::Source;

/// An object is parked if the boxes of its track lie within this of their mean (root mean square,
/// on the ground), m. A voxel's side: boxes of parked vehicles wander by up to two thirds of it as
/// the vehicle passes, because its own poses drift. A creeping object moves 1 m before it exceeds
/// this.
pub const PARKED_M: f64 = 0.3;

/// The same for exact labels, m: the sway of a body on its springs.
const EXACT_M: f64 = 0.01;

/// Speed over ground from which on an object moves, and below which one is parked, m/s.
pub const MOVING_MPS: f64 = 0.5;

/// Motion of an object at a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Static for as long as it is labelled: its true velocity is 0.
    Parked,
    /// Moves at [`MOVING_MPS`] or more.
    Moving,
    /// Slower than that, though not parked: at a traffic light, or standing around. Its labels do
    /// not distinguish noise from motion.
    Slow,
}

/// An object at a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Frame of the sweep.
    pub frame: u64,
    /// Index of the sweep in the source.
    pub index: usize,
    /// Stamp of the sweep, s.
    pub stamp_s: f64,
    /// Pose of the vehicle.
    pub world_from_vehicle: Pose,
    /// Smoothed pose of the box, upright.
    pub world_from_box: Pose,
    /// Velocity of the box's centre over ground, along the axes of the world, m/s.
    pub velocity: DVec3,
    /// Its motion.
    pub motion: Motion,
}

/// A track in the world.
///
/// Poses of parked objects are their mean, so that they do not move at all. Those of others are
/// smoothed: a quadratic is fitted by least squares to position and heading of the boxes within
/// five sweeps and evaluated at the sweep; a line if there are fewer than five boxes. At the ends
/// of a track the window is one-sided. Exact labels are kept as they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    states: Vec<State>,
}

/// The trajectories of all tracks, in their order; boxes of frames missing from the source are
/// ignored.
pub fn trajectories(labels: &Labels, source: &dyn Source) -> Vec<Trajectory> {
    let sweeps = Sweeps::of(source);
    labels.tracks.iter().map(|t| Trajectory::new(t, labels.exact, &sweeps)).collect()
}

impl Trajectory {
    fn new(track: &Track, exact: bool, sweeps: &Sweeps) -> Trajectory {
        let (states, headings) = placed(track, sweeps);
        let samples: Vec<Sample> = states
            .iter()
            .zip(&headings)
            .map(|(s, &yaw)| Sample {
                index: s.index,
                stamp_s: s.stamp_s,
                at: s.world_from_box.translation,
                yaw,
            })
            .collect();
        let mut trajectory = Trajectory { states };
        let tolerance_m = if exact { EXACT_M } else { PARKED_M };
        if let Some(mean) = parked(&samples, tolerance_m) {
            trajectory.park(mean);
        } else {
            trajectory.smooth(&samples, exact);
        }
        trajectory
    }

    fn park(&mut self, mean: Pose) {
        for state in &mut self.states {
            (state.world_from_box, state.velocity) = (mean, DVec3::ZERO);
            state.motion = Motion::Parked;
        }
    }

    fn smooth(&mut self, samples: &[Sample], exact: bool) {
        for (n, state) in self.states.iter_mut().enumerate() {
            let fit = fit(samples, n, exact);
            if !exact {
                state.world_from_box = Pose::planar(fit.at.x, fit.at.y, fit.at.z, fit.yaw);
            }
            state.velocity = fit.velocity;
            let moves = state.velocity.length() >= MOVING_MPS;
            state.motion = if moves { Motion::Moving } else { Motion::Slow };
        }
    }

    /// States at all labelled sweeps, in order of time.
    pub fn states(&self) -> &[State] {
        &self.states
    }

    /// State at a frame; `None` if it is not labelled.
    pub fn at(&self, frame: u64) -> Option<&State> {
        self.place(frame).map(|n| &self.states[n])
    }

    fn place(&self, frame: u64) -> Option<usize> {
        self.states.binary_search_by_key(&frame, |s| s.frame).ok()
    }

    /// Motion of its body from the sweep of a frame to the next sweep of the source, as a transform
    /// of points of the world; `None` if either has no box.
    pub fn step(&self, frame: u64) -> Option<Pose> {
        let n = self.place(frame)?;
        let (here, next) = (&self.states[n], self.states.get(n + 1)?);
        let follows = next.index == here.index + 1;
        follows.then(|| match here.motion {
            Motion::Parked => Pose::IDENTITY,
            _ => next.world_from_box * here.world_from_box.inverse(),
        })
    }

    /// Displacement over ground of a point of its body, given in the vehicle frame of a frame's
    /// sweep, until the next sweep; along the axes of the world, m. `None` as for
    /// [`Trajectory::step`].
    pub fn displacement(&self, frame: u64, at: DVec3) -> Option<DVec3> {
        let point = self.at(frame)?.world_from_vehicle.transform(at);
        Some(self.step(frame)?.transform(point) - point)
    }
}

/// The boxes of a track in the world as labelled, and their unwrapped headings, rad.
fn placed(track: &Track, sweeps: &Sweeps) -> (Vec<State>, Vec<f64>) {
    let (mut states, mut headings): (Vec<State>, Vec<f64>) = Default::default();
    for (&frame, &vehicle_from_box) in &track.boxes {
        let Some(index) = sweeps.index(frame) else { continue };
        let (stamp_s, world_from_vehicle) = sweeps.moment(index);
        let world_from_box = world_from_vehicle * vehicle_from_box;
        let yaw = world_from_box.yaw_rad();
        headings.push(headings.last().map_or(yaw, |last| last + turn(*last, yaw)));
        let (velocity, motion) = (DVec3::ZERO, Motion::Slow);
        states.push(State {
            frame,
            index,
            stamp_s,
            world_from_vehicle,
            world_from_box,
            velocity,
            motion,
        });
    }
    (states, headings)
}

/// The mean pose of an object that is parked: its boxes lie within a tolerance of it and hide no
/// steady motion of [`MOVING_MPS`], as a short track might. A track of one box is inconclusive.
fn parked(samples: &[Sample], tolerance_m: f64) -> Option<Pose> {
    if samples.len() < 2 {
        return None;
    }
    let (at, yaw) = samples.iter().fold((DVec3::ZERO, 0.0), |s, b| (s.0 + b.at, s.1 + b.yaw));
    let (at, yaw) = (at / samples.len() as f64, yaw / samples.len() as f64);
    let square: f64 = samples.iter().map(|s| (s.at - at).truncate().length_squared()).sum();
    let stays = square <= tolerance_m.powi(2) * samples.len() as f64;
    let drift = polynomial(samples, samples[0].stamp_s, 1).velocity.truncate().length();
    (stays && drift < MOVING_MPS).then(|| Pose::planar(at.x, at.y, at.z, yaw))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Road, labels_of, track};
    use super::*;

    /// A vehicle that turns as it drives, and boxes given in the world.
    fn trajectory(exact: bool, world_from_box: impl Fn(f64) -> Pose, count: usize) -> Trajectory {
        let road = Road::of(
            (0..count)
                .map(|i| 0.1 * i as f64)
                .map(|t| (t, Pose::planar(8.0 * t, 0.3 * t * t, 0.0, 0.2 * t))),
        );
        let boxes = (0..count as u64).map(|f| {
            let (t, pose) = road.moment(f as usize);
            (f, pose.inverse() * world_from_box(t))
        });
        let labels = Labels { exact, ..labels_of([track("a", boxes)]) };
        trajectories(&labels, &road).remove(0)
    }

    /// Noise of a fixed pattern, of amplitude 1.
    fn noise(t: f64) -> f64 {
        (1e4 * t).sin()
    }

    #[test]
    fn steady_acceleration_and_turn_are_kept_and_noise_is_not() {
        let truth = |t: f64| Pose::planar(3.0 + 5.0 * t + t * t, 2.0 - t, 0.1 * t, 3.0 + 0.4 * t);
        let found = trajectory(false, truth, 20);
        for state in found.states() {
            let expected = truth(state.stamp_s);
            let off = (expected.inverse() * state.world_from_box).translation.length();
            assert!(off < 1e-9, "{state:?}");
            let velocity = DVec3::new(5.0 + 2.0 * state.stamp_s, -1.0, 0.1);
            assert!((state.velocity - velocity).length() < 1e-9);
            assert_eq!(state.motion, Motion::Moving);
        }
        let shaken = |t: f64| {
            let p = truth(t);
            Pose { translation: p.translation + 0.03 * noise(t) * DVec3::Y, ..p }
        };
        let smooth = trajectory(false, shaken, 20);
        let (mut raw, mut left) = (0.0, 0.0);
        for state in &smooth.states()[5..15] {
            raw += (0.03 * noise(state.stamp_s)).powi(2);
            left +=
                (state.world_from_box.translation.y - truth(state.stamp_s).translation.y).powi(2);
        }
        assert!(left < 0.5 * raw, "{left} of {raw}");
    }

    #[test]
    fn a_point_of_a_turning_body() {
        // Rotating about (20, 5) at 1 rad/s, with its centre 3 m ahead of that point.
        let truth = |t: f64| Pose::planar(20.0, 5.0, 0.0, t) * Pose::planar(3.0, 0.0, 0.0, 0.0);
        let exact = trajectory(true, truth, 5);
        let at = exact.at(2).unwrap().world_from_vehicle.inverse();
        let middle = exact.displacement(2, at.transform(DVec3::new(20.0, 5.0, 0.7))).unwrap();
        assert!(middle.length() < 1e-9, "{middle}");
        let beside = exact.displacement(2, at.transform(DVec3::new(22.0, 5.0, 0.0))).unwrap();
        let expected = DVec3::new(2.0 * (0.1f64.cos() - 1.0), 2.0 * 0.1f64.sin(), 0.0);
        assert!((beside - expected).length() < 1e-9, "{beside}");
        assert_eq!(
            (exact.displacement(4, DVec3::ZERO), exact.displacement(9, DVec3::ZERO)),
            (None, None)
        );
    }

    #[test]
    fn parked_moving_and_neither() {
        let stands = |t: f64| Pose::planar(9.0 + 0.1 * noise(t), 4.0, 0.0, 3.1 + 0.2 * noise(t));
        let parked = trajectory(false, stands, 12);
        assert!(parked.states().iter().all(|s| s.motion == Motion::Parked));
        assert_eq!(parked.step(3), Some(Pose::IDENTITY));
        assert_eq!(parked.displacement(3, DVec3::X), Some(DVec3::ZERO));
        assert_eq!(parked.step(11), None);
        let mean = parked.at(0).unwrap().world_from_box;
        assert!((mean.translation.x - 9.0).abs() < 0.05 && turn(mean.yaw_rad(), 3.1).abs() < 0.1);
        // Static for a second, then leaves.
        let leaves = |t: f64| Pose::planar(9.0 + 2.0 * (t - 1.0).max(0.0).powi(2), 0.0, 0.0, 0.0);
        let leaving = trajectory(false, leaves, 30);
        let motion = |frame: u64| leaving.at(frame).unwrap().motion;
        assert_eq!((motion(2), motion(20)), (Motion::Slow, Motion::Moving));
        // An object that creeps is not parked if labels are exact.
        let creeps = |t: f64| Pose::planar(0.3 * t, 0.0, 0.0, 0.0);
        assert_eq!(trajectory(true, creeps, 20).at(9).unwrap().motion, Motion::Slow);
        assert_eq!(trajectory(false, creeps, 20).at(9).unwrap().motion, Motion::Parked);
        // Nothing gets far in two sweeps.
        let walks = |t: f64| Pose::planar(1.5 * t, 0.0, 0.0, 0.0);
        assert_eq!(trajectory(false, walks, 2).at(0).unwrap().motion, Motion::Moving);
        assert_eq!(trajectory(false, walks, 1).at(0).unwrap().motion, Motion::Slow);
    }

    #[test]
    fn a_sweep_without_boxes_affects_only_its_own_steps() {
        let road = Road::of((0..8).map(|i| (0.1 * i as f64, Pose::IDENTITY)));
        let boxes =
            (0..8u64).filter(|f| *f != 4).map(|f| (f, Pose::planar(f as f64, 0.0, 0.0, 0.0)));
        let found = trajectories(&labels_of([track("a", boxes)]), &road).remove(0);
        assert!(found.at(4).is_none());
        let steps: Vec<bool> = (0..8).map(|f| found.step(f).is_some()).collect();
        assert_eq!(steps, [true, true, true, false, false, true, true, false]);
        assert!((found.step(5).unwrap().translation.x - 1.0).abs() < 1e-9);
    }
}
