//! The Python module `raywake`: NumPy arrays in, arrays of records out.
//!
//! The part written in Python is in `python/raywake`; this is `raywake._raywake`.
#![deny(missing_docs)]

mod arrays;
mod clouds;
mod commands;
mod flow_record;
mod pipeline;
mod poses;
mod recording;
mod rig;

/// `raywake._raywake`.
#[pyo3::pymodule]
mod _raywake {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::clouds::{CloudFlow, flow};
    #[pymodule_export]
    use super::commands::{main, odometry};
    #[pymodule_export]
    use super::pipeline::{PyPipeline, Step};
    #[pymodule_export]
    use super::recording::{PyRecording, PySweep};
    #[pymodule_export]
    use super::rig::PyRig;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        super::arrays::add_types(module)
    }
}
