//! The sparse map of appendix B: log-odds of every voxel any ray of a sweep touched.
//!
//! Section B.2 to the letter, except for exact sizes and bounded memory: count the updates, make
//! room by a prefix sum, emit them, sort by key, sum equal keys. The window spans the sensor's
//! range; its voxels are keyed in the order of [`crate::stages::grid`], and the key space is
//! processed in bands of at most [`BAND_UPDATES`] updates. A voxel gets at most one update per
//! distinct ray, so a band can always be made small enough. Inside the dense window, the map equals
//! it bit for bit.
//! bit for bit.

use crate::params::{BAND_UPDATES, LOG_ODDS_PER_NAT, POINTS_MAX, TILE};
use crate::stages::{MAP_BAND, MAP_COUNT, MAP_RAYS, Storage, run};
use crate::team::SingleThread;

const _: () = assert!(POINTS_MAX <= BAND_UPDATES);

use crate::record::Update;

/// Maximum number of bands remembered from sweep to sweep.
const BANDS_MAX: usize = 256;

/// Neighbouring bands are joined if they had at most this many updates together. Scenes change, and
/// a band that no longer fits is counted in vain: in KITTI drive 0005 the updates of one change by
/// up to 7 % from one sweep to the next.
const JOINED_MAX: usize = BAND_UPDATES / 16 * 15;

/// A band's last key plus one, and the number of its updates.
type BandEnd = (u32, usize);

/// Divides the key space into bands that fit.
pub struct Bands {
    keys: u32,
    ends: heapless::Vec<BandEnd, BANDS_MAX>,
}

impl Bands {
    /// One band over `keys` keys.
    pub fn new(keys: u32) -> Bands {
        let mut ends = heapless::Vec::new();
        // An empty vector has room.
        let _ = ends.push((keys, 0));
        Bands { keys, ends }
    }

    /// Calls `band` with key ranges in ascending order until all keys are done. It returns the
    /// number of updates in the range if they fitted; if not, the range is halved. The next sweep
    /// starts with the ranges that fitted, of which small ones are joined.
    pub fn run<E>(
        &mut self,
        mut band: impl FnMut(u32, u32) -> Result<Option<usize>, E>,
    ) -> Result<(), E> {
        let planned = core::mem::take(&mut self.ends);
        let mut planned = planned.iter().copied();
        let (mut from, mut limit) = (0, 0);
        while from < self.keys {
            if from == limit {
                limit = planned.next().map_or(self.keys, |(end, _)| end);
            }
            let mut to = limit;
            let updates = loop {
                if let Some(updates) = band(from, to)? {
                    break updates;
                }
                to = from + (to - from).div_ceil(2).min(to - from - 1).max(1);
            };
            // If there is no room for more bands, the next sweep divides the last again.
            let full = self.ends.is_full();
            match self.ends.last_mut() {
                Some((end, sum)) if full || *sum + updates <= JOINED_MAX => {
                    (*end, *sum) = (to, *sum + updates);
                }
                _ => drop(self.ends.push((to, updates))),
            }
            from = to;
        }
        Ok(())
    }
}

/// Probability that a voxel is occupied (B.2, B.3): its log-odds, in tenths of nats, are clipped at
/// `clip_nats` either way (l_min and l_max of table B.1).
pub fn occupancy_probability(log_odds_tenths: i32, clip_nats: f32) -> f32 {
    let nats = (log_odds_tenths as f32 / LOG_ODDS_PER_NAT).max(-clip_nats).min(clip_nats);
    1.0 / (1.0 + libm::expf(-nats))
}

