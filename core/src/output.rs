//! The results of one step: plain records, one per column, point and tracklet.
//!
//! Vehicle frame: that of the pair's first sweep for columns and points, that of its second sweep
//! for tracklets. World frame: the frame of the poses. "World velocity" is over ground; "ego
//! velocity" is relative to the moving vehicle, along the vehicle's axes (section 3.7).

use crate::continuity::Reset;
use crate::dropped::DroppedReturns;
use crate::encoder::ColumnClass;
use crate::motion_compensation::EgoMotion;
use crate::params::COLUMNS_MAX;
use crate::pose::{Pose, Twist};
use crate::refinement::cues::Cues;
use crate::sweep::Point;
use crate::thinning::Thinning;
use crate::tracklet::TrackletTurnover;
use glam::DVec3;

/// No lidar sees coordinates beyond this, m: the velocity there might not be finite.
const FARTHEST_M: f32 = 1e6;

/// The results of one pair of sweeps. Borrowed from the pipeline until its next step.
#[derive(Clone, Copy, Debug)]
pub struct PairFlows<'a> {
    /// Solid columns of the first sweep.
    pub columns: &'a [ColumnFlow],
    /// Returns of the first sweep.
    pub points: PointFlows<'a>,
    /// Time between the sweeps, s.
    pub dt_s: f64,
    /// What happened to tracklets.
    pub turnover: TrackletTurnover,
    /// Number of matched columns.
    pub valid: usize,
    /// Columns beyond some capacity: solid ones beyond that for foreground, which count as
    /// background, and moving ones beyond that for observations, which count as unmatched; columns
    /// of clusters, and columns without room for a record.
    pub foreground_dropped: usize,
}

/// Flow of every return of a sweep, in the source's order. It is that of a column, and computed on
/// demand.
#[derive(Clone, Copy, Debug)]
pub struct PointFlows<'a> {
    /// Flow of the solid columns, then of other columns whose returns move with a cluster.
    pub(crate) columns: &'a [ColumnFlow],
    /// For the returns that were taken.
    pub(crate) taken: &'a [ReturnFlow],
    /// The returns of the sweep.
    pub(crate) points: &'a [Point],
    pub(crate) thinning: Thinning,
    pub(crate) ego: EgoMotion,
}

impl<'a> PointFlows<'a> {
    /// The flow of a sweep taken whole by a stationary vehicle. `taken` has one element for each of
    /// `points`.
    pub fn at_rest(
        columns: &'a [ColumnFlow],
        taken: &'a [ReturnFlow],
        points: &'a [Point],
    ) -> PointFlows<'a> {
        let thinning = Thinning::new(points.len(), taken.len());
        let ego = EgoMotion::new(&Pose::IDENTITY, &Twist::default());
        PointFlows { columns, taken, points, thinning, ego }
    }

    /// Number of returns of the sweep.
    pub fn count(self) -> usize {
        self.thinning.of()
    }

    /// The flow of a return of the sweep.
    #[inline]
    pub fn get(self, index: usize) -> Option<PointFlow> {
        let point = self.points.get(index)?;
        let taken = self.thinning.rank(index).and_then(|rank| self.taken.get(rank));
        Some(taken.map_or(PointFlow::OVER_CAPACITY, |taken| self.of(*taken, point)))
    }

    /// A return moves with its column; outside the window and in columns without a record, with the
    /// ground.
    #[inline]
    fn of(self, taken: ReturnFlow, point: &Point) -> PointFlow {
        let mut out = PointFlow { status: taken.status(), ..PointFlow::default() };
        if let Some(flow) = self.columns.get(taken.record()) {
            out.velocity_world_mps = flow.velocity_world_mps;
            out.covariance = flow.covariance;
            out.age = flow.age;
            out.basis = flow.basis;
            out.probability = flow.probability;
            out.class = flow.class;
        }
        let seen = |c: f32| (-FARTHEST_M..=FARTHEST_M).contains(&c);
        let finite = |c: f32| if seen(c) { c as f64 } else { 0.0 };
        let [x, y, z] = point.position;
        // Not `map`: on arrays it is a call.
        let at = DVec3::new(finite(x), finite(y), finite(z));
        out.velocity_ego_mps = self.ego.ego_from_world(at, out.velocity_world_mps);
        out
    }

    /// The slices besides the points, to be copied: columns, and what is kept of returns.
    pub fn slices(self) -> (&'a [ColumnFlow], &'a [ReturnFlow]) {
        (self.columns, self.taken)
    }

    /// Everything but the slices, to be kept alongside them.
    pub fn keep(self) -> KeptPoints {
        let PointFlows { columns, taken, thinning, ego, .. } = self;
        KeptPoints { columns: columns.len(), taken: taken.len(), thinning, ego }
    }

    /// The flow of every return.
    pub fn iter(self) -> impl ExactSizeIterator<Item = PointFlow> + 'a {
        (0..self.count()).map(move |n| self.get(n).unwrap_or(PointFlow::OVER_CAPACITY))
    }
}

