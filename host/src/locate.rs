//! Sweeps located by registration as they come: those without poses, and those whose poses are too
//! poor to tell what moves.

use std::time::Instant;

use glam::DVec3;
use raywake_alloc_guard::Sealed;
use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::Rig;
use raywake_io::source::{Source, SweepData};
use raywake_registration::Odometry;
use raywake_registration::odometry::Locating;
use serde::Serialize;

use crate::console::bytes;
use crate::error::RunError;
use crate::laps::milliseconds;
use crate::memory;
use crate::order_statistics::Spread;

/// Steps from sweep to sweep that decide whether poses are of use.
const CHECKED: u32 = 10;
/// How far from the vehicle poses and registration are compared, m: there a turn counts, too.
const AWAY_M: f64 = 20.0;
/// Poses are replaced where they disagree by more, m (root mean square of steps): three times what
/// `pose_noise_m` takes them to err. Scan-matched KITTI drives have 0.6 to 1.0 cm, those of an
/// inertial unit with satellites 2.5 cm and more.
const DISAGREEMENT_MAX_M: f64 = 0.015;

/// What errs to and fro are poses, and what slips away is registration, as between guard rails: it
/// replaces them where all steps together differ by less than this share of the single ones' sum.
const SLIP_MAX: f64 = 0.3;

/// What becomes of poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PoseUse {
    /// There are none.
    Find,
    /// They are compared.
    Check,
    /// They are used as they are.
    Keep,
    /// Steps are by registration from here on.
    Replace,
}

/// Locates one sweep after the other. Nothing is allocated while it does.
pub struct Locator {
    odometry: Sealed<Box<Odometry>>,
    poses: PoseUse,
    /// Poses of the sweep before: as it was handed on, and as found.
    last: [Pose; 2],
    compared: Compared,
    counts: [u64; 4],
    times_ms: Vec<f64>,
}

/// Differences of steps by poses and by registration: along, across, and of a turn `AWAY_M` away.
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
        let apart = apart.linear.truncate().extend(AWAY_M * apart.angular.z);
        self.count += 1;
        self.sum += apart;
        self.squares += apart.length_squared();
    }

    /// Root mean square, m.
    fn rms_m(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.squares / f64::from(self.count)).sqrt())
    }

    /// Whether registration is to replace the poses.
    fn poor(&self) -> bool {
        let rms_m = self.rms_m().unwrap_or(0.0);
        let slip = self.sum.length() / (f64::from(self.count) * rms_m);
        rms_m > DISAGREEMENT_MAX_M && slip < SLIP_MAX
    }
}

/// How sweeps were located.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LocatedSweeps {
    /// Root mean square of the difference between steps by the recording's poses and by
    /// registration, of places 20 m away, m; null without such poses.
    pub disagreement_m: Option<f64>,
    /// What became of the recording's poses.
    pub poses: PoseUse,
    /// Sweeps whose motion was found.
    pub registered: u64,
    /// Sweeps that show too little, as a wall, a tunnel or a motorway among others that are as fast
    /// does: a part of their motion is that of the sweep before, or a guess.
    pub degenerate: u64,
    /// Sweeps that fit nothing known: their motion is that of the sweep before.
    pub lost: u64,
    /// Time of a sweep, ms; null for a single sweep.
    pub ms: Option<Spread>,
}

/// What registers sweeps, at rest.
///
/// # Errors
/// [`RunError::NoMemory`].
pub fn registration() -> Result<Sealed<Box<Odometry>>, RunError> {
    memory::ask_for(Locator::BYTES)?;
    let odometry = raywake_alloc_guard::boxed!(Odometry, Odometry::new());
    Ok(Sealed::new("registration", odometry))
}

impl Locator {
    /// Bytes that registration works in.
    pub const BYTES: u64 = size_of::<Odometry>() as u64;

    /// Allocates all it needs for a source; nothing is needed for poses that are trusted.
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

    /// For sweeps without poses.
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

    /// Gives a sweep that follows those before its pose and twist, unless those that it has are
    /// kept.
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
        self.counts[found.locating as usize] += 1;
        let step = self.last[1].inverse() * found.world_from_vehicle;
        match self.poses {
            PoseUse::Find => place(sweep, found.world_from_vehicle, found.twist),
            PoseUse::Replace => place(sweep, self.last[0] * step, found.twist),
            PoseUse::Check => match found.locating {
                Locating::Registered => self.compare(sweep, &step),
                Locating::Start => {}
                // Registration that is not sure of itself is no judge of poses.
                Locating::Degenerate | Locating::Lost => self.poses = PoseUse::Keep,
            },
            PoseUse::Keep => {}
        }
        self.last = [sweep.world_from_vehicle, found.world_from_vehicle];
        self.times_ms.push(milliseconds(clock));
        Ok(())
    }

    /// Compares a step with that of the recording's poses; after enough of them, decides.
    fn compare(&mut self, sweep: &SweepData, step: &Pose) {
        let given = self.last[0].inverse() * sweep.world_from_vehicle;
        self.compared.add(step, &given);
        if self.compared.count == CHECKED {
            self.poses = if self.compared.poor() { PoseUse::Replace } else { PoseUse::Keep };
        }
    }

    /// How it went.
    pub fn located(&self) -> LocatedSweeps {
        let count = |locating: Locating| self.counts[locating as usize];
        LocatedSweeps {
            disagreement_m: self.compared.rms_m(),
            poses: self.poses,
            registered: count(Locating::Registered),
            degenerate: count(Locating::Degenerate),
            lost: count(Locating::Lost),
            ms: self.times_ms.get(1..).and_then(Spread::of),
        }
    }
}

fn place(sweep: &mut SweepData, pose: Pose, twist: Twist) {
    (sweep.world_from_vehicle, sweep.twist) = (pose, twist);
}

impl LocatedSweeps {
    /// Lines for people.
    pub fn text(&self) -> String {
        match self.poses {
            PoseUse::Find => self.line(),
            PoseUse::Replace => format!(
                "{}too much: registration goes on instead (--trust-poses keeps them)\n{}",
                self.differences(),
                self.line()
            ),
            _ if self.degenerate + self.lost > 0 => {
                "poses: used unchecked, as the first sweeps show too little\n".into()
            }
            _ if self.disagreement_m > Some(DISAGREEMENT_MAX_M) => format!(
                "{}all one way: they are used; if they are wrong, --poses register\n",
                self.differences()
            ),
            _ => format!("{}they are used\n", self.differences()),
        }
    }

    fn differences(&self) -> String {
        let centimetres = 100.0 * self.disagreement_m.unwrap_or(0.0);
        format!(
            "poses: first steps by them and by registration differ by {centimetres:.1} cm at \
             {AWAY_M:.0} m, "
        )
    }

    fn line(&self) -> String {
        let LocatedSweeps { registered, degenerate, lost, ms, .. } = self;
        let ms = ms.map_or(String::new(), |ms| format!("; {}", ms.line(1)));
        let doubt = match degenerate {
            0 => "",
            _ => "degenerate sweeps do not show how far the vehicle went: poses may be far off\n",
        };
        format!(
            "registration: {registered} sweeps located, {degenerate} degenerate, {lost} lost{ms}; \
             {}\n{doubt}",
            bytes(Locator::BYTES)
        )
    }
}
