//! Locating sweeps by registration one after another: those without poses, and those whose poses
//! are too poor to distinguish what moves.

use std::time::Instant;

use glam::DVec3;
use raywake_alloc_guard::Sealed;
use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::Rig;
use raywake_io::source::{Source, SweepData};
use raywake_registration::Odometry;
use raywake_registration::odometry::PoseStatus;
use serde::Serialize;

use crate::console::bytes;
use crate::error::RunError;
use crate::laps::milliseconds;
use crate::memory;
use crate::order_statistics::Spread;

/// Number of steps from sweep to sweep after which the poses are judged.
const CHECKED: u32 = 10;
/// Distance from the vehicle at which poses and registration are compared, m, so that rotation
/// counts too.
const LEVER_ARM_M: f64 = 20.0;
/// Poses that disagree by more are replaced, m (root mean square of steps): three times the error
/// that `pose_noise_m` assumes. Scan-matched poses of KITTI drives have 0.6 to 1.0 cm, those of a
/// GNSS-aided inertial unit 2.5 cm or more.
const DISAGREEMENT_MAX_M: f64 = 0.015;

/// Differences that alternate are errors of the poses; differences that accumulate are slip of the
/// registration, as between guard rails. The poses are replaced only if the sum of the differences
/// is less than this share of their count times their root mean square.
const SLIP_MAX: f64 = 0.3;

/// What is done with the recording's poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PoseUse {
    /// There are none.
    Find,
    /// They are being compared with registration.
    Check,
    /// They are used unchanged.
    Keep,
    /// Steps are taken from registration from here on.
    Replace,
}

/// Locates one sweep after another, without allocation.
pub struct Locator {
    odometry: Sealed<Box<Odometry>>,
    poses: PoseUse,
    /// Poses of the sweep before: as output, and as registered.
    last: [Pose; 2],
    compared: Compared,
    counts: [u64; 4],
    times_ms: Vec<f64>,
}

/// Differences of steps between poses and registration: along, across, and by rotation at
/// `LEVER_ARM_M`.
#[derive(Clone, Copy, Default)]
struct Compared {
    count: u32,
    /// m.
    sum: DVec3,
    /// m^2.
    squares: f64,
}

impl Compared {
    fn add(&mut self, step: &Pose, given: &Pose) {
        let apart = (step.inverse() * *given).twist(1.0);
        let apart = apart.linear.truncate().extend(LEVER_ARM_M * apart.angular.z);
        self.count += 1;
        self.sum += apart;
        self.squares += apart.length_squared();
    }

    /// Root mean square, m.
    fn rms_m(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.squares / f64::from(self.count)).sqrt())
    }

    /// Whether registration should replace the poses.
    fn poor(&self) -> bool {
        let rms_m = self.rms_m().unwrap_or(0.0);
        let slip = self.sum.length() / (f64::from(self.count) * rms_m);
        rms_m > DISAGREEMENT_MAX_M && slip < SLIP_MAX
    }
}

/// How sweeps were located.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LocatedSweeps {
    /// Root mean square difference between steps by the recording's poses and by registration, of
    /// points 20 m away, m; null without such poses.
    pub disagreement_m: Option<f64>,
    /// What became of the recording's poses.
    pub poses: PoseUse,
    /// Sweeps whose motion was determined.
    pub registered: u64,
    /// Sweeps that show too little, such as a wall, a tunnel, or a motorway with traffic as fast as
    /// the vehicle: part of their motion is taken from the sweep before, or guessed.
    pub degenerate: u64,
    /// Sweeps that match nothing known: their motion is taken from the sweep before.
    pub lost: u64,
    /// Time per sweep, ms; null for a single sweep.
    pub ms: Option<Spread>,
}

/// Allocates the registration of sweeps, starting at rest.
///
/// # Errors
/// [`RunError::NoMemory`].
pub fn registration() -> Result<Sealed<Box<Odometry>>, RunError> {
    memory::probe_memory(Locator::BYTES)?;
    let odometry = raywake_alloc_guard::boxed!(Odometry, Odometry::new());
    Ok(Sealed::new("registration", odometry))
}

impl Locator {
    /// Bytes of memory used by registration.
    pub const BYTES: u64 = size_of::<Odometry>() as u64;

    /// Allocates what a source needs; trusted poses need nothing.
    ///
    /// # Errors
    /// [`RunError::NoMemory`].
    pub fn of<S: Source + ?Sized>(source: &S) -> Result<Option<Locator>, RunError> {
        match source.is_located() {
            true if source.overview().trusted => Ok(None),
            true => Locator::new(PoseUse::Check).map(Some),
            false => Locator::finding().map(Some),
        }
    }

