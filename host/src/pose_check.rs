//! Whether the poses of a recording are good enough to distinguish what moves, judged by how much
//! their steps jitter compared with those of registration.

use glam::DVec3;
use heapless::HistoryBuf;
use raywake_core::continuity::ContinuityLimits;
use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::Rig;
use raywake_io::source::SweepData;
use raywake_registration::odometry::{EXPECTED_WITHIN_M, LEVER_ARM_M, interval_s};

/// Number of steps from sweep to sweep by which poses are judged.
pub const JUDGED: usize = 10;
/// Poses with no more jitter than this are good, m: three times the error that `pose_noise_m`
/// assumes. Exact poses have at most 0.1 cm, scan-matched ones 0.8 to 1.0 cm (KITTI, KITTI-360),
/// those of a GNSS-aided inertial unit 2.7 to 18 cm (KITTI, simulated).
pub const JITTER_MAX_M: f64 = 0.015;
/// Others are replaced if registration has less than this share of their jitter. Where it is right
/// it has 0.02 to 0.47 of it, where it follows traffic between guard rails mostly more than all of
/// it (simulated drives with and without such errors, KITTI).
const SMOOTHER: f64 = 0.5;
/// How far the line through the last steps is off, as a share of their jitter: 0.2 to 0.5 of it
/// unless the vehicle brakes (the same drives with such errors).
const LINE_OFF: f64 = 0.5;
/// Poses that were found good are judged again after this many sweeps, as a vehicle that stands
/// shows no errors of time. Less often than always, as registration takes time.
const UNCHECKED: u32 = 90;
/// Differences from registration whose mean is this share of their root mean square, or more, point
/// in one direction.
const ONE_SIDED: f64 = 0.3;

/// The last steps from sweep to sweep, as velocities.
#[derive(Default)]
struct Steps(HistoryBuf<Twist, JUDGED>);

impl Steps {
    /// Standard deviation of a step, m, if the errors of steps are independent: from their second
    /// differences, where steady motion and acceleration cancel. `None` until there are enough.
    fn jitter_m(&self, interval_s: f64) -> Option<f64> {
        let steps: heapless::Vec<DVec3, JUDGED> =
            self.0.oldest_ordered().map(|velocity| planar(velocity) * interval_s).collect();
        let second = |w: &[DVec3]| (w[0] - 2.0 * w[1] + w[2]).length_squared();
        let sum: f64 = steps.windows(3).map(second).sum();
        // 6 is the sum of the squares of 1, -2 and 1.
        self.0.is_full().then(|| (sum / (6 * (JUDGED - 2)) as f64).sqrt())
    }

    /// The last step according to the line through all of them. `None` until there are enough.
    fn line(&self) -> Option<Twist> {
        let middle = (JUDGED - 1) as f64 / 2.0;
        let spread: f64 = (0..JUDGED).map(|n| (n as f64 - middle).powi(2)).sum();
        let weight = |n: usize| 1.0 / JUDGED as f64 + middle * (n as f64 - middle) / spread;
        let all = || self.0.oldest_ordered().enumerate();
        self.0.is_full().then(|| Twist {
            linear: all().map(|(n, velocity)| weight(n) * velocity.linear).sum(),
            angular: all().map(|(n, velocity)| weight(n) * velocity.angular).sum(),
        })
    }
}

/// Along, across, and by rotation at `LEVER_ARM_M`.
fn planar(of: &Twist) -> DVec3 {
    of.linear.truncate().extend(LEVER_ARM_M * of.angular.z)
}

/// Differences of steps between poses and registration.
#[derive(Clone, Copy, Default)]
struct Differences {
    count: u32,
    /// m.
    sum: DVec3,
    /// m^2.
    squares: f64,
}

impl Differences {
    fn add(&mut self, given: &Twist, registered: &Twist, interval_s: f64) {
        let apart = (planar(given) - planar(registered)) * interval_s;
        self.count += 1;
        self.sum += apart;
        self.squares += apart.length_squared();
    }

    fn rms_m(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.squares / f64::from(self.count)).sqrt())
    }
}

/// A step of the poses.
#[derive(Clone, Copy)]
pub struct GivenStep {
    velocity: Twist,
    interval_s: f64,
}

/// What to do with a sweep.
pub enum Task {
    /// Its pose is used.
    Use,
    /// It is the first one to be registered.
    Start,
    /// It is to be registered, expected to have moved by this, which is off by so much at most, m.
    Register(GivenStep, Twist, f64),
}

