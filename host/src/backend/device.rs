//! The kernels on a Vulkan device as a backend: one recorded command buffer a sweep.

use raywake_core::layout::{BUFFERS, Buffer, DISTINCT_COUNT, FOREGROUND_COUNT, FOREGROUND_MARKED};
use raywake_core::params::{FOREGROUND_MAX, Profile};
use raywake_core::pipeline::Perceived;
use raywake_core::prepare::step_of;
use raywake_core::record::{Ray, Step};
use raywake_gpu::{Census, Executor, GpuError, Options};
use raywake_kernels::schedule;

use super::Tables;
use crate::laps::Laps;

/// Index of the program run every sweep.
const FLOW: usize = 0;
/// Index of the program run once.
const LOAD: usize = 1;

/// A device with everything recorded.
pub struct Device {
    executor: Executor,
}

impl Device {
    /// Allocates and records for a profile, uploads the learned tables and runs the pipeline once
    /// without rays: software devices compile kernels in their first run.
    pub fn new(profile: &Profile, tables: &Tables, options: &Options) -> Result<Device, GpuError> {
        let buffers = schedule::buffers(BUFFERS, profile);
        let programs = [schedule::flow(profile), schedule::load()];
        let mut executor = Executor::new(options, &buffers, &programs)?;
        let mut fill = |buffer: Buffer, words: &[u32]| {
            executor.upload(buffer as usize).copy_from_slice(words);
        };
        fill(Buffer::FilterIn, bytemuck::cast_slice(&tables.filter));
        fill(Buffer::WeightsIn, bytemuck::cast_slice(&tables.constancy));
        fill(Buffer::CostsIn, &tables.costs);
        executor.run(LOAD)?;
        let mut device = Device { executor };
        // Nothing of what the device held before comes into view.
        let empty = Step { shift_x: profile.side as i32, ..step_of(profile, 0) };
        device.perceive(&empty, &mut Laps::start(), || ())?;
        Ok(device)
    }

    /// What was allocated and created.
    pub fn census(&self) -> Census {
        self.executor.census()
    }

    /// Messages of the validation layer.
    pub fn messages(&self) -> Vec<String> {
        self.executor.message_texts()
    }

    /// The device's name.
    pub fn name(&self) -> &str {
        &self.executor.info().name
    }

    /// Where the next sweep goes: mapped memory.
    pub fn input(&mut self) -> (&mut [Ray], &mut [[i32; 4]]) {
        let [rays, origins] =
            self.executor.uploads([Buffer::RaysIn as usize, Buffer::OriginsIn as usize]);
        (bytemuck::cast_slice_mut(rays), bytemuck::cast_slice_mut(origins))
    }

    /// From rays to flow; `meanwhile` is done while the device works.
    pub fn perceive(
        &mut self,
        step: &Step,
        laps: &mut Laps,
        meanwhile: impl FnOnce(),
    ) -> Result<Perceived<'_>, GpuError> {
        step.write(self.executor.upload(Buffer::StepIn as usize));
        self.executor.run_beside(FLOW, meanwhile)?;
        let mut on_device = 0.0;
        for (name, milliseconds) in self.executor.times(FLOW) {
            laps.add(name, milliseconds);
            on_device += milliseconds;
        }
        laps.rest("submit and wait", on_device);
        let read = |b: Buffer| self.executor.readback(b as usize);
        let counters = read(Buffer::CountersOut);
        // A device that answers nonsense yields no flow, not a panic.
        let count = (counters[FOREGROUND_COUNT] as usize).min(FOREGROUND_MAX);
        Ok(Perceived {
            now: bytemuck::cast_slice(read(Buffer::NowOut)),
            before: bytemuck::cast_slice(read(Buffer::BeforeOut)),
            foreground: &read(Buffer::ForegroundOut)[..count],
            marked: counters[FOREGROUND_MARKED] as usize,
            rays: counters[DISTINCT_COUNT] as usize,
            state: read(Buffer::StateOut),
            proposal: &bytemuck::cast_slice(read(Buffer::ProposalOut))[..count],
        })
    }
}
