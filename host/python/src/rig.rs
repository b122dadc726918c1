//! The rig.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use raywake_core::params::SENSORS_MAX;
use raywake_core::pose::Pose;
use raywake_core::sweep::{self, Timing};

use crate::poses::pose;

/// Where the sensors sit, and what the times of their returns mean.
///
/// sensors: poses vehicle_from_sensor, at most 8; default: one at the vehicle's origin.
/// timing: "stamp" (every return is measured at the sweep's stamp), "offset" (returns carry their
///     time after the stamp; a sweep spans `span` seconds from `start` on) or "azimuth" (a sensor
///     that spins clockwise from the rear, stamped when it faces forward).
/// distorted: returns are still distorted by the vehicle's motion; each is moved to the stamp.
/// ground: height of the ground under the vehicle in the vehicle frame, m.
/// own_vehicle: (x0, y0, x1, y1), m: returns in this box belong to the vehicle itself.
#[pyclass(frozen, module = "raywake", name = "Rig")]
#[derive(Clone)]
pub struct PyRig(pub sweep::Rig);

#[pymethods]
impl PyRig {
    #[new]
    #[pyo3(signature = (sensors=None, *, timing="stamp", start=0.0, span=0.1, distorted=false,
        ground=-1.73, own_vehicle=None))]
    fn new(
        sensors: Option<Vec<Bound<'_, PyAny>>>,
        timing: &str,
        start: f64,
        span: f64,
        distorted: bool,
        ground: f64,
        own_vehicle: Option<[f32; 4]>,
    ) -> PyResult<PyRig> {
        let timing = match timing {
            "stamp" => Timing::AtStamp,
            "offset" => Timing::Offset { from_s: start, span_s: span },
            "azimuth" => Timing::Azimuth { span_s: span },
            _ => {
                return Err(PyValueError::new_err("timing must be 'stamp', 'offset' or 'azimuth'"));
            }
        };
        Ok(PyRig(sweep::Rig {
            sensors: places(sensors)?,
            timing,
            distorted,
            ground_m: ground,
            own_vehicle: own_vehicle.map(|[x0, y0, x1, y1]| [[x0, y0], [x1, y1]]),
        }))
    }

    /// Height of the ground under the vehicle in the vehicle frame, m.
    #[getter]
    fn ground(&self) -> f64 {
        self.0.ground_m
    }

    fn __repr__(&self) -> String {
        let (count, ground) = (self.0.sensors.len(), self.0.ground_m);
        format!("<raywake.Rig: {count} sensors, ground at {ground:.2} m>")
    }
}

impl PyRig {
    /// One sensor at the vehicle's origin.
    pub fn alone() -> PyResult<PyRig> {
        PyRig::new(None, "stamp", 0.0, 0.1, false, -1.73, None)
    }
}

fn places(sensors: Option<Vec<Bound<'_, PyAny>>>) -> PyResult<heapless::Vec<Pose, SENSORS_MAX>> {
    let Some(sensors) = sensors else { return Ok([Pose::IDENTITY].into_iter().collect()) };
    if sensors.len() > SENSORS_MAX {
        return Err(PyValueError::new_err(format!("sensors: at most {SENSORS_MAX}")));
    }
    sensors.iter().map(|sensor| pose(sensor, "sensors")).collect()
}
