//! `raywake map`: the sparse map of appendix B, one per sweep, over the sensor's full range.

pub mod command;
pub mod device;
pub mod scalar;

use raywake_core::dropped::DroppedReturns;
use raywake_core::frame::{Window, place};
use raywake_core::params::Profile;
use raywake_core::perceive::RayInput;
use raywake_core::prepare::{Placement, Preparation, RayBuffers, uniform_of};
use raywake_core::record::Update;
use raywake_core::record::{NONE, SweepUniform};
use raywake_core::stages::{MAP_PROGRAMS, Storage};
use raywake_core::sweep::{Rig, Sweep};
use raywake_core::team::SingleThread;
use raywake_gpu::GpuError;

/// Either backend.
pub enum MapBackend {
    /// The core's twins on one thread.
    Scalar(Box<scalar::ScalarMap>),
    /// The kernels on a Vulkan device.
    Device(Box<device::DeviceMap>),
}

impl MapBackend {
    /// The device's name.
    pub fn name(&self) -> &str {
        match self {
            MapBackend::Scalar(_) => "CPU, one thread",
            MapBackend::Device(b) => b.name(),
        }
    }

    fn input(&mut self) -> Result<RayInput<'_>, GpuError> {
        match self {
            MapBackend::Scalar(b) => Ok(b.input()),
            MapBackend::Device(b) => b.input(),
        }
    }

    fn map(
        &mut self,
        sweep: &SweepUniform,
        put: &mut dyn FnMut(&[Update]),
    ) -> Result<(), GpuError> {
        match self {
            MapBackend::Scalar(b) => {
                b.map(sweep, put);
                Ok(())
            }
            MapBackend::Device(b) => b.map(sweep, put),
        }
    }
}

/// Turns sweeps into sparse maps in one lattice.
pub struct Mapper {
    profile: Profile,
    rig: Rig,
    preparation: Preparation,
    lattice_origin: Option<glam::DVec3>,
    columns: Vec<u32>,
    backend: MapBackend,
}

/// Where a map lies and what was dropped.
#[derive(Clone, Copy, Debug)]
pub struct Mapped {
    /// The window; keys count from its corner.
    pub window: Window,
    /// Returns dropped.
    pub dropped: DroppedReturns,
    /// Number of rays.
    pub rays: usize,
}

impl Mapper {
    /// Creates a mapper for a profile that passed [`Profile::check`].
    pub fn new(profile: Profile, rig: Rig, backend: MapBackend) -> Mapper {
        Mapper {
            columns: vec![NONE; profile.returns()],
            profile,
            rig,
            preparation: Preparation::new(),
            lattice_origin: None,
            backend,
        }
    }

    /// Number of keys of a profile.
    pub fn keys(profile: &Profile) -> u32 {
        profile.side * profile.side * profile.levels
    }

    /// Bytes of the scalar backend's buffers.
    pub fn bytes(profile: &Profile) -> usize {
        4 * Storage::words(MAP_PROGRAMS, profile)
    }

    /// Maps a sweep. `put` receives voxels `[key, log-odds in tenths as i32]` in ascending order.
    pub fn map(
        &mut self,
        sweep: &Sweep,
        put: &mut dyn FnMut(&[Update]),
    ) -> Result<Mapped, GpuError> {
        let window =
            place(&self.profile, &self.rig, &sweep.world_from_vehicle, self.lattice_origin);
        self.lattice_origin.get_or_insert(window.lattice_origin);
        let (rays, origins) = self.backend.input()?;
        let (count, dropped) = self.preparation.prepare(
            &SingleThread,
            &Placement { profile: &self.profile, rig: &self.rig, window: &window, sweep },
            RayBuffers { rays, origins, columns: &mut self.columns, placed: &mut [] },
        );
        self.backend.map(&uniform_of(&self.profile, count), put)?;
        Ok(Mapped { window, dropped, rays: count })
    }

    /// Lattice indices of a key.
    pub fn cell(&self, mapped: &Mapped, key: u32) -> [i32; 3] {
        let (side, levels) = (self.profile.side, self.profile.levels);
        let local = [key / levels / side, key / levels % side, key % levels];
        core::array::from_fn(|a| local[a] as i32 + mapped.window.corner[a])
    }
}
