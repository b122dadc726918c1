//! The command line; the doc comment of a field is its help text.

// Flattened groups and plain choices have no doc comments.
#![allow(missing_docs)]

mod clean;
mod flow;
pub mod inputs;
#[cfg(feature = "pcap")]
mod live;
mod recordings;
mod results;
mod sweeps;
mod track;
mod values;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::builder::BoolishValueParser;
use clap::{Parser, Subcommand, ValueEnum};

use raywake_core::params::Profile;
use raywake_io::Error;
use raywake_io::source::{BinFields, Format, OpenOptions, PosesFrame, Unlocated};
use raywake_simd::Simd;

pub use clean::CleanArgs;
pub use flow::FlowArgs;
#[cfg(feature = "pcap")]
pub use live::{LiveArgs, PosesFrom};
pub use recordings::{Recordings, Shard};
pub use results::{Export, PictureFrame, Results, StreamArgs, Views};
pub use sweeps::SweepRange;
pub use track::{EstimateKind, FrontEndKind, TrackArgs};
use values::{count, nats, seconds, simd, size, vehicle_box};

const EXIT_CODES: &str = "\
Exit codes:
    0  success
    2  usage error, or a feature not compiled in
    3  an input file is missing, unreadable or invalid, or two clouds cannot be registered
    4  an output file cannot be written
    5  Vulkan device error
    6  more memory needed than `budget --limit` allows or the machine has
    7  memory was allocated during a sweep: an internal error
  130  interrupted; results so far are kept";

/// Temporal scene flow from LIDAR sweeps and poses.
#[derive(Debug, Parser)]
#[command(name = "raywake", version, after_help = EXIT_CODES, max_term_width = 100)]
pub struct Args {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Estimate the scene flow of a recorded drive
    #[command(after_help = EXIT_CODES)]
    Run(Box<RunArgs>),
    #[command(after_help = EXIT_CODES, after_long_help = flow::after_help(EXIT_CODES))]
    Flow(Box<FlowArgs>),
    #[command(after_help = EXIT_CODES, after_long_help = track::after_help(EXIT_CODES))]
    Track(Box<TrackArgs>),
    #[command(after_help = EXIT_CODES, after_long_help = clean::after_help(EXIT_CODES))]
    Clean(Box<CleanArgs>),
    #[cfg(feature = "pcap")]
    #[command(after_help = EXIT_CODES)]
    Live(Box<LiveArgs>),
    /// Write an occupancy map of every sweep over the sensor's full range
    #[command(after_help = EXIT_CODES)]
    Map(Box<MapArgs>),
    /// Estimate the poses of a recording by registering its sweeps
    #[command(after_help = EXIT_CODES)]
    Odometry(OdometryArgs),
    /// Run on a small simulated drive and compare the result with ground truth
    #[cfg(feature = "demo")]
    Demo(DemoArgs),
    /// Print the memory layout: every buffer, its size, and what writes and reads it
    #[command(after_help = EXIT_CODES)]
    Budget(BudgetArgs),
    /// List Vulkan devices
    Devices(DevicesArgs),
    /// Print a completion script for a shell
    #[cfg(feature = "shell")]
    Completions {
        /// Shell to complete commands in
        shell: clap_complete::Shell,
    },
    /// Print a manual page
    #[cfg(feature = "shell")]
    Man {
        /// Command to describe [default: an overview of all]
        #[arg(value_name = "COMMAND")]
        of: Option<String>,
    },
}

#[derive(Clone, Debug, clap::Args)]
pub struct DevicesArgs {
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Debug, clap::Args)]
pub struct RunArgs {
    #[command(flatten)]
    pub recordings: Recordings,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
    #[command(flatten)]
    pub recording: Recording,
    #[command(flatten)]
    pub flow: FlowChoice,
    #[command(flatten)]
    pub results: Results,
    #[command(flatten)]
    pub part: Selection,
}

#[derive(Clone, Debug, clap::Args)]
pub struct OdometryArgs {
    /// Recording: an MCAP or pcap file, or a folder: KITTI, Argoverse 2, nuScenes, Waymo or clouds
    pub data: PathBuf,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
    /// Poses to write, for use with `--poses` (KITTI odometry: with `--poses-frame vehicle`): 12
    /// numbers (a 3x4 matrix) per line, one line per sweep; the world frame is the vehicle's frame
    /// at the first sweep
    #[arg(short, long, value_name = "FILE")]
    pub out: PathBuf,
    #[command(flatten)]
    pub kind: RecordingKind,
    #[command(flatten)]
    pub part: Selection,
}

