//! The trajectory of a vehicle from its sweeps alone: each is registered with a local map of those
//! before it (as in KISS-ICP, Vizzo et al. 2023, but from points to planes).
//!
//! A sweep is expected where constant motion leads. While it is registered, its returns are moved
//! to the stamp by the motion found so far. Then it becomes part of the map.
//!
//! The motion at the start is unknown: of several, the one that best aligns the second sweep with
//! the first is taken. Between guard rails, among traffic as fast as the vehicle, others fit about
//! as well: 20 m/s and more may be mistaken for standing still. Sweeps are degenerate then, and
//! several motions are tried again every now and then until one is clearly best.

mod surfels;
mod thinned;
mod voxel;

use crate::deskew::{TimedPoint, span_s};
use crate::gauss_newton::Correspondence;
use crate::icp::{CORRESPONDENCES_MIN, Registration, geman_mcclure};
use glam::{DQuat, DVec3};
use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::{Point, Rig};
use surfels::Surfels;
use thinned::ThinnedSweep;

/// Maximum number of returns of a sweep that are matched, evenly chosen. Not tuned separately.
const MATCHED_MAX: usize = 3000;
/// Fewer returns than this, one per voxel, do not make a sweep.
const RETURNS_MIN: usize = 100;
/// Widths of the kernel, m, from coarse to fine; the first is for unknown motions, the last alone
/// for motions that are well known. Not tuned separately.
const KERNELS_M: [f64; 3] = [1.0, 0.4, 0.1];
/// Assumed error over a sweep of a motion of which nothing else is known, such as constant motion,
/// m: at 10 Hz a change of speed by 4 m/s.
pub const EXPECTED_WITHIN_M: f64 = 0.4;
/// Maximum number of steps with each kernel; 2 to 5 are usual.
const STEPS: usize = 15;
/// Minimum share of the matched returns that must lie on the map's planes for a sweep to count as
/// located: for consecutive sweeps it is 0.8 or more (KITTI, simulated drives).
const AGREE_MIN: f64 = 0.6;
/// Forward speeds that are tried when the motion is unknown, m/s. Each covers 10 m/s to either side
/// if anything stands beside the path.
const SPEEDS_MPS: [f64; 4] = [0.0, 10.0, 20.0, 30.0];
/// Motions whose velocities differ by more than this are distinct, m/s: half the spacing of starts.
const DISTINCT_MPS: f64 = 5.0;
/// Share of the best motion's inliers from which another motion counts as fitting as well. Of 110
/// first pairs (simulated streets and outskirts, four rigs; KITTI, KITTI-360, Argoverse 2) 15 were
/// taken for another motion, 14 of them on motorways: for those it was 0.945 to 1.03. For the
/// others it was below 0.88, except for four with 0.94 to 0.975.
const RIVAL: f64 = 0.91;
/// The same if the motion was unclear before: at 0.91, two of 19 such drives and part of a third
/// were then taken for another motion.
const RIVAL_AGAIN: f64 = 0.8;
/// While the motion is unclear, several are tried every this many sweeps: such a sweep takes ten
/// times as long as usual.
const TRIED_EVERY: u32 = 10;
/// A motion has settled when it moves no return by this much more or less than the previous one, m.
/// If the stamp is at an end of the sweep, a round leaves a third of the previous error.
const SETTLED_M: f64 = 0.01;
/// Maximum number of rounds to get there: what is left of 30 m/s then is below 1 cm.
const ROUNDS_MAX: usize = 5;
/// Assumed distance of returns moved by a rotation, m.
pub const LEVER_ARM_M: f64 = 20.0;
/// Intervals between stamps this close to whole revolutions of the sensor come from a coarser
/// clock, revolutions.
const WHOLE: f64 = 0.2;

/// How a sweep was located.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseStatus {
    /// It is the first one.
    Start,
    /// By registration.
    Registered,
    /// It does not determine all of its motion on the ground: the rest was taken from the previous
    /// motion. Or the first sweeps fit several motions, and none has been clearly best since.
    Degenerate,
    /// It fits nothing known, and a new map begins, or it has too few returns: its pose is
    /// extrapolated from the previous motion.
    Lost,
}

