//! Locating sweeps by registration one after another: those without poses, and those whose poses
//! are too poor to distinguish what moves.

use std::time::Instant;

use raywake_alloc_guard::Sealed;
use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::Rig;
use raywake_io::source::SweepData;
use raywake_registration::Odometry;
use raywake_registration::odometry::{LEVER_ARM_M, Located, PoseStatus};
use serde::Serialize;

use crate::console::bytes;
use crate::error::RunError;
use crate::laps::milliseconds;
use crate::latency::{Latencies, LatencyFigures};
use crate::memory;
use crate::pose_check::{JITTER_MAX_M, JUDGED, PoseCheck, Task};

/// What became of the recording's poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PoseUse {
    /// There are none.
    Find,
    /// They were used unchanged.
    Keep,
    /// Some steps were taken from registration.
    Replace,
}

/// Locates one sweep after another, without allocation.
pub struct Locator {
    registrar: Registrar,
    /// For poses of the recording.
    check: Option<PoseCheck>,
}

/// Registers one sweep after another.
struct Registrar {
    odometry: Sealed<Box<Odometry>>,
    /// Pose of the sweep before.
    last: Pose,
    counts: [u64; 4],
    times: Latencies,
}

impl Registrar {
    fn locate(
        &mut self,
        rig: &Rig,
        sweep: &SweepData,
        prepare: impl FnOnce(&mut Odometry),
    ) -> Result<Located, RunError> {
        let clock = Instant::now();
        let found = self.odometry.step(|odometry| {
            prepare(odometry);
            Ok::<_, RunError>(odometry.locate(sweep.stamp_s, &sweep.points, rig))
        })?;
        self.counts[found.pose_status as usize] += 1;
        if found.pose_status != PoseStatus::Start {
            self.times.add(milliseconds(clock));
        }
        Ok(found)
    }

    /// Begins anew with a sweep.
    fn start(&mut self, rig: &Rig, sweep: &SweepData) -> Result<(), RunError> {
        self.last = self.locate(rig, sweep, Odometry::restart)?.world_from_vehicle;
        Ok(())
    }

    /// Returns the motion since the sweep before, expected to be `expected` within `within_m`, and
    /// the velocity.
    fn step(
        &mut self,
        rig: &Rig,
        sweep: &SweepData,
        (expected, within_m): (Twist, f64),
    ) -> Result<(Pose, Twist), RunError> {
        let found = self.locate(rig, sweep, |odometry| odometry.expect(expected, within_m))?;
        let before = std::mem::replace(&mut self.last, found.world_from_vehicle);
        Ok((before.inverse() * found.world_from_vehicle, found.twist))
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
    /// Steps of the recording's poses that were replaced.
    pub replaced: u64,
    /// Whether steps by poses and by registration differ mostly in one direction.
    pub one_sided: bool,
    /// Sweeps whose motion was determined.
    pub registered: u64,
    /// Sweeps that show too little, such as a wall, a tunnel, or a motorway with traffic as fast as
    /// the vehicle: part of their motion is taken from the recording's poses or, without those,
    /// from the sweep before, or guessed.
    pub degenerate: u64,
    /// Sweeps that match nothing known: their motion is taken from the same.
    pub lost: u64,
    /// Time per sweep, ms; null for a single sweep.
    pub ms: Option<LatencyFigures>,
}

/// Allocates the registration of sweeps, starting at rest.
///
/// # Errors
/// [`RunError::NoMemory`].
fn registration() -> Result<Sealed<Box<Odometry>>, RunError> {
    memory::probe_memory(Locator::BYTES)?;
    let odometry = raywake_alloc_guard::boxed!(Odometry, Odometry::new());
    Ok(Sealed::new("registration", odometry))
}

impl Locator {
    /// Bytes of memory used by registration.
    pub const BYTES: u64 = size_of::<Odometry>() as u64;

    /// Allocates what sweeps with or without poses need; trusted poses need nothing.
    ///
    /// # Errors
    /// [`RunError::NoMemory`].
    pub fn of(located: bool, trusted: bool) -> Result<Option<Locator>, RunError> {
        match located {
            true if trusted => Ok(None),
            true => Locator::new(Some(PoseCheck::new())).map(Some),
            false => Locator::finding().map(Some),
        }
    }

