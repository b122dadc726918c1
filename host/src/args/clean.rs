//! `raywake clean`.

use std::path::PathBuf;

use super::{FlowChoice, Recording, Recordings, Selection};

const ABOUT: &str = "\
Remove moving objects from a recording: labels, clouds and a map of the static scene

The flow of every sweep is computed twice, forwards and backwards in time; then all sweeps are \
written in order. Memory grows by 60 kB per sweep of 120,000 returns, and with the map.";

const FILES: &str = "\
Files of --out DIR:
    labels/FRAME.label   SemanticKITTI's labels of moving object segmentation, one per return of
                         the input: 251 moving, 9 static, 0 neither (outside the window, or
                         not a surface)
    static/FRAME.bin     returns that do not move, also those outside the window, in the vehicle
                         frame and the recording's own format: .bin (little-endian float32 x, y, z,
                         intensity), .npy, .pcd, .ply or .feather. For an MCAP file or a capture:
                         static.mcap, with /points and /tf
    moving/FRAME.bin     returns that move; or moving.mcap
    map.ply              the static scene in the world frame of the poses: one point per voxel in
                         which more returns were static than moving";

#[derive(Clone, Debug, clap::Args)]
#[command(about = ABOUT.lines().next(), long_about = ABOUT)]
pub struct CleanArgs {
    #[command(flatten)]
    pub recordings: Recordings,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
    /// Output folder: `labels`, `static`, `moving` and `map.ply`
    #[arg(short, long, value_name = "DIR", help_heading = "Results")]
    pub out: PathBuf,
    /// Voxel size of the map, m
    #[arg(long, value_name = "M", default_value_t = 0.2, value_parser = edge)]
    #[arg(help_heading = "Results")]
    pub voxel: f64,
    #[command(flatten)]
    pub recording: Recording,
    #[command(flatten)]
    pub flow: FlowChoice,
    #[command(flatten)]
    pub part: Selection,
}

fn edge(text: &str) -> Result<f64, String> {
    let edge: f64 = text.parse().map_err(|_| "not a number")?;
    if (0.02..=5.0).contains(&edge) { Ok(edge) } else { Err("must be from 0.02 to 5".into()) }
}

/// Text at the end of `--help`.
pub(super) fn after_help(exit_codes: &str) -> String {
    format!("{FILES}\n\n{exit_codes}")
}