/// [`PointFlows`] without the slices, for callers that keep those.
#[derive(Clone, Copy, Debug)]
pub struct KeptPoints {
    columns: usize,
    taken: usize,
    thinning: Thinning,
    ego: EgoMotion,
}

impl KeptPoints {
    /// Adds the slices: columns and returns as passed to the step, and as points its `before`.
    /// Slices that are too short give no flow.
    pub fn over<'a>(
        &self,
        columns: &'a [ColumnFlow],
        taken: &'a [ReturnFlow],
        points: &'a [Point],
    ) -> PointFlows<'a> {
        PointFlows {
            columns: columns.get(..self.columns).unwrap_or_default(),
            taken: taken.get(..self.taken).unwrap_or_default(),
            points,
            thinning: self.thinning,
            ego: self.ego,
        }
    }
}

/// What is kept of a return: the record of its column, and its status.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReturnFlow(u32);

impl ReturnFlow {
    /// A return whose column has this record of its sweep; without one it moves with the ground.
    pub const fn new(record: Option<u32>, status: Status) -> ReturnFlow {
        let record = match record {
            Some(record) if record < ReturnFlow::NO_RECORD => record,
            _ => ReturnFlow::NO_RECORD,
        };
        ReturnFlow((status as u32) << ReturnFlow::RECORD_BITS | record)
    }

    #[inline]
    fn record(self) -> usize {
        (self.0 & ReturnFlow::NO_RECORD) as usize
    }

    #[inline]
    fn status(self) -> Status {
        Status::ALL[(self.0 >> ReturnFlow::RECORD_BITS) as usize % Status::ALL.len()]
    }

    const RECORD_BITS: u32 = 24;
    /// Larger than any record.
    const NO_RECORD: u32 = (1 << ReturnFlow::RECORD_BITS) - 1;
}

const _: () = assert!(COLUMNS_MAX < ReturnFlow::NO_RECORD as usize);

/// The results of one sweep. Borrowed from the caller's [`Output`].
#[derive(Clone, Copy, Debug)]
pub struct SweepOutput<'a> {
    /// Flow of the pair that this sweep completes; `None` after a reset.
    pub flows: Option<PairFlows<'a>>,
    /// Returns left out.
    pub dropped: DroppedReturns,
    /// Set if this sweep has no usable predecessor.
    pub reset: Option<Reset>,
    /// Returns beyond the capacity of the refinement, which ignores them.
    pub unrefined: usize,
    /// Number of foreground columns.
    pub foreground: usize,
    /// Number of distinct rays.
    pub rays: usize,
}

/// Caller-owned storage for the output of a step.
pub struct Output<'a> {
    /// [`crate::params::SOLID_MAX`] elements, or as many as the profile has columns.
    pub columns: &'a mut [ColumnFlow],
    /// As many elements as the profile takes returns.
    pub points: &'a mut [ReturnFlow],
}

/// The basis of a column's flow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum FlowBasis {
    /// Not foreground: the flow follows from odometry (section 3.4.2).
    #[default]
    Background = 0,
    /// Foreground, but the energy minimisation left no valid match; the velocity is that of
    /// odometry.
    Unmatched = 1,
    /// Foreground with a valid match (section 3.5.2).
    Matched = 2,
    /// Without a match of its own, but part of a cluster that was found to move: the flow is
    /// the cluster's.
    Joined = 3,
}

/// Flow of one solid column of the pair's first sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColumnFlow {
    /// Index of the column in the lattice, whose cell (0, 0) lies at the vehicle in the first sweep
    /// of the run (`dissertation` preset: in this sweep).
    pub cell: [i32; 2],
    /// Centre of the column in the world, m.
    pub position_world_m: [f64; 2],
    /// Centre of the column in the vehicle frame, m.
    pub position_vehicle_m: [f32; 2],
    /// Raw displacement in cells (3.14); meaningful if matched.
    pub displacement_cells: [i32; 2],
    /// Displacement over ground until the second sweep, world axes, m: refined below the cell's
    /// size, zero if the column was classified as static.
    pub displacement_m: [f32; 2],
    /// Covariance of `displacement_m` (xx, xy, yy), m^2; zero if neither matched nor joined.
    pub displacement_covariance: [f32; 3],
    /// Energy of the match in thousandths of a nat; meaningful if matched.
    pub energy: i32,
    /// Velocity over ground along world axes, m/s.
    pub velocity_world_mps: [f32; 2],
    /// Velocity relative to the vehicle along vehicle axes, m/s.
    pub velocity_ego_mps: [f32; 2],
    /// Covariance of the world velocity (xx, xy, yy), (m/s)^2; zero if neither matched nor joined.
    pub covariance: [f32; 3],
    /// Observations of the tracklet after its birth (section 3.6.2).
    pub age: u32,
    /// Where the flow comes from.
    pub basis: FlowBasis,
    /// P(moves). Below [`moves_min`](crate::params::MovesParams::moves_min), or what takes its
    /// place in first pairs, displacement and velocity are those of static structure.
    pub probability: f32,
    /// The cues behind that; zeros if nothing was found to move.
    pub cues: Cues,
    /// Its class according to the encoder; `None` without an encoder.
    pub class: Option<ColumnClass>,
}