    /// A locator for sweeps without poses.
    ///
    /// # Errors
    /// [`RunError::NoMemory`].
    pub fn finding() -> Result<Locator, RunError> {
        Locator::new(PoseUse::Find)
    }

    fn new(poses: PoseUse) -> Result<Locator, RunError> {
        Ok(Locator {
            odometry: registration()?,
            poses,
            last: [Pose::IDENTITY; 2],
            compared: Compared::default(),
            counts: [0; 4],
            times_ms: Vec::new(),
        })
    }

    /// Sets the pose and twist of the next sweep, unless those it has are kept.
    ///
    /// # Errors
    /// [`RunError::Allocation`].
    pub fn locate(&mut self, rig: &Rig, sweep: &mut SweepData) -> Result<(), RunError> {
        if self.poses == PoseUse::Keep {
            return Ok(());
        }
        let clock = Instant::now();
        let expected = (self.poses == PoseUse::Check).then_some(sweep.twist);
        let (stamp_s, points) = (sweep.stamp_s, &sweep.points);
        let found = self.odometry.step(|odometry| {
            expected.into_iter().for_each(|twist| odometry.expect(twist));
            Ok::<_, RunError>(odometry.locate(stamp_s, points, rig))
        })?;
        self.counts[found.pose_status as usize] += 1;
        let step = self.last[1].inverse() * found.world_from_vehicle;
        match self.poses {
            PoseUse::Find => place(sweep, found.world_from_vehicle, found.twist),
            PoseUse::Replace => place(sweep, self.last[0] * step, found.twist),
            PoseUse::Check => match found.pose_status {
                PoseStatus::Registered => self.compare(sweep, &step),
                PoseStatus::Start => {}
                // Uncertain registration cannot judge poses.
                PoseStatus::Degenerate | PoseStatus::Lost => self.poses = PoseUse::Keep,
            },
            PoseUse::Keep => {}
        }
        self.last = [sweep.world_from_vehicle, found.world_from_vehicle];
        self.times_ms.push(milliseconds(clock));
        Ok(())
    }

    /// Compares a step with that of the recording's poses, and decides after enough steps.
    fn compare(&mut self, sweep: &SweepData, step: &Pose) {
        let given = self.last[0].inverse() * sweep.world_from_vehicle;
        self.compared.add(step, &given);
        if self.compared.count == CHECKED {
            self.poses = if self.compared.poor() { PoseUse::Replace } else { PoseUse::Keep };
        }
    }

    /// Returns how sweeps were located so far.
    pub fn located(&self) -> LocatedSweeps {
        let count = |pose_status: PoseStatus| self.counts[pose_status as usize];
        LocatedSweeps {
            disagreement_m: self.compared.rms_m(),
            poses: self.poses,
            registered: count(PoseStatus::Registered),
            degenerate: count(PoseStatus::Degenerate),
            lost: count(PoseStatus::Lost),
            ms: self.times_ms.get(1..).and_then(Spread::of),
        }
    }
}

fn place(sweep: &mut SweepData, pose: Pose, twist: Twist) {
    (sweep.world_from_vehicle, sweep.twist) = (pose, twist);
}

impl LocatedSweeps {
    /// Lines for the user.
    pub fn text(&self) -> String {
        match self.poses {
            PoseUse::Find => self.line(),
            PoseUse::Replace => format!(
                "{}too much: using registration instead (--trust-poses keeps the poses)\n{}",
                self.differences(),
                self.line()
            ),
            _ if self.degenerate + self.lost > 0 => {
                "poses: used unchecked, as the first sweeps show too little\n".into()
            }
            _ if self.disagreement_m > Some(DISAGREEMENT_MAX_M) => format!(
                "{}all in one direction: the poses are used; if wrong, use --poses register\n",
                self.differences()
            ),
            _ => format!("{}the poses are used\n", self.differences()),
        }
    }

    fn differences(&self) -> String {
        let centimetres = 100.0 * self.disagreement_m.unwrap_or(0.0);
        format!(
            "poses: the first steps by poses and by registration differ by {centimetres:.1} cm at \
             {LEVER_ARM_M:.0} m, "
        )
    }

    fn line(&self) -> String {
        let LocatedSweeps { registered, degenerate, lost, ms, .. } = self;
        let ms = ms.map_or(String::new(), |ms| format!("; {}", ms.line(1)));
        let doubt = match degenerate {
            0 => "",
            _ => "degenerate sweeps do not show how far the vehicle moved: poses may be far off\n",
        };
        format!(
            "registration: {registered} sweeps located, {degenerate} degenerate, {lost} lost{ms}; \
             {}\n{doubt}",
            bytes(Locator::BYTES)
        )
    }
}