/// Maps the sweep in `storage` on the CPU: `put` receives the voxels of each band, in ascending
/// order of keys.
pub fn map(storage: &mut Storage, bands: &mut Bands, mut put: impl FnMut(&[Update])) {
    let quiet = &mut |_| ();
    run(MAP_RAYS, storage, 0, &SingleThread, quiet);
    let done: Result<(), core::convert::Infallible> = bands.run(|from, to| {
        (storage.sweep.band_from, storage.sweep.band_to) = (from as i32, to as i32);
        run(MAP_COUNT, storage, 0, &SingleThread, quiet);
        let updates = storage.count_tiles[TILE] as usize;
        if updates > BAND_UPDATES {
            return Ok(None);
        }
        run(MAP_BAND, storage, 0, &SingleThread, quiet);
        put(&storage.scratch[..storage.run_tiles[TILE] as usize]);
        Ok(Some(updates))
    });
    let Ok(()) = done;
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::params::Profile;
    use crate::record::{Ray, SweepUniform, ray};
    use crate::stages::grid::ray_trace::{inside, ray_trace};
    use crate::stages::{DISTINCT_COUNT, MAP_PROGRAMS};
    use std::vec;
    use std::vec::Vec;

    #[test]
    fn probabilities_of_log_odds() {
        let p = |tenths| occupancy_probability(tenths, 3.0);
        assert_eq!(p(0), 0.5);
        // log(p / (1 - p)) gives the log-odds back, unless they are clipped.
        for tenths in [-30, -7, 1, 10, 29] {
            let nats = (p(tenths) / (1.0 - p(tenths))).ln();
            assert!((nats - tenths as f32 / 10.0).abs() < 1e-5, "{tenths}");
        }
        assert_eq!((p(1_000_000), p(i32::MIN)), (p(30), p(-30)));
        assert!(occupancy_probability(31, 4.0) > p(31));
    }

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
                // Too many to be joined.
                Ok(narrow(from, to).then_some(JOINED_MAX))
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
            Ok((to - from == 1).then_some(JOINED_MAX))
        });
        assert_eq!((ok, count), (Ok(()), 3));
    }

    #[test]
    fn small_bands_are_joined() {
        let mut bands = Bands::new(JOINED_MAX as u32);
        // One update per key, four, and one again.
        for (each, wanted) in [(1, 1), (4, 5), (1, 1)] {
            let mut starts: Vec<u32> = Vec::new();
            for _ in 0..3 {
                starts.clear();
                let ok: Result<(), ()> = bands.run(|from, to| {
                    let updates = (to - from) as usize * each;
                    let fits = updates <= BAND_UPDATES;
                    starts.extend(fits.then_some(from));
                    Ok(fits.then_some(updates))
                });
                ok.unwrap();
            }
            assert_eq!(starts.len(), wanted, "{starts:?}");
        }
    }

    #[test]
    fn equals_the_dense_window() {
        let mut seed = 5u64;
        let mut random = |n: i32| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            ((seed >> 33) % n as u64) as i32
        };
        // Enough updates for several bands.
        let rays: Vec<Ray> = (0..30_000)
            .map(|_| ray([random(201), random(201), random(41)], 0, random(9) == 0))
            .collect();
        let profile = Profile { side: 201, levels: 41, ..Profile::map() };
        let mut words = vec![0; Storage::words(MAP_PROGRAMS, &profile)];
        let mut storage = Storage::over(&mut words, MAP_PROGRAMS, &profile);
        storage.sweep = SweepUniform {
            side: 201,
            levels: 41,
            range_steps: 90,
            rays: rays.len() as i32,
            ..Default::default()
        };
        storage.origins[0] = [100, 100, 20, 0];
        storage.rays[..rays.len()].copy_from_slice(&rays);
        let mut bands = Bands::new(201 * 201 * 41);
        let mut voxels = Vec::new();
        let mut parts = 0;
        map(&mut storage, &mut bands, |v| {
            parts += 1;
            voxels.extend_from_slice(v);
        });
        assert!(parts > 1);
        assert!(voxels.windows(2).all(|w| w[0][0] < w[1][0]), "keys ascend and occur once");
        let s = &storage;
        let distinct = &s.distinct[..s.counters[DISTINCT_COUNT] as usize];
        let mut dense = vec![0; 201 * 201 * 41];
        ray_trace(&s.sweep, s.origins, s.rays, s.slots, distinct, &mut dense);
        let mut sparse = vec![0; dense.len()];
        voxels.iter().for_each(|v| sparse[v[0] as usize] = v[1] as i32);
        assert!(sparse == dense);
        assert_eq!(inside(&s.sweep, [200, 200, 40]), Some(dense.len() - 1));
    }
}
