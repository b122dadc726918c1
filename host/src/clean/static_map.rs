//! The static map: the mean of the static returns of every voxel in which more returns were static
//! than moving.

use std::collections::HashMap;

use glam::DVec3;

use super::verdict::ReturnVerdict;

/// The returns in a voxel.
#[derive(Clone, Copy, Default)]
struct VoxelReturns {
    /// Sums of the static returns' positions relative to the voxel's corner, m, and of their
    /// intensities.
    sum: [f32; 4],
    still: u32,
    moving: u32,
}

/// The static map, growing with the drive.
pub struct StaticMap {
    voxel_m: f64,
    voxels: HashMap<[i64; 3], VoxelReturns>,
}

impl StaticMap {
    pub fn new(voxel_m: f64) -> StaticMap {
        StaticMap { voxel_m, voxels: HashMap::new() }
    }

    /// Adds a return at a world position.
    pub fn add(&mut self, at: DVec3, intensity: f32, judged: ReturnVerdict) {
        let index = (at / self.voxel_m).floor();
        let key = index.to_array().map(|c| c as i64);
        match judged {
            ReturnVerdict::Moving => self.voxels.entry(key).or_default().moving += 1,
            ReturnVerdict::Static => {
                let seen = self.voxels.entry(key).or_default();
                let [x, y, z] = (at - index * self.voxel_m).as_vec3().to_array();
                seen.sum.iter_mut().zip([x, y, z, intensity]).for_each(|(sum, v)| *sum += v);
                seen.still += 1;
            }
            ReturnVerdict::None | ReturnVerdict::Unknown => {}
        }
    }

    /// The points: x, y, z (m, world), and intensity, in voxel order.
    pub fn points(&self) -> Vec<([f64; 3], f32)> {
        let still = self.voxels.iter().filter(|(_, seen)| seen.still > seen.moving);
        let mut still: Vec<_> = still.collect();
        still.sort_unstable_by_key(|(key, _)| **key);
        let point = |(key, seen): (&[i64; 3], &VoxelReturns)| {
            let [x, y, z, intensity] = seen.sum.map(|sum| f64::from(sum) / f64::from(seen.still));
            let corner = DVec3::from_array(key.map(|c| c as f64)) * self.voxel_m;
            ((corner + DVec3::new(x, y, z)).to_array(), intensity as f32)
        };
        still.into_iter().map(point).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_that_mostly_moved_are_left_out() {
        let mut map = StaticMap::new(0.5);
        for (x, judged) in [
            (-0.3, ReturnVerdict::Static),
            (-0.1, ReturnVerdict::Static),
            (-0.2, ReturnVerdict::Moving),
            (0.2, ReturnVerdict::Static),
            (0.3, ReturnVerdict::Moving),
            (0.7, ReturnVerdict::Unknown),
        ] {
            map.add(DVec3::new(x, 1.25, 0.0), 0.5, judged);
        }
        let [([x, y, z], intensity)] = map.points()[..] else { panic!("{:?}", map.points()) };
        assert!((x + 0.2).abs() < 1e-6 && [y, z] == [1.25, 0.0] && intensity == 0.5);
    }

    /// Where neighbouring float32 are half a metre apart.
    #[test]
    fn positions_far_from_the_origin() {
        let mut map = StaticMap::new(0.02);
        let at = DVec3::new(458_000.123, 5_428_000.456, -9e7);
        map.add(at, 0.0, ReturnVerdict::Static);
        let [(point, _)] = map.points()[..] else { panic!("{:?}", map.points()) };
        assert!(DVec3::from_array(point).distance(at) < 1e-3, "{point:?}");
    }
}
