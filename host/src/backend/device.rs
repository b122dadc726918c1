//! The kernels on a Vulkan device as a backend: one recorded command buffer per sweep.

use raywake_core::params::Profile;
use raywake_core::perceive::{
    MEANWHILE, Perceive, Perceived, PerceptionBuffers, RayInput, StageTimer,
};
use raywake_core::prepare::uniform_of;
use raywake_core::record::SweepUniform;
use raywake_core::stages::{Buffer, FLOW_PROGRAMS};
use raywake_core::team::{SingleThread, Team};
use raywake_gpu::{Census, Executor, GpuError, Heap, Options};
use raywake_kernels::schedule::Schedule;

use super::Tables;

/// Indices of the program run once and of the one run every sweep.
const LOAD: usize = 0;
const FLOW: usize = 1;

/// A device with all its programs recorded.
pub struct Device {
    executor: Executor,
    schedule: Schedule,
}

impl Device {
    /// Allocates and records for a profile, uploads the learned tables and runs the pipeline once
    /// without rays: software devices compile kernels on their first run.
    pub fn new(profile: &Profile, tables: &Tables, options: &Options) -> Result<Device, GpuError> {
        let schedule = Schedule::new(FLOW_PROGRAMS, profile);
        let buffers = schedule.buffers(profile);
        let executor = Executor::with(options, &buffers, |device| schedule.programs_on(device))?;
        let mut device = Device { executor, schedule };
        device.upload(Buffer::filter_table, bytemuck::cast_slice(&tables.filter))?;
        device.upload(Buffer::constancy_weights, bytemuck::cast_slice(&tables.constancy))?;
        device.upload(Buffer::constancy_costs, &tables.costs)?;
        device.executor.run(LOAD)?;
        // Shifted out of view: nothing the device held before remains.
        let empty = SweepUniform { shift_x: profile.side as i32, ..uniform_of(profile, 0) };
        device.perceive(&empty, &SingleThread, &mut (), || ())?;
        Ok(device)
    }

    /// Counts of what was allocated and created.
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

    fn upload(&mut self, buffer: Buffer, words: &[u32]) -> Result<(), GpuError> {
        self.executor.upload(self.schedule.index(Heap::Upload, buffer))?.copy_from_slice(words);
        Ok(())
    }

    /// The results of the last sweep.
    fn left(&self) -> PerceptionBuffers<'_> {
        PerceptionBuffers {
            counters: self.readback(Buffer::counters),
            columns_before: bytemuck::cast_slice(self.readback(Buffer::columns_before)),
            columns_now: bytemuck::cast_slice(self.readback(Buffer::columns_now)),
            foreground: self.readback(Buffer::foreground),
            flow: self.readback(Buffer::flow),
            proposal: bytemuck::cast_slice(self.readback(Buffer::proposal)),
        }
    }

    fn readback(&self, buffer: Buffer) -> &[u32] {
        self.executor.readback(self.schedule.index(Heap::Readback, buffer))
    }
}

impl Perceive for Device {
    type Error = GpuError;

    fn input(&mut self) -> Result<RayInput<'_>, GpuError> {
        let rows = [Buffer::rays, Buffer::origins].map(|b| self.schedule.index(Heap::Upload, b));
        let [rays, origins] = self.executor.uploads(rows)?;
        Ok((bytemuck::cast_slice_mut(rays), bytemuck::cast_slice_mut(origins)))
    }

    fn perceive(
        &mut self,
        sweep: &SweepUniform,
        _: &impl Team,
        timer: &mut (impl StageTimer + Send),
        meanwhile: impl FnOnce() + Send,
    ) -> Result<Perceived<'_>, GpuError> {
        sweep.write(self.executor.upload(self.schedule.index(Heap::Upload, Buffer::sweep))?);
        self.executor.run_alongside(FLOW, meanwhile)?;
        timer.measured(&mut self.executor.times(FLOW), MEANWHILE);
        if let Err(what) = self.left().check(sweep) {
            return Err(self.executor.give_up(FLOW, what));
        }
        Ok(self.left().into())
    }
}
