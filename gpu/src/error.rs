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
    /// The loader knows no device, or none of the index asked for.
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
    /// The device stopped working. Final.
    #[error("device lost during {during}, says {call}")]
    DeviceLost {
        /// The function that said so.
        call: &'static str,
        /// How far it came.
        during: During,
    },
    /// A run missed its deadline. Final, because the device may still be at it.
    #[error("no end of {during} within {after:?}")]
    Timeout {
        /// How far it came.
        during: During,
        /// The deadline.
        after: Duration,
    },
    /// What was done beside the device panicked, and nobody waited for the device. Final.
    #[error("`{program}` was abandoned")]
    Abandoned {
        /// The program's name.
        program: &'static str,
    },
    /// What a program left behind cannot be. Final.
    #[error("`{program}` left nonsense behind: {what}")]
    Nonsense {
        /// The program's name.
        program: &'static str,
        /// What cannot be.
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

/// How far a program came before it failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct During {
    /// The program's name.
    pub program: &'static str,
    /// Index and name of the last step known to have finished. None also where the device has no
    /// timestamps or cannot be asked while it runs.
    pub last: Option<(usize, &'static str)>,
}

impl fmt::Display for During {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.last {
            Some((index, name)) => {
                write!(f, "`{}`, after step {index} `{name}`", self.program)
            }
            None => write!(f, "`{}`", self.program),
        }
    }
}

/// For `map_err`: names the call that failed.
pub(crate) fn failed(call: &'static str) -> impl Fn(vk::Result) -> GpuError {
    move |result| GpuError::Vulkan { call, result }
}
