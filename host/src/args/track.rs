//! `raywake track`.

use std::path::PathBuf;

use clap::ValueEnum;

use super::{BackendChoice, Learned, Part, ProfileChoice, Recording};

const ABOUT: &str = "\
Follow the objects of a recorded drive, trajectory and shape

Returns of objects are segmented and associated from sweep to sweep; each track has a filter of its \
segments' centroids, and at its end an estimate of trajectory and shape together, with every return \
at its own time.";

const FILES: &str = "\
Files of --out DIR:
    tracks.feather   a row per track and update: track, time_s, and as the estimate at the track's
                     end has it, the filter (ekf_) and the estimate of the sweep (lag_; NaN without
                     --fixed-lag): x_m y_m z_m (world), heading_rad (unwrapped), speed_mps,
                     climb_mps, turn_rate_radps; lag_time_s, as that of the sweep is for its end
    clouds/ID.ply    returns of a track in the object's frame at their own times: x y z (m), time (s
                     after the track's start)
    summary.json     the figures of the report";

/// `raywake track`.
#[derive(Debug, clap::Args)]
#[command(about = ABOUT.lines().next(), long_about = ABOUT)]
pub struct Track {
    /// Folder of the recording: a KITTI drive, an Argoverse 2 log or a folder of clouds
    pub data: PathBuf,
    /// What tells objects from the rest and from each other
    #[arg(long, value_enum, value_name = "KIND", default_value = "variance")]
    pub front_end: FrontEndKind,
    /// Heights of the ground in the frame of the poses, an ESRI ASCII grid; found in the returns where
    /// it has none
    #[arg(long, value_name = "FILE")]
    pub ground_map: Option<PathBuf>,
    /// Estimate with every sweep too, from the last seconds alone
    #[arg(long)]
    pub fixed_lag: bool,
    /// Folder for `tracks.feather`, `clouds` and `summary.json`
    #[arg(long, value_name = "DIR", help_heading = "Results")]
    pub out: Option<PathBuf>,
    /// Figures as JSON; with --out they go to DIR/summary.json otherwise
    #[arg(long, value_name = "FILE", help_heading = "Results")]
    pub summary: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub recording: Recording,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub profile: ProfileChoice,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub learned: Learned,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub backend: BackendChoice,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub part: Part,
    /// No progress and no report, errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// What segments and associates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FrontEndKind {
    /// Height and its variance in cells on the ground, positions alone
    Variance,
    /// The scene flow too: what moves is an object, and velocities join the association
    Flow,
}

/// What `--help` ends with.
pub(super) fn after_help(exit_codes: &str) -> String {
    format!("{FILES}\n\n{exit_codes}")
}
