//! `raywake flow`.

use std::path::PathBuf;
use std::time::Duration;

use raywake_core::params::POINTS_MAX;
use raywake_io::source::BinFields;

use super::FlowChoice;
use super::values::seconds;

const ABOUT: &str = "\
Scene flow from cloud A to cloud B; no poses needed

The motion of the sensor is estimated by registration, then both clouds are processed as two \
sweeps of a drive. Clouds are scans of a spinning sensor, with z up, in the frame of the sensor or \
the vehicle: .bin (float32 x, y, z, intensity), .npy, .pcd, .ply or .feather (columns x, y, z); A \
and B may differ in format. Times of individual returns are ignored.";

const FILES: &str = "\
Columns of --out FILE.feather, one row per point of A in file order, including invalid points:
    x_m y_m z_m                      the point
    flow_x_m flow_y_m flow_z_m       its position in B's frame minus its position in A's frame
    motion_x_m motion_y_m motion_z_m motion over ground (ego motion removed), along A's axes
    cov_dx_dx cov_dx_dy cov_dy_dy    covariance of the motion, m^2; 0 where unmatched
    foreground                       could move: not rejected by the background filter
    valid                            matched, or part of a moving cluster
    status                           what became of the point, by number: static, moving, unmatched,
                                     outside window, over capacity, own vehicle, no echo, invalid
Flow and motion are NaN if a coordinate is. FILE.bin has flow and motion only: 6 little-endian
float32 per row. The metadata of the feather file has dt_s, ground_m and a_from_b, the estimated
motion (a row-major 3x4 matrix: the pose of B's frame in A's).
Only moving points have a motion. A cloud is thinned evenly to at most";

#[derive(Debug, clap::Args)]
#[command(about = ABOUT.lines().next(), long_about = ABOUT)]
pub struct FlowArgs {
    /// First cloud; the flow is that of its points
    #[arg(value_name = "A")]
    pub first: PathBuf,
    /// Second cloud
    #[arg(value_name = "B")]
    pub second: PathBuf,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
    /// Output file: .feather or .bin
    #[arg(short, long, value_name = "FILE", help_heading = "Results")]
    pub out: PathBuf,
    /// Also draw the flow from above; without FILE, next to --out
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true)]
    #[arg(help_heading = "Results")]
    pub png: Option<Option<PathBuf>>,
    /// Also write an MCAP file for Foxglove, Rerun or rviz: A with velocities
    #[arg(long, value_name = "FILE", help_heading = "Results")]
    pub mcap: Option<PathBuf>,
    /// Fields of a point in .bin and .npy files [default: x,y,z,intensity]
    #[arg(long, value_name = "NAMES", value_parser = BinFields::parse)]
    pub bin_fields: Option<BinFields>,
    /// Time from A to B, s
    #[arg(long, value_name = "SECONDS", default_value = "0.1", value_parser = seconds)]
    pub dt: Duration,
    /// Ground height in A's frame, m [default: estimated from A]
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub ground: Option<f64>,
    /// Sensor position in the clouds' frame, m [default: the origin, or 1.73 m above the ground if
    /// the origin is at ground level]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = place)]
    pub sensor: Option<[f64; 3]>,
    /// Known sensor motion, used instead of registration: a 3x4 matrix, the pose of B's frame in
    /// A's
    #[arg(long, value_name = "FILE")]
    pub pose: Option<PathBuf>,
    #[command(flatten)]
    pub flow: FlowChoice,
}

/// Text at the end of `--help`.
pub(super) fn after_help(exit_codes: &str) -> String {
    format!("{FILES} {POINTS_MAX} points.\n\n{exit_codes}")
}

/// Parses three finite numbers separated by commas.
fn place(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|word| word.trim().parse()).collect();
    let place = numbers.ok().and_then(|n| <[f64; 3]>::try_from(n).ok());
    place
        .filter(|p| p.iter().all(|v| v.is_finite()))
        .ok_or_else(|| "expected X,Y,Z, for example 0,0,1.73".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places() {
        assert_eq!(place("-1.5,0,2"), Ok([-1.5, 0.0, 2.0]));
        assert!(["", "1,2", "1,2,3,4", "1,2,x", "1,2,inf"].iter().all(|t| place(t).is_err()));
    }
}