#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Recording")]
pub struct Recording {
    #[command(flatten)]
    pub kind: RecordingKind,
    /// Poses: 12 numbers (a 3x4 matrix) per line, one line per sweep from the first one on, or
    /// TUM's time, x, y, z and quaternion; or `register` to estimate them by registration [default:
    /// those of the recording; if it has none, by registration]
    #[arg(long, value_name = "FILE|register")]
    pub poses: Option<PathBuf>,
    /// Frame the poses refer to
    #[arg(long, value_name = "FRAME")]
    pub poses_frame: Option<PosesFrame>,
    /// Use the poses even where they jitter much more than registration
    #[arg(long)]
    pub trust_poses: bool,
}

/// The kind of recording and how to read it.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Recording")]
pub struct RecordingKind {
    /// Recording format [default: detected]
    #[arg(long)]
    pub format: Option<Format>,
    /// Point cloud topic of an MCAP recording; repeat it for several lidars [default: the only one,
    /// or all lidars that /tf_static connects]. For a pcap file: the sensor, as ADDRESS:PORT. For
    /// nuScenes and Waymo: the scene or segment
    #[arg(long)]
    pub topic: Vec<String>,
    /// Mounting poses of the lidars of an MCAP recording, instead of /tf_static, one per line:
    /// PARENT CHILD x y z qx qy qz qw, where CHILD is a frame or a topic
    #[arg(long, value_name = "FILE")]
    pub extrinsics: Option<PathBuf>,
    /// Fields of a return in .bin and .npy files, for example x,y,z,intensity,ring [default:
    /// x,y,z,intensity; for .pcd.bin, those of nuScenes]
    #[arg(long, value_name = "NAMES", value_parser = BinFields::parse)]
    pub bin_fields: Option<BinFields>,
    /// Whether sweeps still contain motion distortion
    #[arg(long, value_name = "on|off", hide_possible_values = true)]
    #[arg(value_parser = BoolishValueParser::new())]
    pub deskew: Option<bool>,
    /// Ground height in the vehicle frame, m (KITTI: -1.73)
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub ground: Option<f64>,
    /// Box around the own vehicle in its frame, m: returns in it, at any height, are ignored
    #[arg(long, value_name = "X0,Y0,X1,Y1", allow_hyphen_values = true, value_parser = vehicle_box)]
    pub own_vehicle: Option<[[f32; 2]; 2]>,
}

/// Profile, weights and backend the flow is computed with.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct FlowChoice {
    #[command(flatten)]
    pub profile: ProfileChoice,
    #[command(flatten)]
    pub learned: Learned,
    #[command(flatten)]
    pub backend: BackendChoice,
}

#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Profile")]
pub struct ProfileChoice {
    /// Built-in profile: hdl64 (window of ±25 m, the default), wide (±35 m), far (±50 m) or
    /// dissertation
    #[arg(long, value_name = "NAME", conflicts_with = "config")]
    pub profile: Option<String>,
    /// Custom profile (TOML): `base = "hdl64"` and the parameters to change
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Report as moving what moves with at least this probability (`moves_min` in PARAMETERS.md)
    #[arg(long, value_name = "P")]
    pub moving: Option<f32>,
    /// Set a parameter of the profile, as named in PARAMETERS.md; may be repeated
    #[arg(long, value_name = "NAME=VALUE")]
    pub set: Vec<String>,
}

#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Model weights")]
pub struct Learned {
    /// Background filter weights; `none` treats every occupied column as foreground
    #[arg(long, value_name = "FILE|none")]
    pub filter: Option<PathBuf>,
    /// Occupancy constancy weights
    #[arg(long, value_name = "FILE")]
    pub constancy: Option<PathBuf>,
    /// Encoder weights; `none` refines without the classes of the columns
    #[arg(long, value_name = "FILE|none")]
    pub encoder: Option<PathBuf>,
    /// Weights of P(moves), the probability that a column moves
    #[arg(long, value_name = "FILE")]
    pub moves: Option<PathBuf>,
}

/// Where the grid and flow stages run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum BackendKind {
    /// The fastest Vulkan GPU, or the CPU if there is none
    #[default]
    Auto,
    /// A Vulkan device, even if it is a CPU
    Vulkan,
    /// The CPU
    Scalar,
}

