//! Sweeps without poses, located by registration as they come.

use std::time::Instant;

use raywake_alloc_guard::Sealed;
use raywake_core::sweep::Rig;
use raywake_io::source::SweepData;
use raywake_registration::Odometry;
use raywake_registration::odometry::Locating;
use serde::Serialize;

use crate::console::bytes;
use crate::error::RunError;
use crate::laps::milliseconds;
use crate::order_statistics::Spread;

/// Locates one sweep after the other. Nothing is allocated while it does.
pub struct Locator {
    odometry: Sealed<Box<Odometry>>,
    counts: [u64; 4],
    times_ms: Vec<f64>,
}

/// How sweeps were located.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LocatedSweeps {
    /// Sweeps whose motion was found.
    pub registered: u64,
    /// Sweeps that show too little, as a wall or a tunnel does: a part of their motion is that of
    /// the sweep before.
    pub degenerate: u64,
    /// Sweeps that fit nothing known: their motion is that of the sweep before.
    pub lost: u64,
    /// Time of a sweep, ms; null for a single sweep.
    pub ms: Option<Spread>,
}

impl Default for Locator {
    /// Allocates all it needs.
    fn default() -> Locator {
        let odometry = raywake_alloc_guard::boxed!(Odometry, Odometry::new());
        Locator {
            odometry: Sealed::new("registration", odometry),
            counts: [0; 4],
            times_ms: Vec::new(),
        }
    }
}

impl Locator {
    /// Bytes that registration works in.
    pub const BYTES: u64 = size_of::<Odometry>() as u64;

    /// Gives a sweep that follows those before its pose and twist.
    ///
    /// # Errors
    /// [`RunError::Allocation`].
    pub fn locate(&mut self, rig: &Rig, sweep: &mut SweepData) -> Result<(), RunError> {
        let clock = Instant::now();
        let (stamp_s, points) = (sweep.stamp_s, &sweep.points);
        let found = self
            .odometry
            .step(|odometry| Ok::<_, RunError>(odometry.locate(stamp_s, points, rig)))?;
        self.times_ms.push(milliseconds(clock));
        self.counts[found.locating as usize] += 1;
        (sweep.world_from_vehicle, sweep.twist) = (found.world_from_vehicle, found.twist);
        Ok(())
    }

    /// How it went.
    pub fn located(&self) -> LocatedSweeps {
        let count = |locating: Locating| self.counts[locating as usize];
        LocatedSweeps {
            registered: count(Locating::Registered),
            degenerate: count(Locating::Degenerate),
            lost: count(Locating::Lost),
            ms: self.times_ms.get(1..).and_then(Spread::of),
        }
    }
}

impl LocatedSweeps {
    /// A line for people.
    pub fn line(&self) -> String {
        let LocatedSweeps { registered, degenerate, lost, ms } = self;
        let ms = ms.map_or(String::new(), |ms| format!("; {}", ms.line(1)));
        format!(
            "registration: {registered} sweeps located, {degenerate} degenerate, {lost} lost{ms}; \
             {}\n",
            bytes(Locator::BYTES)
        )
    }
}