/// The status of a return.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Status {
    /// Is static.
    #[default]
    Static = 0,
    /// Moves with its velocity.
    Moving = 1,
    /// Foreground for which no match was found: reported as static.
    Unmatched = 2,
    /// Outside the window of the flow: reported as static.
    OutsideWindow = 3,
    /// Left out of a sweep that has more returns than are taken; nothing is known about it.
    OverCapacity = 4,
    /// On the ego vehicle.
    OwnVehicle = 5,
    /// No return: at exactly (0, 0, 0).
    NoEcho = 6,
    /// Not finite, or from a sensor that the rig does not have.
    Invalid = 7,
}

impl Status {
    /// All of them, in the order of their numbers.
    pub const ALL: [Status; 8] = [
        Status::Static,
        Status::Moving,
        Status::Unmatched,
        Status::OutsideWindow,
        Status::OverCapacity,
        Status::OwnVehicle,
        Status::NoEcho,
        Status::Invalid,
    ];

    /// The name in words.
    pub const fn name(self) -> &'static str {
        match self {
            Status::Static => "static",
            Status::Moving => "moving",
            Status::Unmatched => "unmatched",
            Status::OutsideWindow => "outside window",
            Status::OverCapacity => "over capacity",
            Status::OwnVehicle => "own vehicle",
            Status::NoEcho => "no echo",
            Status::Invalid => "invalid",
        }
    }
}

/// Flow of one return of the pair's first sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointFlow {
    /// Velocity over ground along world axes, m/s.
    pub velocity_world_mps: [f32; 2],
    /// Velocity relative to the vehicle along vehicle axes, m/s.
    pub velocity_ego_mps: [f32; 3],
    /// Covariance of the world velocity (xx, xy, yy), (m/s)^2; zero if neither matched nor joined.
    pub covariance: [f32; 3],
    /// Age of the column's tracklet.
    pub age: u32,
    /// Where the flow comes from; returns outside the window are background.
    pub basis: FlowBasis,
    /// The status of the return.
    pub status: Status,
    /// P(moves), that of its column.
    pub probability: f32,
    /// Class of its column according to the encoder; `None` if the column is not solid or outside
    /// the window, and without an encoder.
    pub class: Option<ColumnClass>,
}

impl PointFlow {
    /// The flow of a return that was not taken.
    pub const OVER_CAPACITY: PointFlow = PointFlow {
        velocity_world_mps: [0.0; 2],
        velocity_ego_mps: [0.0; 3],
        covariance: [0.0; 3],
        age: 0,
        basis: FlowBasis::Background,
        status: Status::OverCapacity,
        probability: 0.0,
        class: None,
    };
}

/// A flow tracklet after the step (section 3.6), at the time of the pair's second sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrackletState {
    /// The cell it lies in, counted as in [`ColumnFlow::cell`].
    pub cell: [i32; 2],
    /// Position in the world, m.
    pub position_world_m: [f64; 2],
    /// Position in the vehicle frame, m.
    pub position_vehicle_m: [f32; 2],
    /// Heading of motion in the world, rad.
    pub heading_rad: f32,
    /// Speed over ground along the heading, m/s.
    pub speed_mps: f32,
    /// Turn rate, rad/s.
    pub turn_rate_radps: f32,
    /// Velocity over ground along world axes, m/s.
    pub velocity_world_mps: [f32; 2],
    /// Velocity relative to the vehicle along vehicle axes, m/s.
    pub velocity_ego_mps: [f32; 2],
    /// Covariance of the filter's (x, y, heading, speed, turn rate), row-major; with the
    /// `dissertation` preset its motion is relative to the vehicle, along vehicle axes.
    pub covariance: [[f32; 5]; 5],
    /// Observations after birth.
    pub age: u32,
    /// P(moves), as last observed.
    pub probability: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocities_of_returns_at_no_place_are_finite() {
        let points = [f32::MAX, -3.4e38, f32::NAN, f32::INFINITY, 5.0]
            .map(|x| Point { position: [x, x, 0.0], ..Point::default() });
        let taken = [ReturnFlow::default(); 5];
        let turning = Twist { linear: DVec3::ZERO, angular: DVec3::new(0.0, 0.0, 3.0) };
        let ego = EgoMotion::new(&Pose::IDENTITY, &turning);
        let flows = PointFlows { ego, ..PointFlows::at_rest(&[], &taken, &points) };
        for flow in flows.iter() {
            assert!(flow.velocity_ego_mps.iter().all(|v| v.is_finite()), "{flow:?}");
        }
        assert_eq!(flows.get(4).map(|flow| flow.velocity_ego_mps[1]), Some(-15.0));
    }
}
