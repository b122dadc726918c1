//! What can go wrong between the caller's tables and the device.

use crate::Heap;
use ash::vk;
use std::fmt;
use std::time::Duration;

/// Why the device cannot be set up or a program did not finish.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// There is no Vulkan loader (`libvulkan`) on this machine.
    #[error("no Vulkan loader found")]
    NoLoader,
    /// The loader finds no device, or none with the requested index.
    #[error("no such Vulkan device")]
    NoDevice,
    /// The device or the Vulkan installation lacks something needed.
    #[error("{device} lacks {what}")]
    Unsupported {
        /// The device's name.
        device: String,
        /// What it lacks.
        what: String,
    },
    /// The buffers of one heap do not fit.
    #[error("the {heap:?} heap cannot hold {bytes} bytes")]
    OutOfMemory {
        /// The heap.
        heap: Heap,
        /// What all its buffers need together.
        bytes: u64,
    },
    /// The device was lost. Final.
    #[error("device lost during {during}, reported by {call}")]
    DeviceLost {
        /// The function that reported it.
        call: &'static str,
        /// How far the program got.
        during: FailurePoint,
    },
    /// A run missed its deadline. Final, because the device may still be running it.
    #[error("{during} did not finish within {after:?}")]
    Timeout {
        /// How far the program got.
        during: FailurePoint,
        /// The deadline.
        after: Duration,
    },
    /// The work done beside the device panicked, so the device was not waited for. Final.
    #[error("`{program}` was abandoned: the work beside it panicked")]
    Abandoned {
        /// The program's name.
        program: &'static str,
    },
    /// The results of a program are impossible. Final.
    #[error("`{program}` left invalid results behind: {what}")]
    InvalidResults {
        /// The program's name.
        program: &'static str,
        /// What is impossible.
        what: &'static str,
    },
    /// The buffer table or a program contradicts itself or the device's limits.
    #[error("`{dispatch}` of `{program}`: {what}")]
    Schedule {
        /// The program's name.
        program: &'static str,
        /// The step's name ([`crate::Op::name`]).
        dispatch: &'static str,
        /// What is wrong.
        what: String,
    },
    /// A Vulkan call failed in a way none of the above describes.
    #[error("{call} failed: {result}")]
    Vulkan {
        /// The function.
        call: &'static str,
        /// What it returned.
        result: vk::Result,
    },
}

/// How far a program got before it failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FailurePoint {
    /// The program's name.
    pub program: &'static str,
    /// Index and name of the last step known to have finished. Also `None` if the device has no
    /// timestamps or cannot be queried while it runs.
    pub last: Option<(usize, &'static str)>,
}

impl fmt::Display for FailurePoint {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.last {
            Some((index, name)) => {
                write!(f, "`{}` (after step {index} `{name}`)", self.program)
            }
            None => write!(f, "`{}`", self.program),
        }
    }
}

/// For `map_err`: names the call that failed.
pub(crate) fn failed(call: &'static str) -> impl Fn(vk::Result) -> GpuError {
    move |result| GpuError::Vulkan { call, result }
}
