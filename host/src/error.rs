//! The errors that end a command, and their exit codes.

use crate::console;
use raywake_alloc_guard::Allocation;
use raywake_gpu::GpuError;
use raywake_io::Error;

/// A failure of a command: a file, the device, or a limit.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A file, or inconsistent arguments.
    #[error(transparent)]
    Io(#[from] Error),
    /// The Vulkan device, or the lack of one.
    #[error("{}", device(.0))]
    Device(#[from] GpuError),
    /// Memory was allocated within a sweep.
    #[error("internal error: {0}")]
    Allocation(#[from] Allocation),
    /// More memory than the system provides.
    #[error("{} needed, which the system cannot provide", console::bytes(*.bytes))]
    NoMemory {
        /// Bytes needed.
        bytes: u64,
    },
    /// More memory than the user's limit.
    #[error("{} needed, over the limit of {}", console::bytes(*.bytes), console::bytes(*.limit))]
    OverBudget {
        /// Bytes needed.
        bytes: u64,
        /// Bytes allowed.
        limit: u64,
    },
}

impl RunError {
    /// Exit code of the process: that of [`Error`], 5 for the device, 6 for memory over the limit
    /// or refused, 7 for memory allocated within a sweep.
    pub fn exit_code(&self) -> u8 {
        match self {
            RunError::Io(e) => e.exit_code(),
            RunError::Device(_) => 5,
            RunError::OverBudget { .. } | RunError::NoMemory { .. } => 6,
            RunError::Allocation(_) => 7,
        }
    }
}

/// The text of a device error, with advice if there is no device.
fn device(e: &GpuError) -> String {
    match e {
        GpuError::NoLoader | GpuError::NoDevice => {
            format!("{e}: see `raywake devices`, or use --backend scalar")
        }
        e => format!("device: {e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_and_codes() {
        let device = RunError::from(GpuError::NoLoader);
        assert!(device.to_string().starts_with("no Vulkan loader found: see"));
        assert_eq!(device.exit_code(), 5);
        assert_eq!(RunError::OverBudget { bytes: 2, limit: 1 }.exit_code(), 6);
        assert_eq!(RunError::NoMemory { bytes: 1 }.exit_code(), 6);
        assert_eq!(RunError::from(Error::Usage("x".into())).exit_code(), 2);
    }
}
