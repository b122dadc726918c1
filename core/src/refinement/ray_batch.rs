//! Several rays at once: their directions and how steep they are.

use crate::return_clock::{TURN, pseudo_angle};
use crate::sensor_paths::SensorPaths;
use crate::sweep::Placed;
use raywake_simd::integer_part;

/// Number of directions in the plane that are distinguished, by [`pseudo_angle`]: each 0.2 to 0.5
/// degrees wide.
pub const AZIMUTHS: usize = 1024;
/// Steps per voxel that ends of rays are rounded to, 5 mm.
pub const STEPS: f32 = 64.0;
/// Ends farther than this, voxels along an axis, are pulled in along their ray: what the type of a
/// step can hold.
const FAR: f32 = 500.0;
const _: () = assert!(FAR * STEPS <= i16::MAX as f32);
/// The slope half way from level to vertical: there are as many bands below it as above. Most rays
/// of a spinning sensor are below it.
const MIDDLE_SLOPE: f32 = 0.25;

/// Number of rays in a batch, as of returns in one that is placed.
pub const BATCH: usize = 64;

/// Rays waiting to be sorted.
pub struct RayBatch {
    pub len: usize,
    /// Where each ended, by axis, voxels from the window's corner.
    at: [[f32; BATCH]; 3],
    /// When each was measured, s after the sweep's stamp.
    offset_s: [f32; BATCH],
    pub sensor: [u32; BATCH],
}

/// Rays of a batch as they are kept. Entries beyond its length are meaningless.
pub struct KeptRays {
    /// The part of the sweep that had passed by the time of each.
    pub part: [f32; BATCH],
    /// Their ends, by axis, steps from the sensor.
    pub end: [[i16; BATCH]; 3],
    /// [`azimuth`] of each.
    pub azimuth: [u16; BATCH],
    /// [`slope`] of each.
    pub slope: [f32; BATCH],
}

impl RayBatch {
    pub const fn new() -> RayBatch {
        RayBatch { len: 0, at: [[0.0; BATCH]; 3], offset_s: [0.0; BATCH], sensor: [0; BATCH] }
    }

    /// Adds a ray to a batch that is not full. Returns whether it is full now.
    #[inline(always)]
    pub fn push(&mut self, sensor: u32, placed: &Placed) -> bool {
        let n = self.len;
        for (axis, at) in self.at.iter_mut().zip(placed.at) {
            axis[n] = at;
        }
        (self.offset_s[n], self.sensor[n]) = (placed.offset_s, sensor);
        self.len += 1;
        self.len == BATCH
    }

    /// Its rays as they are kept.
    #[inline(always)]
    pub fn kept(&self, paths: &SensorPaths) -> KeptRays {
        let mut kept = KeptRays {
            part: [0.0; BATCH],
            end: [[0; BATCH]; 3],
            azimuth: [0; BATCH],
            slope: [0.0; BATCH],
        };
        for (part, offset_s) in kept.part.iter_mut().zip(self.offset_s) {
            *part = paths.part(offset_s);
        }
        let [x, y, z] = self.relative_ends(paths, &kept.part);
        let [end_x, end_y, end_z] = &mut kept.end;
        for n in 0..BATCH {
            let farthest = x[n].abs().max(y[n].abs()).max(z[n].abs());
            let scale = STEPS * (FAR / farthest).min(1.0);
            let end = [x[n], y[n], z[n]].map(|v| integer_part(v * scale));
            [end_x[n], end_y[n], end_z[n]] = end.map(|v| v as i16);
            kept.azimuth[n] = azimuth([x[n], y[n]]);
            kept.slope[n] = slope(end.map(|v| v as f32));
        }
        kept
    }

    /// The ends by axis, voxels from the sensor.
    #[inline(always)]
    fn relative_ends(&self, paths: &SensorPaths, part: &[f32; BATCH]) -> [[f32; BATCH]; 3] {
        let (mut relative, mut from) = ([[0.0; BATCH]; 3], 0);
        for same in self.sensor.chunk_by(|a, b| a == b) {
            let to = from + same.len();
            let [start, by] = paths.line(same[0] as usize);
            for (axis, out) in relative.iter_mut().enumerate() {
                let at = self.at[axis][from..to].iter().zip(&part[from..to]);
                for (out, (at, part)) in out[from..to].iter_mut().zip(at) {
                    *out = at - (start[axis] + part * by[axis]);
                }
            }
            from = to;
        }
        relative
    }
}

/// The direction of a ray in the plane, as an index.
#[inline(always)]
pub fn azimuth([x, y]: [f32; 2]) -> u16 {
    let azimuth = integer_part(pseudo_angle(x, y) * (AZIMUTHS as f32 / TURN));
    azimuth.clamp(0, AZIMUTHS as i32 - 1) as u16
}

/// A monotonic stand-in for how steeply a ray rises, from -1, straight down, to 1.
#[inline(always)]
pub fn slope([x, y, z]: [f32; 3]) -> f32 {
    let scale = z.abs() + MIDDLE_SLOPE * (x.abs() + y.abs());
    if scale > 0.0 { z / scale } else { 0.0 }
}
