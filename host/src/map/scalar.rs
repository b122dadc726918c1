//! The scalar map: allocates its buffers once.

use raywake_core::map::{Bands, map};
use raywake_core::params::Profile;
use raywake_core::perceive::RayInput;
use raywake_core::record::SweepUniform;
use raywake_core::record::Update;
use raywake_core::stages::{MAP_PROGRAMS, Storage};

use super::Mapper;

/// Buffer memory and bands.
pub struct ScalarMap {
    words: Vec<u32>,
    profile: Profile,
    bands: Bands,
}

impl ScalarMap {
    /// Allocates for a profile.
    pub fn new(profile: &Profile) -> ScalarMap {
        let words = vec![0; Storage::words(MAP_PROGRAMS, profile)];
        ScalarMap { words, profile: profile.clone(), bands: Bands::new(Mapper::keys(profile)) }
    }

    /// Where the next sweep goes.
    pub fn input(&mut self) -> RayInput<'_> {
        let storage = Storage::over(&mut self.words, MAP_PROGRAMS, &self.profile);
        (storage.rays, storage.origins)
    }

    /// Maps the sweep.
    pub fn map(&mut self, sweep: &SweepUniform, put: &mut dyn FnMut(&[Update])) {
        let mut storage = Storage::over(&mut self.words, MAP_PROGRAMS, &self.profile);
        storage.sweep = *sweep;
        map(&mut storage, &mut self.bands, put);
    }
}
