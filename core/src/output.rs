//! What one step hands back: records of plain numbers, one per column, point and tracklet.
//!
//! Vehicle frame: of the pair's first sweep for columns and points, of its second sweep for
//! tracklets. World frame: the frame of the poses. "World velocity" is over ground; "ego velocity"
//! is relative to the moving vehicle, along the vehicle's axes (section 3.7).

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

/// Numbers beyond are no place that a lidar sees, m: the velocity there may not be finite.
const FARTHEST_M: f32 = 1e6;

/// What one pair of sweeps yields. Borrowed from the pipeline until its next step.
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
    /// Matched columns.
    pub valid: usize,
    /// Solid columns beyond the capacity for foreground, which count as background, and those
    /// beyond as many that moved, which count as unmatched; columns of clusters and columns that
    /// there is no room for.
    pub foreground_dropped: usize,
}

/// Flow of every return of a sweep, in the source's order. It is that of a column, and made up when
/// it is asked for.
#[derive(Clone, Copy, Debug)]
pub struct PointFlows<'a> {
    /// Those of the solid columns, then those of others whose returns move with a cluster.
    pub(crate) columns: &'a [ColumnFlow],
    /// Of those that were taken.
    pub(crate) taken: &'a [ReturnFlow],
    /// The sweep.
    pub(crate) points: &'a [Point],
    pub(crate) thinning: Thinning,
    pub(crate) ego: EgoMotion,
}

impl<'a> PointFlows<'a> {
    /// Of a sweep taken whole by a vehicle that stands. `taken` has an element for each of
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

    /// Returns of the sweep.
    pub fn count(self) -> usize {
        self.thinning.of()
    }

    /// That of a return of the sweep.
    #[inline]
    pub fn get(self, index: usize) -> Option<PointFlow> {
        let point = self.points.get(index)?;
        let taken = self.thinning.rank(index).and_then(|rank| self.taken.get(rank));
        Some(taken.map_or(PointFlow::OVER_CAPACITY, |taken| self.of(*taken, point)))
    }

    /// A return moves with its column; outside the window, and where nothing is solid, with the
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
        // `map` of arrays is a call.
        let at = DVec3::new(finite(x), finite(y), finite(z));
        out.velocity_ego_mps = self.ego.ego_from_world(at, out.velocity_world_mps);
        out
    }

    /// What it is made of besides, to be copied: columns, and what is kept of returns.
    pub fn slices(self) -> (&'a [ColumnFlow], &'a [ReturnFlow]) {
        (self.columns, self.taken)
    }

    /// All but the slices, to be kept beside them.
    pub fn keep(self) -> KeptPoints {
        let PointFlows { columns, taken, thinning, ego, .. } = self;
        KeptPoints { columns: columns.len(), taken: taken.len(), thinning, ego }
    }

    /// Those of all returns.
    pub fn iter(self) -> impl ExactSizeIterator<Item = PointFlow> + 'a {
        (0..self.count()).map(move |n| self.get(n).unwrap_or(PointFlow::OVER_CAPACITY))
    }
}

/// [`PointFlows`] without the slices, for whoever keeps those.
#[derive(Clone, Copy, Debug)]
pub struct KeptPoints {
    columns: usize,
    taken: usize,
    thinning: Thinning,
    ego: EgoMotion,
}

impl KeptPoints {
    /// With the slices: of columns and returns those given to the step, of points its `before`.
    /// Shorter ones have no flow.
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

/// What is kept of a return: the record of its column, and what became of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReturnFlow(u32);

impl ReturnFlow {
    /// A return whose column has the record `record` of its sweep's; none moves with the ground.
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
    /// Beyond all records.
    const NO_RECORD: u32 = (1 << ReturnFlow::RECORD_BITS) - 1;
}

const _: () = assert!(COLUMNS_MAX < ReturnFlow::NO_RECORD as usize);

/// What one sweep yields. Borrowed from the caller's [`Output`].
#[derive(Clone, Copy, Debug)]
pub struct SweepOutput<'a> {
    /// Flow of the pair that this sweep completes; none after a reset.
    pub flows: Option<PairFlows<'a>>,
    /// Returns left out.
    pub dropped: DroppedReturns,
    /// Set where this sweep has no usable predecessor.
    pub reset: Option<Reset>,
    /// Returns beyond the capacity of the refinement: it does not see them.
    pub unrefined: usize,
    /// Foreground columns.
    pub foreground: usize,
    /// Distinct rays.
    pub rays: usize,
}

