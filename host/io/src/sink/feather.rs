//! Results as feather files (Arrow IPC), one table each, for pandas, polars, DuckDB and others.
//!
//! Every column is named with its unit; frames are those of [`raywake_core::output`]: `_world` is
//! the frame of the poses, without it the vehicle's; `v` is over ground along world axes, `v_ego`
//! relative to the moving vehicle along its axes.

use std::path::Path;

use raywake_core::encoder::ColumnClass;
use raywake_core::map::occupancy_probability;
use raywake_core::output::{ColumnFlow, FlowBasis, PointFlow, Status, TrackletState};
use raywake_core::params::LOG_ODDS_PER_NAT;
use raywake_core::sweep::Point;

use super::Meta;
use super::table::TableWriter;
use crate::Error;

/// Elements of a tracklet's state: m, m, rad, m/s and rad/s.
const STATE: [&str; 5] = ["x", "y", "heading", "speed", "turn"];

/// The flow of columns, one row each.
///
/// `cell_i cell_j` int32; `x_world_m y_world_m` float64; `x_m y_m`, `vx_world_mps vy_world_mps`,
/// `vx_ego_mps vy_ego_mps`, `cov_xx cov_xy cov_yy` ((m/s)^2, of the world velocity) float32;
/// `displacement_i displacement_j` (whole cells), `energy_millinats` int32; `dx_world_m dy_world_m`
/// (refined displacement over ground until the next sweep) and its covariance `cov_dx_dx cov_dx_dy
/// cov_dy_dy` (m^2) float32; `age` uint32; `p_moves` (probability that the column moves) float32;
/// `foreground` (not explained by odometry) and `valid` (with a match of its own or part of a
/// moving cluster) bool; `class` uint8, the class that the encoder assigns to the column: the
/// number of a [`ColumnClass`], whose names are in the metadata, or 255.
pub fn columns(columns: &[ColumnFlow]) -> TableWriter {
    let mut t = TableWriter::default();
    t.array(["cell_i", "cell_j"], columns, |c| c.cell);
    t.array(["x_world_m", "y_world_m"], columns, |c| c.position_world_m);
    t.array(["x_m", "y_m"], columns, |c| c.position_vehicle_m);
    t.array(["vx_world_mps", "vy_world_mps"], columns, |c| c.velocity_world_mps);
    t.array(["vx_ego_mps", "vy_ego_mps"], columns, |c| c.velocity_ego_mps);
    t.array(["cov_xx", "cov_xy", "cov_yy"], columns, |c| c.covariance);
    t.array(["displacement_i", "displacement_j"], columns, |c| c.displacement_cells);
    t.array(["dx_world_m", "dy_world_m"], columns, |c| c.displacement_m);
    t.array(["cov_dx_dx", "cov_dx_dy", "cov_dy_dy"], columns, |c| c.displacement_covariance);
    t.column("energy_millinats", columns, |c| c.energy);
    t.column("age", columns, |c| c.age);
    t.column("p_moves", columns, |c| c.probability);
    t.column("foreground", columns, |c| c.basis != FlowBasis::Background);
    t.column("valid", columns, |c| c.basis >= FlowBasis::Matched);
    t.column("class", columns, |c| ColumnClass::number(c.class));
    t
}

/// The flow of returns, one row each in the sweep's order.
///
/// `x_m y_m z_m`, `vx_world_mps vy_world_mps`, `vx_ego_mps vy_ego_mps vz_ego_mps`, `cov_xx cov_xy
/// cov_yy` of the world velocity float32; `age` uint32; `p_moves` float32; `foreground`, `valid`
/// bool; `status` uint8, what became of the return: the number of a
/// [`raywake_core::output::Status`], whose names are in the metadata, as are those of `class`.
///
/// `points` and `flows` belong to the same sweep.
pub fn points(points: &[Point], flows: &[PointFlow]) -> TableWriter {
    let mut t = TableWriter::default();
    t.array(["x_m", "y_m", "z_m"], points, |p| p.position);
    t.array(["vx_world_mps", "vy_world_mps"], flows, |f| f.velocity_world_mps);
    t.array(["vx_ego_mps", "vy_ego_mps", "vz_ego_mps"], flows, |f| f.velocity_ego_mps);
    found(&mut t, flows);
    t
}

