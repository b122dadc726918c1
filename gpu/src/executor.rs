//! Set-up, running a frame, and clean-up.

use crate::arena::{self, Slot};
use crate::error::failed;
use crate::instance::Instance;
use crate::owner::{Census, Gpu, ReadyDevice};
use crate::program::Pipelines;
use crate::recorder::{Recorded, record};
use crate::{Buffer, DeviceInfo, DeviceKind, FailurePoint, GpuError, Heap, Options, Program};
use crate::{check, device};
use ash::vk;
use std::time::Duration;

/// A run that merely missed its deadline gets this long to end before its objects are leaked.
const GRACE: Duration = Duration::from_secs(1);

/// A device with its buffers and recorded programs; see the [crate] for the contract.
///
/// Buffers and programs are named by their index in the tables given to [`Executor::new`]; an
/// index out of range, or a buffer of the wrong heap, panics.
pub struct Executor {
    gpu: ReadyDevice,
    slots: Vec<Slot>,
    programs: Vec<Recorded>,
    fence: vk::Fence,
    timeout: Duration,
    in_flight: bool,
    failure: Option<GpuError>,
}

impl Executor {
    /// Checks the schedule, then allocates, creates and records everything.
    ///
    /// # Errors
    /// `NoLoader`, `NoDevice`, `Unsupported` if there is nothing to run on; `Schedule` if the
    /// tables contradict themselves or the device's limits; `OutOfMemory` if the buffers of a heap
    /// exceed it; `Vulkan`. Nothing is left behind.
    pub fn new(
        options: &Options,
        buffers: &[Buffer],
        programs: &[Program],
    ) -> Result<Self, GpuError> {
        Self::with(options, buffers, |_| programs)
    }

