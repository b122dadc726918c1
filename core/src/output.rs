//! What one step hands back: records of plain numbers, one per column, point and tracklet.
//!
//! Vehicle frame: of the pair's first sweep for columns and points, of its second sweep for
//! tracklets. World frame: the frame of the poses. "World velocity" is over ground; "ego velocity"
//! is relative to the moving vehicle, along the vehicle's axes (section 3.7).

use crate::continuity::Reset;
use crate::dropped::DroppedReturns;
use crate::refinement::cues::Cues;
use crate::tracklet::TrackletTurnover;

/// What one pair of sweeps yields. Borrowed from the pipeline until its next step.
#[derive(Clone, Copy, Debug)]
pub struct PairFlows<'a> {
    /// Solid columns of the first sweep.
    pub columns: &'a [ColumnFlow],
    /// Points of the first sweep, in the source's order.
    pub points: &'a [PointFlow],
    /// Time between the sweeps, s.
    pub dt_s: f64,
    /// What happened to tracklets.
    pub turnover: TrackletTurnover,
    /// Matched columns.
    pub valid: usize,
    /// Solid columns beyond the capacity for foreground, which count as background, and those
    /// beyond as many that moved, which count as unmatched.
    pub foreground_dropped: usize,
}

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
    /// [`crate::params::COLUMNS_MAX`] elements, or as many as the profile has columns.
    pub columns: &'a mut [ColumnFlow],
    /// [`crate::params::POINTS_MAX`] elements.
    pub points: &'a mut [PointFlow],
}

/// What is known of a column's flow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Origin {
    /// Not foreground: the flow follows from odometry (section 3.4.2).
    #[default]
    Background = 0,
    /// Foreground, but the energy minimisation left no valid match; velocity is that of odometry.
    Unmatched = 1,
    /// Foreground with a valid match (section 3.5.2).
    Matched = 2,
    /// Without a match of its own, but part of a thing that was found to move: the flow is that
    /// thing's.
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
    pub origin: Origin,
    /// P(moves). Below [`moves_min`](crate::params::MovesParams::moves_min) displacement and
    /// velocity are those of what stands.
    pub probability: f32,
    /// What that was told by; zeros where nothing was found to move.
    pub cues: Cues,
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
    pub origin: Origin,
    /// P(moves), that of its column.
    pub probability: f32,
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
