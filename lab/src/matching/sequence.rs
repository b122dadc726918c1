//! Ego motion of a drive: each sweep registered with the few before it.

use glam::DVec3;
use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::{Point, Rig};
use raywake_registration::deskew::{TimedPoint, VOXEL_M, span_s, thin, thin_sweep};
use raywake_registration::{
    CORRESPONDENCES, Correspondence, IcpOptions, OrientedCloud, OrientedPoint, Registration,
    register,
};
use std::collections::VecDeque;

/// Sweeps that the target has beside the one before. With four, simulated drives end closer to the
/// truth than with none (0.01 against 0.15 degrees, 1 against 3 cm in 20 sweeps), single steps are
/// as good, and a pair takes a third longer.
const EARLIER: usize = 4;
/// Times that a pair is deskewed by the motion found so far and registered again, at most.
const ROUNDS: usize = 4;
/// A motion this close to the one that the sweeps were deskewed by changes no point by more than
/// half of it (m, and rad at 20 m).
const CLOSE_M: f64 = 0.02;
const CLOSE_RAD: f64 = 0.001;

/// Motion from one sweep to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matched {
    /// `before_from_now`; the initial one where the registration did not converge.
    pub motion: Pose,
    /// The last registration; its source is the later sweep.
    pub registration: Registration,
    /// Registrations it took, each deskewed by the motion before it.
    pub rounds: usize,
}

/// Registers sweeps in the order they come.
pub struct Matcher {
    rig: Rig,
    before: Option<(f64, Vec<TimedPoint>)>,
    /// Points of sweeps before that one, in its frame, deskewed; the latest first.
    earlier: VecDeque<Vec<DVec3>>,
    correspondences: Vec<Correspondence>,
}

/// The points where they were at the stamp, for a vehicle with this motion.
fn at_stamp(points: &[TimedPoint], twist: Twist) -> impl Iterator<Item = DVec3> {
    points.iter().map(move |p| p.at_stamp(&twist))
}

impl Matcher {
    pub fn new(rig: &Rig) -> Matcher {
        Matcher {
            rig: rig.clone(),
            before: None,
            earlier: VecDeque::new(),
            correspondences: vec![Correspondence::default(); CORRESPONDENCES],
        }
    }

    /// The motion from the sweep before this one, started at `initial` (`before_from_now`). `None`
    /// on the first sweep.
    pub fn next(&mut self, stamp_s: f64, points: &[Point], initial: Pose) -> Option<Matched> {
        let mut storage = vec![TimedPoint::default(); points.len()];
        let now = thin_sweep(points, &self.rig, &mut storage).to_vec();
        let before = self.before.take();
        let matched = before.map(|(before_s, before)| {
            let dt_s = self.duration_s(stamp_s - before_s);
            let matched = self.pair(&before, &now, dt_s, initial);
            self.remember(&before, dt_s, &matched);
            matched
        });
        self.before = Some((stamp_s, now));
        matched
    }

    /// Moves the sweep before to the earlier ones, and all of them into the frame of this one.
    /// Where the motion is unknown they are of no use.
    fn remember(&mut self, before: &[TimedPoint], dt_s: f64, matched: &Matched) {
        if !matched.registration.converged {
            self.earlier.clear();
            return;
        }
        self.earlier.push_front(at_stamp(before, matched.motion.twist(dt_s)).collect());
        self.earlier.truncate(EARLIER);
        let now_from_before = matched.motion.inverse();
        for p in self.earlier.iter_mut().flatten() {
            *p = now_from_before.transform(*p);
        }
    }

    /// The sweep before, and where it leaves voxels empty the earlier ones.
    fn target(&self, before: impl Iterator<Item = DVec3>) -> Vec<OrientedPoint> {
        let all = before.chain(self.earlier.iter().flatten().copied());
        let mut all: Vec<TimedPoint> = all.map(TimedPoint::from).collect();
        thin(&mut all, VOXEL_M).iter().map(|p| p.position.into()).collect()
    }

    /// Time between two stamps: whole turns where the sensor spins, as stamps are often coarser.
    fn duration_s(&self, between_s: f64) -> f64 {
        match span_s(&self.rig) {
            Some(turn_s) if turn_s > 0.0 => (between_s / turn_s).round().max(1.0) * turn_s,
            _ => between_s,
        }
    }