/// Room for what a step puts out, the caller's.
pub struct Output<'a> {
    /// [`crate::params::SOLID_MAX`] elements, or as many as the profile has columns.
    pub columns: &'a mut [ColumnFlow],
    /// As many as the profile takes returns.
    pub points: &'a mut [ReturnFlow],
}

/// What a column's flow rests on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum FlowBasis {
    /// Not foreground: the flow follows from odometry (section 3.4.2).
    #[default]
    Background = 0,
    /// Foreground, but the energy minimisation left no valid match; velocity is that of odometry.
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
    /// Raw displacement in cells (3.14); meaningful where matched.
    pub displacement_cells: [i32; 2],
    /// Displacement over ground until the second sweep, world axes, m: refined below the cell's
    /// size, zero where the column was found to stand still.
    pub displacement_m: [f32; 2],
    /// Covariance of `displacement_m` (xx, xy, yy), m^2; zero where neither matched nor joined.
    pub displacement_covariance: [f32; 3],
    /// Energy of the match in thousandths of a nat; meaningful where matched.
    pub energy: i32,
    /// Velocity over ground along world axes, m/s.
    pub velocity_world_mps: [f32; 2],
    /// Velocity relative to the vehicle along vehicle axes, m/s.
    pub velocity_ego_mps: [f32; 2],
    /// Covariance of the world velocity (xx, xy, yy), (m/s)^2; zero where neither matched nor
    /// joined.
    pub covariance: [f32; 3],
    /// Observations of the tracklet after its birth (section 3.6.2).
    pub age: u32,
    /// Where the flow comes from.
    pub basis: FlowBasis,
    /// P(moves). Below [`moves_min`](crate::params::MovesParams::moves_min) displacement and
    /// velocity are those of what stands.
    pub probability: f32,
    /// What that was told by; zeros where nothing was found to move.
    pub cues: Cues,
    /// What the encoder takes it for; none where there is no encoder.
    pub class: Option<ColumnClass>,
}

/// What became of a return.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Status {
    /// Stands.
    #[default]
    Static = 0,
    /// Moves with its velocity.
    Moving = 1,
    /// Foreground for which no match was found: put out as static.
    Unmatched = 2,
    /// Outside the window of the flow: put out as static.
    OutsideWindow = 3,
    /// Left out of a sweep that has more than are taken; nothing is known of it.
    OverCapacity = 4,
    /// On the own vehicle.
    OwnVehicle = 5,
    /// No return: at exactly (0, 0, 0).
    NoEcho = 6,
    /// Not finite, or of a sensor that the rig does not have.
    Invalid = 7,
}

impl Status {
    /// All, in the order of their numbers.
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

    /// In words.
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
    /// Covariance of the world velocity (xx, xy, yy), (m/s)^2; zero where neither matched nor
    /// joined.
    pub covariance: [f32; 3],
    /// Age of the column's tracklet.
    pub age: u32,
    /// Where the flow comes from; returns outside the window are background.
    pub basis: FlowBasis,
    /// What became of it.
    pub status: Status,
    /// P(moves), that of its column.
    pub probability: f32,
    /// What the encoder takes its column for; none where that is not solid, outside the window and
    /// without an encoder.
    pub class: Option<ColumnClass>,
}

impl PointFlow {
    /// Of a return that was not taken.
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
    /// Cell it lies in, counted as in [`ColumnFlow::cell`].
    pub cell: [i32; 2],
    /// Position in the world, m.
    pub position_world_m: [f64; 2],
    /// Position in the vehicle frame, m.
    pub position_vehicle_m: [f32; 2],
    /// Heading of motion in the world, rad.
    pub heading_rad: f32,
    /// Speed over ground along the heading, m/s.
    pub speed_mps: f32,
    /// Turning rate, rad/s.
    pub turn_rate_radps: f32,
    /// Velocity over ground along world axes, m/s.
    pub velocity_world_mps: [f32; 2],
    /// Velocity relative to the vehicle along vehicle axes, m/s.
    pub velocity_ego_mps: [f32; 2],
    /// Covariance of the filter's (x, y, heading, speed, turn rate), row-major; under the
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
