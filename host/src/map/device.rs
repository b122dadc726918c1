//! The map's kernels on a Vulkan device: three recorded programs.

use raywake_core::map::Bands;
use raywake_core::params::{BAND_UPDATES, Profile, TILE};
use raywake_core::perceive::RayInput;
use raywake_core::record::SweepUniform;
use raywake_core::record::Update;
use raywake_core::stages::{Buffer, MAP_PROGRAMS};
use raywake_gpu::{Executor, GpuError, Heap, Options};
use raywake_kernels::schedule::Schedule;

use super::Mapper;

/// Indices of the executor's programs.
const RAYS: usize = 0;
const COUNT: usize = 1;
const BAND: usize = 2;

/// A device with all its programs recorded.
pub struct DeviceMap {
    executor: Executor,
    schedule: Schedule,
    bands: Bands,
}

impl DeviceMap {
    /// Allocates and records for a profile.
    pub fn new(profile: &Profile, options: &Options) -> Result<DeviceMap, GpuError> {
        let schedule = Schedule::new(MAP_PROGRAMS, profile);
        let buffers = schedule.buffers(profile);
        let executor = Executor::with(options, &buffers, |device| schedule.programs_on(device))?;
        Ok(DeviceMap { executor, schedule, bands: Bands::new(Mapper::keys(profile)) })
    }

    /// The device's name.
    pub fn name(&self) -> &str {
        &self.executor.info().name
    }

    /// Where the next sweep goes, in mapped memory.
    pub fn input(&mut self) -> Result<RayInput<'_>, GpuError> {
        let rows = [Buffer::rays, Buffer::origins].map(|b| self.schedule.index(Heap::Upload, b));
        let [rays, origins] = self.executor.uploads(rows)?;
        Ok((bytemuck::cast_slice_mut(rays), bytemuck::cast_slice_mut(origins)))
    }

    /// Maps the sweep.
    pub fn map(
        &mut self,
        sweep: &SweepUniform,
        put: &mut dyn FnMut(&[Update]),
    ) -> Result<(), GpuError> {
        let executor = &mut self.executor;
        let uniform = self.schedule.index(Heap::Upload, Buffer::sweep);
        let [count_tiles, run_tiles, voxels] =
            [Buffer::count_tiles, Buffer::run_tiles, Buffer::scratch]
                .map(|b| self.schedule.index(Heap::Readback, b));
        sweep.write(executor.upload(uniform)?);
        executor.run(RAYS)?;
        self.bands.run(|from, to| {
            let band = SweepUniform { band_from: from as i32, band_to: to as i32, ..*sweep };
            band.write(executor.upload(uniform)?);
            executor.run(COUNT)?;
            let updates = executor.readback(count_tiles)[TILE] as usize;
            if updates > BAND_UPDATES {
                return Ok(None);
            }
            executor.run(BAND)?;
            let count = (executor.readback(run_tiles)[TILE] as usize).min(BAND_UPDATES);
            put(&bytemuck::cast_slice(executor.readback(voxels))[..count]);
            Ok(Some(updates))
        })
    }
}