    /// A locator for sweeps without poses.
    ///
    /// # Errors
    /// [`RunError::NoMemory`].
    pub fn finding() -> Result<Locator, RunError> {
        Locator::new(None)
    }

    fn new(check: Option<PoseCheck>) -> Result<Locator, RunError> {
        let (odometry, last) = (registration()?, Pose::IDENTITY);
        let (counts, times) = ([0; 4], Latencies::default());
        let registrar = Registrar { odometry, last, counts, times };
        Ok(Locator { registrar, check })
    }

    /// Sets the pose and twist of the next sweep, unless those it has are good.
    ///
    /// # Errors
    /// [`RunError::Allocation`].
    pub fn locate(&mut self, rig: &Rig, sweep: &mut SweepData) -> Result<(), RunError> {
        let registrar = &mut self.registrar;
        let Some(check) = &mut self.check else {
            let found = registrar.locate(rig, sweep, |_| ())?;
            (sweep.world_from_vehicle, sweep.twist) = (found.world_from_vehicle, found.twist);
            return Ok(());
        };
        let replaced = match check.next(rig, sweep) {
            Task::Use => None,
            Task::Start => {
                registrar.start(rig, sweep)?;
                None
            }
            Task::Register(given, expected, within_m) => {
                let found = registrar.step(rig, sweep, (expected, within_m))?;
                check.judge(given, found.1).then_some(found)
            }
        };
        check.settle(sweep, replaced);
        Ok(())
    }

    /// Returns how sweeps were located so far.
    pub fn located(&self) -> LocatedSweeps {
        let count = |pose_status: PoseStatus| self.registrar.counts[pose_status as usize];
        let check = self.check.as_ref();
        let replaced = check.map_or(0, PoseCheck::replaced);
        LocatedSweeps {
            disagreement_m: check.and_then(PoseCheck::disagreement_m),
            poses: match check {
                None => PoseUse::Find,
                Some(_) if replaced == 0 => PoseUse::Keep,
                Some(_) => PoseUse::Replace,
            },
            replaced,
            one_sided: check.is_some_and(PoseCheck::is_one_sided),
            registered: count(PoseStatus::Registered),
            degenerate: count(PoseStatus::Degenerate),
            lost: count(PoseStatus::Lost),
            ms: self.registrar.times.figures(),
        }
    }
}

impl LocatedSweeps {
    /// Lines for the user.
    pub fn text(&self) -> String {
        let verdict = match self.poses {
            PoseUse::Find => return self.line(),
            PoseUse::Replace => {
                let end = "steps are from registration (--trust-poses keeps the poses)";
                format!("as the poses jitter: {} {end}\n{}", self.replaced, self.line())
            }
            PoseUse::Keep if self.disagreement_m <= Some(JITTER_MAX_M) => {
                "the poses are used\n".into()
            }
            PoseUse::Keep if self.registered + self.degenerate + self.lost < JUDGED as u64 => {
                "but these are too few to judge: the poses are used\n".into()
            }
            PoseUse::Keep if self.one_sided => {
                "all in one direction: the poses are used; if wrong, use --poses register\n".into()
            }
            PoseUse::Keep => "but registration is no smoother: the poses are used\n".into(),
        };
        self.disagreement_m.map_or(String::new(), |metres| {
            format!(
                "poses: steps by poses and by registration differ by {:.1} cm at {LEVER_ARM_M:.0} \
                 m, {verdict}",
                100.0 * metres
            )
        })
    }

    fn line(&self) -> String {
        let LocatedSweeps { registered, degenerate, lost, ms, .. } = self;
        let ms = ms.map_or(String::new(), |ms| format!("; {}", ms.line()));
        let doubt = match self.poses {
            PoseUse::Find if *degenerate > 0 => {
                "degenerate sweeps do not show how far the vehicle moved: poses may be far off\n"
            }
            _ => "",
        };
        format!(
            "registration: {registered} sweeps located, {degenerate} degenerate, {lost} lost{ms}; \
             {}\n{doubt}",
            bytes(Locator::BYTES)
        )
    }
}
