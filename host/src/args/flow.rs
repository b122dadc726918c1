//! `raywake flow`.

use std::path::PathBuf;
use std::time::Duration;

use raywake_core::params::POINTS_MAX;

use super::{BackendChoice, Learned, ProfileChoice, seconds};

const ABOUT: &str = "\
Flow of every point of cloud A until cloud B, without poses

The motion between the clouds is found by registration, then the clouds go through the pipeline as \
two sweeps of a drive. The clouds are files as a spinning sensor makes them, upright (z up) and in \
the frame of their sensor or vehicle: .bin (float32 x, y, z, intensity), .pcd, .ply or .feather \
(columns x, y, z), each of its own kind. Times of single returns are not looked at.";

const FILES: &str = "\
Columns of --out FILE.feather, a row per point of A in its order, points without a place too:
    x_m y_m z_m                      the point
    flow_x_m flow_y_m flow_z_m       where it is in B's frame less where it was in A's
    motion_x_m motion_y_m motion_z_m over ground, the sensor's own motion removed, along A's axes
    cov_dx_dx cov_dx_dy cov_dy_dy    covariance of the motion, m^2; 0 where nothing was matched
    foreground                       not explained by the sensor's own motion
    valid                            matched, or part of a thing that moves
Flow and motion are NaN where a coordinate is. FILE.bin holds flow and motion alone, 6 little-endian
float32 a row. The file's metadata has dt_s, ground_m and a_from_b, the motion found (3x4 numbers,
row by row: the pose of B's frame in A's).
Points outside the profile's window, and those of A after its first";

/// `raywake flow`.
#[derive(Debug, clap::Args)]
#[command(about = ABOUT.lines().next(), long_about = ABOUT)]
pub struct Flow {
    /// The cloud whose flow is wanted
    #[arg(value_name = "A")]
    pub first: PathBuf,
    /// The cloud after it
    #[arg(value_name = "B")]
    pub second: PathBuf,
    /// File of the flow: .feather or .bin
    #[arg(long, value_name = "FILE", help_heading = "Results")]
    pub out: PathBuf,
    /// Time from A to B, s
    #[arg(long, value_name = "SECONDS", default_value = "0.1", value_parser = seconds)]
    pub dt: Duration,
    /// Height of the ground in A's frame, m; found in A where not given
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub ground: Option<f64>,
    /// Place of the sensor in the clouds' frame, m; else their origin, or 1.73 m above the ground
    /// where the ground is found at the origin
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = place)]
    pub sensor: Option<[f64; 3]>,
    /// The motion, where it is known: 3x4 numbers, the pose of B's frame in A's
    #[arg(long, value_name = "FILE")]
    pub pose: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub profile: ProfileChoice,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub learned: Learned,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub backend: BackendChoice,
    /// No report, errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// What `--help` ends with.
pub(super) fn after_help(exit_codes: &str) -> String {
    format!("{FILES} {POINTS_MAX}, count as standing still.\n\n{exit_codes}")
}

/// Three finite numbers with commas between them.
fn place(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|word| word.trim().parse()).collect();
    let place = numbers.ok().and_then(|n| <[f64; 3]>::try_from(n).ok());
    place
        .filter(|p| p.iter().all(|v| v.is_finite()))
        .ok_or_else(|| "write X,Y,Z, for example 0,0,1.73".into())
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
