//! Objects in live sweeps: the front end of `raywake track`, without the estimates at the ends of
//! tracks.

use raywake_alloc_guard::Sealed;
use raywake_core::output::PointFlows;
use raywake_core::params::Profile;
use raywake_core::sweep::{Rig, Sweep};
use raywake_objects::front_end::TrackingCounts;
use raywake_objects::params::TrackingParams;
use raywake_objects::tracked::{ObjectTracker, TrackedObject};

use crate::error::RunError;
use crate::memory;

/// The object tracker. Once created, it allocates nothing.
pub struct LiveObjects<'a> {
    params: TrackingParams,
    profile: &'a Profile,
    tracker: Sealed<Box<ObjectTracker>>,
    counts: TrackingCounts,
}

impl LiveObjects<'_> {
    /// Bytes held.
    pub const BYTES: usize = size_of::<LiveObjects>() + size_of::<ObjectTracker>();

    /// Creates a tracker without tracks.
    ///
    /// # Errors
    /// [`RunError::NoMemory`].
    pub fn new(params: TrackingParams, profile: &Profile) -> Result<LiveObjects<'_>, RunError> {
        memory::probe_memory(LiveObjects::BYTES as u64)?;
        let tracker = raywake_alloc_guard::boxed!(ObjectTracker, ObjectTracker::new());
        Ok(LiveObjects {
            params,
            profile,
            tracker: Sealed::new("objects", tracker),
            counts: TrackingCounts::default(),
        })
    }

    /// Counts so far.
    pub fn counts(&self) -> TrackingCounts {
        self.counts
    }

    /// Tracks the objects through a sweep, with its flow if there is any. Returns those in it.
    ///
    /// # Errors
    /// Memory was allocated.
    pub fn step(
        &mut self,
        rig: &Rig,
        sweep: &Sweep,
        flows: Option<PointFlows>,
    ) -> Result<&[TrackedObject], RunError> {
        let LiveObjects { params, profile, tracker, counts } = self;
        let flows = flows.map(|of| (of, *profile));
        tracker.step(|tracker| {
            *counts += tracker.step(params, rig, sweep, flows);
            Ok::<_, RunError>(())
        })?;
        Ok(tracker.objects())
    }
}
