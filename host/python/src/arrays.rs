//! Arrays of records, and reading the caller's arrays.

use bytemuck::Pod;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use raywake_core::sweep::Point;
use raywake_embed::{ColumnRecord, ObjectRecord, PointRecord, TrackletRecord};

use crate::flow_record::FlowRecord;

/// A record that NumPy can have arrays of.
pub trait Record: Pod {
    /// For each field: name, NumPy type code, count (none: a scalar, without an axis) and offset.
    const FIELDS: &'static [(&'static str, &'static str, Option<usize>, usize)];
}

/// The type of a field.
trait RecordField {
    const CODE: &'static str;
    const COUNT: Option<usize> = None;
}

macro_rules! field {
    ($($type:ty, $code:literal;)*) => {$(
        impl RecordField for $type {
            const CODE: &'static str = $code;
        }
    )*};
}

field! {
    f64, "<f8";
    f32, "<f4";
    i32, "<i4";
    u32, "<u4";
    u8, "u1";
}

impl<T: RecordField, const N: usize> RecordField for [T; N] {
    const CODE: &'static str = T::CODE;
    const COUNT: Option<usize> = Some(N);
}

/// A field's NumPy type code and count, inferred from its accessor.
const fn code<R, T: RecordField>(_: fn(&R) -> &T) -> (&'static str, Option<usize>) {
    (T::CODE, T::COUNT)
}

macro_rules! record {
    ($($record:ident { $($name:ident),* })*) => {$(
        impl Record for $record {
            const FIELDS: &'static [(&'static str, &'static str, Option<usize>, usize)] = &[$({
                let (code, count) = code(|record: &$record| &record.$name);
                (stringify!($name), code, count, std::mem::offset_of!($record, $name))
            }),*];
        }

        const _: fn($record) = |record| {
            // All fields except the reserved ones.
            #[allow(unused_variables, clippy::unneeded_field_pattern)]
            let $record { $($name,)* .. } = record;
        };
    )*};
}

record! {
    ColumnRecord {
        position_world_m, cell, position_vehicle_m, displacement_m, displacement_covariance,
        velocity_world_mps, velocity_ego_mps, velocity_covariance, probability, age, basis, class_id
    }
    PointRecord {
        velocity_world_mps, velocity_ego_mps, velocity_covariance, probability, age, status, basis,
        class_id
    }
    TrackletRecord {
        position_world_m, cell, position_vehicle_m, heading_rad, speed_mps, turn_rate_radps,
        probability, velocity_world_mps, velocity_ego_mps, covariance, age
    }
    ObjectRecord {
        time_s, position_world_m, heading_rad, size_m, velocity_world_mps, turn_rate_radps,
        position_covariance, heading_variance, speed_variance, turn_rate_variance, probability,
        class_share, id, observations, moves, class_id
    }
    FlowRecord { flow_m, motion_m, covariance, status, basis }
}

/// Returns NumPy's type of a record.
pub fn dtype<'py, R: Record>(py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
    let numpy = py.import("numpy")?;
    let format = |(_, code, count, _): &(&str, &'static str, Option<usize>, usize)| match count {
        Some(count) => (*code, (*count,)).into_pyobject(py).map(Bound::into_any),
        None => Ok((*code).into_pyobject(py)?.into_any()),
    };
    let about = PyDict::new(py);
    about.set_item("names", R::FIELDS.iter().map(|field| field.0).collect::<Vec<_>>())?;
    about.set_item("formats", R::FIELDS.iter().map(format).collect::<PyResult<Vec<_>>>()?)?;
    about.set_item("offsets", R::FIELDS.iter().map(|field| field.3).collect::<Vec<_>>())?;
    about.set_item("itemsize", size_of::<R>())?;
    numpy.getattr("dtype")?.call1((about,))
}

/// Adds the types of records to the module.
pub fn add_types(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("COLUMN_DTYPE", dtype::<ColumnRecord>(py)?)?;
    module.add("POINT_DTYPE", dtype::<PointRecord>(py)?)?;
    module.add("TRACKLET_DTYPE", dtype::<TrackletRecord>(py)?)?;
    module.add("OBJECT_DTYPE", dtype::<ObjectRecord>(py)?)?;
    module.add("FLOW_DTYPE", dtype::<FlowRecord>(py)?)
}

