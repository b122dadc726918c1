//! Several rays at once: their directions and how steep they are.

use crate::return_clock::{TURN, pseudo_angle};
use crate::sensor_paths::SensorPaths;
use crate::sweep::Placed;
use core::array::from_fn;
use raywake_simd::integer_part;

/// Number of directions in the plane that are distinguished, by [`pseudo_angle`]: each 0.2 to 0.5
/// degrees wide.
pub const AZIMUTHS: usize = 1024;
/// Number of rays that are examined together; the last ones with whatever follows them in memory.
pub const LANES: usize = 8;
/// Steps per voxel that ends of rays are rounded to, 5 mm.
pub const STEPS: f32 = 64.0;
/// Ends farther than this, voxels along an axis, are pulled in along their ray: what the type of a
/// step can hold.
const FAR: f32 = 500.0;
const _: () = assert!(FAR * STEPS <= i16::MAX as f32);
/// The slope half way from level to vertical: there are as many bands below it as above. Most rays
/// of a spinning sensor are below it.
const MIDDLE_SLOPE: f32 = 0.25;

/// Rays waiting to be sorted.
pub struct RayBatch {
    pub len: usize,
    /// Where each ended, by axis, voxels from the window's corner.
    at: [[f32; LANES]; 3],
    /// The part of the sweep that had passed by then.
    pub part: [f32; LANES],
    pub sensor: [usize; LANES],
}

/// Rays of a batch as they are kept. Entries beyond its length are meaningless.
pub struct KeptRays {
    /// Their ends, by axis, steps from the sensor.
    pub end: [[i16; LANES]; 3],
    /// [`azimuth`] of each.
    pub azimuth: [u16; LANES],
    /// [`slope`] of each.
    pub slope: [f32; LANES],
}

impl RayBatch {
    pub const fn new() -> RayBatch {
        RayBatch { len: 0, at: [[0.0; LANES]; 3], part: [0.0; LANES], sensor: [0; LANES] }
    }

    /// Adds a ray to a batch that is not full. Returns whether it is full now.
    #[inline(always)]
    pub fn push(&mut self, paths: &SensorPaths, sensor: usize, placed: &Placed) -> bool {
        let n = self.len;
        for (axis, at) in self.at.iter_mut().zip(placed.at) {
            axis[n] = at;
        }
        (self.part[n], self.sensor[n]) = (paths.part(placed.offset_s), sensor);
        self.len += 1;
        self.len == LANES
    }

    /// Its rays as they are kept.
    #[inline(always)]
    pub fn kept(&self, paths: &SensorPaths) -> KeptRays {
        let eye: [[f32; 3]; LANES] = from_fn(|l| paths.at(self.sensor[l], self.part[l]));
        let [x, y, z]: [[f32; LANES]; 3] = from_fn(|a| from_fn(|l| self.at[a][l] - eye[l][a]));
        let mut scale = [0.0; LANES];
        let mut azimuths = [0; LANES];
        for l in 0..LANES {
            let farthest = x[l].abs().max(y[l].abs()).max(z[l].abs());
            scale[l] = STEPS * (FAR / farthest).min(1.0);
            azimuths[l] = azimuth([x[l], y[l]]);
        }
        let whole = |v: [f32; LANES]| -> [i32; LANES] { from_fn(|l| integer_part(v[l] * scale[l])) };
        let end = [x, y, z].map(whole);
        let mut slopes = [0.0; LANES];
        for l in 0..LANES {
            slopes[l] = slope(end.each_ref().map(|axis| axis[l] as f32));
        }
        KeptRays { end: end.map(|axis| axis.map(|v| v as i16)), azimuth: azimuths, slope: slopes }
    }
}

/// The direction of a ray in the plane, as an index.
#[inline(always)]
pub fn azimuth([x, y]: [f32; 2]) -> u16 {
    let azimuth = integer_part(pseudo_angle(x, y) * (AZIMUTHS as f32 / TURN));
    azimuth.min(AZIMUTHS as i32 - 1) as u16
}

/// A monotonic stand-in for how steeply a ray rises, from -1, straight down, to 1.
#[inline(always)]
pub fn slope([x, y, z]: [f32; 3]) -> f32 {
    let scale = z.abs() + MIDDLE_SLOPE * (x.abs() + y.abs());
    if scale > 0.0 { z / scale } else { 0.0 }
}
