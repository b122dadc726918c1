//! Simulated drives, and pipelines set up for them.

use raywake::backend::device::Device;
use raywake::backend::{Backend, Tables};
use raywake_core::encoder;
use raywake_core::params::Profile;
use raywake_core::refinement::forest;
use raywake_core::stages::occupancy_constancy;
use raywake_core::sweep::{Rig, Sweep};
use raywake_gpu::Options;
use raywake_sim::{Drive, Ego, Scene, SensorRig, SimSweep};
use std::sync::OnceLock;

use crate::vulkan;

/// A profile, the rig it is for, and the background filter.
#[derive(Clone)]
pub struct Setup {
    /// Profile.
    pub profile: Profile,
    /// Rig.
    pub rig: Rig,
    /// Text of a weights file, if there is a filter.
    pub filter: Option<String>,
}

impl Setup {
    /// Setup for a simulated drive.
    pub fn new(profile: Profile, filter: Option<String>) -> Setup {
        let nowhere = raywake_sim::Path::stationary(0.0, 0.0, 0.0);
        let drive = Drive::through(Scene::empty(), nowhere, 0, raywake_sim::Options::default());
        Setup { profile, rig: drive.rig(), filter }
    }

    /// The learned tables.
    pub fn tables(&self) -> Tables {
        let constancy = occupancy_constancy::shipped(self.profile.frame);
        Tables::load(
            &self.profile,
            self.filter.as_deref(),
            constancy,
            Some(encoder::SHIPPED),
            forest::SHIPPED,
        )
        .unwrap_or_else(|e| panic!("{e}"))
    }

    /// The scalar backend.
    pub fn scalar(&self) -> Backend {
        Backend::scalar(&self.profile, &self.tables())
    }

    /// A device. Prints a remark and returns `None` if there is none.
    pub fn device(&self, options: &Options) -> Option<Backend> {
        let device = vulkan::expect(Device::new(&self.profile, &self.tables(), options))?;
        Some(Backend::Device(Box::new(device)))
    }

    /// The pipeline on a backend.
    pub fn drive(&self, backend: Backend) -> raywake::drive::Drive {
        raywake::drive::Drive::new(&self.profile, &self.rig, &self.tables(), backend, None)
    }
}

/// Converts a simulated sweep to core's form.
pub fn sweep(simulated: &SimSweep) -> Sweep<'_> {
    Sweep {
        stamp_s: simulated.stamp_s,
        points: &simulated.points,
        world_from_vehicle: simulated.world_from_vehicle,
        twist: simulated.twist,
    }
}

/// Each sweep with the one before it.
pub fn pairs(sweeps: &[SimSweep]) -> impl Iterator<Item = (&SimSweep, Option<&SimSweep>)> {
    let before = std::iter::once(None).chain(sweeps.iter().map(Some));
    sweeps.iter().zip(before)
}

/// A busy street: ten sweeps, turning left more and more from the third on.
pub fn street() -> &'static [SimSweep] {
    static SWEEPS: OnceLock<Vec<SimSweep>> = OnceLock::new();
    SWEEPS.get_or_init(|| {
        let ego = Ego::Turn { left: true, speed: 6.0 };
        let options = raywake_sim::Options { sweeps: 10, ego, ..Default::default() };
        Drive::new(3, options).collect()
    })
}

/// Sweeps along a path (street frame) through a scene built by hand, without noise.
pub fn ideal(scene: Scene, path: raywake_sim::Path, sweeps: usize) -> Drive {
    let options = raywake_sim::Options { sweeps, rig: SensorRig::ideal(), ..Default::default() };
    Drive::through(scene, path, 1, options)
}
