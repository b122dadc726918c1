//! Places of returns, one array per axis, so that several are compared at once. Compilers vectorise
//! this only if nothing in a lane can branch: hence no sums with overflow checks.

use crate::params::{CLOUD_MAX, SENSORS_MAX};
use core::array::from_fn;
use core::ops::Range;

/// Number of returns that are compared at once.
const LANES: usize = 8;
/// The last returns are compared together with whatever follows them in memory.
const ROOM: usize = CLOUD_MAX + LANES;
/// No return.
const NONE: u32 = u32::MAX;

/// Moments of the differences x, y, z from a place: 1, x, y, z, xx, xy, xz, yy, yz, zz.
pub type Moments = [f32; 10];

/// Places of returns, voxels from the window's corner, with the sensor that saw each and when:
/// every sensor sees an object at a different time.
pub struct Places {
    len: usize,
    at: [[f32; ROOM]; 3],
    seen: [Seen; ROOM],
}

/// The sensor that saw a return and, in the lower bits, when: ticks after the sweep's stamp.
type Seen = u32;

const TICK_BITS: u32 = 24;
/// A tick is a microsecond, in which an object at 40 m/s moves 40 µm; the range is 8 s either way.
const TICKS_PER_S: f32 = 1e6;
const TICKS_MAX: f32 = ((1 << (TICK_BITS - 1)) - 1) as f32;
const _: () = assert!(SENSORS_MAX <= 1 << (u32::BITS - TICK_BITS));

fn seen(sensor: u32, offset_s: f32) -> Seen {
    let ticks = (offset_s * TICKS_PER_S).clamp(-TICKS_MAX, TICKS_MAX) as i32 as u32;
    sensor << TICK_BITS | ticks & ((1 << TICK_BITS) - 1)
}

/// Added to an index once for each earlier look.
const LOOK: u32 = 1 << 24;
const _: () = assert!(CLOUD_MAX < LOOK as usize);

/// The nearest return so far. Each lane has its own, so that none waits for another.
pub struct Nearest {
    /// Squared distances.
    least: [f32; LANES],
    /// Their indices and the looks they were found in, or [`NONE`].
    best: [u32; LANES],
    /// [`LOOK`] times the number of looks so far.
    looks: u32,
}

impl Nearest {
    /// Nothing found yet within this squared distance.
    #[inline(always)]
    pub fn within(d2: f32) -> Nearest {
        Nearest { least: [d2; LANES], best: [NONE; LANES], looks: 0 }
    }

    /// Its squared distance, or the one within which nothing was found.
    #[inline(always)]
    pub fn squared_distance(&self) -> f32 {
        // Non-negative floats sort like their bits, whose minimum may be found in any order.
        let bits = self.least.map(f32::to_bits);
        let least =
            bits.iter().fold(u32::MAX, |least, bits| if *bits < least { *bits } else { least });
        f32::from_bits(least)
    }

    /// Its squared distance and index; among equally near ones, the first of the first look.
    #[inline(always)]
    pub fn found(&self) -> Option<(f32, usize)> {
        // The bit patterns of non-negative floats sort like their values.
        let mut keys = [0; LANES];
        for (l, key) in keys.iter_mut().enumerate() {
            *key = (self.least[l].to_bits() as u64) << 32 | self.best[l] as u64;
        }
        let mut key = u64::MAX;
        for k in keys {
            key = if k < key { k } else { key };
        }
        let best = key as u32;
        (best != NONE).then(|| (f32::from_bits((key >> 32) as u32), (best % LOOK) as usize))
    }
}

/// The values in a range as blocks.
#[inline(always)]
fn blocks<'a, T>(of: &'a [T; ROOM], range: &Range<usize>) -> &'a [[T; LANES]] {
    of[range.start..range.end].as_chunks().0
}

/// A number, or zero if the mask is.
#[inline(always)]
fn masked(v: f32, mask: u32) -> f32 {
    f32::from_bits(v.to_bits() & mask)
}

/// Moments so far. Each lane has its own, so that none waits for another.
pub struct MomentSums([[f32; LANES]; 10]);

impl MomentSums {
    pub const ZERO: MomentSums = MomentSums([[0.0; LANES]; 10]);

    /// The sums over all lanes, always added in the same order.
    #[inline(always)]
    pub fn total(&self) -> Moments {
        self.0.map(|[a, b, c, d, e, f, g, h]| ((a + b) + (c + d)) + ((e + f) + (g + h)))
    }
}

