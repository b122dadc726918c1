//! The flow, a sweep at a time.

use pyo3::exceptions::{PyMemoryError, PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use raywake::statistics::describe_reset;
use raywake_core::digest::Digest;
use raywake_core::params::{AssignError, ParameterSetting, Profile, Value};
use raywake_embed::{
    ColumnRecord, CreateError, EstimatorOptions, FlowEstimator, ObjectRecord, PointRecord,
    ReceivedStep, StepError, StepSummary, SweepPlace, TeamError, TeamEstimator, TrackletRecord,
};

use raywake_registration::odometry::PoseStatus;

use crate::arrays::{CallerReturns, array};
use crate::poses::{matrix, pose, twist};
use crate::recording::PySweep;
use crate::rig::PyRig;

/// Temporal scene flow, a sweep at a time, on the CPU.
///
/// profile: "hdl64" (a window of +-25 m), "wide" (+-35 m), "far" (+-50 m) or "dissertation".
/// rig: where the sensors sit; see Rig.
/// settings: parameters of the profile, by the names in PARAMETERS.md.
/// find_poses: poses are found by registration instead of being given.
/// objects: objects are tracked too; see Step.objects.
/// points_max: maximum number of returns of a sweep; 0: as many as the profile takes.
/// threads: 0: as many as pay off.
///
/// All memory is allocated here.
#[pyclass(module = "raywake", name = "Pipeline")]
pub struct PyPipeline {
    team: TeamEstimator,
    /// Steps so far.
    steps: u64,
    digest: Digest,
    find_poses: bool,
    /// Number of bytes it works in.
    memory: usize,
}

/// Returns a profile with some of its parameters set.
pub fn profile(name: &str, settings: Option<&Bound<'_, PyDict>>) -> PyResult<Profile> {
    let mut profile = Profile::named(name)
        .ok_or_else(|| PyValueError::new_err(format!("there is no profile {name:?}")))?;
    for (key, value) in settings.into_iter().flat_map(|settings| settings.iter()) {
        set(&mut profile, &key.extract::<String>()?, &value)?;
    }
    Ok(profile)
}

fn set(profile: &mut Profile, path: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let word: String;
    let value = if let Ok(flag) = value.extract::<bool>() {
        Value::Flag(flag)
    } else if let Ok(number) = value.extract::<f64>() {
        Value::Number(number)
    } else {
        word = value.extract()?;
        Value::Word(&word)
    };
    profile.assign(&ParameterSetting::new(path, value)).map_err(|e| match e {
        AssignError::Unknown => PyValueError::new_err(format!("there is no parameter {path:?}")),
        AssignError::InvalidValue(requirement) => {
            PyValueError::new_err(format!("{path} must be {requirement}"))
        }
    })
}

/// Creates an estimator in its own memory.
pub fn estimator(options: &EstimatorOptions, threads: usize) -> PyResult<TeamEstimator> {
    TeamEstimator::on_heap(options, threads).map_err(|e| match e {
        TeamError::Create(CreateError::Memory(_)) => PyMemoryError::new_err(e.to_string()),
        TeamError::Create(_) => PyValueError::new_err(e.to_string()),
        TeamError::Threads(e) => e.into(),
    })
}

#[pymethods]
impl PyPipeline {
    #[new]
    #[pyo3(signature = (profile="hdl64", rig=None, *, settings=None, find_poses=false,
        objects=false, points_max=0, threads=0))]
    fn new(
        profile: &str,
        rig: Option<&PyRig>,
        settings: Option<&Bound<'_, PyDict>>,
        find_poses: bool,
        objects: bool,
        points_max: usize,
        threads: usize,
    ) -> PyResult<PyPipeline> {
        let profile = self::profile(profile, settings)?;
        let rig = rig.map_or_else(PyRig::alone, |rig| Ok(rig.clone()))?.0;
        let points_max = if points_max == 0 { profile.returns() } else { points_max };
        let options = EstimatorOptions { profile, rig, points_max, registers: find_poses, objects };
        let team = estimator(&options, threads)?;
        let memory = options.bytes().map_err(|e| PyValueError::new_err(e.to_string()))?;
        Ok(PyPipeline { team, steps: 0, digest: Digest::default(), find_poses, memory })
    }

    /// Processes one sweep; returns the results for the pair of the previous sweep and this one.
    ///
    /// points: N x 3 or more numbers, x, y, z in the vehicle frame, m; (0, 0, 0) and NaN are not
    ///     returns. Or a Sweep of a Recording, which includes everything below.
    /// stamp: time of the sweep, s.
    /// pose: world_from_vehicle, used as it is, however much it jitters; not with find_poses.
    /// twist: vx, vy, vz, wx, wy, wz of the vehicle along its own axes; default: from the poses.
    /// time: time of every return after the stamp, s.
    /// sensor: index of every return's sensor.
    #[pyo3(signature = (points, stamp=None, pose=None, *, twist=None, time=None, sensor=None))]
    fn step(
        slf: &Bound<'_, Self>,
        points: &Bound<'_, PyAny>,
        stamp: Option<f64>,
        pose: Option<&Bound<'_, PyAny>>,
        twist: Option<&Bound<'_, PyAny>>,
        time: Option<&Bound<'_, PyAny>>,
        sensor: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Step> {
        let mut this = slf.try_borrow_mut().map_err(|_| busy())?;
        let (py, find_poses) = (points.py(), this.find_poses);
        let team = &mut this.team;
        let stepped = if let Ok(sweep) = points.cast::<PySweep>() {
            if stamp.is_some() || [pose, twist, time, sensor].iter().any(Option::is_some) {
                return Err(PyTypeError::new_err(
                    "a Sweep already has stamp, pose, twist, time and sensor",
                ));
            }
            let PySweep { data, located, .. } = sweep.get();
            let given = *located && !find_poses;
            let place = SweepPlace {
                stamp_s: data.stamp_s,
                pose: given.then_some(data.world_from_vehicle),
                twist: given.then_some(data.twist),
            };
            py.detach(|| team.step(&place, &data.points[..]))
        } else {
            let returns = CallerReturns::new(points, time, sensor)?;
            let place = SweepPlace {
                stamp_s: stamp.ok_or_else(|| PyTypeError::new_err("stamp is missing"))?,
                pose: pose.map(|value| self::pose(value, "pose")).transpose()?,
                twist: twist.map(self::twist).transpose()?,
            };
            // While they are copied, nobody else may change the arrays.
            let received = team.receive(&place, &returns);
            py.detach(|| received.and_then(ReceivedStep::complete))
        };
        let summary = stepped.map_err(refused)?;
        this.steps += 1;
        let number = this.steps;
        Ok(Step { pipeline: slf.clone().unbind(), number, summary, arrays: [const { None }; 4] })
    }

    /// Adds everything the last step found, except objects, to the digest and returns it: called
    /// after every sweep of a recording, it gives the digest that `raywake run` prints.
    fn update_digest(slf: &Bound<'_, Self>) -> PyResult<String> {
        let mut this = slf.try_borrow_mut().map_err(|_| busy())?;
        let PyPipeline { team, digest, .. } = &mut *this;
        team.read(|found| found.add_to(digest)).map_err(refused)?;
        Ok(format!("{:016x}", digest.value()))
    }

    /// Number of threads that share the work.
    #[getter]
    fn threads(slf: &Bound<'_, Self>) -> PyResult<usize> {
        Ok(slf.try_borrow().map_err(|_| busy())?.team.threads())
    }

    /// Number of bytes it works in.
    #[getter]
    fn memory(slf: &Bound<'_, Self>) -> PyResult<usize> {
        Ok(slf.try_borrow().map_err(|_| busy())?.memory)
    }
}

