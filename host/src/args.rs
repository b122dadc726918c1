//! The command line.

mod flow;
mod sweeps;
mod track;

use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

use clap::builder::BoolishValueParser;
use clap::{Parser, Subcommand, ValueEnum};

use raywake_io::Error;
use raywake_io::source::{Format, OpenOptions, PosesFrame};

pub use flow::Flow;
pub use sweeps::Sweeps;
pub use track::{FrontEndKind, Track};

const EXIT_CODES: &str = "\
Exit codes:
    0  done
    2  the command line, or a feature this build lacks
    3  an input file is unreadable or makes no sense
    4  an output file cannot be written
    5  the Vulkan device
    6  over the limit of `budget --limit`
  130  interrupted; what was finished stays";

/// Temporal scene flow from LIDAR sweeps and poses.
#[derive(Debug, Parser)]
#[command(name = "raywake", version, after_help = EXIT_CODES, max_term_width = 100)]
pub struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Estimate the flow of a recorded drive
    #[command(after_help = EXIT_CODES)]
    Run(Box<Run>),
    #[allow(missing_docs)]
    #[command(after_help = EXIT_CODES, after_long_help = flow::after_help(EXIT_CODES))]
    Flow(Box<Flow>),
    #[allow(missing_docs)]
    #[command(after_help = EXIT_CODES, after_long_help = track::after_help(EXIT_CODES))]
    Track(Box<Track>),
    /// Map the occupancy of every sweep over the sensor's whole range
    Map(Box<Map>),
    /// Run on a small simulated drive and compare with its truth
    #[cfg(feature = "demo")]
    Demo(Demo),
    /// Print every byte a profile takes, and who writes and reads it
    Budget(Budget),
    /// List the Vulkan devices
    Devices,
}

/// `raywake run`.
#[derive(Debug, clap::Args)]
pub struct Run {
    /// Folder of the recording: a KITTI drive, an Argoverse 2 log or a folder of clouds
    pub data: PathBuf,
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
    pub results: Results,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub part: Part,
    /// No progress and no report, errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// What the user says about the recording.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Recording")]
pub struct Recording {
    /// Kind of recording, where the folder does not tell
    #[arg(long)]
    pub format: Option<Format>,
    /// 3x4 poses, one row per sweep
    #[arg(long, value_name = "FILE")]
    pub poses: Option<PathBuf>,
    /// Whose motion the poses tell
    #[arg(long, value_name = "FRAME")]
    pub poses_frame: Option<PosesFrame>,
    /// Whether the vehicle's motion within a sweep is still to be removed
    #[arg(long, value_name = "on|off", hide_possible_values = true)]
    #[arg(value_parser = BoolishValueParser::new())]
    pub deskew: Option<bool>,
    /// Height of the ground in the vehicle frame, m (KITTI: -1.73)
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub ground: Option<f64>,
}

/// Which profile.
#[derive(Debug, Default, clap::Args)]
#[command(next_help_heading = "Profile")]
pub struct ProfileChoice {
    /// A shipped profile: hdl64 (50 m, the default), wide (70.5 m) or dissertation
    #[arg(long, value_name = "NAME", conflicts_with = "config")]
    pub profile: Option<String>,
    /// A profile of one's own: `base = "hdl64"` and the fields to change
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Set one parameter of the profile, as PARAMETERS.md names it; may be given again
    #[arg(long, value_name = "NAME=VALUE")]
    pub set: Vec<String>,
}

/// Learned numbers.
#[derive(Debug, Default, clap::Args)]
#[command(next_help_heading = "Learned numbers")]
pub struct Learned {
    /// Weights of the background filter; `none`: every solid column may move
    #[arg(long, value_name = "FILE|none")]
    pub filter: Option<PathBuf>,
    /// Weights of the occupancy constancy
    #[arg(long, value_name = "FILE")]
    pub constancy: Option<PathBuf>,
}

/// Where the heavy half runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum BackendKind {
    /// The fastest Vulkan device that is not a CPU, else scalar
    #[default]
    Auto,
    /// A Vulkan device, a CPU too if there is nothing else
    Vulkan,
    /// The CPU
    Scalar,
}

/// Checks of the Khronos validation layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[allow(missing_docs)]
pub enum Validate {
    Sync,
    Gpu,
}

