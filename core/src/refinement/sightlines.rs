//! The rays of a sweep by direction: whether something at a place would have been seen there.
//!
//! Rings of returns on a wall, a barrier or a bonnet move with the sensor. Where one was in the
//! previous sweep there is none now, though the surface it lay on is still there: the lack of a
//! nearby return proves nothing there. A ray that passed does: it went through, or ended at the
//! surface.
//!
//! As in registration by projection (Blais and Levine, "Registering multiview range data to create
//! 3D computer objects", PAMI 1995) a place is compared with what its direction shows, not with
//! what is near it in space.

use super::ray_batch::{AZIMUTHS, RayBatch, STEPS, azimuth, slope};
use super::sample::{SurfaceWeight, minus, weighed};
use super::scaled::Scaled;
use crate::params::{SENSORS_MAX, SIGHTLINES_MAX};
use crate::sensor_paths::SensorPaths;
use crate::sweep::Placed;
use crate::thinning::TakenPoints;
use core::ops::{Range, RangeInclusive};
use raywake_simd::Simd;

/// Steps of a sweep that the time of a ray is rounded to, 0.4 ms.
const PARTS: f32 = 255.0;
/// Maximum number of iterations to find the time at which a sensor looked towards a place: between
/// two sweeps it has moved, and the direction has changed with it.
const ROUNDS: usize = 3;

/// Number of bands that the slopes of rays are sorted into, over all sensors: only rays in bands
/// within reach of a place are examined. This only saves time: three directions have 190 rays on
/// average, of which 40 are left (KITTI drive 0005).
const BANDS: usize = 16;
const _: () = assert!(SENSORS_MAX <= BANDS);

/// Number of rays that are examined together; the last ones with whatever follows them in memory.
const LANES: usize = 8;

/// Scratch of [`Sightlines::fill`]: rays in the order they come.
pub(super) type Unsorted = [UnsortedRay; SIGHTLINES_MAX];

/// A ray, and the cell that it belongs to.
#[derive(Clone, Copy)]
pub(super) struct UnsortedRay {
    end: [i16; 3],
    cell: u16,
}
const _: () = assert!(BANDS * AZIMUTHS <= u16::MAX as usize + 1);

impl UnsortedRay {
    pub const NONE: UnsortedRay = UnsortedRay { end: [0; 3], cell: 0 };
}

/// By how much farther away a ray may pass than computed, voxels: at the farthest end an f32 is
/// exact to less than a hundredth of this.
const ROUNDING: f32 = 0.01;

/// The part of a direction without a ray: an all-zero initial state takes no room in the
/// executable. Other parts are stored plus one.
const NO_PART: u16 = 0;

/// The rays of one sweep, evenly thinned to the capacity.
pub struct Sightlines {
    paths: SensorPaths,
    /// Bands per sensor: a division for every ray would take longer.
    bands: usize,
    /// Where the rays of each cell begin, and where those of the last one end. A cell is a band of
    /// a direction; the cells of a band are contiguous, and so are the bands of a sensor.
    start: [u32; BANDS * AZIMUTHS + 1],
    /// Their ends, by axis, steps from the sensor.
    end: [[i16; SIGHTLINES_MAX + LANES]; 3],
    /// The part of the sweep, out of [`PARTS`], that had passed at the first ray of a direction.
    part: [[u16; AZIMUTHS]; SENSORS_MAX],
}

impl Sightlines {
    pub const fn new() -> Sightlines {
        Sightlines {
            paths: SensorPaths::NOWHERE,
            bands: 0,
            start: [0; BANDS * AZIMUTHS + 1],
            end: [[0; SIGHTLINES_MAX + LANES]; 3],
            part: [[NO_PART; AZIMUTHS]; SENSORS_MAX],
        }
    }

    /// Takes over the rays of a sweep.
    pub(super) fn fill(
        &mut self,
        paths: &SensorPaths,
        points: TakenPoints,
        placed: &[Placed],
        simd: Simd,
        rays: &mut Unsorted,
    ) {
        self.paths = *paths;
        self.start.fill(0);
        self.part.fill([NO_PART; AZIMUTHS]);
        self.bands = BANDS / paths.sensors.max(1);
        let share = share_kept(placed.len());
        let count = simd.run(
            #[inline(always)]
            |_| {
                let (mut batch, mut count) = (RayBatch::new(), 0);
                for (n, placed) in placed.iter().enumerate() {
                    let taken = is_kept(n, share) && placed.at.iter().all(|v| v.is_finite());
                    if taken && batch.push(paths.sensor_of(points, n), placed) {
                        count += self.count(&batch, &mut rays[count..]);
                        batch.len = 0;
                    }
                }
                count + self.count(&batch, &mut rays[count..])
            },
        );
        // The entry after each cell's own holds its start, which becomes its end, where the next
        // cell starts.
        let mut total = 0;
        for start in &mut self.start[1..] {
            total += core::mem::replace(start, total);
        }
        for ray in &rays[..count] {
            let start = &mut self.start[usize::from(ray.cell) + 1];
            let to = *start as usize;
            *start += 1;
            for (axis, v) in self.end.iter_mut().zip(ray.end) {
                axis[to] = v;
            }
        }
    }

