//! Arrays of records, and reading the caller's arrays.

use std::ops::Range;

use bytemuck::Pod;
use numpy::ndarray::s;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::{PyMemoryError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use raywake_core::sweep::Point;
use raywake_embed::{ColumnRecord, ObjectRecord, PointRecord, ReturnSource, TrackletRecord};

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

/// Makes an array of whatever NumPy can make one of real numbers of.
pub fn real<'py>(value: &Bound<'py, PyAny>, what: &str) -> PyResult<Bound<'py, PyAny>> {
    let numpy = value.py().import("numpy")?;
    let wrong =
        |kind: &str| PyTypeError::new_err(format!("{what}: expected real numbers, not {kind}"));
    if value.is_instance(&numpy.getattr("ma")?.getattr("MaskedArray")?)? {
        return Err(wrong("a masked array, whose mask would be lost"));
    }
    let given = numpy.call_method1("asarray", (value,))?;
    let kind: String = given.getattr("dtype")?.getattr("kind")?.extract()?;
    match kind.as_str() {
        "f" | "i" | "u" => Ok(given),
        _ => Err(wrong(&given.getattr("dtype")?.str()?.to_string())),
    }
}

/// Converts to single precision in native byte order.
fn as_f32<'py>(value: &Bound<'py, PyAny>, what: &str) -> PyResult<Bound<'py, PyAny>> {
    let (py, given) = (value.py(), real(value, what)?);
    let numpy = py.import("numpy")?;
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

/// Returns copied at a time; columns with gaps between their elements are gathered first.
const BLOCK: usize = 1024;

/// Returns in the caller's arrays, which are read while no other Python thread runs.
pub struct CallerReturns<'py> {
    positions: PyReadonlyArray2<'py, f32>,
    times: Option<PyReadonlyArray1<'py, f32>>,
    sensors: Option<PyReadonlyArray1<'py, f32>>,
}

impl<'py> CallerReturns<'py> {
    /// Checks and, if need be, converts arrays.
    pub fn new(
        points: &Bound<'py, PyAny>,
        times: Option<&Bound<'py, PyAny>>,
        sensors: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<CallerReturns<'py>> {
        let points = as_f32(points, "points")?;
        let positions: PyReadonlyArray2<f32> = points.extract().map_err(|_| shape(&points))?;
        let [count, width] = [positions.shape()[0], positions.shape()[1]];
        if width < 3 {
            let why = format!("points need at least 3 numbers, not {width}");
            return Err(PyValueError::new_err(why));
        }
        let times = times.map(|times| one_each(times, "time", count)).transpose()?;
        let sensors = sensors.map(|sensors| one_each(sensors, "sensor", count)).transpose()?;
        Ok(CallerReturns { positions, times, sensors })
    }
}

impl ReturnSource for CallerReturns<'_> {
    fn count(&self) -> usize {
        self.positions.shape()[0]
    }

    fn copy(&self, to: &mut [Point]) {
        let positions = self.positions.as_array();
        let mut gathered = [[0.0; BLOCK]; 2];
        let [time_room, sensor_room] = &mut gathered;
        for (n, to) in to.chunks_mut(BLOCK).enumerate() {
            let block = n * BLOCK..n * BLOCK + to.len();
            let times = part(&self.times, block.clone(), time_room);
            let sensors = part(&self.sensors, block.clone(), sensor_room);
            let rest = times.iter().zip(sensors);
            let positions = positions.slice(s![block, ..]);
            match positions.to_slice() {
                Some(flat) => {
                    let rows = flat.chunks_exact(positions.ncols());
                    write(to, rows.map(|row| [row[0], row[1], row[2]]).zip(rest));
                }
                None => {
                    let rows = positions.rows().into_iter();
                    write(to, rows.map(|row| [row[0], row[1], row[2]]).zip(rest));
                }
            }
        }
    }
}

/// Writes positions, times and sensors.
fn write<'a>(to: &mut [Point], values: impl Iterator<Item = ([f32; 3], (&'a f32, &'a f32))>) {
    // An invalid index stands for no sensor; it is counted.
    let index = |v: f32| if (0.0..256.0).contains(&v) { v as u32 } else { u32::MAX };
    for (to, (position, (time, sensor))) in to.iter_mut().zip(values) {
        *to = Point { position, intensity: 0.0, offset_s: *time, sensor: index(*sensor) };
    }
}

/// Some elements of an array, contiguous: where they are or, if there are gaps, in `room`; zeros if
/// there is no array.
fn part<'a>(
    values: &'a Option<PyReadonlyArray1<f32>>,
    which: Range<usize>,
    room: &'a mut [f32; BLOCK],
) -> &'a [f32] {
    let Some(values) = values else { return &[0.0; BLOCK][..which.len()] };
    let values = values.as_array();
    if let Some(flat) = values.to_slice() {
        return &flat[which];
    }
    let room = &mut room[..which.len()];
    room.iter_mut().zip(which).for_each(|(to, n)| *to = values[n]);
    room
}

/// Copies a cloud.
pub fn cloud(points: &Bound<'_, PyAny>) -> PyResult<Vec<Point>> {
    let given = CallerReturns::new(points, None, None)?;
    let (mut cloud, count) = (Vec::new(), given.count());
    let lacking = |_| PyMemoryError::new_err(format!("no memory for {count} points"));
    cloud.try_reserve_exact(count).map_err(lacking)?;
    cloud.resize(count, Point::default());
    given.copy(&mut cloud);
    Ok(cloud)
}

fn shape(points: &Bound<'_, PyAny>) -> PyErr {
    let shape = points.getattr("shape").map(|shape| shape.to_string()).unwrap_or_default();
    PyValueError::new_err(format!("points: expected an N x 3 array, not {shape}"))
}

fn one_each<'py>(
    values: &Bound<'py, PyAny>,
    what: &str,
    count: usize,
) -> PyResult<PyReadonlyArray1<'py, f32>> {
    let wrong = || PyValueError::new_err(format!("{what}: expected one number per point"));
    let values: PyReadonlyArray1<f32> = as_f32(values, what)?.extract().map_err(|_| wrong())?;
    if values.len() == count { Ok(values) } else { Err(wrong()) }
}
