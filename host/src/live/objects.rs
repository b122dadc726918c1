//! Objects in the sweeps that come: the front end of `raywake track`, without the estimates at the
//! ends of tracks.

use raywake_alloc_guard::Sealed;
use raywake_core::output::PointFlows;
use raywake_core::params::Profile;
use raywake_core::sweep::{Rig, Sweep};
use raywake_objects::front_end::{Flows, TRACKS_MAX, TrackingCounts};
use raywake_objects::params::TrackingParams;
use raywake_objects::tracked::{ObjectTracker, TrackedObject};

use crate::error::RunError;

/// Tracks and what is put out of them. Nothing is allocated once it is made.
pub struct LiveObjects {
    params: TrackingParams,
    reach_m: f64,
    tracker: Sealed<Box<ObjectTracker>>,
    seen: heapless::Vec<TrackedObject, TRACKS_MAX>,
    counts: TrackingCounts,
}

impl LiveObjects {
    /// Bytes that it holds.
    pub const BYTES: usize = size_of::<LiveObjects>() + size_of::<ObjectTracker>();

    /// No tracks yet.
    pub fn new(params: TrackingParams, profile: &Profile) -> LiveObjects {
        let tracker = raywake_alloc_guard::boxed!(ObjectTracker, ObjectTracker::new());
        LiveObjects {
            params,
            reach_m: Flows::reach_m(profile),
            tracker: Sealed::new("objects", tracker),
            seen: heapless::Vec::new(),
            counts: TrackingCounts::default(),
        }
    }

    /// What was done so far.
    pub fn counts(&self) -> TrackingCounts {
        self.counts
    }

    /// Follows the objects through a sweep whose flow is known, or is not to be had. Returns those
    /// in it.
    ///
    /// # Errors
    /// Memory was allocated.
    pub fn step(
        &mut self,
        rig: &Rig,
        sweep: &Sweep,
        flows: Option<PointFlows>,
    ) -> Result<&[TrackedObject], RunError> {
        let LiveObjects { params, reach_m, tracker, seen, counts } = self;
        let flows = flows.map(|of| Flows { of, reach_m: *reach_m });
        tracker.step(|tracker| {
            *counts += tracker.step(params, rig, sweep, flows);
            seen.clear();
            seen.extend(tracker.objects(params));
            Ok::<_, RunError>(())
        })?;
        Ok(seen)
    }
}
