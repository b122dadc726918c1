//! Weighted ray tracing into the dense window (B.2.2, B.4, B.5).

use super::ray_merge::merged;
use super::walk::Walk;
use crate::params::{EXTENT_VOXELS, LOG_ODDS_FREE, LOG_ODDS_OCCUPIED, RANGE_STEPS_MAX, SIDE_MAX};
use crate::record::{NO_END, Ray, SweepUniform, ray_end, ray_origin};

/// Adds the updates of every entry of `distinct` to `log_odds` (tenths, one per voxel): each voxel
/// passed inside the window gets the free update, the end the occupied one. A ray that leaves the
/// window, goes beyond `range_steps` or carries `no_end` leaves only free space. The sums are
/// integers, so the order of the rays does not matter.
#[inline(always)]
pub fn ray_trace(
    sweep: &SweepUniform,
    origins: &[[i32; 4]],
    rays: &[Ray],
    slots: &[[u32; 2]],
    distinct: &[u32],
    log_odds: &mut [i32],
) {
    // Looked up in batches: the rays are scattered in memory, and a processor waits for several at
    // once if there is no walk in between.
    let mut batch = [([0; 2], 0); BATCH];
    for entries in distinct.chunks(BATCH) {
        let batch = &mut batch[..entries.len()];
        batch.iter_mut().zip(entries).for_each(|(to, entry)| *to = merged(*entry, rays, slots));
        for &(ray, weight) in &*batch {
            let [x, y, z, _] = origins[ray_origin(ray)];
            trace(sweep, [x, y, z], ray, weight, log_odds);
        }
    }
}

/// Number of rays looked up at once.
const BATCH: usize = 64;
/// Number of steps of a walk computed at once: those of a vector of AVX2. Other numbers, and wider
/// vectors, were not measured.
const LANES: usize = 8;
/// Bits of the part of a voxel that a walk has gone along an axis: as many as leave room for the
/// voxels of [`LANES`] steps. They decide exactly where a voxel ends: those places are at least
/// 1 / (2 length) of a voxel apart, and rounding adds up to less than that in a walk of fewer than
/// 2^(PART_BITS - 1) / length steps.
const PART_BITS: u32 = u32::BITS - LANES.ilog2() - 1;
/// The longest walk that passes through the window: it starts at most [`RANGE_STEPS_MAX`] away.
const LENGTH_MAX: i64 = EXTENT_VOXELS as i64 + RANGE_STEPS_MAX as i64 + SIDE_MAX as i64;
const _: () = assert!(SIDE_MAX as i64 * LENGTH_MAX < 1 << (PART_BITS - 1));

/// Adds the updates of a ray that counts `weight` times: those of [`Walk`], clipped to the window
/// first and then walked by index.
#[inline(always)]
fn trace(sweep: &SweepUniform, start: [i32; 3], ray: Ray, weight: i32, log_odds: &mut [i32]) {
    let end = ray_end(ray);
    let line = WalkInWindow::new(sweep, start, end);
    let (from, to) = line.clip(sweep, start);
    line.walk(from, to, start, |index| log_odds[index] += LOG_ODDS_FREE * weight);
    let hit = ray[1] & NO_END == 0 && !Walk::beyond(start, end, sweep.range_steps);
    if let (true, Some(index)) = (hit, inside(sweep, end)) {
        log_odds[index] += LOG_ODDS_OCCUPIED * weight;
    }
}

/// A [`Walk`] in closed form: after `n` steps it has gone `(2 extent n + length) / (2 length)`
/// voxels along an axis, rounded down, since the error that decides the next step along it is then
/// `2 extent (n + 1) - length - 2 length gone`.
struct WalkInWindow {
    /// Voxels along every axis, and along the one that steps every time.
    extent: [i64; 3],
    length: i64,
    step: [i32; 3],
    /// Index distance of neighbours along every axis, in the order of the grid.
    stride: [i32; 3],
}

impl WalkInWindow {
    #[inline]
    fn new(sweep: &SweepUniform, start: [i32; 3], end: [i32; 3]) -> WalkInWindow {
        let delta = [0, 1, 2].map(|a| end[a] - start[a]);
        let extent = delta.map(|d| i64::from(d.abs()));
        let length = extent[0].max(extent[1]).max(extent[2]);
        let stride = [sweep.side * sweep.levels, sweep.levels, 1];
        WalkInWindow { extent, length, step: delta.map(i32::signum), stride }
    }