/// The same without what the recording itself contains: positions only of moving returns (null for
/// the others), and velocities only over ground.
pub fn points_in_short(points: &[Point], flows: &[PointFlow]) -> TableWriter {
    let mut t = TableWriter::default();
    let rows: Vec<_> = points.iter().zip(flows).collect();
    let place = |(point, flow): &(&Point, &PointFlow)| {
        point.position.map(|v| (flow.status == Status::Moving).then_some(v))
    };
    t.array(["x_m", "y_m", "z_m"], &rows, place);
    t.array(["vx_world_mps", "vy_world_mps"], flows, |f| f.velocity_world_mps);
    found(&mut t, flows);
    t
}

/// The results for returns besides their velocities.
fn found(t: &mut TableWriter, flows: &[PointFlow]) {
    t.array(["cov_xx", "cov_xy", "cov_yy"], flows, |f| f.covariance);
    t.column("age", flows, |f| f.age);
    t.column("p_moves", flows, |f| f.probability);
    t.column("foreground", flows, |f| f.basis != FlowBasis::Background);
    t.column("valid", flows, |f| f.basis >= FlowBasis::Matched);
    t.column("status", flows, |f| f.status as u8);
    t.column("class", flows, |f| ColumnClass::number(f.class));
}

/// `class`: the names of all numbers, separated by commas.
pub fn class_names() -> (&'static str, String) {
    ("class", ColumnClass::ALL.map(ColumnClass::name).join(","))
}

/// `status`: the names of all numbers, separated by commas.
pub fn status_names() -> (&'static str, String) {
    ("status", Status::ALL.map(Status::name).join(","))
}

/// Tracklets, one row each.
///
/// `cell_i cell_j` int32; `x_world_m y_world_m` float64; `x_m y_m`, `heading_world_rad`,
/// `speed_mps`, `turn_rate_radps`, `vx_world_mps vy_world_mps`, `vx_ego_mps vy_ego_mps` and the
/// upper half of the covariance, `cov_x_x` to `cov_turn_turn`, float32; `age` uint32; `p_moves`
/// float32.
pub fn tracklets(tracklets: &[TrackletState]) -> TableWriter {
    let mut t = TableWriter::default();
    t.array(["cell_i", "cell_j"], tracklets, |s| s.cell);
    t.array(["x_world_m", "y_world_m"], tracklets, |s| s.position_world_m);
    t.array(["x_m", "y_m"], tracklets, |s| s.position_vehicle_m);
    t.column("heading_world_rad", tracklets, |s| s.heading_rad);
    t.column("speed_mps", tracklets, |s| s.speed_mps);
    t.column("turn_rate_radps", tracklets, |s| s.turn_rate_radps);
    t.array(["vx_world_mps", "vy_world_mps"], tracklets, |s| s.velocity_world_mps);
    t.array(["vx_ego_mps", "vy_ego_mps"], tracklets, |s| s.velocity_ego_mps);
    for (row, of) in STATE.iter().enumerate() {
        for (column, with) in STATE.iter().enumerate().skip(row) {
            t.column(&format!("cov_{of}_{with}"), tracklets, |s| s.covariance[row][column]);
        }
    }
    t.column("age", tracklets, |s| s.age);
    t.column("p_moves", tracklets, |s| s.probability);
    t
}

/// A voxel of an occupancy map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Voxel {
    /// Position in the map's lattice.
    pub index: [i32; 3],
    /// Log-odds of being occupied, tenths of nats.
    pub log_odds_tenths: i32,
}

/// Writes an occupancy map, one row per voxel: `i j k` int32, `log_odds` float32 (nats, positive is
/// occupied), `probability` float32 (of being occupied, with the log-odds clipped at `clip_nats`).
///
/// Voxel (i, j, k) spans from `origin_m + resolution_m * (i, j, k)` one resolution further along
/// every axis of the world; both go into the metadata as `origin_x_m`, `origin_y_m`, `origin_z_m`,
/// `resolution_m`, the limit as `clip_nats`.
pub fn write_map(
    path: &Path,
    voxels: &[Voxel],
    origin_m: [f64; 3],
    resolution_m: f64,
    clip_nats: f32,
    meta: Meta<'_>,
) -> Result<(), Error> {
    let mut t = TableWriter::default();
    t.array(["i", "j", "k"], voxels, |v| v.index);
    t.column("log_odds", voxels, |v| v.log_odds_tenths as f32 / LOG_ODDS_PER_NAT);
    t.column("probability", voxels, |v| occupancy_probability(v.log_odds_tenths, clip_nats));
    let place = [
        ("origin_x_m", origin_m[0].to_string()),
        ("origin_y_m", origin_m[1].to_string()),
        ("origin_z_m", origin_m[2].to_string()),
        ("resolution_m", resolution_m.to_string()),
        ("clip_nats", clip_nats.to_string()),
    ];
    t.write(path, &[meta, &place].concat())
}
