//! Scene flow in the format of the Argoverse 2 scene flow grader.

use std::path::{Path, PathBuf};

use glam::DVec3;
use raywake_core::output::{FlowBasis, PointFlow};
use raywake_core::pose::Pose;

use super::atomic;
use super::table::TableWriter;
use crate::Error;

/// Writes `<out>/<log>/<timestamp_ns>.feather`: one row per return of the pair's first sweep, in
/// its order, with `flow_tx_m flow_ty_m flow_tz_m` (float32: motion over `dt_s` in the vehicle
/// frame of the first sweep, without the vehicle's own motion) and `is_valid` (bool: false for
/// foreground without a match).
///
/// `first` is `world_from_vehicle` of the first sweep, `dt_s` the time to the second. Returns the
/// file's path. Fails with [`Error::Usage`] if `log` cannot name a folder, and if the file cannot
/// be written.
pub fn export(
    out: &Path,
    log: &str,
    timestamp_ns: u64,
    flows: &[PointFlow],
    first: &Pose,
    dt_s: f64,
) -> Result<PathBuf, Error> {
    if log.is_empty() || log == "." || log == ".." || log.contains(['/', '\\']) {
        return Err(Error::Usage(format!("`{log}` is not a valid log name")));
    }
    let folder = out.join(log);
    atomic::create_folder(&folder)?;
    let path = folder.join(format!("{timestamp_ns}.feather"));
    let mut table = TableWriter::default();
    table.array(["flow_tx_m", "flow_ty_m", "flow_tz_m"], flows, |f| displacement(f, first, dt_s));
    table.column("is_valid", flows, |f| f.basis != FlowBasis::Unmatched);
    table.write(&path, &[])?;
    Ok(path)
}

/// Motion over ground in `dt_s`, along the vehicle's axes, m.
pub fn displacement(flow: &PointFlow, world_from_vehicle: &Pose, dt_s: f64) -> [f32; 3] {
    let [x, y] = flow.velocity_world_mps.map(f64::from);
    let motion = world_from_vehicle.rotation.conjugate() * DVec3::new(x, y, 0.0) * dt_s;
    motion.as_vec3().to_array()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn world_velocity_along_the_vehicles_axes() {
        // The vehicle heads along world y and the return moves along world y: straight ahead.
        let pose = Pose::planar(100.0, -50.0, 1.0, core::f64::consts::FRAC_PI_2);
        let flow = PointFlow { velocity_world_mps: [0.0, 20.0], ..PointFlow::default() };
        let d = displacement(&flow, &pose, 0.1);
        assert!((d[0] - 2.0).abs() < 1e-6 && d[1].abs() < 1e-6 && d[2].abs() < 1e-6, "{d:?}");
        let flow = PointFlow { velocity_world_mps: [-10.0, 0.0], ..PointFlow::default() };
        assert!((displacement(&flow, &pose, 0.1)[1] - 1.0).abs() < 1e-6);
    }
}