    /// Adds a batch to the counts by cell and to the unsorted rays. Returns how many there was room
    /// for.
    #[inline(always)]
    fn count(&mut self, batch: &RayBatch, rays: &mut [UnsortedRay]) -> usize {
        let kept = batch.kept(&self.paths);
        let added = batch.len.min(rays.len());
        for (l, ray) in rays[..added].iter_mut().enumerate() {
            let (sensor, azimuth) = (batch.sensor[l] as usize, usize::from(kept.azimuth[l]));
            let part = &mut self.part[sensor][azimuth];
            if *part == NO_PART {
                *part = (kept.part[l] * PARTS) as u16 + 1;
            }
            let cell = self.first_cell(sensor, self.band(kept.slope[l])) + azimuth;
            let end = kept.end.each_ref().map(|axis| axis[l]);
            *ray = UnsortedRay { end, cell: cell as u16 };
            self.start[cell + 1] += 1;
        }
        added
    }

    /// The band of a slope.
    fn band(&self, slope: f32) -> usize {
        (((slope + 1.0) * (0.5 * self.bands as f32)) as usize).min(self.bands - 1)
    }

    /// The first cell of a band of a sensor: one for each azimuth.
    fn first_cell(&self, sensor: usize, band: usize) -> usize {
        (sensor * self.bands + band) * AZIMUTHS
    }

    /// How far behind the surface at a place, voxels across it, the ray ended that met the surface
    /// nearest to the place; `None` if none came near. `offset_s` is when the place is assumed to
    /// have been seen, s after the stamp.
    pub fn depth(
        &self,
        simd: Simd,
        scaled: &Scaled,
        at: [f32; 3],
        weight: &SurfaceWeight,
        offset_s: f32,
    ) -> Option<f32> {
        let mut nearest = NearestRay { squared_distance: f32::INFINITY, depth: None };
        for sensor in 0..self.paths.sensors {
            if self.rays(self.first_cell(sensor, 0)..self.first_cell(sensor + 1, 0)).is_empty() {
                continue;
            }
            let (eye, azimuth) = self.eye(sensor, at, offset_s);
            let surface = SurfacePatch::new(minus(at, eye), weight);
            let reach = scaled.sight_reach(surface.distance());
            let first_cell = |slope| self.first_cell(sensor, self.band(slope));
            let [lowest, highest] = slopes_within(reach, surface.at).map(first_cell);
            let bands = lowest..=highest;
            let within = nearest.squared_distance.min(reach * reach);
            let found = simd.run(
                #[inline(always)]
                |_| self.nearest(bands, azimuth, &surface, within),
            );
            nearest = if found.depth.is_some() { found } else { nearest };
        }
        nearest.depth
    }

    /// Where a sensor was when it looked at a place, and the azimuth of the place from there.
    fn eye(&self, sensor: usize, at: [f32; 3], offset_s: f32) -> ([f32; 3], usize) {
        let look = |part: f32| {
            let eye = self.paths.at(sensor, part);
            let [x, y, _] = minus(at, eye);
            (eye, usize::from(azimuth([x, y])))
        };
        let (mut eye, mut azimuth) = look(self.paths.part(offset_s));
        let mut before = NO_PART;
        for _ in 0..ROUNDS {
            let part = self.part[sensor][azimuth];
            if part == NO_PART || part == before {
                break;
            }
            (eye, azimuth) = look(f32::from(part - 1) / PARTS);
            before = part;
        }
        (eye, azimuth)
    }

    /// Indices of the rays in a range of cells.
    fn rays(&self, cells: Range<usize>) -> Range<usize> {
        self.start[cells.start] as usize..self.start[cells.end] as usize
    }

