//! Summaries of sweeps and pairs.

use raywake_core::continuity::Reset;
use raywake_core::dropped::DroppedReturns;
use raywake_core::output::{PairFlows, SweepOutput};
use raywake_core::pose::Pose;
use raywake_core::tracklet::TrackletTurnover;
use raywake_registration::odometry::PoseStatus;

/// Summary of a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepSummary {
    /// The pair of the previous sweep and this one; none after a reset.
    pub pair: Option<PairSummary>,
    /// Set if the sweep has no usable predecessor.
    pub reset: Option<Reset>,
    /// Returns left out.
    pub dropped: DroppedReturns,
    /// Returns that the refinement had no room for.
    pub unrefined: usize,
    /// Foreground columns.
    pub foreground: usize,
    /// Distinct rays.
    pub rays: usize,
    /// `world_from_vehicle` at the stamp.
    pub pose: Pose,
    /// How it was found, unless it was given.
    pub pose_status: Option<PoseStatus>,
    /// Objects in the previous sweep.
    pub objects: usize,
}

/// Summary of a pair of sweeps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairSummary {
    /// Time between them, s.
    pub dt_s: f64,
    /// Solid columns of the first sweep.
    pub columns: usize,
    /// Returns of the first sweep.
    pub points: usize,
    /// Matched columns.
    pub valid: usize,
    /// Columns beyond the capacity.
    pub foreground_dropped: usize,
    /// What happened to tracklets.
    pub turnover: TrackletTurnover,
}

impl StepSummary {
    pub(crate) fn new(
        output: &SweepOutput,
        pose: Pose,
        pose_status: Option<PoseStatus>,
        objects: usize,
    ) -> StepSummary {
        StepSummary {
            pair: output.flows.as_ref().map(PairSummary::from),
            reset: output.reset,
            dropped: output.dropped,
            unrefined: output.unrefined,
            foreground: output.foreground,
            rays: output.rays,
            pose,
            pose_status,
            objects,
        }
    }
}

impl From<&PairFlows<'_>> for PairSummary {
    fn from(flows: &PairFlows) -> PairSummary {
        PairSummary {
            dt_s: flows.dt_s,
            columns: flows.columns.len(),
            points: flows.points.count(),
            valid: flows.valid,
            foreground_dropped: flows.foreground_dropped,
            turnover: flows.turnover,
        }
    }
}