/// Checks of the Khronos validation layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Validate {
    Sync,
    Gpu,
}

#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Backend")]
pub struct BackendChoice {
    /// Compute backend
    #[arg(long, value_enum, value_name = "KIND", default_value = "auto")]
    pub backend: BackendKind,
    /// Instruction set used on the CPU: sse2, avx2 or avx512, on Arm neon [default: the widest it
    /// has]. Results are the same
    #[arg(long, value_name = "NAME", value_parser = simd)]
    pub simd: Option<Simd>,
    /// Device index, see `raywake devices`
    #[arg(long, value_name = "N")]
    pub device: Option<usize>,
    /// GPU time limit per sweep, in seconds
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = seconds)]
    pub timeout: Duration,
    /// Run with the validation layer
    #[arg(long, hide = true)]
    pub validation: Option<Validate>,
}

#[derive(Clone, Debug, clap::Args)]
pub struct MapArgs {
    /// Recording: an MCAP or pcap file, or a folder: KITTI, Argoverse 2, nuScenes, Waymo or clouds
    pub data: PathBuf,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
    /// Output folder: FRAME.feather per sweep, with i, j, k, log-odds and probability of every
    /// observed voxel
    #[arg(short, long, value_name = "DIR")]
    pub out: PathBuf,
    /// Clip the log-odds of a voxel to this magnitude
    #[arg(long, value_name = "NATS", default_value = "3", value_parser = nats)]
    pub clip: f32,
    /// Also draw each map from above: DIR/FRAME.png
    #[arg(long)]
    pub png: bool,
    #[command(flatten)]
    pub views: Views,
    #[command(flatten)]
    pub recording: Recording,
    #[command(flatten)]
    pub backend: BackendChoice,
    #[command(flatten)]
    pub part: Selection,
}

#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Sweeps")]
pub struct Selection {
    /// Process at most this many sweeps
    #[arg(short = 'n', value_name = "COUNT", value_parser = count)]
    pub count: Option<usize>,
    /// Process only sweeps A to B (B excluded); either end may be omitted
    #[arg(long, value_name = "A..B", value_parser = SweepRange::parse)]
    pub sweeps: Option<SweepRange>,
}

#[derive(Clone, Debug, clap::Args)]
pub struct DemoArgs {
    /// Output folder
    #[arg(short, long, value_name = "DIR", default_value = "raywake-demo")]
    pub out: PathBuf,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
    #[command(flatten)]
    pub backend: BackendChoice,
}

#[derive(Clone, Debug, clap::Args)]
pub struct BudgetArgs {
    /// Exit with code 6 if device and host memory together exceed this, for example 64MiB or 128MB
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub limit: Option<u64>,
    /// Print PARAMETERS.md instead: every parameter with unit, range, default and rationale
    #[arg(long, conflicts_with = "json")]
    pub parameters: bool,
    /// Print JSON: sizes in bytes
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub profile: ProfileChoice,
}

impl Selection {
    /// Returns the selected sweeps of a recording of `len`.
    pub fn range(&self, len: usize) -> Result<Range<usize>, Error> {
        let range = self.sweeps.unwrap_or_default().within(len)?;
        let count = self.count.unwrap_or(range.len()).min(range.len());
        Ok(range.start..range.start + count)
    }
}

impl Recording {
    /// Options for [`raywake_io::source::open`].
    pub fn options(&self) -> OpenOptions {
        let register = self.poses.as_deref() == Some(Path::new("register"));
        OpenOptions {
            poses: self.poses.clone().filter(|_| !register),
            poses_frame: self.poses_frame,
            trusted: self.trust_poses,
            unlocated: if register { Unlocated::Always } else { Unlocated::Accept },
            ..self.kind.options()
        }
    }
}

impl RecordingKind {
    /// Makes a profile, whatever it says, compensate motion if that is asked for.
    pub fn adapt(&self, profile: &mut Profile) {
        profile.deskew |= self.deskew == Some(true);
    }

    /// Options for [`raywake_io::source::open`], without poses.
    pub fn options(&self) -> OpenOptions {
        OpenOptions {
            format: self.format,
            topics: self.topic.clone(),
            extrinsics: self.extrinsics.clone(),
            bin_fields: self.bin_fields.clone(),
            deskew: self.deskew,
            ground_m: self.ground,
            own_vehicle: self.own_vehicle,
            ..OpenOptions::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_declaration_is_sound() {
        Args::command().debug_assert();
    }
}
