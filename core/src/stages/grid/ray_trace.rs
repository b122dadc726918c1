//! Weighted ray tracing into the dense window (B.2.2, B.4, B.5).

use super::ray_merge::merged;
use super::walk::Walk;
use crate::params::{LOG_ODDS_FREE, LOG_ODDS_OCCUPIED};
use crate::record::{NO_END, Ray, SweepUniform, ray_end, ray_origin};

/// Adds the updates of every entry of `distinct` to `log_odds` (tenths, one per voxel): each voxel
/// passed inside the window gets the free update, the end the occupied one. A ray that leaves the
/// window, goes beyond `range_steps` or carries `no_end` leaves only free space. Integer sums: the
/// order of the rays does not matter.
pub fn ray_trace(
    sweep: &SweepUniform,
    origins: &[[i32; 4]],
    rays: &[Ray],
    slots: &[[u32; 2]],
    distinct: &[u32],
    log_odds: &mut [i32],
) {
    for &entry in distinct {
        let (ray, weight) = merged(entry, rays, slots);
        let [x, y, z, _] = origins[ray_origin(ray)];
        trace(sweep, [x, y, z], ray, weight, log_odds);
    }
}

/// Adds the updates of a ray that counts `weight` times.
#[inline]
fn trace(sweep: &SweepUniform, start: [i32; 3], ray: Ray, weight: i32, log_odds: &mut [i32]) {
    let end = ray_end(ray);
    let mut entered = false;
    for voxel in Walk::new(start, end, sweep.range_steps) {
        match inside(sweep, voxel) {
            Some(index) => {
                entered = true;
                log_odds[index] += LOG_ODDS_FREE * weight;
            }
            // The window is convex: once left, it is never met again.
            None if entered => break,
            None => {}
        }
    }
    let hit = ray[1] & NO_END == 0 && !Walk::beyond(start, end, sweep.range_steps);
    if let (true, Some(index)) = (hit, inside(sweep, end)) {
        log_odds[index] += LOG_ODDS_OCCUPIED * weight;
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
