//! Where a thing may have gone if nothing else tells: every displacement within reach, by voxels.

use super::align::Thing;

/// Displacements searched either way, voxels: 30 m/s at 0.30 m and 10 Hz.
const FARTHEST: i32 = 10;

/// The displacement that puts most of the thing's returns on returns of the newest sweep; what
/// stood there before counts half. The first of those as good.
pub fn search(thing: &Thing) -> [f32; 2] {
    let other = &thing.sweeps.others[0];
    let mut best = (0, [0.0; 2]);
    for du in -FARTHEST..=FARTHEST {
        for dv in -FARTHEST..=FARTHEST {
            let by = [du as f32, dv as f32];
            let mut score = 0;
            for s in &thing.samples {
                let at = [s.at[0] + by[0], s.at[1] + by[1], s.at[2]];
                let there = core::array::from_fn(|a| at[a] + other.offset[a]);
                if other.cloud.is_hit(there) {
                    score += 2 - thing.sweeps.first.is_hit(at) as u32;
                }
            }
            if score > best.0 {
                best = (score, by);
            }
        }
    }
    best.1
}
