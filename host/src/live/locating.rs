//! Locating the vehicle: by registration, or by received poses.

use raywake_alloc_guard::Sealed;
use raywake_core::pose::Pose;
use raywake_core::sweep::Rig;
use raywake_io::source::capture::assembly::LiveSweep;
use raywake_registration::Odometry;
use raywake_registration::odometry::PoseStatus;
use serde::Serialize;

use super::poses::PoseReceiver;
use crate::error::RunError;
use crate::locate::registration;

/// How sweeps were located.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LocatedCounts {
    /// By received poses.
    pub by_poses: u64,
    /// Dropped for lack of a pose.
    pub without_pose: u64,
    /// By registration, including the first one.
    pub registered: u64,
    /// Sweeps that show too little: part of their motion is taken from the sweep before.
    pub degenerate: u64,
    /// Sweeps that match nothing known: their motion is taken from the sweep before.
    pub lost: u64,
}

/// Locates one sweep after another.
pub struct LiveLocator<'a> {
    by: By<'a>,
    counts: LocatedCounts,
}

enum By<'a> {
    Registration(Sealed<Box<Odometry>>),
    Poses(&'a PoseReceiver),
}

impl<'a> LiveLocator<'a> {
    /// Locates by poses, or by registration if there is no receiver.
    ///
    /// # Errors
    /// [`RunError::NoMemory`].
    pub fn new(poses: Option<&'a PoseReceiver>) -> Result<LiveLocator<'a>, RunError> {
        let by = match poses {
            Some(poses) => By::Poses(poses),
            None => By::Registration(registration()?),
        };
        Ok(LiveLocator { by, counts: LocatedCounts::default() })
    }

    /// Counts so far.
    pub fn counts(&self) -> LocatedCounts {
        self.counts
    }

    /// Sets the pose and twist of a sweep; `sweep_ns` is the duration of one. Returns whether a
    /// pose was found.
    ///
    /// # Errors
    /// [`RunError::Allocation`].
    pub fn locate(
        &mut self,
        rig: &Rig,
        sweep: &mut LiveSweep,
        sweep_ns: u64,
    ) -> Result<bool, RunError> {
        let (counts, data) = (&mut self.counts, &mut sweep.data);
        let (pose, twist) = match &mut self.by {
            By::Poses(poses) => match poses.at(sweep.stamp_ns, sweep_ns) {
                Some(found) => {
                    counts.by_poses += 1;
                    found
                }
                None => {
                    counts.without_pose += 1;
                    data.world_from_vehicle = Pose::IDENTITY;
                    return Ok(false);
                }
            },
            By::Registration(odometry) => {
                let (stamp_s, points) = (data.stamp_s, &data.points);
                let found = odometry
                    .step(|odometry| Ok::<_, RunError>(odometry.locate(stamp_s, points, rig)))?;
                *match found.pose_status {
                    PoseStatus::Start | PoseStatus::Registered => &mut counts.registered,
                    PoseStatus::Degenerate => &mut counts.degenerate,
                    PoseStatus::Lost => &mut counts.lost,
                } += 1;
                (found.world_from_vehicle, found.twist)
            }
        };
        (data.world_from_vehicle, data.twist) = (pose, twist);
        Ok(true)
    }
}
