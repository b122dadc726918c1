//! The program's commands.

use std::path::PathBuf;

use clap::CommandFactory;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::{PyMemoryError, PyOSError};
use pyo3::prelude::*;
use raywake::args::Args;
use raywake::error::RunError;
use raywake::locate::Locator;
use raywake_io::source::{OpenOptions, SweepData, Unlocated, open};

use crate::recording::failed;

/// The program: carries out a command line and returns its exit code.
#[pyfunction]
pub fn main(py: Python<'_>, args: Vec<String>) -> u8 {
    py.detach(|| {
        let line = Args::command().try_get_matches_from(args);
        line.and_then(|line| raywake::run_command_line(&line)).unwrap_or_else(|e| {
            // If this cannot be printed, nothing can.
            let _ = e.print();
            e.exit_code() as u8
        })
    })
}

/// Finds the poses of a recording from its sweeps alone: N x 4 x 4, world_from_vehicle, where the
/// world is the vehicle's frame at the first sweep.
#[pyfunction]
pub fn odometry(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    let options = OpenOptions { unlocated: Unlocated::Always, ..OpenOptions::default() };
    let mut source = py.detach(|| open(&path, &options)).map_err(failed)?;
    let in_memory = |e: RunError| PyMemoryError::new_err(e.to_string());
    let mut locator = Locator::finding().map_err(in_memory)?;
    let mut sweep = SweepData::default();
    let mut numbers = Vec::with_capacity(16 * source.len());
    for index in 0..source.len() {
        py.check_signals()?;
        py.detach(|| {
            source.read(index, &mut sweep).map_err(failed)?;
            let rig = source.rig().clone();
            let located = locator.locate(&rig, &mut sweep);
            located.map_err(|e| PyOSError::new_err(e.to_string()))
        })?;
        let pose = crate::poses::rows(&sweep.world_from_vehicle);
        numbers.extend_from_slice(pose.as_flattened());
    }
    let count = numbers.len() / 16;
    Ok(PyArray1::from_vec(py, numbers).reshape([count, 4, 4])?.into_any())
}
