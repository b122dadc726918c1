//! The sparse map of appendix B: log-odds of every voxel any ray of a sweep touched.
//!
//! Section B.2 to the letter, but for exact sizes and bounded memory: count the updates, make room
//! by a prefix sum, emit them, sort by key, sum equal keys. The window spans the sensor's range;
//! its voxels are keyed in the order of [`crate::grid`], and the key space is worked through in
//! bands of at most [`BAND_UPDATES`] updates. A voxel gets one update per distinct ray at most,
//! so a band can always be made small enough. The map equals the dense window inside that, bit for
//! bit.

pub mod emit;
pub mod radix_sort;
pub mod reduce_by_key;

use crate::grid::ray_merge::ray_merge;
use crate::params::{BAND_UPDATES, POINTS_MAX};
use crate::prefix_sum::prefix_sum;
use crate::record::{Ray, Step};

const _: () = assert!(POINTS_MAX <= BAND_UPDATES);

/// `[key, log-odds as i32]`: an update, or a voxel of the map.
pub type Update = [u32; 2];

/// Storage of the scalar map, one slice per buffer of the layout.
pub struct Storage<'a> {
    /// [`crate::params::MERGE_SLOTS`] elements.
    pub slots: &'a mut [[u32; 2]],
    /// [`POINTS_MAX`] elements.
    pub distinct: &'a mut [u32],
    /// As many.
    pub counts: &'a mut [u32],
    /// As many.
    pub offsets: &'a mut [u32],
    /// [`BAND_UPDATES`] elements.
    pub updates: &'a mut [Update],
    /// As many.
    pub scratch: &'a mut [Update],
}

/// Bands remembered from sweep to sweep.
const BANDS_MAX: usize = 256;

/// Cuts the key space into bands that hold.
pub struct Bands {
    keys: u32,
    ends: heapless::Vec<u32, BANDS_MAX>,
}

impl Bands {
    /// One band over `keys` keys.
    pub fn new(keys: u32) -> Bands {
        let mut ends = heapless::Vec::new();
        // An empty vector has room.
        let _ = ends.push(keys);
        Bands { keys, ends }
    }

    /// Calls `band` with key ranges in ascending order until all keys are done. It returns whether
    /// the range held; if not, it is halved. Ranges that held are where the next sweep starts.
    pub fn run<E>(&mut self, mut band: impl FnMut(u32, u32) -> Result<bool, E>) -> Result<(), E> {
        let planned = core::mem::take(&mut self.ends);
        let mut planned = planned.iter().copied();
        let (mut from, mut limit) = (0, 0);
        while from < self.keys {
            if from == limit {
                limit = planned.next().unwrap_or(self.keys);
            }
            let mut to = limit;
            while !band(from, to)? {
                to = from + (to - from).div_ceil(2).min(to - from - 1).max(1);
            }
            // Where there are more bands than fit, the next sweep finds the rest again.
            let _ = self.ends.push(to);
            from = to;
        }
        Ok(())
    }
}

/// Maps a sweep: `put` receives the voxels of each band, in ascending order of keys.
pub fn map(
    s: &mut Storage,
    step: &Step,
    bands: &mut Bands,
    rays: &[Ray],
    origins: &[[i32; 4]],
    mut put: impl FnMut(&[Update]),
) {
    s.slots.fill([0; 2]);
    let used = ray_merge(rays, s.slots, s.distinct);
    let distinct = &s.distinct[..used];
    let done: Result<(), core::convert::Infallible> = bands.run(|from, to| {
        let step = Step { band_from: from as i32, band_to: to as i32, ..*step };
        emit::count(&step, origins, rays, s.slots, distinct, &mut s.counts[..used]);
        let total = prefix_sum(&s.counts[..used], &mut s.offsets[..used]) as usize;
        if total > BAND_UPDATES {
            return Ok(false);
        }
        emit::emit(&step, origins, rays, s.slots, distinct, &s.offsets[..used], s.updates);
        radix_sort::radix_sort(&mut s.updates[..total], &mut s.scratch[..total]);
        let voxels = reduce_by_key::reduce_by_key(&s.updates[..total], s.scratch);
        put(&s.scratch[..voxels]);
        Ok(true)
    });
    let Ok(()) = done;
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::grid::ray_trace::{inside, ray_trace};
    use crate::params::MERGE_SLOTS;
    use crate::random::Random;
    use crate::record::ray;
    use std::vec;
    use std::vec::Vec;

    #[test]
    fn bands_cover_all_keys_and_are_remembered() {
        let mut bands = Bands::new(1000);
        let mut seen = Vec::new();
        let narrow = |from: u32, to: u32| to - from <= if from < 300 { 70 } else { 400 };
        let mut tries = 0;
        for round in 0..2 {
            seen.clear();
            tries = 0;
            let ok: Result<(), ()> = bands.run(|from, to| {
                tries += 1;
                if narrow(from, to) {
                    seen.push((from, to));
                }
                Ok(narrow(from, to))
            });
            ok.unwrap();
            assert_eq!((seen[0].0, seen[seen.len() - 1].1), (0, 1000), "round {round}");
            assert!(seen.windows(2).all(|w| w[0].1 == w[1].0));
        }
        assert_eq!(tries, seen.len(), "the second sweep knows the bands");
        // Down to a single key.
        let mut bands = Bands::new(3);
        let mut count = 0;
        let ok: Result<(), ()> = bands.run(|from, to| {
            count += (to - from == 1) as u32;
            Ok(to - from == 1)
        });
        assert_eq!((ok, count), (Ok(()), 3));
    }

    #[test]
    fn equals_the_dense_window() {
        let mut generator = Random(5);
        let mut random = |n| generator.below(n) as i32;
        // Enough updates for several bands.
        let rays: Vec<Ray> = (0..30_000)
            .map(|_| ray([random(201), random(201), random(41)], 0, random(9) == 0))
            .collect();
        let step = Step { side: 201, levels: 41, range_steps: 90, ..Default::default() };
        let origins = [[100, 100, 20, 0]];
        let mut slots = vec![[0; 2]; MERGE_SLOTS];
        let mut distinct = vec![0; POINTS_MAX];
        let used = ray_merge(&rays, &mut slots, &mut distinct);
        let mut dense = vec![0; 201 * 201 * 41];
        ray_trace(&step, &origins, &rays, &slots, &distinct[..used], &mut dense);

        let (mut counts, mut offsets) = (vec![0; POINTS_MAX], vec![0; POINTS_MAX]);
        let (mut updates, mut scratch) = (vec![[0; 2]; BAND_UPDATES], vec![[0; 2]; BAND_UPDATES]);
        let mut storage = Storage {
            slots: &mut slots,
            distinct: &mut distinct,
            counts: &mut counts,
            offsets: &mut offsets,
            updates: &mut updates,
            scratch: &mut scratch,
        };
        let mut bands = Bands::new(201 * 201 * 41);
        let mut voxels = Vec::new();
        let mut parts = 0;
        map(&mut storage, &step, &mut bands, &rays, &origins, |v| {
            parts += 1;
            voxels.extend_from_slice(v);
        });
        assert!(parts > 1);
        assert!(voxels.windows(2).all(|w| w[0][0] < w[1][0]), "keys ascend and occur once");
        let mut sparse = vec![0; dense.len()];
        voxels.iter().for_each(|v| sparse[v[0] as usize] = v[1] as i32);
        assert!(sparse == dense);
        assert_eq!(inside(&step, [200, 200, 40]), Some(dense.len() - 1));
    }
}
