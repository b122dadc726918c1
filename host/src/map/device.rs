//! The map's kernels on a Vulkan device: three recorded programs.

use raywake_core::layout::{MAP_BUFFERS, MapBuffer};
use raywake_core::map::{Bands, Update};
use raywake_core::params::{BAND_UPDATES, Profile, TILE};
use raywake_core::record::{Ray, Step};
use raywake_gpu::{Executor, GpuError, Options};
use raywake_kernels::schedule;

use super::{Mapper, row};

/// Programs in the order the executor has them.
const RAYS: usize = 0;
const COUNT: usize = 1;
const BAND: usize = 2;

/// A device with everything recorded.
pub struct DeviceMap {
    executor: Executor,
    bands: Bands,
}

impl DeviceMap {
    /// Allocates and records for a profile.
    pub fn new(profile: &Profile, options: &Options) -> Result<DeviceMap, GpuError> {
        let buffers = schedule::buffers(MAP_BUFFERS, profile);
        let programs = [schedule::map_rays(), schedule::map_count(), schedule::map_band()];
        let executor = Executor::new(options, &buffers, &programs)?;
        Ok(DeviceMap { executor, bands: Bands::new(Mapper::keys(profile)) })
    }

    /// The device's name.
    pub fn name(&self) -> &str {
        &self.executor.info().name
    }

    /// Where the next sweep goes: mapped memory.
    pub fn input(&mut self) -> (&mut [Ray], &mut [[i32; 4]]) {
        let [rays, origins] =
            self.executor.uploads([row(MapBuffer::RaysIn), row(MapBuffer::OriginsIn)]);
        (bytemuck::cast_slice_mut(rays), bytemuck::cast_slice_mut(origins))
    }

    /// Maps the sweep.
    pub fn map(&mut self, step: &Step, put: &mut dyn FnMut(&[Update])) -> Result<(), GpuError> {
        let executor = &mut self.executor;
        step.write(executor.upload(row(MapBuffer::StepIn)));
        executor.run(RAYS)?;
        self.bands.run(|from, to| {
            let band = Step { band_from: from as i32, band_to: to as i32, ..*step };
            band.write(executor.upload(row(MapBuffer::StepIn)));
            executor.run(COUNT)?;
            if executor.readback(row(MapBuffer::CountOut))[TILE] as usize > BAND_UPDATES {
                return Ok(false);
            }
            executor.run(BAND)?;
            let voxels = executor.readback(row(MapBuffer::RunsOut))[TILE] as usize;
            let voxels = voxels.min(BAND_UPDATES);
            let words = executor.readback(row(MapBuffer::VoxelsOut));
            put(&bytemuck::cast_slice(words)[..voxels]);
            Ok(true)
        })
    }
}
