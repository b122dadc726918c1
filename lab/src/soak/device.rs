//! Pipelines on the device, which may be one that is lost now and then.

use raywake::args::BackendChoice;
use raywake::backend::Backend;
use raywake::choose;
use raywake::drive::Drive;
use raywake::error::RunError;
use raywake::weight_files::WeightFiles;
use raywake_core::params::Profile;
use raywake_core::sweep::Rig;
use raywake_faulty_layer::{FAULT, environment};
use raywake_io::sink::atomic;
use std::error::Error;
use std::path::Path;
use std::process::Command;

/// Every thousandth submission reports the device as lost.
const LOST: &str = "vkQueueSubmit 1000 -4 each";

/// What pipelines are made from.
pub struct PipelineConfig<'a> {
    /// Where the expensive half runs.
    pub backend: &'a BackendChoice,
    /// Weights, read and checked.
    pub weights: WeightFiles,
    /// The profile, checked.
    pub profile: Profile,
    /// The rig of the recording.
    pub rig: Rig,
}

impl PipelineConfig<'_> {
    /// A pipeline on the requested backend.
    pub fn drive(&self) -> Result<Drive, RunError> {
        let PipelineConfig { backend, weights, profile, rig } = self;
        Ok(choose::drive(backend, weights, profile, rig)?.drive)
    }

    /// A pipeline on the CPU.
    pub fn scalar(&self) -> Result<Drive, RunError> {
        let tables = self.weights.tables(&self.profile)?;
        let backend = Backend::scalar(&self.profile, &tables);
        Ok(Drive::new(&self.profile, &self.rig, &tables, backend, self.backend.simd))
    }
}

/// Whether this process runs under a layer that loses the device.
pub fn is_under_layer() -> bool {
    std::env::var_os(FAULT).is_some()
}

/// Runs this program again under such a layer, since its variables are read when a process starts.
/// `folder` receives the layer's manifest.
///
/// # Errors
/// If the other process failed or could not be started.
pub fn under_layer(library: &Path, folder: &Path) -> Result<(), Box<dyn Error>> {
    let library = library.canonicalize()?;
    atomic::create_folder(folder)?;
    let folder = folder.canonicalize()?;
    let mut command = Command::new(std::env::current_exe()?);
    command.args(std::env::args_os().skip(1)).envs(environment(&folder, &library)?);
    let done = command.env(FAULT, LOST).status()?;
    if done.success() { Ok(()) } else { Err(format!("soak: {done}").into()) }
}