fn busy() -> PyErr {
    PyRuntimeError::new_err("another thread is in a step of this pipeline")
}

fn refused(e: StepError) -> PyErr {
    match e {
        StepError::Sweep(e) => PyValueError::new_err(e.to_string()),
        StepError::Failed => PyRuntimeError::new_err(e.to_string()),
    }
}

/// Results of a step: the flow of the previous sweep, and tracklets at the time of this one.
///
/// Arrays are made when they are first asked for, which must be before the pipeline's next step.
#[pyclass(module = "raywake")]
pub struct Step {
    pipeline: Py<PyPipeline>,
    number: u64,
    summary: StepSummary,
    /// Of columns, points, tracklets and objects.
    arrays: [Option<Py<PyAny>>; 4],
}

impl Step {
    /// Returns an array, made now unless it was before.
    fn array(
        &mut self,
        py: Python<'_>,
        which: usize,
        make: impl FnOnce(&FlowEstimator) -> PyResult<Py<PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        if let Some(array) = &self.arrays[which] {
            return Ok(array.clone_ref(py));
        }
        let pipeline = self.pipeline.try_borrow(py).map_err(|_| busy())?;
        if pipeline.steps != self.number {
            let why = "the pipeline has gone on: read the arrays of a step before the next step";
            return Err(PyRuntimeError::new_err(why));
        }
        let array = pipeline.team.read(make).map_err(refused)??;
        self.arrays[which] = Some(array.clone_ref(py));
        Ok(array)
    }
}