    /// Steps after which it has gone this many voxels along an axis; `i64::MAX` if it never does.
    #[inline]
    fn steps_to(&self, voxels: i32, axis: usize) -> i64 {
        let voxels = i64::from(voxels);
        match voxels {
            ..=0 => 0,
            _ if voxels > self.extent[axis] => i64::MAX,
            _ => {
                (self.length * (2 * voxels - 1) + 2 * self.extent[axis] - 1)
                    / (2 * self.extent[axis])
            }
        }
    }

    /// The range of steps before which it is inside the window, the last excluded, as far as a ray
    /// reaches.
    #[inline]
    fn clip(&self, sweep: &SweepUniform, start: [i32; 3]) -> (i64, i64) {
        let sizes = [sweep.side, sweep.side, sweep.levels];
        let (mut from, mut to) = (0, self.length.min(i64::from(sweep.range_steps)));
        for axis in 0..3 {
            let (at, size) = (start[axis], sizes[axis]);
            let (enters, leaves) = match self.step[axis] {
                0 if (0..size).contains(&at) => continue,
                0 => return (0, 0),
                1 => (-at, size - at),
                _ => (at - (size - 1), at + 1),
            };
            from = from.max(self.steps_to(enters, axis));
            to = to.min(self.steps_to(leaves, axis));
        }
        (from, to)
    }

    /// Visits the voxels before these steps by index, those of [`LANES`] steps computed at once.
    #[inline(always)]
    fn walk(&self, from: i64, to: i64, start: [i32; 3], mut visit: impl FnMut(usize)) {
        if from >= to {
            return;
        }
        let (extent, length) = (self.extent, self.length);
        let gone = match from {
            0 => [0; 3],
            _ => extent.map(|extent| (2 * extent * from + length) / (2 * length)),
        };
        let by = |axis: usize| self.step[axis] * self.stride[axis];
        let at = |axis: usize| start[axis] * self.stride[axis] + gone[axis] as i32 * by(axis);
        let mut first = (0..3).map(at).sum::<i32>();
        let longest = (0..3).rev().find(|a| extent[*a] == length).unwrap_or(0);
        let others = [(longest + 1) % 3, (longest + 2) % 3];
        // Rounded up, so that what is exactly at a voxel's edge is beyond it.
        let mut part = others.map(|axis| {
            let of_voxel = 2 * extent[axis] * from + length - 2 * length * gone[axis];
            ((of_voxel << PART_BITS) as u64).div_ceil(2 * length as u64) as u32
        });
        let rise = others.map(|axis| ((extent[axis] << PART_BITS) as u64).div_ceil(length as u64));
        let rise = rise.map(|rise| rise as u32);
        let (always, [one, other]) = (by(longest), others.map(by));
        let after = |n: u32, part: [u32; 2]| {
            let [a, b] = [0, 1].map(|axis| (part[axis] + n * rise[axis]) >> PART_BITS);
            n as i32 * always + a as i32 * one + b as i32 * other
        };
        let mut left = (to - from) as usize;
        loop {
            let mut voxels = [0; LANES];
            for (n, voxel) in voxels.iter_mut().enumerate() {
                *voxel = (first + after(n as u32, part)) as u32;
            }
            if left < LANES {
                return voxels[..left].iter().for_each(|voxel| visit(*voxel as usize));
            }
            voxels.iter().for_each(|voxel| visit(*voxel as usize));
            left -= LANES;
            first += after(LANES as u32, part);
            part = [0, 1].map(|n| (part[n] + LANES as u32 * rise[n]) % (1 << PART_BITS));
        }
    }
}

