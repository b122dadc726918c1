//! Executes fixed schedules over preallocated buffers on raw Vulkan.
//!
//! The caller provides a table of [`Buffer`]s and a few [`Program`]s, lists of fills, copies and
//! kernel dispatches; [`Executor::new`] creates everything these need: memory, pipelines,
//! descriptor sets, recorded command buffers. After that, a frame is: write [`Executor::upload`],
//! call [`Executor::run`], read [`Executor::readback`].
//!
//! # Contract
//!
//! - **Allocation.** Only `Executor::new` allocates, at most one device memory block per [`Heap`].
//!   [`Executor::run`] and [`Executor::times`] allocate nothing on the host. They create, record
//!   and update nothing on the device: that takes a mutable reference which only set-up has. What
//!   a driver allocates inside a submit is outside this contract.
//! - **Waiting.** `run` submits and waits, at most [`Options::timeout`];
//!   [`Executor::run_alongside`] does the caller's work in between. Programs never overlap, so
//!   nothing needs ordering between two runs.
//! - **Ordering.** Within a program there is a barrier exactly where declared accesses conflict
//!   ([`Binding::reads`], [`Binding::writes`]): accesses that a kernel does not declare are not
//!   ordered.
//! - **Contents.** Mapped buffers start as zeros; [`Heap::Device`] buffers start undefined, so a
//!   program has to fill or write what it reads. All contents persist from one run to the next.
//! - **Trust.** The SPIR-V is trusted: it must be valid, stay within its bindings and use no
//!   optional feature. Indirect group counts cannot be checked here either: the kernel that writes
//!   them keeps them within [`Limits::workgroups`]. [`Validation`] finds most violations.
//! - **After a failure.** A lost device or a missed deadline is final: every later run returns the
//!   same error immediately. What is still running is left alone and its objects are leaked, never
//!   destroyed in use.
//!
//! Apart from a layer for tests, this is the only crate of the project that calls Vulkan.
#![deny(missing_docs)]

mod arena;
mod check;
mod device;
mod error;
mod executor;
mod instance;
mod messages;
mod order;
mod owner;
mod program;
mod recorder;
mod timer;

pub use device::{DeviceInfo, DeviceKind, Limits, devices};
pub use error::{FailurePoint, GpuError};
pub use executor::Executor;
pub use order::{Access, CommandCounts, accesses};
pub use owner::Census;

use std::time::Duration;

/// The kind of memory a buffer lives in, by who accesses it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heap {
    /// Written by the host through a mapping, only read by the device.
    Upload,
    /// Accessed only by the device.
    Device,
    /// Written by the device, read by the host through a mapping.
    Readback,
}

/// One row of the caller's buffer table. From then on, buffers are identified by their row.
#[derive(Clone, Copy, Debug)]
pub struct Buffer {
    /// For messages.
    pub name: &'static str,
    /// Where it lives.
    pub heap: Heap,
    /// Size; a multiple of four, not zero.
    pub bytes: u64,
}

/// One buffer of a kernel and what the kernel does with it. Barriers derive from this.
#[derive(Clone, Copy, Debug)]
pub struct Binding {
    /// For messages.
    pub name: &'static str,
    /// Whether the kernel may read it.
    pub reads: bool,
    /// Whether the kernel may write it; atomics read and write.
    pub writes: bool,
    /// Whether it is a uniform buffer rather than a storage buffer: the same for every invocation,
    /// and only read.
    pub uniform: bool,
}

impl Binding {
    /// A storage buffer.
    pub const fn storage(name: &'static str, reads: bool, writes: bool) -> Binding {
        Binding { name, reads, writes, uniform: false }
    }

    /// A uniform buffer.
    pub const fn uniform(name: &'static str) -> Binding {
        Binding { name, reads: true, writes: false, uniform: true }
    }

    fn descriptor(&self) -> ash::vk::DescriptorType {
        match self.uniform {
            true => ash::vk::DescriptorType::UNIFORM_BUFFER,
            false => ash::vk::DescriptorType::STORAGE_BUFFER,
        }
    }
}

/// A compiled compute shader. Each has its own static, whose address identifies it.
#[derive(Clone, Copy, Debug)]
pub struct Kernel {
    /// The entry point's name in the module; also for messages.
    pub name: &'static str,
    /// The module.
    pub spirv: Spirv,
    /// Invocations per workgroup, as compiled in.
    pub workgroup: [u32; 3],
    /// Buffers of set 0; the binding number is the index.
    pub bindings: &'static [Binding],
}

/// The words of a module that may be run.
#[derive(Clone, Copy, Debug)]
pub struct Spirv(&'static [u32]);

impl Spirv {
    /// A module of these words.
    ///
    /// # Safety
    /// They must be a module that is valid for Vulkan 1.1 (SPIR-V 1.3 or older), and its shader
    /// must stay within the buffers of [`Kernel::bindings`], whatever these contain. Drivers do not
    /// check this.
    pub const unsafe fn new(words: &'static [u32]) -> Spirv {
        Spirv(words)
    }

    /// The words.
    pub const fn words(self) -> &'static [u32] {
        self.0
    }
}

/// How many workgroups a dispatch runs.
#[derive(Clone, Copy, Debug)]
pub enum Groups {
    /// Known when the schedule is made.
    Fixed([u32; 3]),
    /// Three `u32` in a buffer, read by the device when the dispatch starts.
    Indirect {
        /// Row of the buffer table.
        buffer: usize,
        /// Where the three words start; a multiple of four.
        offset_bytes: u64,
    },
}

/// One step of a program.
#[derive(Clone, Debug)]
pub enum Op {
    /// Sets every word of a buffer.
    Fill {
        /// Row of the buffer table.
        buffer: usize,
        /// The word.
        value: u32,
    },
    /// Copies a whole buffer to another of the same size.
    Copy {
        /// Row of the buffer table.
        from: usize,
        /// Row of the buffer table.
        to: usize,
    },
    /// Runs a kernel.
    Dispatch {
        /// For times and messages; one kernel may serve several dispatches.
        name: &'static str,
        /// What to run.
        kernel: &'static Kernel,
        /// Rows of the buffer table, one per binding of the kernel.
        buffers: Vec<usize>,
        /// How many workgroups.
        groups: Groups,
    },
}

impl Op {
    /// The dispatch's name, or "fill" or "copy".
    pub fn name(&self) -> &'static str {
        match self {
            Op::Fill { .. } => "fill",
            Op::Copy { .. } => "copy",
            Op::Dispatch { name, .. } => name,
        }
    }
}

/// A list of steps, recorded once into one command buffer and run as a whole.
#[derive(Clone, Debug)]
pub struct Program {
    /// For messages.
    pub name: &'static str,
    /// What it does, in order.
    pub ops: Vec<Op>,
}

/// A run-time check by the Khronos validation layer; slow, meant for tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Validation {
    /// Core checks and synchronisation hazards.
    Sync,
    /// Core checks and instrumented shaders, for out-of-bounds accesses.
    GpuAssisted,
}

/// Which device, and how to run it.
#[derive(Clone, Debug)]
pub struct Options {
    /// Index in [`devices()`]; if `None`, the first of the fastest kind that lacks nothing.
    pub device: Option<usize>,
    /// What to check with the validation layer, if anything.
    pub validation: Option<Validation>,
    /// The longest a single run may take. Software devices compile kernels in their first run.
    pub timeout: Duration,
}

impl Default for Options {
    fn default() -> Self {
        Self { device: None, validation: None, timeout: Duration::from_secs(10) }
    }
}
