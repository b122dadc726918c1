//! What a run writes.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::ValueEnum;
use raywake_io::sink::streams::{Pace, StreamTargets};

#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Results")]
pub struct Results {
    /// Output folder: `columns`, `points`, `tracklets` (feather), `png` and `summary.json`. Tables
    /// left there by an interrupted run are kept
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Also draw bird's-eye pictures, with velocities over ground or relative to the vehicle
    #[arg(long, requires = "out", value_name = "FRAME", value_enum)]
    #[arg(num_args = 0..=1, require_equals = true, default_missing_value = "world")]
    pub png: Option<PictureFrame>,
    #[command(flatten)]
    pub views: Views,
    #[command(flatten)]
    pub streams: StreamArgs,
    /// Write columns.parquet, points.parquet and tracklets.parquet, with a row group per sweep,
    /// instead of feather files per sweep (feature `parquet`)
    #[arg(long, requires = "out")]
    pub parquet: bool,
    /// Do not write per-point files
    #[arg(long)]
    pub no_points: bool,
    /// Also write submission files: DIR/argoverse/LOG/TIMESTAMP.feather
    #[arg(long, value_name = "FORMAT", requires = "out")]
    pub export: Option<Export>,
    /// Write run statistics as JSON [default with --out: DIR/summary.json]
    #[arg(long, value_name = "FILE")]
    pub summary: Option<PathBuf>,
}

/// Views of a whole run, besides pictures of single sweeps.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Results")]
pub struct Views {
    /// Also write a film at the recording's pace: an animated PNG, which browsers can play
    #[arg(long, value_name = "FILE")]
    pub film: Option<PathBuf>,
    /// Also write an HTML page: a slider over the sweeps, charts, the busiest moments
    #[arg(long, value_name = "FILE.html")]
    pub page: Option<PathBuf>,
}

/// ROS 2 messages.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Results")]
pub struct StreamArgs {
    /// Also write an MCAP file for Foxglove, Rerun, rviz or Autoware: points, what moves, poses
    #[arg(long, value_name = "FILE")]
    pub mcap: Option<PathBuf>,
    /// Also send the same to Foxglove, once it connects, at the recording's pace (feature `live`)
    #[arg(long, value_name = "ADDRESS:PORT", num_args = 0..=1, require_equals = true)]
    #[arg(default_missing_value = "127.0.0.1:8765")]
    pub live: Option<SocketAddr>,
}

impl StreamArgs {
    /// Targets for [`raywake_io::sink::bag`].
    pub fn sinks(&self, pace: Pace) -> StreamTargets {
        StreamTargets { mcap: self.mcap.clone(), live: self.live, pace }
    }
}

/// The velocities in a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum PictureFrame {
    /// Over ground
    #[default]
    World,
    /// Relative to the vehicle
    Ego,
}

/// Export formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Export {
    /// Argoverse 2 scene flow
    Argoverse,
}

impl Views {
    /// The option given, if any, for a single file of all sweeps.
    pub fn single_file(&self) -> Option<&'static str> {
        let page = self.page.is_some().then_some("page");
        self.film.is_some().then_some("film").or(page)
    }
}

impl StreamArgs {
    /// The option given, if any, for a single file, or viewers, of all sweeps.
    pub fn single_file(&self) -> Option<&'static str> {
        let live = self.live.is_some().then_some("live");
        self.mcap.is_some().then_some("mcap").or(live)
    }
}

impl Results {
    /// The option given, if any, for a single file of all sweeps.
    pub fn single_file(&self) -> Option<&'static str> {
        let summary = self.summary.is_some().then_some("summary");
        self.streams.single_file().or(self.views.single_file()).or(summary)
    }
}
