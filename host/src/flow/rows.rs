//! Per-point flow as rows, and their files.

use std::io::Write;
use std::path::Path;

use glam::Vec3;
use raywake_core::output::{FlowBasis, PointFlow, Status};
use raywake_core::pose::Pose;
use raywake_core::sweep::Point;

use raywake_io::Error;
use raywake_io::sink::argoverse::displacement;
use raywake_io::sink::feather::status_names;
use raywake_io::sink::table::TableWriter;
use raywake_io::sink::{Meta, atomic};

/// The output for a point of the first cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointRow {
    /// Position in the first cloud's frame, m.
    pub position: [f32; 3],
    /// Position in the second cloud's frame minus `position`, m.
    pub flow: [f32; 3],
    /// Motion over ground along the axes of the first cloud, m.
    pub motion: [f32; 3],
    /// Covariance of the motion (xx, xy, yy), m^2; zero if neither matched nor joined.
    pub covariance: [f32; 3],
    /// Where the flow comes from.
    pub basis: FlowBasis,
    /// What became of the point.
    pub status: Status,
}

impl PointRow {
    /// Creates the row of a point and its flow over `dt_s`; `second_from_first` is the inverse of
    /// the sensor's motion.
    pub fn new(point: &Point, flow: &PointFlow, second_from_first: &Pose, dt_s: f64) -> PointRow {
        let at = Vec3::from_array(point.position);
        let measured = if at.is_finite() { 1.0 } else { f32::NAN };
        let motion = displacement(flow, &Pose::IDENTITY, dt_s).map(|v| v * measured);
        let then = second_from_first.transform((at + Vec3::from_array(motion)).as_dvec3());
        PointRow {
            position: point.position,
            flow: (then - at.as_dvec3()).as_vec3().to_array(),
            motion,
            covariance: flow.covariance.map(|v| v * (dt_s * dt_s) as f32),
            basis: flow.basis,
            status: flow.status,
        }
    }

    /// Whether the point was matched or is part of a moving cluster.
    pub fn valid(&self) -> bool {
        self.basis >= FlowBasis::Matched
    }
}

/// File format of the rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A table.
    Feather,
    /// Little-endian float32: flow and motion of every row.
    Bin,
}

impl Form {
    /// The format of a file by its extension. Fails if the extension is unknown, or this build
    /// cannot write it.
    pub fn of(path: &Path) -> Result<Form, Error> {
        let unable = |what: &str| format!("--out {}: {what}", path.display());
        match path.extension().and_then(|e| e.to_str()) {
            Some("feather") if cfg!(feature = "arrow") => Ok(Form::Feather),
            Some("feather") => {
                Err(Error::missing_feature(format!("--out {}", path.display()), "arrow"))
            }
            Some("bin") => Ok(Form::Bin),
            _ => Err(Error::Usage(unable("the extension must be .feather or .bin"))),
        }
    }

    /// Writes the rows, whole or not at all; `meta` goes into a table's metadata.
    pub fn write(self, path: &Path, rows: &[PointRow], meta: Meta<'_>) -> Result<(), Error> {
        match self {
            Form::Feather => table(rows).write(path, &[meta, &[status_names()]].concat()),
            Form::Bin => atomic::write(path, |out| {
                let numbers = rows.iter().flat_map(|r| [r.flow, r.motion]).flatten();
                numbers.into_iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))
            }),
        }
    }
}

fn table(rows: &[PointRow]) -> TableWriter {
    let mut t = TableWriter::default();
    t.array(["x_m", "y_m", "z_m"], rows, |r| r.position);
    t.array(["flow_x_m", "flow_y_m", "flow_z_m"], rows, |r| r.flow);
    t.array(["motion_x_m", "motion_y_m", "motion_z_m"], rows, |r| r.motion);
    t.array(["cov_dx_dx", "cov_dx_dy", "cov_dy_dy"], rows, |r| r.covariance);
    t.column("foreground", rows, |r| r.basis != FlowBasis::Background);
    t.column("valid", rows, PointRow::valid);
    t.column("status", rows, |r| r.status as u8);
    t
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn flow_includes_the_sensors_motion_and_motion_does_not() {
        // The sensor moves a metre forward and turns left.
        let second_from_first = Pose::planar(1.0, 0.0, 0.0, FRAC_PI_2).inverse();
        let row = |position, velocity_world_mps| {
            let flow = PointFlow {
                velocity_world_mps,
                covariance: [4.0, 1.0, 2.0],
                basis: FlowBasis::Matched,
                ..PointFlow::default()
            };
            let point = Point { position, ..Point::default() };
            PointRow::new(&point, &flow, &second_from_first, 0.5)
        };
        let near =
            |a: [f32; 3], b: [f32; 3]| (Vec3::from_array(a) - Vec3::from_array(b)).length() < 1e-5;
        let still = row([5.0, 2.0, 1.0], [0.0; 2]);
        assert!(near(still.flow, [-3.0, -6.0, 0.0]) && still.motion == [0.0; 3], "{still:?}");
        let moving = row([5.0, 2.0, 1.0], [6.0, -4.0]);
        assert!(near(moving.motion, [3.0, -2.0, 0.0]), "{moving:?}");
        assert!(near(moving.flow, [0.0 - 5.0, -7.0 - 2.0, 0.0]), "{moving:?}");
        assert_eq!((moving.covariance, moving.valid()), ([1.0, 0.25, 0.5], true));
        for bad in [f32::NAN, f32::INFINITY] {
            let row = row([5.0, bad, 1.0], [6.0, -4.0]);
            assert!(row.flow.iter().chain(&row.motion).all(|v| v.is_nan()), "{row:?}");
        }
    }
}
