//! Locating the vehicle: by registration, or by received poses, checked as those of a recording.

use raywake_core::pose::Pose;
use raywake_core::sweep::Rig;
use raywake_io::source::capture::assembly::LiveSweep;
use serde::Serialize;

use super::poses::PoseReceiver;
use crate::error::RunError;
use crate::locate::{LocatedSweeps, Locator};

/// How sweeps were located.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LocatedCounts {
    /// Sweeps for which poses had been received.
    pub with_pose: u64,
    /// Sweeps dropped because none had.
    pub without_pose: u64,
    /// What registration did, unless received poses are trusted.
    pub registration: Option<LocatedSweeps>,
}

/// Locates one sweep after another.
pub struct LiveLocator<'a> {
    poses: Option<&'a PoseReceiver>,
    /// Finds poses, or checks those received.
    locator: Option<Locator>,
    with_pose: u64,
    without_pose: u64,
}

impl<'a> LiveLocator<'a> {
    /// Locates by poses, or by registration if there is no receiver. `trusted` poses are not
    /// checked.
    ///
    /// # Errors
    /// [`RunError::NoMemory`].
    pub fn new(
        poses: Option<&'a PoseReceiver>,
        trusted: bool,
    ) -> Result<LiveLocator<'a>, RunError> {
        let locator = Locator::of(poses.is_some(), trusted)?;
        Ok(LiveLocator { poses, locator, with_pose: 0, without_pose: 0 })
    }

    /// Counts so far.
    pub fn counts(&self) -> LocatedCounts {
        LocatedCounts {
            with_pose: self.with_pose,
            without_pose: self.without_pose,
            registration: self.locator.as_ref().map(Locator::located),
        }
    }

    /// Sets the pose and twist of a sweep; `sweep_ns` is the duration of one. Returns whether it
    /// could be located: poses may be lacking.
    ///
    /// # Errors
    /// [`RunError::Allocation`].
    pub fn locate(
        &mut self,
        rig: &Rig,
        sweep: &mut LiveSweep,
        sweep_ns: u64,
    ) -> Result<bool, RunError> {
        let data = &mut sweep.data;
        if let Some(poses) = self.poses {
            let Some((pose, twist)) = poses.at(sweep.stamp_ns, sweep_ns) else {
                self.without_pose += 1;
                data.world_from_vehicle = Pose::IDENTITY;
                return Ok(false);
            };
            (data.world_from_vehicle, data.twist) = (pose, twist);
            self.with_pose += 1;
        }
        self.locator.as_mut().map_or(Ok(()), |locator| locator.locate(rig, data))?;
        Ok(true)
    }
}
