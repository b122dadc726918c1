//! Poses and twists given by the caller.

use glam::{DQuat, DVec3};
use numpy::{PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use raywake_core::pose::{Pose, Twist};

use crate::arrays::real;

/// Returns the numbers of an array of any shape, row by row.
fn numbers(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<f64>> {
    let numpy = value.py().import("numpy")?;
    let double = numpy.getattr("float64")?;
    let flat =
        numpy.call_method1("asarray", (real(value, what)?, double))?.call_method0("ravel")?;
    let flat: numpy::PyReadonlyArray1<f64> = flat.extract()?;
    let numbers = flat.as_array().to_vec();
    match numbers.iter().all(|v| v.is_finite()) {
        true => Ok(numbers),
        false => Err(PyValueError::new_err(format!("{what}: not finite"))),
    }
}

/// Reads a pose from a 4x4 or 3x4 matrix, or from x, y, z, qx, qy, qz, qw, whose bits are kept.
pub fn pose(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Pose> {
    const WHAT: &str = "expected a 4x4 or 3x4 matrix, or x, y, z, qx, qy, qz, qw";
    let wrong = |why: &str| PyValueError::new_err(format!("{what}: {why}"));
    let numbers = numbers(value, what)?;
    match numbers[..] {
        [x, y, z, qx, qy, qz, qw] => Ok(Pose {
            translation: DVec3::new(x, y, z),
            rotation: DQuat::from_xyzw(qx, qy, qz, qw),
        }),
        _ => {
            let rows = numbers.first_chunk().ok_or_else(|| wrong(WHAT))?;
            match numbers.get(12..) {
                Some([] | [0.0, 0.0, 0.0, 1.0]) => {
                    Pose::from_rows(rows).map_err(|_| wrong("its 3x3 part is not a rotation"))
                }
                _ => Err(wrong(WHAT)),
            }
        }
    }
}

/// Reads a twist: a linear and an angular velocity.
pub fn twist(value: &Bound<'_, PyAny>) -> PyResult<Twist> {
    match numbers(value, "twist")?[..] {
        [x, y, z, a, b, c] => {
            Ok(Twist { linear: DVec3::new(x, y, z), angular: DVec3::new(a, b, c) })
        }
        _ => Err(PyValueError::new_err("twist: expected vx, vy, vz, wx, wy, wz")),
    }
}

/// Returns the rows of a 4x4 matrix.
pub fn rows(pose: &Pose) -> [[f64; 4]; 4] {
    let (r, t) = (pose.matrix(), pose.translation);
    let row = |n: usize| [r.row(n).x, r.row(n).y, r.row(n).z, t[n]];
    [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
}

/// Returns a pose as a 4x4 matrix.
pub fn matrix<'py>(py: Python<'py>, pose: &Pose) -> PyResult<Bound<'py, PyArray2<f64>>> {
    numpy::PyArray1::from_slice(py, rows(pose).as_flattened()).reshape([4, 4])
}
