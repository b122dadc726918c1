//! `raywake track`.

use std::path::PathBuf;

use clap::ValueEnum;
use raywake_objects::estimate::EstimateParams;

use super::{FlowChoice, Recording, Recordings, Selection, StreamArgs, Views};

const ABOUT: &str = "\
Track the objects of a recorded drive: trajectory and shape

Returns of objects are segmented and associated from sweep to sweep. An EKF filters the centroids \
of each track; when a track ends, trajectory and shape are estimated jointly from all its returns, \
each at its own time.";

const FILES: &str = "\
Files of --out DIR:
    tracks.feather   one row per track and update: track, time_s, and x_m y_m z_m (world),
                     heading_rad (unwrapped), speed_mps, climb_mps, turn_rate_radps three times:
                     by the estimate at the end of the track, by the EKF (ekf_), and by the
                     fixed-lag estimate (lag_; NaN without --fixed-lag), which refers to
                     lag_time_s, the end of the sweep; the covariance of the EKF's position
                     (cov_xx cov_xy cov_yy cov_zz, m²) and the variances of its speed and heading
                     (cov_speed, cov_heading, rad²); the box around the part seen:
                     box_x_m box_y_m box_z_m (its centre in the world), box_heading_rad (if
                     stationary, either end may be the front), length_m, width_m, height_m;
                     p_moves (mean of its returns; NaN if unknown); class (names in the
                     metadata; 255: unknown)
    returns/FRAME.feather  track of every return of a sweep, in its order; -1 without one
    clouds/ID.ply    returns of a track in the object's frame: x y z (m), time (s since the start
                     of the track)
    summary.json     statistics of the run";

#[derive(Clone, Debug, clap::Args)]
#[command(about = ABOUT.lines().next(), long_about = ABOUT)]
pub struct TrackArgs {
    #[command(flatten)]
    pub recordings: Recordings,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
    /// Detection and association method
    #[arg(long, value_enum, value_name = "KIND", default_value = "flow")]
    pub front_end: FrontEndKind,
    /// How trajectory and shape are estimated
    #[arg(long, value_enum, value_name = "KIND", default_value = "refined")]
    pub estimate: EstimateKind,
    /// Ground heights in the world frame of the poses, an ESRI ASCII grid; where it has no data
    /// they are estimated from the returns
    #[arg(long, value_name = "FILE")]
    pub ground_map: Option<PathBuf>,
    /// Also estimate at every sweep, from a sliding window
    #[arg(long)]
    pub fixed_lag: bool,
    /// Output folder: `tracks.feather`, `returns`, `clouds` and `summary.json`
    #[arg(short, long, value_name = "DIR", help_heading = "Results")]
    pub out: Option<PathBuf>,
    /// Also draw the tracks of each sweep from above: DIR/png/FRAME.png
    #[arg(long, requires = "out", help_heading = "Results")]
    pub png: bool,
    #[command(flatten)]
    pub views: Views,
    #[command(flatten)]
    pub streams: StreamArgs,
    /// Show all tracks, including stationary ones that are not vehicles, people or two-wheelers
    #[arg(long)]
    pub all: bool,
    /// Write run statistics as JSON [default with --out: DIR/summary.json]
    #[arg(long, value_name = "FILE", help_heading = "Results")]
    pub summary: Option<PathBuf>,
    #[command(flatten)]
    pub recording: Recording,
    #[command(flatten)]
    pub flow: FlowChoice,
    #[command(flatten)]
    pub part: Selection,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FrontEndKind {
    /// Height variance in cells of a ground grid; association by position
    Variance,
    /// Scene flow as well: moving points are objects; association by position and velocity.
    /// Stationary objects other than vehicles, people and two-wheelers are left out, as is
    /// everything outside the window of the profile (±25 m; `far`: ±50 m)
    Flow,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EstimateKind {
    /// Chapter 2, refined: surfaces, ends, free space along rays, several starts
    Refined,
    /// Chapter 2 as printed, with its parameters (2.6.2)
    Printed,
}

impl EstimateKind {
    /// Initial parameters; `--set` and files change them.
    pub fn params(self) -> EstimateParams {
        match self {
            EstimateKind::Refined => EstimateParams::DEFAULT,
            EstimateKind::Printed => EstimateParams::DISSERTATION,
        }
    }
}

/// Text at the end of `--help`.
pub(super) fn after_help(exit_codes: &str) -> String {
    format!("{FILES}\n\n{exit_codes}")
}