#[pymethods]
impl Step {
    /// Solid columns of the previous sweep: an array of COLUMN_DTYPE.
    #[getter]
    fn columns(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.array(py, 0, |found| {
            let columns = found.columns();
            Ok(array(py, columns.len(), columns.iter().map(ColumnRecord::from))?.unbind())
        })
    }

    /// Returns of the previous sweep, in their order: an array of POINT_DTYPE.
    #[getter]
    fn points(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.array(py, 1, |found| {
            let count = found.points().map_or(0, |points| points.count());
            let points = found.points().into_iter().flat_map(|points| points.iter());
            Ok(array(py, count, points.map(PointRecord::from))?.unbind())
        })
    }

    /// Tracklets at the time of this sweep: an array of TRACKLET_DTYPE.
    #[getter]
    fn tracklets(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.array(py, 2, |found| {
            let count = found.tracklet_count();
            Ok(array(py, count, found.tracklets().map(TrackletRecord::from))?.unbind())
        })
    }

    /// Objects in the previous sweep: an array of OBJECT_DTYPE; empty unless the pipeline was
    /// created with objects=True.
    #[getter]
    fn objects(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.array(py, 3, |found| {
            let objects = found.objects();
            Ok(array(py, objects.len(), objects.iter().map(ObjectRecord::from))?.unbind())
        })
    }

    /// Time from the previous sweep to this one, s; None if they are not a pair.
    #[getter]
    fn dt(&self) -> Option<f64> {
        self.summary.pair.map(|pair| pair.dt_s)
    }

    /// Why this sweep does not continue the previous one: "first", "backwards", "gap", "jump" or
    /// "spin"; None if it does.
    #[getter]
    fn reset(&self) -> Option<&'static str> {
        self.summary.reset.map(|reset| describe_reset(reset).0)
    }

    /// world_from_vehicle of this sweep, 4x4.
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(matrix(py, &self.summary.pose)?.into_any())
    }

    /// How the pose was found: "start", "registered", "degenerate" or "lost"; None if it was given.
    #[getter]
    fn located(&self) -> Option<&'static str> {
        self.summary.pose_status.map(PoseStatus::name)
    }

    /// Returns of this sweep that were left out, by reason.
    #[getter]
    fn dropped<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (dropped, reasons) = (&self.summary.dropped, PyDict::new(py));
        reasons.set_item("over_capacity", dropped.over_capacity)?;
        reasons.set_item("not_finite", dropped.not_finite)?;
        reasons.set_item("no_return", dropped.no_return)?;
        reasons.set_item("too_far", dropped.too_far)?;
        reasons.set_item("unknown_sensor", dropped.unknown_sensor)?;
        reasons.set_item("own_vehicle", dropped.own_vehicle)?;
        reasons.set_item("unrefined", self.summary.unrefined)?;
        Ok(reasons)
    }

    fn __repr__(&self) -> String {
        match (self.summary.pair, self.reset()) {
            (Some(pair), _) => format!(
                "<raywake.Step: {} columns, {} points, {:.3} s>",
                pair.columns, pair.points, pair.dt_s
            ),
            (None, reset) => format!("<raywake.Step: no pair: {}>", reset.unwrap_or("none")),
        }
    }
}
