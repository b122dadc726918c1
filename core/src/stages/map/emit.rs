//! The list of updates (B.2.2), at its exact size.

use crate::params::{LOG_ODDS_FREE, LOG_ODDS_OCCUPIED};
use crate::record::Update;
use crate::record::{NO_END, Ray, SweepUniform, ray_end, ray_origin};
use crate::stages::grid::ray_merge::merged;
use crate::stages::grid::ray_trace::inside;
use crate::stages::grid::walk::Walk;

/// `counts[n]` becomes the number of updates of `distinct[n]` whose keys lie in the band, 0 after
/// the last.
pub fn count(
    sweep: &SweepUniform,
    origins: &[[i32; 4]],
    rays: &[Ray],
    slots: &[[u32; 2]],
    distinct: &[u32],
    counts: &mut [u32],
) {
    counts.fill(0);
    for (&entry, count) in distinct.iter().zip(counts) {
        walk(sweep, origins, merged(entry, rays, slots), |_| *count += 1);
    }
}

/// Writes the updates of every distinct ray in the band, starting at `offsets`.
pub fn emit(
    sweep: &SweepUniform,
    origins: &[[i32; 4]],
    rays: &[Ray],
    slots: &[[u32; 2]],
    distinct: &[u32],
    offsets: &[u32],
    updates: &mut [Update],
) {
    for (&entry, &offset) in distinct.iter().zip(offsets) {
        let mut at = offset as usize;
        walk(sweep, origins, merged(entry, rays, slots), |update| {
            updates[at] = update;
            at += 1;
        });
    }
}

/// Calls `each` with every update of a distinct ray in the band.
#[inline]
fn walk(
    sweep: &SweepUniform,
    origins: &[[i32; 4]],
    (ray, weight): (Ray, i32),
    mut each: impl FnMut(Update),
) {
    let [x, y, z, _] = origins[ray_origin(ray)];
    let (start, end) = ([x, y, z], ray_end(ray));
    if is_beside_band(sweep, x, end[0]) {
        return;
    }
    let band = sweep.band_from as usize..sweep.band_to as usize;
    let mut put = |voxel, log_odds: i32| {
        if let Some(key) = inside(sweep, voxel).filter(|k| band.contains(k)) {
            each([key as u32, (log_odds * weight) as u32]);
        }
    };
    for voxel in Walk::new(start, end, sweep.range_steps) {
        put(voxel, LOG_ODDS_FREE);
    }
    if ray[1] & NO_END == 0 && !Walk::beyond(start, end, sweep.range_steps) {
        put(end, LOG_ODDS_OCCUPIED);
    }
}

/// Whether a ray lies outside the band's slabs: keys ascend with x, so it has no updates in the
/// band.
#[inline]
fn is_beside_band(sweep: &SweepUniform, from_x: i32, to_x: i32) -> bool {
    let slab = sweep.side * sweep.levels;
    from_x.max(to_x) < sweep.band_from / slab || from_x.min(to_x) > sweep.band_to / slab
}