    /// Like [`Executor::new`], with the programs chosen for the device that is found.
    ///
    /// # Errors
    /// As [`Executor::new`].
    pub fn with<'p>(
        options: &Options,
        buffers: &[Buffer],
        programs: impl FnOnce(&DeviceInfo) -> &'p [Program],
    ) -> Result<Self, GpuError> {
        let instance = Instance::new(options.validation)?;
        let physical = device::select(&instance, options.device)?;
        let programs = programs(&physical.info);
        check::schedule(&physical.info.limits, buffers, programs)?;
        let mut gpu = Gpu::new(instance, physical)?;
        let slots = arena::allocate(&mut gpu, buffers)?;
        let pipelines = Pipelines::new(&mut gpu, &slots, programs)?;
        let commands = gpu.command_buffers(programs.len() as u32)?;
        let recorded = programs.iter().zip(commands);
        let recorded = recorded
            .map(|(program, commands)| record(&mut gpu, commands, program, &slots, &pipelines))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            fence: gpu.fence()?,
            gpu: ReadyDevice::new(gpu),
            slots,
            programs: recorded,
            timeout: options.timeout,
            in_flight: false,
            failure: None,
        })
    }

    /// The words of a [`Heap::Upload`] buffer. The device reads them in later runs, as they are.
    ///
    /// # Errors
    /// The error of an earlier failed run, because the device may still be reading there.
    pub fn upload(&mut self, buffer: usize) -> Result<&mut [u32], GpuError> {
        self.uploads([buffer]).map(|[words]| words)
    }

    /// Several different [`Heap::Upload`] buffers at once.
    ///
    /// # Errors
    /// As [`Executor::upload`].
    pub fn uploads<const N: usize>(
        &mut self,
        buffers: [usize; N],
    ) -> Result<[&mut [u32]; N], GpuError> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        let slots = self.slots.get_disjoint_mut(buffers).expect("different buffers of the table");
        Ok(slots.map(|slot| {
            assert_eq!(slot.row.heap, Heap::Upload, "{}", slot.row.name);
            slot.mapped_mut().expect("upload buffers are mapped")
        }))
    }

    /// The words of a [`Heap::Readback`] buffer, as the last run left them.
    ///
    /// Empty once a run has failed, because the device may still be writing there.
    pub fn readback(&self, buffer: usize) -> &[u32] {
        let slot = &self.slots[buffer];
        assert_eq!(slot.row.heap, Heap::Readback, "{}", slot.row.name);
        if self.failure.is_some() {
            return &[];
        }
        slot.mapped().expect("readback buffers are mapped")
    }

    /// Runs a program to completion. Allocates nothing.
    ///
    /// # Errors
    /// `Timeout` after [`Options::timeout`], `DeviceLost`, `Vulkan`. Once one of them has been
    /// returned, every later run returns it again immediately.
    pub fn run(&mut self, program: usize) -> Result<(), GpuError> {
        self.run_alongside(program, || ())
    }

    /// Runs a program to completion, and `work` on this thread while the device is busy. The time
    /// `work` takes does not count against [`Options::timeout`].
    ///
    /// # Errors
    /// As [`Executor::run`]. `work` has not been done if the submission failed.
    pub fn run_alongside(&mut self, program: usize, work: impl FnOnce()) -> Result<(), GpuError> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        let outcome = self.submit_and_wait(program, work);
        self.failure = outcome.clone().err();
        outcome
    }

    fn submit_and_wait(&mut self, program: usize, work: impl FnOnce()) -> Result<(), GpuError> {
        let commands = self.programs[program].commands;
        let submitted = self.gpu.submit(commands, self.fence);
        submitted.map_err(|(call, result)| self.fault(call, result, program))?;
        self.in_flight = true;
        // Stays set if `work` panics and the panic is caught.
        self.failure = Some(GpuError::Abandoned { program: self.programs[program].name });
        work();
        let waited = self.gpu.wait(self.fence, self.timeout);
        let finished = waited.map_err(|result| self.fault("vkWaitForFences", result, program))?;
        if !finished {
            return Err(GpuError::Timeout { during: self.during(program), after: self.timeout });
        }
        self.in_flight = false;
        self.programs[program].timer.read(&self.gpu);
        Ok(())
    }

    fn fault(&mut self, call: &'static str, result: vk::Result, program: usize) -> GpuError {
        match result {
            vk::Result::ERROR_DEVICE_LOST => {
                GpuError::DeviceLost { call, during: self.during(program) }
            }
            _ => failed(call)(result),
        }
    }

    fn during(&mut self, program: usize) -> FailurePoint {
        let Recorded { name, timer, .. } = &mut self.programs[program];
        // Software drivers answer this query only when they are idle.
        let last = match self.gpu.info().kind {
            DeviceKind::Cpu => None,
            _ => timer.last_finished(&self.gpu),
        };
        FailurePoint { program: name, last }
    }

    /// Gives up on the device because the results of a program are impossible: from now on every
    /// run fails with the returned error.
    pub fn give_up(&mut self, program: usize, what: &'static str) -> GpuError {
        let failure = GpuError::InvalidResults { program: self.programs[program].name, what };
        self.failure = Some(failure.clone());
        failure
    }

    /// Name and duration in milliseconds of each step of the program's last run, in order.
    ///
    /// A step's time runs from the end of all steps before it to its own end. Steps without a
    /// barrier between them may overlap, so the sum is meaningful, a single time only roughly so.
    /// Yields nothing before the first run or on devices without timestamps. Allocates nothing.
    pub fn times(&self, program: usize) -> impl Iterator<Item = (&'static str, f64)> {
        self.programs[program].timer.times(&self.gpu)
    }

    /// What has been created so far.
    pub fn census(&self) -> Census {
        self.gpu.census
    }

    /// How many warnings and errors the validation layer has reported; zero without it.
    pub fn messages(&self) -> u64 {
        self.gpu.instance.messages().map_or(0, |m| m.count())
    }

    /// The first few of these messages.
    pub fn message_texts(&self) -> Vec<String> {
        let messages = self.gpu.instance.messages();
        messages.map_or_else(Vec::new, |m| m.texts())
    }

    /// The device this runs on.
    pub fn info(&self) -> &DeviceInfo {
        self.gpu.info()
    }
}

impl Drop for Executor {
    fn drop(&mut self) {
        let grace = self.timeout.max(GRACE);
        let idle = !self.in_flight
            || match self.gpu.wait(self.fence, grace) {
                Ok(finished) => finished,
                // A driver may report a lost device that is still working.
                Err(result) => {
                    result == vk::Result::ERROR_DEVICE_LOST && self.gpu.is_idle_within(grace)
                }
            };
        // A run in progress uses the objects and might never end: then all are leaked, with the
        // device.
        if idle {
            // SAFETY: only destroyed here, and never used again.
            unsafe { self.gpu.destroy() };
        }
    }
}
