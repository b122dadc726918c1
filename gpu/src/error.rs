use crate::Heap;
use ash::vk;
use std::fmt;
use std::time::Duration;

/// Why the device cannot be set up or a program did not finish.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum GpuError {
    /// There is no Vulkan loader (`libvulkan`) on this machine.
    NoLoader,
    /// The loader knows no device, or none of the index asked for.
    NoDevice,
    /// The device or the Vulkan installation lacks something needed.
    Unsupported {
        /// The device's name.
        device: String,
        /// What it lacks.
        what: String,
    },
    /// The buffers of one heap do not fit.
    OutOfMemory {
        /// The heap.
        heap: Heap,
        /// What all its buffers need together.
        bytes: u64,
    },
    /// The device stopped working. Final.
    DeviceLost {
        /// How far it came.
        during: During,
    },
    /// A run missed its deadline. Final, because the device may still be at it.
    Timeout {
        /// How far it came.
        during: During,
        /// The deadline.
        after: Duration,
    },
    /// The buffer table or a program contradicts itself or the device's limits.
    Schedule {
        /// The program's name.
        program: &'static str,
        /// The step's name ([`crate::Op::name`]).
        dispatch: &'static str,
        /// What is wrong.
        what: String,
    },
    /// A Vulkan call failed in a way none of the above describes.
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

impl fmt::Display for GpuError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::NoLoader => write!(f, "no Vulkan loader found"),
            Self::NoDevice => write!(f, "no such Vulkan device"),
            Self::Unsupported { device, what } => write!(f, "{device} lacks {what}"),
            Self::OutOfMemory { heap, bytes } => {
                write!(f, "the {heap:?} heap cannot hold {bytes} bytes")
            }
            Self::DeviceLost { during } => write!(f, "device lost during {during}"),
            Self::Timeout { during, after } => {
                write!(f, "no end of {during} within {after:?}")
            }
            Self::Schedule { program, dispatch, what } => {
                write!(f, "`{dispatch}` of `{program}`: {what}")
            }
            Self::Vulkan { call, result } => write!(f, "{call} failed: {result}"),
        }
    }
}

impl std::error::Error for GpuError {}

/// For `map_err`: names the call that failed.
pub(crate) fn failed(call: &'static str) -> impl Fn(vk::Result) -> GpuError {
    move |result| GpuError::Vulkan { call, result }
}