impl Places {
    pub const fn new() -> Places {
        Places { len: 0, at: [[0.0; ROOM]; 3], seen: [0; ROOM] }
    }

    pub fn clear(&mut self) {
        self.len = 0;
    }

    pub fn len(&self) -> usize {
        self.len
    }

    /// Adds a return if there is room. Returns whether there was.
    pub fn push(&mut self, at: [f32; 3], sensor: u32, offset_s: f32) -> bool {
        if self.len == CLOUD_MAX {
            return false;
        }
        for (of, v) in self.at.iter_mut().zip(at) {
            of[self.len] = v;
        }
        self.seen[self.len] = seen(sensor, offset_s);
        self.len += 1;
        true
    }

    pub fn at(&self, n: usize) -> [f32; 3] {
        from_fn(|a| self.at[a][n])
    }

    /// The sensor that saw a return, and when, s after the sweep's stamp.
    pub fn seen(&self, n: usize) -> (u32, f32) {
        let seen = self.seen[n];
        // Shifted up and down again to extend the sign.
        let ticks = (seen << (u32::BITS - TICK_BITS)) as i32 >> (u32::BITS - TICK_BITS);
        (seen >> TICK_BITS, ticks as f32 / TICKS_PER_S)
    }

    /// Looks in a range for the return of a sensor that is nearest to a place.
    #[inline(always)]
    pub fn look(&self, range: Range<usize>, at: [f32; 3], sensor: u32, nearest: &mut Nearest) {
        let padded = range.start..range.start + range.len().next_multiple_of(LANES);
        let (x, y) = (blocks(&self.at[0], &padded), blocks(&self.at[1], &padded));
        let (z, seen) = (blocks(&self.at[2], &padded), blocks(&self.seen, &padded));
        let (mut n, end) = (range.start as u32 | nearest.looks, range.end as u32 | nearest.looks);
        nearest.looks += LOOK;
        let (mut least, mut best) = (nearest.least, nearest.best);
        for (((x, y), z), seen) in x.iter().zip(y).zip(z).zip(seen) {
            for l in 0..LANES {
                let d = [x[l] - at[0], y[l] - at[1], z[l] - at[2]];
                let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                let own = n.wrapping_add(l as u32);
                let closer = (d2 < least[l]) & (seen[l] >> TICK_BITS == sensor) & (own < end);
                least[l] = if closer { d2 } else { least[l] };
                best[l] = if closer { own } else { best[l] };
            }
            n = n.wrapping_add(LANES as u32);
        }
        (nearest.least, nearest.best) = (least, best);
    }

    /// Adds those returns of a sensor in a range that are closer to a place than `radius`.
    #[inline(always)]
    pub fn add_around(
        &self,
        range: Range<usize>,
        at: [f32; 3],
        sensor: u32,
        radius: f32,
        sums: &mut MomentSums,
    ) {
        let padded = range.start..range.start + range.len().next_multiple_of(LANES);
        let (x, y) = (blocks(&self.at[0], &padded), blocks(&self.at[1], &padded));
        let (z, seen) = (blocks(&self.at[2], &padded), blocks(&self.seen, &padded));
        let (mut n, end) = (range.start as u32, range.end as u32);
        for (((x, y), z), seen) in x.iter().zip(y).zip(z).zip(seen) {
            for l in 0..LANES {
                let d = [x[l] - at[0], y[l] - at[1], z[l] - at[2]];
                let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                let own = n.wrapping_add(l as u32);
                let near = (d2 < radius * radius) & (seen[l] >> TICK_BITS == sensor) & (own < end);
                // Returns that are not near add zeros, which change no sum.
                let mask = if near { u32::MAX } else { 0 };
                let [x, y, z] = [masked(d[0], mask), masked(d[1], mask), masked(d[2], mask)];
                sums.0[0][l] += masked(1.0, mask);
                sums.0[1][l] += x;
                sums.0[2][l] += y;
                sums.0[3][l] += z;
                sums.0[4][l] += x * x;
                sums.0[5][l] += x * y;
                sums.0[6][l] += x * z;
                sums.0[7][l] += y * y;
                sums.0[8][l] += y * z;
                sums.0[9][l] += z * z;
            }
            n = n.wrapping_add(LANES as u32);
        }
    }
}
