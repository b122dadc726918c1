//! The program's commands.

use std::path::PathBuf;

use clap::{CommandFactory, FromArgMatches};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use raywake::args::{self, Args};
use raywake::console::{INTERRUPTED_CODE, warn};
use raywake::error::RunError;
use raywake::locate::Locator;
use raywake::{execute, team};
use raywake_io::source::{OpenOptions, SweepData, Unlocated, open};

use crate::recording::failed;

/// The program: carries out a command line and returns its exit code.
#[pyfunction]
pub fn main(py: Python<'_>, args: Vec<String>) -> u8 {
    py.detach(|| match Args::command().try_get_matches_from(args) {
        Ok(matches) => carry_out(&matches),
        Err(e) => {
            // Where it cannot be printed, nothing can.
            let _ = e.print();
            e.exit_code() as u8
        }
    })
}

fn carry_out(matches: &clap::ArgMatches) -> u8 {
    let command = match Args::from_arg_matches(matches) {
        Ok(args) => args.command,
        Err(e) => {
            let _ = e.print();
            return e.exit_code() as u8;
        }
    };
    let run =
        || args::inputs::protect(matches).map_err(RunError::from).and_then(|()| execute(command));
    match team::lead(team::available(), run) {
        Ok(true) => 0,
        Ok(false) => INTERRUPTED_CODE,
        Err(e) => {
            warn(&e.to_string());
            e.exit_code()
        }
    }
}

/// Poses of a recording from its sweeps alone: N x 4 x 4, world_from_vehicle, where the world is
/// the vehicle's frame at the first sweep.
#[pyfunction]
pub fn odometry(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    let options = OpenOptions { unlocated: Unlocated::Always, ..OpenOptions::default() };
    let mut source = py.detach(|| open(&path, &options)).map_err(failed)?;
    let (mut locator, mut sweep) = (Locator::finding(), SweepData::default());
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