impl PoseStatus {
    /// Returns the name, a single word.
    pub const fn name(self) -> &'static str {
        match self {
            PoseStatus::Start => "start",
            PoseStatus::Registered => "registered",
            PoseStatus::Degenerate => "degenerate",
            PoseStatus::Lost => "lost",
        }
    }
}

/// Where a sweep was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// `world_from_vehicle` at the stamp; the world is the vehicle's frame at the first sweep.
    pub world_from_vehicle: Pose,
    /// Velocity at the stamp.
    pub twist: Twist,
    /// How that is known.
    pub pose_status: PoseStatus,
}

/// The map and the motion so far.
pub struct Odometry {
    map: Surfels,
    /// The current sweep and the one before it, indexed by the parity of `count`.
    sweeps: [ThinnedSweep; 2],
    correspondences: [Correspondence; MATCHED_MAX],
    /// Number of sweeps so far.
    count: u32,
    stamp_s: f64,
    pose: Pose,
    twist: Twist,
    /// How far off the twist is over a sweep at most, if it is known from elsewhere, m.
    twist_within_m: Option<f64>,
    /// Whether other motions fit as well as the one taken.
    unsure: bool,
}

impl Default for Odometry {
    fn default() -> Odometry {
        Odometry::new()
    }
}

impl Odometry {
    /// The state before the first sweep, all zeros: as a static it takes no room in a binary.
    pub const fn new() -> Odometry {
        Odometry {
            map: Surfels::new(),
            sweeps: [const { ThinnedSweep::new() }; 2],
            correspondences: [Correspondence::NONE; MATCHED_MAX],
            count: 0,
            stamp_s: 0.0,
            pose: Pose { rotation: DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), translation: DVec3::ZERO },
            twist: Twist::ZERO,
            twist_within_m: None,
            unsure: false,
        }
    }

    /// Sets the motion to expect of the next sweep, along the axes of the vehicle there, and the
    /// most that it is off by over a sweep, m; [`EXPECTED_WITHIN_M`] if unknown. The closer it is,
    /// the less counts what does not follow it, such as traffic.
    pub fn expect(&mut self, twist: Twist, within_m: f64) {
        (self.twist, self.twist_within_m) = (twist, Some(within_m));
    }

    /// Forgets the sweeps so far, but not the motion: the next sweep is the first one.
    pub fn restart(&mut self) {
        (self.count, self.unsure) = (0, false);
        self.map.clear();
    }

    /// Locates the next sweep.
    pub fn locate(&mut self, stamp_s: f64, points: &[Point], rig: &Rig) -> Located {
        self.count += 1;
        self.sweeps[self.count as usize % 2].fill(points, rig);
        let dt_s = interval_s(rig, stamp_s - self.stamp_s);
        self.stamp_s = stamp_s;
        let pose_status = match self.count {
            1 => {
                self.pose = Pose::IDENTITY;
                PoseStatus::Start
            }
            _ if self.points().len() < RETURNS_MIN => self.miss(dt_s),
            2 => self.start(dt_s),
            _ => self.follow(dt_s),
        };
        let motion = self.twist;
        self.put(self.count, &motion);
        Located { world_from_vehicle: self.pose, twist: self.twist, pose_status }
    }

    /// Returns of the current sweep, one per voxel.
    fn points(&self) -> &[TimedPoint] {
        self.sweeps[self.count as usize % 2].points()
    }

    /// Continues with constant motion.
    fn miss(&mut self, dt_s: f64) -> PoseStatus {
        self.pose = self.pose * self.twist.over(dt_s);
        PoseStatus::Lost
    }

    /// Registers the sweep with the map or, if that fails, with the previous sweep.
    fn follow(&mut self, dt_s: f64) -> PoseStatus {
        if self.unsure && self.count.is_multiple_of(TRIED_EVERY) {
            return self.start(dt_s);
        }
        let initial = self.pose * self.twist.over(dt_s);
        let found = self.register(initial, dt_s, self.kernels(EXPECTED_WITHIN_M));
        if is_located(&found) {
            return self.adopt(&found, dt_s);
        }
        // A motion from elsewhere is farther off than it was said to be.
        self.twist_within_m = self.twist_within_m.map(|_| KERNELS_M[0]);
        self.start(dt_s)
    }

    /// Tries several motions for the sweep and the one before it.
    fn start(&mut self, dt_s: f64) -> PoseStatus {
        let best = self.best_start(dt_s);
        let (found, before) = self.settle(best, dt_s);
        self.map_of_before(&before);
        if is_located(&found) {
            return self.adopt(&found, dt_s);
        }
        self.map.clear();
        self.miss(dt_s)
    }

    /// The best-fitting of several motions. If others fit as well, it is unsure, and if it already
    /// was before, the expected one is kept.
    fn best_start(&mut self, dt_s: f64) -> (Registration, Twist) {
        let speeds_mps = if self.twist_within_m.is_some() { &[][..] } else { &SPEEDS_MPS };
        let ahead = speeds_mps.iter().map(|x| Twist { linear: DVec3::X * *x, ..Twist::ZERO });
        let expected = self.pair(self.twist, dt_s);
        let mut all = heapless::Vec::<_, { SPEEDS_MPS.len() + 1 }>::from([expected]);
        for motion in ahead {
            // There is room for all of them.
            let _ = all.push(self.pair(motion, dt_s));
        }
        let rank = |r: &Registration| (is_located(r), r.unobservable.planar == 0, r.inliers);
        let better = |best: (Registration, Twist), other: (Registration, Twist)| {
            if rank(&other.0) > rank(&best.0) { other } else { best }
        };
        let best = all.iter().copied().fold(expected, better);
        let was_unsure = self.unsure;
        let rival = if was_unsure { RIVAL_AGAIN } else { RIVAL };
        self.unsure = all.iter().any(|(other, _)| self.rivals(rival, other, &best.0, dt_s));
        let keeps = was_unsure && self.unsure && is_located(&expected.0);
        if keeps { expected } else { best }
    }

    /// Whether another, distinct motion has more than this share of the best one's inliers.
    fn rivals(&self, share: f64, other: &Registration, best: &Registration, dt_s: f64) -> bool {
        let linear = |r: &Registration| (self.pose.inverse() * r.pose).twist(dt_s).linear;
        is_located(other)
            && other.inliers as f64 > share * best.inliers as f64
            && (linear(other) - linear(best)).length() > DISTINCT_MPS
    }

    /// Registers the sweep with only the one before it, both deskewed by constant motion, first as
    /// given and then as found. Also returns the motion that the one before was deskewed by.
    fn pair(&mut self, motion: Twist, dt_s: f64) -> (Registration, Twist) {
        self.map_of_before(&motion);
        let initial = self.pose * motion.over(dt_s);
        let found = self.register(initial, dt_s, self.kernels(KERNELS_M[0]));
        self.again(&found, dt_s)
    }

    /// Registers them once more, the one before deskewed by the motion found. Also returns that
    /// motion.
    fn again(&mut self, found: &Registration, dt_s: f64) -> (Registration, Twist) {
        let motion = (self.pose.inverse() * found.pose).twist(dt_s);
        self.map_of_before(&motion);
        (self.register(found.pose, dt_s, self.kernels(EXPECTED_WITHIN_M)), motion)
    }

    /// Repeats this until the motion moves returns as the previous one did.
    fn settle(
        &mut self,
        (found, before): (Registration, Twist),
        dt_s: f64,
    ) -> (Registration, Twist) {
        let (mut found, mut before) = (found, before);
        for _ in 0..ROUNDS_MAX {
            let now = (self.pose.inverse() * found.pose).twist(dt_s);
            let (linear, angular) = (now.linear - before.linear, now.angular - before.angular);
            let changed_m = (linear.length() + LEVER_ARM_M * angular.length()) * dt_s.abs();
            if !is_located(&found) || changed_m < SETTLED_M {
                break;
            }
            (found, before) = self.again(&found, dt_s);
        }
        (found, before)
    }

    /// Rebuilds the map from only the previous sweep, deskewed by a motion.
    fn map_of_before(&mut self, motion: &Twist) {
        self.map.clear();
        self.put(self.count - 1, motion);
    }

    /// Puts a sweep, the current one or the one before it, into the map at the last known pose.
    fn put(&mut self, sweep: u32, motion: &Twist) {
        for point in self.sweeps[sweep as usize % 2].points() {
            self.map.add(self.pose.transform(point.at_stamp(motion)), sweep);
        }
    }

    /// The kernels from the finest one that is as wide as the error of the motion, which is
    /// `usual_m` if it is not known from elsewhere.
    fn kernels(&self, usual_m: f64) -> &'static [f64] {
        let within_m = self.twist_within_m.unwrap_or(usual_m);
        let from = KERNELS_M.iter().rposition(|kernel_m| *kernel_m >= within_m);
        &KERNELS_M[from.unwrap_or(0)..]
    }

    /// Adopts the pose that was found.
    fn adopt(&mut self, found: &Registration, dt_s: f64) -> PoseStatus {
        self.twist = constant_twist(&(self.pose.inverse() * found.pose), dt_s);
        self.pose = found.pose;
        let determined = found.unobservable.planar == 0 && !self.unsure;
        if determined { PoseStatus::Registered } else { PoseStatus::Degenerate }
    }

    /// Finds the pose that aligns the sweep with the map, starting at `initial`.
    fn register(&mut self, initial: Pose, dt_s: f64, kernels_m: &[f64]) -> Registration {
        let points = self.sweeps[self.count as usize % 2].points();
        let stride = points.len().div_ceil(MATCHED_MAX).max(1);
        let mut found = Registration::unmatched(initial);
        for &kernel_m in kernels_m {
            found.converged = false;
            let mut count = 0;
            for _ in 0..STEPS {
                let twist = constant_twist(&(self.pose.inverse() * found.pose), dt_s);
                let all = points.iter().step_by(stride);
                let (motion, into) = ((&found.pose, &twist), &mut self.correspondences);
                count = matched(all, &mut self.map, motion, kernel_m, into);
                if !found.advance(&self.correspondences[..count], &initial) {
                    break;
                }
            }
            found.evaluate(&self.correspondences[..count], count, kernel_m);
        }
        found
    }
}

