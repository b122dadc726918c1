//! The rays of a sweep by direction: whether what stands at a place would have been seen there.
//!
//! Rings of returns on a wall, a barrier or a bonnet move with the sensor. Where one was in the
//! sweep before there is none now, though what it lay on still stands: that no return is near tells
//! nothing there. A ray that passed tells: it went through, or ended where the surface is.
//!
//! As in registration by projection (Blais and Levine, "Registering multiview range data to create
//! 3D computer objects", PAMI 1995) a place is compared with what its direction shows, not with
//! what is near it in space.

use super::sample::{SurfaceWeight, minus, weighed};
use super::scaled::Scaled;
use crate::params::{SENSORS_MAX, SIGHTLINES_MAX};
use crate::return_clock::{TURN, pseudo_angle};
use crate::sensor_paths::SensorPaths;
use crate::sweep::Placed;
use crate::thinning::TakenPoints;
use core::ops::Range;
use raywake_simd::Simd;

/// Directions in the plane that are told apart, by [`pseudo_angle`]: of 0.2 to 0.5 degrees.
const AZIMUTHS: usize = 1024;
/// Steps of a sweep that the time of a ray is rounded to, 0.4 ms.
const PARTS: f32 = 255.0;
/// Steps of a voxel that ends of rays are rounded to, 5 mm.
const STEPS: f32 = 64.0;
/// Farther ends, voxels along an axis, are moved up along their ray: what a step's type holds.
const FAR: f32 = 500.0;
const _: () = assert!(FAR * STEPS <= i16::MAX as f32);
/// Times that the moment is sought at which a sensor looked in a direction: between two sweeps it
/// has moved, and with it the direction.
const ROUNDS: usize = 3;

/// Rays that are looked at together; the last ones with what lies behind them.
const LANES: usize = 8;

/// A direction of a sensor, sensors in order.
type Bin = usize;

/// Scratch of [`Sightlines::fill`]: the direction of every ray, as they come.
pub(super) type Directions = [u16; SIGHTLINES_MAX];
const _: () = assert!(SENSORS_MAX * AZIMUTHS <= u16::MAX as usize + 1);

/// The rays of one sweep, thinned evenly to the capacity.
pub struct Sightlines {
    paths: SensorPaths,
    /// Where the rays of a direction begin, and those of the last one end.
    start: [u32; SENSORS_MAX * AZIMUTHS + 1],
    /// Their ends by axis, steps from the sensor.
    end: [[i16; SIGHTLINES_MAX + LANES]; 3],
    /// The part of the sweep that had passed, of [`PARTS`].
    part: [u8; SIGHTLINES_MAX],
}

impl Sightlines {
    pub const fn new() -> Sightlines {
        Sightlines {
            paths: SensorPaths::NOWHERE,
            start: [0; SENSORS_MAX * AZIMUTHS + 1],
            end: [[0; SIGHTLINES_MAX + LANES]; 3],
            part: [0; SIGHTLINES_MAX],
        }
    }

    /// Takes over the rays of a sweep.
    pub(super) fn fill(
        &mut self,
        paths: &SensorPaths,
        points: TakenPoints,
        placed: &[Placed],
        directions: &mut Directions,
    ) {
        self.paths = *paths;
        self.start.fill(0);
        let share = share_kept(placed.len());
        let kept = || {
            let rays = placed.iter().enumerate();
            rays.filter(|(n, placed)| is_kept(*n, share) && placed.at[0].is_finite())
        };
        let mut count = 0;
        for ((n, placed), direction) in kept().zip(directions.iter_mut()) {
            let sensor = points.get(n).sensor as usize;
            let eye = paths.at(sensor, paths.part(placed.offset_s));
            let bin = bin(sensor, minus(placed.at, eye));
            *direction = bin as u16;
            self.start[bin + 1] += 1;
            count += 1;
        }
        // Behind each direction its start, which becomes its end, where the next one starts.
        let mut total = 0;
        for start in &mut self.start[1..] {
            total += core::mem::replace(start, total);
        }
        for ((_, placed), bin) in kept().zip(&directions[..count]) {
            let bin = usize::from(*bin);
            let to = self.start[bin + 1] as usize;
            self.start[bin + 1] += 1;
            self.keep(to, bin, placed);
        }
    }

    /// Keeps a ray.
    fn keep(&mut self, to: usize, bin: Bin, placed: &Placed) {
        let part = self.paths.part(placed.offset_s);
        let ray = minus(placed.at, self.paths.at(bin / AZIMUTHS, part));
        let farthest = ray.iter().fold(0.0f32, |most, v| most.max(v.abs()));
        let scale = STEPS * (FAR / farthest).min(1.0);
        for (end, v) in self.end.iter_mut().zip(ray) {
            end[to] = (v * scale) as i16;
        }
        self.part[to] = (part * PARTS) as u8;
    }