/// Which backend.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Backend")]
pub struct BackendChoice {
    /// Where the heavy half runs
    #[arg(long, value_enum, value_name = "KIND", default_value = "auto")]
    pub backend: BackendKind,
    /// Index of the device in `raywake devices`
    #[arg(long, value_name = "N")]
    pub device: Option<usize>,
    /// The longest a sweep may take on the device, s
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = seconds)]
    pub timeout: Duration,
    /// Run under the validation layer
    #[arg(long, hide = true)]
    pub validation: Option<Validate>,
}

/// What is written.
#[derive(Debug, Default, clap::Args)]
#[command(next_help_heading = "Results")]
pub struct Results {
    /// Folder for `columns`, `points`, `tracklets` (feather), `png` and `summary.json`
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Bird's-eye pictures too, with the flow over ground or as the moving vehicle sees it
    #[arg(long, requires = "out", value_name = "FRAME", value_enum)]
    #[arg(num_args = 0..=1, require_equals = true, default_missing_value = "world")]
    pub png: Option<PictureFrame>,
    /// No files of single returns
    #[arg(long)]
    pub no_points: bool,
    /// Submission files: DIR/argoverse/LOG/TIMESTAMP.feather
    #[arg(long, value_name = "FORMAT", requires = "out")]
    pub export: Option<Export>,
    /// Figures of the run as JSON; with --out they go to DIR/summary.json otherwise
    #[arg(long, value_name = "FILE")]
    pub summary: Option<PathBuf>,
}

/// Velocities a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PictureFrame {
    /// Over ground
    World,
    /// Relative to the vehicle
    Ego,
}

/// Formats of other programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Export {
    /// Argoverse 2 scene flow
    Argoverse,
}

/// `raywake map`.
#[derive(Debug, clap::Args)]
pub struct Map {
    /// Folder of the recording: a KITTI drive, an Argoverse 2 log or a folder of clouds
    pub data: PathBuf,
    /// Folder for one map a sweep: FRAME.feather with i, j, k and log-odds of every voxel touched
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub recording: Recording,
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

/// Which sweeps.
#[derive(Debug, Default, clap::Args)]
pub struct Part {
    /// Stop after this many sweeps
    #[arg(short = 'n', value_name = "COUNT", value_parser = count)]
    pub count: Option<usize>,
    /// Only these sweeps, the last one excluded; `A..` and `..B` are open ends
    #[arg(long, value_name = "A..B", value_parser = Sweeps::parse)]
    pub sweeps: Option<Sweeps>,
}

/// `raywake demo`.
#[derive(Debug, clap::Args)]
pub struct Demo {
    /// Folder for the results
    #[arg(long, value_name = "DIR", default_value = "raywake-demo")]
    pub out: PathBuf,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub backend: BackendChoice,
    /// Errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// `raywake budget`.
#[derive(Debug, clap::Args)]
pub struct Budget {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub profile: ProfileChoice,
    /// Fail with exit code 6 where device and host memory together exceed this, bytes
    #[arg(long, value_name = "BYTES")]
    pub limit: Option<u64>,
    /// Print PARAMETERS.md instead: every parameter with its unit, range, default and reason
    #[arg(long)]
    pub parameters: bool,
}

impl Part {
    /// The sweeps asked for of a recording of `len`.
    pub fn range(&self, len: usize) -> Result<Range<usize>, Error> {
        let range = self.sweeps.unwrap_or_default().within(len)?;
        let count = self.count.unwrap_or(range.len()).min(range.len());
        Ok(range.start..range.start + count)
    }
}

impl Recording {
    /// For [`raywake_io::source::open`].
    pub fn options(&self) -> OpenOptions {
        OpenOptions {
            format: self.format,
            poses: self.poses.clone(),
            poses_frame: self.poses_frame,
            deskew: self.deskew,
            ground_m: self.ground,
        }
    }
}

fn count(text: &str) -> Result<usize, String> {
    let count = text.parse().map_err(|_| "no number")?;
    if count > 0 { Ok(count) } else { Err("at least one sweep".into()) }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "no number")?;
    let duration = Duration::try_from_secs_f64(seconds).map_err(|e| e.to_string())?;
    if duration.is_zero() { Err("more than 0 is needed".into()) } else { Ok(duration) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_declaration_is_sound() {
        Args::command().debug_assert();
    }

    #[test]
    fn numbers() {
        assert_eq!(seconds("0.5"), Ok(Duration::from_millis(500)));
        assert!(["0", "-1", "nan", "inf", "x"].iter().all(|s| seconds(s).is_err()));
        assert!(count("0").is_err());
    }
}