    /// Both sweeps are deskewed as if the vehicle had moved evenly from stamp to stamp.
    fn pair(
        &mut self,
        before: &[TimedPoint],
        now: &[TimedPoint],
        dt_s: f64,
        initial: Pose,
    ) -> Matched {
        let mut motion = initial;
        for rounds in 1.. {
            let mut target = self.target(at_stamp(before, motion.twist(dt_s)));
            let source = at_stamp(now, motion.inverse().twist(-dt_s));
            let mut source: Vec<OrientedPoint> = source.map(OrientedPoint::from).collect();
            let [source, target] = [&mut source, &mut target].map(|p| OrientedCloud::new(p));
            let pairs = &mut self.correspondences;
            let registration = register(&source, &target, motion, &IcpOptions::DEFAULT, pairs);
            if !registration.converged {
                return Matched { motion: initial, registration, rounds };
            }
            let change = (motion.inverse() * registration.pose).twist(1.0);
            motion = registration.pose;
            let close = change.linear.length() < CLOSE_M && change.angular.length() < CLOSE_RAD;
            if close || !self.rig.distorted || rounds == ROUNDS {
                return Matched { motion, registration, rounds };
            }
        }
        unreachable!("the last round returns")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;
    use raywake_io::source::{OpenOptions, SweepData, open};
    use raywake_sim::{Drive, Ego, Options as Sim};

    #[test]
    fn a_simulated_drive_from_nothing() {
        let ego = Ego::Straight { speed: 11.0 };
        let drive = Drive::new(4, Sim { sweeps: 3, ego, ..Sim::default() });
        let mut matcher = Matcher::new(&drive.rig());
        let mut before = None;
        for sweep in drive {
            let found = matcher.next(sweep.stamp_s, &sweep.points, Pose::IDENTITY);
            let truth = before.map(|b: Pose| b.inverse() * sweep.world_from_vehicle);
            assert_eq!(found.is_some(), truth.is_some());
            if let (Some(found), Some(truth)) = (found, truth) {
                let error = (truth.inverse() * found.motion).twist(1.0);
                let (m, rad) = (error.linear.length(), error.angular.length());
                assert!(found.registration.converged && found.rounds > 1, "{found:?}");
                assert!(m < 0.03 && rad.to_degrees() < 0.06, "{m} m, {rad} rad, {found:?}");
            }
            before = Some(sweep.world_from_vehicle);
        }
    }

    #[test]
    fn sweeps_without_returns_fall_back() {
        let drive = Drive::new(4, Sim { sweeps: 1, ..Sim::default() });
        let mut matcher = Matcher::new(&drive.rig());
        let initial = Pose::planar(1.0, 0.0, 0.0, 0.1);
        assert_eq!(matcher.next(0.0, &[], initial), None);
        let nan = Point { position: [f32::NAN; 3], ..Point::default() };
        let found = matcher.next(0.1, &[nan; 1000], initial).unwrap();
        assert!(!found.registration.converged && found.motion == initial);
    }

    /// Pairs of the drive against its given poses, from near and from as far off as is promised.
    #[test]
    #[ignore = "needs RAYWAKE_DATA"]
    fn pairs_of_a_recorded_drive() {
        let folder = std::env::var_os("RAYWAKE_DATA").expect("RAYWAKE_DATA names a folder");
        let drive = std::path::Path::new(&folder).join("kitti_raw_0005");
        let mut source = open(&drive, &OpenOptions::default()).unwrap();
        let [mut first, mut second] = [SweepData::default(), SweepData::default()];
        for index in [5, 60, 100, 140] {
            source.read(index, &mut first).unwrap();
            source.read(index + 1, &mut second).unwrap();
            let given = first.world_from_vehicle.inverse() * second.world_from_vehicle;
            let off = [
                Pose::IDENTITY,
                given.inverse(),
                Pose::planar(2.0, 0.5, 0.0, 5f64.to_radians()),
                Pose::planar(-2.0, -0.5, 0.1, -5f64.to_radians()),
                Pose::new(DQuat::from_rotation_x(2f64.to_radians()), DVec3::new(2.9, 0.0, 0.0)),
            ];
            for (n, off) in off.iter().enumerate() {
                let mut matcher = Matcher::new(source.rig());
                assert!(matcher.next(first.stamp_s, &first.points, Pose::IDENTITY).is_none());
                let found = matcher.next(second.stamp_s, &second.points, given * *off).unwrap();
                let apart = (given.inverse() * found.motion).twist(1.0);
                let (metres, degrees) =
                    (apart.linear.length(), apart.angular.length().to_degrees());
                println!("pair {index}, start {n}: {metres:.4} m, {degrees:.4} deg, {found:?}");
                assert!(found.registration.converged && found.registration.unobserved.count() == 0);
                assert!(metres < 0.02 && degrees < 0.08, "pair {index}, start {n}");
            }
        }
    }
}
