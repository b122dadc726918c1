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
    voxels: HashMap<[i32; 3], VoxelReturns>,
}

impl StaticMap {
    pub fn new(voxel_m: f64) -> StaticMap {
        StaticMap { voxel_m, voxels: HashMap::new() }
    }

    /// Adds a return at a world position.
    pub fn add(&mut self, at: DVec3, intensity: f32, judged: ReturnVerdict) {
        let index = (at / self.voxel_m).floor();
        let key = index.to_array().map(|c| c as i32);
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

    /// The points: x, y, z (m, world) and intensity, in voxel order.
    pub fn points(&self) -> Vec<[f32; 4]> {
        let still = self.voxels.iter().filter(|(_, seen)| seen.still > seen.moving);
        let mut still: Vec<_> = still.collect();
        still.sort_unstable_by_key(|(key, _)| **key);
        let point = |(key, seen): (&[i32; 3], &VoxelReturns)| {
            let [x, y, z, intensity] = seen.sum.map(|sum| f64::from(sum) / f64::from(seen.still));
            let corner = DVec3::from_array(key.map(f64::from)) * self.voxel_m;
            let [x, y, z] = (corner + DVec3::new(x, y, z)).as_vec3().to_array();
            [x, y, z, intensity as f32]
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
        let points = map.points();
        assert_eq!(points.len(), 1, "{points:?}");
        assert!((points[0][0] + 0.2).abs() < 1e-6 && points[0][1..] == [1.25, 0.0, 0.5]);
    }
}