/// Finds correspondences of points of a sweep with a map. Returns their number.
fn matched<'a>(
    points: impl Iterator<Item = &'a TimedPoint>,
    map: &mut Surfels,
    (pose, twist): (&Pose, &Twist),
    kernel_m: f64,
    into: &mut [Correspondence],
) -> usize {
    let found = points.filter_map(|p| {
        let mut found = map.plane(pose.transform(p.at_stamp(twist)))?;
        found.weight = geman_mcclure(found.residual() / kernel_m);
        Some(found)
    });
    into.iter_mut().zip(found).map(|(slot, found)| *slot = found).count()
}

fn is_located(found: &Registration) -> bool {
    found.overlap >= AGREE_MIN && found.inliers >= CORRESPONDENCES_MIN
}

/// The constant motion that led here in `dt_s`, along the current axes of the vehicle.
fn constant_twist(before_from_now: &Pose, dt_s: f64) -> Twist {
    before_from_now.inverse().twist(-dt_s)
}

/// Time between two stamps, rounded to whole revolutions if close, as stamps are often coarser.
pub fn interval_s(rig: &Rig, between_s: f64) -> f64 {
    let period_s = span_s(rig).filter(|period_s| *period_s > 0.0).unwrap_or(between_s);
    let periods = between_s / period_s;
    let whole = libm::round(periods);
    if whole > 0.0 && (periods - whole).abs() < WHOLE { whole * period_s } else { between_s }
}

#[cfg(test)]
mod tests;
