//! Distinct rays. A trace depends only on the voxels of its origin and its end, so equal rays are
//! traced once with a weight: 5 to 8 times fewer rays on real sweeps, the same sums.

use crate::params::{MERGE_PROBES, MERGE_SLOTS};
use crate::record::{Ray, SweepUniform};
use crate::stages::DISTINCT_COUNT;

/// Merges equal rays in an open-addressed table of indices into `rays`.
///
/// `slots` must hold [`MERGE_SLOTS`] zeros and receives, for each distinct ray, `index + 1` of one
/// instance and the number of instances; `distinct` receives the used slots in no particular order,
/// and word [`DISTINCT_COUNT`] of `counters`, which must be zero, their number. A ray that finds no
/// slot within [`MERGE_PROBES`] is appended as `MERGE_SLOTS + index` and counts once: which rays
/// this happens to changes no sum.
pub fn ray_merge(
    sweep: &SweepUniform,
    rays: &[Ray],
    slots: &mut [[u32; 2]],
    distinct: &mut [u32],
    counters: &mut [u32],
) {
    let rays = &rays[..sweep.rays as usize];
    assert!(slots.len() == MERGE_SLOTS && distinct.len() >= rays.len());
    let mut used = 0;
    for index in 0..rays.len() {
        if let Some(entry) = merge(rays, index, slots) {
            distinct[used] = entry;
            used += 1;
        }
    }
    counters[DISTINCT_COUNT] = used as u32;
}

/// Merges one ray. Returns its entry of `distinct`, unless an equal one is already there.
#[inline]
fn merge(rays: &[Ray], index: usize, slots: &mut [[u32; 2]]) -> Option<u32> {
    let first = hash(rays[index]);
    for slot in (first..first + MERGE_PROBES as usize).map(|n| n & (MERGE_SLOTS - 1)) {
        let [holder, _] = slots[slot];
        if holder == 0 {
            slots[slot] = [index as u32 + 1, 1];
            return Some(slot as u32);
        }
        if rays[holder as usize - 1] == rays[index] {
            slots[slot][1] += 1;
            return None;
        }
    }
    Some((MERGE_SLOTS + index) as u32)
}

/// First slot of a ray: multiply and fold, as the kernel does.
#[inline]
fn hash(ray: Ray) -> usize {
    let mixed = ray[0].wrapping_mul(0x9e37_79b1) ^ ray[1].wrapping_mul(0x85eb_ca77);
    let mixed = (mixed ^ mixed >> 15).wrapping_mul(0x2c1b_3c6d);
    ((mixed ^ mixed >> 13) as usize) & (MERGE_SLOTS - 1)
}

/// The ray of an entry of `distinct`, and its weight.
#[inline]
pub fn merged(entry: u32, rays: &[Ray], slots: &[[u32; 2]]) -> (Ray, i32) {
    let entry = entry as usize;
    if entry < MERGE_SLOTS {
        (rays[slots[entry][0] as usize - 1], slots[entry][1] as i32)
    } else {
        (rays[entry - MERGE_SLOTS], 1)
    }
}