/// Index of a voxel of the window.
#[inline]
pub fn inside(sweep: &SweepUniform, v: [i32; 3]) -> Option<usize> {
    let (side, levels) = (sweep.side as u32, sweep.levels as u32);
    let [i, j, k] = v.map(|a| a as u32);
    (i < side && j < side && k < levels).then(|| ((i * side + j) * levels + k) as usize)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::params::MERGE_SLOTS;
    use crate::record::ray;
    use crate::stages::grid::ray_merge::ray_merge;
    use crate::stages::{COUNTERS, DISTINCT_COUNT};
    use std::collections::HashMap;
    use std::vec;
    use std::vec::Vec;

    /// Appendix B to the letter: one update list entry per ray and voxel, summed by voxel.
    fn naive(sweep: &SweepUniform, origin: [i32; 3], rays: &[Ray]) -> HashMap<[i32; 3], i32> {
        let mut map = HashMap::new();
        for &r in rays {
            let end = ray_end(r);
            for v in Walk::new(origin, end, sweep.range_steps) {
                *map.entry(v).or_insert(0) -= 1;
            }
            if r[1] & NO_END == 0 && !Walk::beyond(origin, end, sweep.range_steps) {
                *map.entry(end).or_insert(0) += 10;
            }
        }
        map
    }

    #[test]
    fn clipping_a_walk_keeps_exactly_its_part_in_the_window() {
        let mut rng = crate::random::Random(7);
        let mut draw =
            |least: i32, most: i32| least + rng.below((most - least + 1) as usize) as i32;
        let mut long = 0;
        for n in 0..20_000 {
            // Of every four, one in a large window, with ends as far as rays have them, one that
            // starts far away as well, and two among few voxels.
            let [side, reach, end_reach] = match n % 4 {
                0 => [SIDE_MAX as i32, 400, EXTENT_VOXELS],
                1 => [40, EXTENT_VOXELS, EXTENT_VOXELS],
                _ => [40, 60, 60],
            };
            let sweep = SweepUniform {
                side: draw(1, side),
                levels: draw(1, 12),
                range_steps: draw(1, if n % 4 == 0 { RANGE_STEPS_MAX } else { 300 }),
                ..Default::default()
            };
            let mut start = [0; 3].map(|_| draw(-reach, reach));
            let mut end = [0; 3].map(|_| draw(-end_reach, end_reach));
            if n % 4 == 0 {
                // Level enough to stay in the window for long; every other one along a diagonal or
                // at a ratio of small numbers, where voxels are left through their edges.
                (start[2], end[2]) = (draw(0, 11), draw(0, 11));
                if n % 8 == 0 {
                    let by = draw(1, 1000);
                    end = [start[0] + by * draw(-3, 3), start[1] + by * draw(-3, 3), end[2]];
                }
            }
            let walk = Walk::new(start, end, sweep.range_steps);
            let wanted: Vec<usize> = walk.filter_map(|v| inside(&sweep, v)).collect();
            let line = WalkInWindow::new(&sweep, start, end);
            let (from, to) = line.clip(&sweep, start);
            let mut found = Vec::new();
            line.walk(from, to, start, |index| found.push(index));
            assert_eq!(found, wanted, "{start:?} to {end:?} in {sweep:?}");
            long += usize::from(found.len() > 100);
        }
        assert!(long > 200, "{long}");
    }

    #[test]
    fn merged_and_traced_equals_the_update_list() {
        let sweep = SweepUniform { side: 31, levels: 8, range_steps: 20, ..Default::default() };
        let mut seed = 1u64;
        let mut random = |n: i32| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            ((seed >> 33) % n as u64) as i32
        };
        // One origin inside the window, one outside it.
        for origin in [[15, 15, 4], [-3, 15, 4]] {
            let rays: Vec<Ray> = (0..4000)
                .map(|_| {
                    ray([random(60) - 15, random(60) - 15, random(16) - 4], 0, random(20) == 0)
                })
                .collect();
            let mut slots = vec![[0; 2]; MERGE_SLOTS];
            let mut distinct = vec![0; rays.len()];
            let mut counters = [0; COUNTERS];
            let sweep = SweepUniform { rays: rays.len() as i32, ..sweep };
            ray_merge(&sweep, &rays, &mut slots, &mut distinct, &mut counters);
            let used = counters[DISTINCT_COUNT] as usize;
            let kinds: std::collections::HashSet<_> = rays.iter().collect();
            assert_eq!(used, kinds.len());
            let mut grid = vec![0; 31 * 31 * 8];
            let origins = [[origin[0], origin[1], origin[2], 0]];
            ray_trace(&sweep, &origins, &rays, &slots, &distinct[..used], &mut grid);
            let map = naive(&sweep, origin, &rays);
            for i in 0..31 {
                for j in 0..31 {
                    for k in 0..8 {
                        let index = inside(&sweep, [i, j, k]).unwrap();
                        let wanted = map.get(&[i, j, k]).copied().unwrap_or(0);
                        assert_eq!(grid[index], wanted, "voxel {i} {j} {k}");
                    }
                }
            }
        }
    }
}
