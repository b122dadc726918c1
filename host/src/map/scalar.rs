//! The scalar map: vectors allocated once, one per buffer it needs.

use raywake_core::layout::{MAP_BUFFERS, MapBuffer};
use raywake_core::map::{Bands, Storage, Update, map};
use raywake_core::params::Profile;
use raywake_core::record::{Ray, Step};

use super::{Mapper, row};

/// Storage and bands.
pub struct ScalarMap {
    buffers: [Vec<u32>; 8],
    bands: Bands,
}

/// What the twins work on, in the order of `buffers`.
const NEEDED: [MapBuffer; 8] = [
    MapBuffer::Rays,
    MapBuffer::Origins,
    MapBuffer::Slots,
    MapBuffer::Distinct,
    MapBuffer::Counts,
    MapBuffer::Offsets,
    MapBuffer::Updates,
    MapBuffer::Scratch,
];

impl ScalarMap {
    /// Allocates for a profile.
    pub fn new(profile: &Profile) -> ScalarMap {
        let words = |b: MapBuffer| MAP_BUFFERS[row(b)].bytes(profile) / 4;
        ScalarMap {
            buffers: NEEDED.map(|b| vec![0; words(b)]),
            bands: Bands::new(Mapper::keys(profile)),
        }
    }

    /// Where the next sweep goes.
    pub fn input(&mut self) -> (&mut [Ray], &mut [[i32; 4]]) {
        let [rays, origins, ..] = &mut self.buffers;
        (bytemuck::cast_slice_mut(rays), bytemuck::cast_slice_mut(origins))
    }

    /// Maps the sweep.
    pub fn map(&mut self, step: &Step, put: &mut dyn FnMut(&[Update])) {
        let [rays, origins, slots, distinct, counts, offsets, updates, scratch] = &mut self.buffers;
        let mut storage = Storage {
            slots: bytemuck::cast_slice_mut(slots),
            distinct,
            counts,
            offsets,
            updates: bytemuck::cast_slice_mut(updates),
            scratch: bytemuck::cast_slice_mut(scratch),
        };
        let rays: &[Ray] = bytemuck::cast_slice(rays);
        let rays = &rays[..step.rays as usize];
        map(&mut storage, step, &mut self.bands, rays, bytemuck::cast_slice(origins), put);
    }
}