    /// How far behind a place of a surface, voxels across it, the ray ended that met the surface
    /// nearest to there: nothing where none came near. `offset_s` is when the place is thought to
    /// be seen, s after the stamp.
    pub fn depth(
        &self,
        simd: Simd,
        scaled: &Scaled,
        at: [f32; 3],
        weight: &SurfaceWeight,
        offset_s: f32,
    ) -> Option<f32> {
        let mut nearest = NearestRay { squared_distance: f32::INFINITY, depth: None };
        for sensor in 0..SENSORS_MAX {
            if self.rays(sensor * AZIMUTHS..(sensor + 1) * AZIMUTHS).is_empty() {
                continue;
            }
            let (eye, bin) = self.eye(sensor, at, offset_s);
            let surface = SurfacePatch::new(minus(at, eye), weight);
            let reach = scaled.sight_reach(surface.distance());
            let within = nearest.squared_distance.min(reach * reach);
            let found = simd.run(
                #[inline(always)]
                || self.nearest(bin, &surface, within),
            );
            nearest = if found.depth.is_some() { found } else { nearest };
        }
        nearest.depth
    }

    /// Where a sensor was as it looked at a place, and the direction of that.
    fn eye(&self, sensor: usize, at: [f32; 3], offset_s: f32) -> ([f32; 3], Bin) {
        let look = |part: f32| {
            let eye = self.paths.at(sensor, part);
            (eye, bin(sensor, minus(at, eye)))
        };
        let (mut eye, mut direction) = look(self.paths.part(offset_s));
        for _ in 0..ROUNDS {
            let Some(first) = self.rays(direction..direction + 1).next() else { break };
            (eye, direction) = look(f32::from(self.part[first]) / PARTS);
        }
        (eye, direction)
    }

    /// Indices of the rays of some directions.
    fn rays(&self, bins: Range<Bin>) -> Range<usize> {
        self.start[bins.start] as usize..self.start[bins.end] as usize
    }

    /// The ray of a direction, or of those beside it, that meets a surface nearest to its place,
    /// within a squared distance, voxels².
    #[inline(always)]
    fn nearest(&self, bin: Bin, surface: &SurfacePatch, within: f32) -> NearestRay {
        let (mut least, mut depth) = ([within; LANES], [f32::NAN; LANES]);
        for bins in beside(bin) {
            let rays = self.rays(bins);
            let padded = rays.start..rays.start + rays.len().next_multiple_of(LANES);
            let [x, y, z] = self.end.each_ref().map(|of| of[padded.clone()].as_chunks().0);
            for (n, ((x, y), z)) in x.iter().zip(y).zip(z).enumerate() {
                let left = rays.len() - n * LANES;
                surface.meet([x, y, z], left, &mut least, &mut depth);
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

/// How many of 2³² returns are kept where a sweep has so many.
fn share_kept(of: usize) -> u64 {
    ((SIGHTLINES_MAX as u64) << 32) / of.max(1) as u64
}

/// Whether a return is among those kept: in steps of the golden ratio they are spread evenly,
/// however the source orders them.
fn is_kept(n: usize, share: u64) -> bool {
    u64::from((n as u32).wrapping_mul(0x9E37_79B1)) < share
}

fn bin(sensor: usize, [x, y, _]: [f32; 3]) -> Bin {
    let azimuth = (pseudo_angle(x, y) * (AZIMUTHS as f32 / TURN)) as usize;
    sensor * AZIMUTHS + azimuth.min(AZIMUTHS - 1)
}

/// A direction and those beside it: of the first and the last of a sensor one lies apart.
fn beside(bin: Bin) -> [Range<Bin>; 2] {
    let (first, last) = (bin - bin % AZIMUTHS, bin - bin % AZIMUTHS + AZIMUTHS - 1);
    match bin {
        _ if bin == first => [first..first + 2, last..last + 1],
        _ if bin == last => [last - 1..last + 1, first..first + 1],
        _ => [bin - 1..bin + 2, bin..bin],
    }
}

/// The ray that meets a surface nearest to its place.
struct NearestRay {
    /// Between the two, voxels²; before there is one, of the farthest that counts.
    squared_distance: f32,
    /// How far behind the surface it ended, voxels across it.
    depth: Option<f32>,
}

/// A surface through a place, seen from a sensor: across it where the returns around tell, across
/// the line of sight where they do not.
struct SurfacePatch {
    /// The place, voxels from the sensor.
    at: [f32; 3],
    /// Unit vector across, away from the sensor.
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

    /// Where each of `left` rays, steps from the sensor, meets it: takes those nearer to the place
    /// than the squared distance so far, and how far behind they end.
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
