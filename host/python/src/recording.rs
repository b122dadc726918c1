//! Recordings.

use std::path::PathBuf;
use std::sync::Mutex;

use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::{PyIndexError, PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use raywake_core::sweep::Point;
use raywake_io::Error;
use raywake_io::source::{OpenOptions, Source, SweepData, Unlocated, open};

use crate::poses::matrix;
use crate::rig::PyRig;

/// Converts an error: what cannot be read is an OSError, the rest a ValueError.
pub fn failed(e: Error) -> PyErr {
    match e {
        Error::Usage(_) => PyValueError::new_err(e.to_string()),
        _ => PyOSError::new_err(e.to_string()),
    }
}

/// Sweeps of a recording, in their order: an MCAP or pcap file, or a folder of KITTI, Argoverse 2,
/// nuScenes, Waymo or clouds.
///
/// poses: file of poses (12 numbers per line, or TUM's), instead of the recording's own.
/// topics: point cloud topics of an MCAP file; default: all lidars that can be connected.
/// ground: height of the ground in the vehicle frame, m; default: the recording's.
#[pyclass(frozen, module = "raywake", name = "Recording")]
pub struct PyRecording {
    source: Mutex<Box<dyn Source>>,
    rig: PyRig,
    about: String,
    located: bool,
    length: usize,
}

#[pymethods]
impl PyRecording {
    #[new]
    #[pyo3(signature = (path, *, poses=None, topics=None, ground=None))]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        poses: Option<PathBuf>,
        topics: Option<Vec<String>>,
        ground: Option<f64>,
    ) -> PyResult<PyRecording> {
        let topics = topics.unwrap_or_default();
        let options = OpenOptions {
            poses,
            topics,
            ground_m: ground,
            unlocated: Unlocated::Accept,
            ..OpenOptions::default()
        };
        let source = py.detach(|| open(&path, &options)).map_err(failed)?;
        let (rig, about) = (PyRig(source.rig().clone()), source.describe());
        let (located, length) = (source.is_located(), source.len());
        Ok(PyRecording { source: Mutex::new(source), rig, about, located, length })
    }

    fn __len__(&self) -> usize {
        self.length
    }

    /// Returns a sweep; a negative index counts from the end.
    fn __getitem__(&self, py: Python<'_>, index: isize) -> PyResult<PySweep> {
        let from_end = if index < 0 { self.length as isize } else { 0 };
        let index = usize::try_from(index + from_end).ok().filter(|n| *n < self.length);
        let index = index.ok_or_else(|| PyIndexError::new_err("sweep index out of range"))?;
        py.detach(|| {
            let poisoned = |_| PyRuntimeError::new_err("reading an earlier sweep failed");
            let mut source = self.source.lock().map_err(poisoned)?;
            let (mut sweep, arrays) = (SweepData::default(), [const { PyOnceLock::new() }; 4]);
            source.read(index, &mut sweep).map_err(failed)?;
            Ok(PySweep { data: sweep, located: self.located, arrays })
        })
    }

    /// Where the sensors sit.
    #[getter]
    fn rig(&self) -> PyRig {
        self.rig.clone()
    }

    /// Whether it comes with poses; if not, Pipeline(find_poses=True) finds them.
    #[getter]
    fn located(&self) -> bool {
        self.located
    }

    fn __repr__(&self) -> String {
        format!("<raywake.Recording: {}>", self.about)
    }
}

/// A sweep of a recording. Its arrays are made when they are first asked for, and kept: they are
/// read-only, and must not be made writeable.
#[pyclass(frozen, module = "raywake", name = "Sweep")]
pub struct PySweep {
    /// The sweep as read.
    pub data: SweepData,
    /// Whether it has a pose.
    pub located: bool,
    /// Of positions, intensities, times and sensors.
    arrays: [PyOnceLock<Py<PyAny>>; 4],
}

impl PySweep {
    /// Returns an array of `N` numbers per return, made now unless it was before.
    fn array<'py, T: numpy::Element, const N: usize>(
        &self,
        py: Python<'py>,
        which: usize,
        of: impl Fn(&Point) -> [T; N],
    ) -> PyResult<Bound<'py, PyAny>> {
        let make = || {
            let flat = PyArray1::from_iter(py, self.data.points.iter().flat_map(of));
            let array = match N {
                1 => flat.into_any(),
                _ => flat.reshape([self.data.points.len(), N])?.into_any(),
            };
            array.getattr("flags")?.setattr("writeable", false)?;
            Ok::<_, PyErr>(array.unbind())
        };
        Ok(self.arrays[which].get_or_try_init(py, make)?.bind(py).clone())
    }
}

#[pymethods]
impl PySweep {
    /// Positions of the returns in the vehicle frame, m: N x 3.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, 0, |p| p.position)
    }

    /// Intensity of every return, 0 to 1 if the recording has it.
    #[getter]
    fn intensity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, 1, |p| [p.intensity])
    }

    /// Time of every return after the stamp, s.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, 2, |p| [p.offset_s])
    }

    /// Index of every return's sensor.
    #[getter]
    fn sensor<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, 3, |p| [p.sensor])
    }

    /// Time of the sweep, s.
    #[getter]
    fn stamp(&self) -> f64 {
        self.data.stamp_s
    }

    /// Number of its file.
    #[getter]
    fn frame(&self) -> u64 {
        self.data.frame
    }

    /// world_from_vehicle, 4x4; None if the recording has no poses.
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let pose = || matrix(py, &self.data.world_from_vehicle).map(Bound::into_any);
        self.located.then(pose).transpose()
    }

    /// Velocity of the vehicle along its own axes: vx, vy, vz, wx, wy, wz.
    #[getter]
    fn twist<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        let (linear, angular) =
            (self.data.twist.linear.to_array(), self.data.twist.angular.to_array());
        PyArray1::from_slice(py, [linear, angular].as_flattened()).into_any()
    }

    fn __len__(&self) -> usize {
        self.data.points.len()
    }

    fn __repr__(&self) -> String {
        format!("<raywake.Sweep {}: {} returns>", self.data.frame, self.data.points.len())
    }
}