    /// The ray of an azimuth, or of those next to it, that meets a surface nearest to its place,
    /// within a squared distance, voxels². `bands` are given by their first cells.
    #[inline(always)]
    fn nearest(
        &self,
        bands: RangeInclusive<usize>,
        azimuth: usize,
        surface: &SurfacePatch,
        within: f32,
    ) -> NearestRay {
        let (mut least, mut depth) = ([within; LANES], [f32::NAN; LANES]);
        let beside = beside(azimuth);
        for first in bands.step_by(AZIMUTHS) {
            for azimuths in beside.clone() {
                let rays = self.rays(first + azimuths.start..first + azimuths.end);
                let padded = rays.start..rays.start + rays.len().next_multiple_of(LANES);
                let [x, y, z] = self.end.each_ref().map(|of| of[padded.clone()].as_chunks().0);
                for (n, ((x, y), z)) in x.iter().zip(y).zip(z).enumerate() {
                    let left = rays.len() - n * LANES;
                    surface.meet([x, y, z], left, &mut least, &mut depth);
                }
            }
        }
        let mut nearest = NearestRay { squared_distance: within, depth: None };
        for (least, depth) in least.into_iter().zip(depth) {
            if least < nearest.squared_distance {
                nearest = NearestRay { squared_distance: least, depth: Some(depth) };
            }
        }
        nearest
    }
}

/// How many of every 2³² returns are kept if a sweep has this many.
fn share_kept(of: usize) -> u64 {
    ((SIGHTLINES_MAX as u64) << 32) / of.max(1) as u64
}

/// Whether a return is kept: steps of the golden ratio spread those evenly, however the source
/// orders them.
fn is_kept(n: usize, share: u64) -> bool {
    u64::from((n as u32).wrapping_mul(0x9E37_79B1)) < share
}

/// An azimuth and those next to it; at either end of the range one of them wraps around.
fn beside(azimuth: usize) -> [Range<usize>; 2] {
    const LAST: usize = AZIMUTHS - 1;
    match azimuth {
        0 => [0..2, LAST..AZIMUTHS],
        LAST => [LAST - 1..AZIMUTHS, 0..1],
        _ => [azimuth - 1..azimuth + 2, 0..0],
    }
}

/// The lowest and the highest slope of a ray that passes within `reach` of a place, relative to the
/// sensor.
fn slopes_within(reach: f32, [x, y, z]: [f32; 3]) -> [f32; 2] {
    let reach = reach + ROUNDING;
    let along = x.abs() + y.abs();
    let (near, far) =
        (along - core::f32::consts::SQRT_2 * reach, along + core::f32::consts::SQRT_2 * reach);
    if near <= 0.0 {
        return [-1.0, 1.0];
    }
    let (low, high) = (z - reach, z + reach);
    let low = slope([if low < 0.0 { near } else { far }, 0.0, low]);
    let high = slope([if high < 0.0 { far } else { near }, 0.0, high]);
    [low, high]
}

/// The ray that meets a surface nearest to its place.
struct NearestRay {
    /// Between the place and where it meets the surface, voxels²; until a ray is found, that of the
    /// farthest one that counts.
    squared_distance: f32,
    /// How far behind the surface it ended, voxels across it.
    depth: Option<f32>,
}

/// A surface through a place, seen from a sensor: oriented as the surrounding returns say, or
/// perpendicular to the line of sight if they say nothing.
struct SurfacePatch {
    /// The place, voxels from the sensor.
    at: [f32; 3],
    /// Unit normal, away from the sensor.
    across: [f32; 3],
    /// The sensor's distance from it, voxels.
    away: f32,
}

impl SurfacePatch {
    fn new(at: [f32; 3], weight: &SurfaceWeight) -> SurfacePatch {
        let across = weighed(weight, at);
        let across = across.map(|v| v / libm::sqrtf(dot(across, across)));
        SurfacePatch { at, across, away: dot(across, at) }
    }

    fn distance(&self) -> f32 {
        libm::sqrtf(dot(self.at, self.at))
    }

    /// Intersects `left` rays, steps from the sensor, with it: where one meets it nearer to the
    /// place than the squared distance so far, stores the distance and how far behind the ray ends.
    #[inline(always)]
    fn meet(
        &self,
        [x, y, z]: [&[i16; LANES]; 3],
        left: usize,
        least: &mut [f32; LANES],
        depth: &mut [f32; LANES],
    ) {
        for l in 0..LANES {
            let ray = [f32::from(x[l]), f32::from(y[l]), f32::from(z[l])];
            let goes = dot(self.across, ray);
            let share = self.away / goes;
            let off = [
                share * ray[0] - self.at[0],
                share * ray[1] - self.at[1],
                share * ray[2] - self.at[2],
            ];
            let squared = dot(off, off);
            let closer = (goes > 0.0) & (squared < least[l]) & (l < left);
            least[l] = if closer { squared } else { least[l] };
            depth[l] = if closer { goes * (1.0 / STEPS) - self.away } else { depth[l] };
        }
    }
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