/// Compares the poses of a recording with registration, and replaces them where they are poor.
pub struct PoseCheck {
    given: Steps,
    registered: Steps,
    /// Stamp and given pose of the sweep before.
    before: Option<(f64, Pose)>,
    /// Pose of the sweep before as it was used.
    used: Pose,
    /// Where the world of the given poses is, once some were replaced.
    world_from_given: Option<Pose>,
    /// Sweeps left that are not checked.
    unchecked: u32,
    /// Whether registration begins with the next sweep.
    begins: bool,
    differences: Differences,
    replaced: u64,
}

impl PoseCheck {
    pub fn new() -> PoseCheck {
        PoseCheck {
            given: Steps::default(),
            registered: Steps::default(),
            before: None,
            used: Pose::IDENTITY,
            world_from_given: None,
            unchecked: 0,
            begins: true,
            differences: Differences::default(),
            replaced: 0,
        }
    }

    /// Takes in the pose of the next sweep, and says what to do with it.
    pub fn next(&mut self, rig: &Rig, sweep: &SweepData) -> Task {
        let (stamp_s, pose) = (sweep.stamp_s, sweep.world_from_vehicle);
        let before = self.before.replace((stamp_s, pose)).filter(|(before_s, before)| {
            let limits = ContinuityLimits::DEFAULT;
            limits.broken(before, &pose, stamp_s - before_s).is_none()
        });
        if self.unchecked > 0 {
            self.unchecked -= 1;
            return Task::Use;
        }
        let Some((before_s, before)) = before.filter(|_| !self.begins) else {
            (self.given, self.registered) = Default::default();
            self.begins = false;
            return Task::Start;
        };
        let interval_s = interval_s(rig, stamp_s - before_s);
        let velocity = (pose.inverse() * before).twist(-interval_s);
        self.given.0.write(velocity);
        let line = self.given.line().zip(self.given.jitter_m(interval_s));
        let (expected, within_m) = line
            .map_or((velocity, EXPECTED_WITHIN_M), |(line, jitter_m)| (line, LINE_OFF * jitter_m));
        Task::Register(GivenStep { velocity, interval_s }, expected, within_m)
    }

    /// Compares a step with registration. Returns whether registration replaces it.
    pub fn judge(&mut self, given: GivenStep, registered: Twist) -> bool {
        let GivenStep { velocity, interval_s } = given;
        self.registered.0.write(registered);
        self.differences.add(&velocity, &registered, interval_s);
        let [Some(given_m), Some(registered_m)] =
            [&self.given, &self.registered].map(|steps| steps.jitter_m(interval_s))
        else {
            return false;
        };
        if given_m <= JITTER_MAX_M {
            (self.unchecked, self.begins) = (UNCHECKED, true);
        }
        given_m > JITTER_MAX_M && registered_m < SMOOTHER * given_m
    }

    /// Sets the pose of the sweep that [`PoseCheck::next`] took in: one step of registration from
    /// the one before, if it is replaced.
    pub fn settle(&mut self, sweep: &mut SweepData, step: Option<(Pose, Twist)>) {
        let given = sweep.world_from_vehicle;
        if let Some((step, twist)) = step {
            (sweep.world_from_vehicle, sweep.twist) = (self.used * step, twist);
            self.world_from_given = Some(sweep.world_from_vehicle * given.inverse());
            self.replaced += 1;
        } else if let Some(world_from_given) = self.world_from_given {
            sweep.world_from_vehicle = world_from_given * given;
        }
        self.used = sweep.world_from_vehicle;
    }

    /// Number of steps taken from registration.
    pub fn replaced(&self) -> u64 {
        self.replaced
    }

    /// Root mean square difference between steps by the poses and by registration, of points
    /// `LEVER_ARM_M` away, m; `None` without any.
    pub fn disagreement_m(&self) -> Option<f64> {
        self.differences.rms_m()
    }