/// Makes a new array and writes the records into it.
pub fn array<'py, R: Record>(
    py: Python<'py>,
    count: usize,
    records: impl Iterator<Item = R>,
) -> PyResult<Bound<'py, PyAny>> {
    let bytes = PyArray1::<u8>::zeros(py, count * size_of::<R>(), false);
    {
        let mut bytes = bytes.readwrite();
        let places = bytes.as_slice_mut()?.chunks_exact_mut(size_of::<R>());
        for (place, record) in places.zip(records) {
            place.copy_from_slice(bytemuck::bytes_of(&record));
        }
    }
    bytes.call_method1("view", (dtype::<R>(py)?,))
}

/// Converts whatever NumPy can make an array of to single precision in native byte order.
fn as_f32<'py>(value: &Bound<'py, PyAny>, what: &str) -> PyResult<Bound<'py, PyAny>> {
    let py = value.py();
    let numpy = py.import("numpy")?;
    let given = numpy.call_method1("asarray", (value,))?;
    let kind: String = given.getattr("dtype")?.getattr("kind")?.extract()?;
    if !matches!(kind.as_str(), "f" | "i" | "u") {
        let name = given.getattr("dtype")?.str()?;
        let why = format!("{what}: expected real numbers, not {name}");
        return Err(pyo3::exceptions::PyTypeError::new_err(why));
    }
    let single = numpy.getattr("float32")?;
    // A number beyond single precision becomes an infinity, which is counted as not finite.
    let quiet = PyDict::new(py);
    quiet.set_item("all", "ignore")?;
    let state = numpy.call_method("errstate", (), Some(&quiet))?;
    state.call_method0("__enter__")?;
    let made = numpy.call_method1("asarray", (given, single));
    state.call_method1("__exit__", (py.None(), py.None(), py.None()))?;
    made
}

/// Copies the caller's returns while no other Python thread runs.
pub fn points(
    to: &mut Vec<Point>,
    points: &Bound<'_, PyAny>,
    times: Option<&Bound<'_, PyAny>>,
    sensors: Option<&Bound<'_, PyAny>>,
) -> PyResult<()> {
    let points = as_f32(points, "points")?;
    let points: PyReadonlyArray2<f32> = points.extract().map_err(|_| shape(&points))?;
    let [count, width] = [points.shape()[0], points.shape()[1]];
    if width < 3 {
        return Err(PyValueError::new_err(format!("points need at least 3 numbers, not {width}")));
    }
    to.clear();
    to.reserve(count);
    to.extend(
        points
            .as_array()
            .rows()
            .into_iter()
            .map(|row| Point { position: [row[0], row[1], row[2]], ..Point::default() }),
    );
    if let Some(times) = times {
        let times = as_f32(times, "time")?;
        each(to, &times, "time", |point, time| point.offset_s = time)?;
    }
    if let Some(sensors) = sensors {
        let sensors = as_f32(sensors, "sensor")?;
        // An invalid index stands for no sensor; it is counted.
        let index = |v: f32| if (0.0..256.0).contains(&v) { v as u32 } else { u32::MAX };
        each(to, &sensors, "sensor", |point, sensor| point.sensor = index(sensor))?;
    }
    Ok(())
}

fn shape(points: &Bound<'_, PyAny>) -> PyErr {
    let shape = points.getattr("shape").map(|shape| shape.to_string()).unwrap_or_default();
    PyValueError::new_err(format!("points: expected an N x 3 array, not {shape}"))
}

fn each(
    to: &mut [Point],
    values: &Bound<'_, PyAny>,
    what: &str,
    mut set: impl FnMut(&mut Point, f32),
) -> PyResult<()> {
    let wrong = || PyValueError::new_err(format!("{what}: expected one number per point"));
    let values: PyReadonlyArray1<f32> = values.extract().map_err(|_| wrong())?;
    if values.len() != to.len() {
        return Err(wrong());
    }
    to.iter_mut().zip(values.as_array()).for_each(|(point, value)| set(point, *value));
    Ok(())
}
