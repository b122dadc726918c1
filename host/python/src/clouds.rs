//! Flow from one cloud to the next.

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use raywake::flow::rows::PointRow;
use raywake::flow::{motion, place};
use raywake_core::pose::Pose;
use raywake_core::sweep::Point;
use raywake_embed::{EstimatorOptions, SweepPlace};

use crate::arrays::{array, cloud};
use crate::flow_record::FlowRecord;
use crate::pipeline::{estimator, profile};
use crate::poses::{matrix, pose};

/// Flow from one cloud to the next.
#[pyclass(frozen, module = "raywake")]
pub struct CloudFlow {
    /// Points of the first cloud, in their order: an array of FLOW_DTYPE.
    #[pyo3(get)]
    points: Py<PyAny>,
    /// Pose of the second cloud's frame in the first one's, 4x4.
    #[pyo3(get)]
    pose: Py<PyAny>,
    /// Height of the ground in the first cloud's frame, m.
    #[pyo3(get)]
    ground: f64,
}

#[pymethods]
impl CloudFlow {
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<raywake.CloudFlow: {} points>", self.points.bind(py).len()?))
    }
}

/// Scene flow from cloud a to cloud b, scans of one sensor with z up; no poses needed.
///
/// a, b: N x 3 or more numbers: x, y, z, m.
/// dt: time from a to b, s.
/// profile, settings: as for Pipeline.
/// ground: height of the ground in a's frame, m; default: estimated from a.
/// sensor: x, y, z of the sensor in the clouds' frame, m; default: their origin, unless the ground
///     is too close to it.
/// pose: pose of b's frame in a's, if known; default: by registration.
///
/// Raises ValueError if the clouds cannot be registered to each other: no motion is guessed.
#[pyfunction]
#[pyo3(signature = (a, b, *, dt=0.1, profile="hdl64", settings=None, ground=None, sensor=None,
    pose=None))]
#[expect(clippy::too_many_arguments, reason = "named arguments")]
pub fn flow(
    py: Python<'_>,
    a: &Bound<'_, PyAny>,
    b: &Bound<'_, PyAny>,
    dt: f64,
    profile: &str,
    settings: Option<&Bound<'_, PyDict>>,
    ground: Option<f64>,
    sensor: Option<[f64; 3]>,
    pose: Option<&Bound<'_, PyAny>>,
) -> PyResult<CloudFlow> {
    if !(dt.is_finite() && dt > 0.0) {
        return Err(PyValueError::new_err("dt must be positive and finite"));
    }
    let profile = self::profile(profile, settings)?;
    let [first, second] = [cloud(a)?, cloud(b)?];
    let pose = pose.map(|value| self::pose(value, "pose")).transpose()?;
    let placed = py.detach(|| place::rig(&first, ground, sensor));
    let (rig, _) = placed.map_err(|e| PyValueError::new_err(e.to_string()))?;
    let ground = rig.ground_m;
    let (rows, motion) = py.detach(|| {
        let motion = match pose {
            Some(pose) => pose,
            None => motion::find([&first, &second], &rig).map_err(PyValueError::new_err)?.0,
        };
        let points_max = first.len().max(second.len());
        let options =
            EstimatorOptions { profile, rig, points_max, registers: false, objects: false };
        Ok::<_, PyErr>((rows(&options, [&first, &second], motion, dt)?, motion))
    })?;
    let points = array(py, rows.len(), rows.into_iter())?.unbind();
    Ok(CloudFlow { points, pose: matrix(py, &motion)?.into_any().unbind(), ground })
}

fn rows(
    options: &EstimatorOptions,
    [first, second]: [&[Point]; 2],
    motion: Pose,
    dt_s: f64,
) -> PyResult<Vec<FlowRecord>> {
    let mut team = estimator(options, 0)?;
    let sweeps = [(0.0, Pose::IDENTITY, first), (dt_s, motion, second)];
    for (stamp_s, pose, points) in sweeps {
        let place = SweepPlace { stamp_s, pose: Some(pose), twist: Some(Default::default()) };
        let step = team.step(&place, points);
        let summary = step.map_err(|e| PyValueError::new_err(e.to_string()))?;
        if stamp_s > 0.0
            && let Some(reset) = summary.reset
        {
            let why = format!("b does not follow a: {reset:?}");
            return Err(PyValueError::new_err(why));
        }
    }
    let second_from_first = motion.inverse();
    let row = |(point, flow)| {
        let row = PointRow::new(point, &flow, &second_from_first, dt_s);
        FlowRecord {
            flow_m: row.flow,
            motion_m: row.motion,
            covariance: row.covariance,
            status: row.status as u8,
            basis: row.basis as u8,
            reserved: [0; 2],
        }
    };
    let rows = team.read(|found| {
        let flows = found.points().into_iter().flat_map(|points| points.iter());
        first.iter().zip(flows).map(row).collect()
    });
    rows.map_err(|e| PyRuntimeError::new_err(e.to_string()))
}