    /// Whether these differences point in one direction, as from a false scale, a frame other than
    /// the vehicle's, or registration that slips.
    pub fn is_one_sided(&self) -> bool {
        let Differences { count, sum, .. } = self.differences;
        self.disagreement_m()
            .is_some_and(|rms_m| sum.length() > ONE_SIDED * f64::from(count) * rms_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.1;

    fn rig() -> Rig {
        Rig {
            sensors: [Pose::IDENTITY].into_iter().collect(),
            timing: raywake_core::sweep::Timing::AtStamp,
            distorted: false,
            ground_m: -1.7,
            own_vehicle: None,
        }
    }

    /// A vehicle at 20 m/s whose poses are off by `error_m` of every sweep, and whose registration
    /// is off by `registered_m` of every step.
    struct Run {
        check: PoseCheck,
        /// How far from where it was at the first sweep every sweep was placed, m.
        used_m: Vec<f64>,
        /// Sweeps that were registered.
        registered: Vec<usize>,
    }

    impl Run {
        fn new(
            sweeps: usize,
            error_m: impl Fn(usize) -> f64,
            registered_m: impl Fn(usize) -> f64,
        ) -> Run {
            let mut run =
                Run { check: PoseCheck::new(), used_m: Vec::new(), registered: Vec::new() };
            for n in 0..sweeps {
                let x = 2.0 * n as f64 + error_m(n);
                let mut sweep = SweepData {
                    stamp_s: PERIOD_S * n as f64,
                    world_from_vehicle: Pose::planar(x, 0.0, 0.0, 0.0),
                    ..SweepData::default()
                };
                let step = Pose::planar(2.0 + registered_m(n), 0.0, 0.0, 0.0);
                let twist = step.twist(PERIOD_S);
                let replaced = match run.check.next(&rig(), &sweep) {
                    Task::Register(given, ..) => {
                        run.registered.push(n);
                        run.check.judge(given, twist).then_some((step, twist))
                    }
                    Task::Start | Task::Use => None,
                };
                run.check.settle(&mut sweep, replaced);
                run.used_m.push(sweep.world_from_vehicle.translation.x);
            }
            run
        }
    }

    /// Errors without a pattern, in -1..1.
    fn uneven(n: usize) -> f64 {
        (n as f64).powi(2).sin()
    }

    #[test]
    fn even_poses_are_used_and_checked_rarely() {
        let run = Run::new(120, |_| 0.0, |n| 0.01 * uneven(n));
        assert!(run.used_m.iter().enumerate().all(|(n, x)| *x == 2.0 * n as f64));
        let checked =
            (1..=JUDGED).chain(JUDGED + 2 + UNCHECKED as usize..).take(run.registered.len());
        assert!(run.registered.iter().copied().eq(checked), "{:?}", run.registered);
        assert_eq!(run.check.replaced(), 0);
    }

    #[test]
    fn uneven_poses_are_replaced_by_registration_that_is_even() {
        let run = Run::new(30, |n| 0.05 * uneven(n), |_| 0.001);
        assert_eq!(run.check.replaced(), 30 - JUDGED as u64);
        let steps = run.used_m[JUDGED - 1..].windows(2).map(|w| w[1] - w[0]);
        assert!(steps.clone().all(|step| (step - 2.001).abs() < 1e-9), "{steps:?}");
    }

    #[test]
    fn uneven_poses_are_kept_if_registration_is_less_even() {
        let run = Run::new(30, |n| 0.05 * uneven(n), |n| 0.1 * uneven(3 * n));
        assert_eq!((run.check.replaced(), run.registered.len()), (0, 29));
    }

    /// A vehicle that stands for ten seconds shows no errors of time.
    #[test]
    fn poses_that_become_uneven_are_replaced() {
        let run = Run::new(150, |n| if n < 100 { 0.0 } else { 0.05 * uneven(n) }, |_| 0.0);
        assert_eq!(run.check.replaced(), (150 - 2 - 2 * JUDGED - UNCHECKED as usize + 1) as u64);
    }

    #[test]
    fn the_line_through_steps_has_less_jitter_than_they() {
        let mut steps = Steps::default();
        let (mut off, mut jitter) = (0.0, 0.0);
        for n in 0..200 {
            let accelerating = 10.0 + 0.2 * n as f64;
            let velocity = accelerating + 0.5 * (uneven(n + 1) - uneven(n));
            steps.0.write(Twist { linear: velocity * DVec3::X, ..Twist::ZERO });
            if let Some((line, jitter_m)) = steps.line().zip(steps.jitter_m(PERIOD_S)) {
                off += (PERIOD_S * (line.linear.x - accelerating)).powi(2);
                jitter += jitter_m.powi(2);
            }
        }
        let share = (off / jitter).sqrt();
        assert!((0.1..LINE_OFF).contains(&share), "{share}");
    }

    #[test]
    fn registration_begins_anew_after_a_jump() {
        let run = Run::new(30, |n| if n < 15 { 0.0 } else { 100.0 } + 0.05 * uneven(n), |_| 0.0);
        assert!(!run.registered.contains(&15), "{:?}", run.registered);
        assert_eq!(run.check.replaced(), (14 - JUDGED + 1 + 14 - JUDGED + 1) as u64);
        assert!((run.used_m[15] - run.used_m[14] - 102.0).abs() < 0.2, "{:?}", run.used_m);
    }
}
