//! The returns of a sweep that rise above the ground, thinned and sorted by column.

use super::align::{NOISE, Sample, Weight};
use super::places::Places;
use crate::ground::Ground;
use crate::params::{
    ANCHOR_ABOVE_GROUND_M, CLOUD_MAX, COLUMNS_MAX, LEVELS_MAX, POINTS_MAX, Profile,
};
use crate::prepare::{Placed, central};
use crate::record::NONE;
use crate::sweep::{Point, SENSORS_MAX};
use core::ops::Range;
use core::sync::atomic::AtomicU32;
use core::sync::atomic::Ordering::{Acquire, Relaxed, Release};
use nalgebra::Matrix3;

/// Returns higher above the ground than this belong to things, voxels.
pub const GROUND_HEIGHT: f32 = 0.6;
/// Returns lower than this above the ground belong to it in any column, voxels.
const GROUND_RETURN: f32 = 0.35;
/// Returns from this height on belong to no thing, voxels: 4.2 m at 0.30 m.
const THING_HEIGHT: f32 = 14.0;
/// Returns so near tell which way the surface faces, voxels; and so near where those lie on a line, as
/// of one ring on a hood: a line would hold a thing across the surface and along it.
const AROUND: [f32; 2] = [1.5, 2.5];
/// Variance across a line, voxels².
const LINE: f32 = 0.05;
/// Sub-voxels along an axis, of which each keeps one return: 10 cm at 0.30 m.
const THINNED: f32 = 3.0;
/// Words of a mask of the sub-voxels of a column: 3 x 3 x 3 x 16.
const MASK_WORDS: usize = (3 * 3 * 3 * LEVELS_MAX).div_ceil(32);

/// Scratch of [`Cloud::fill`]: returns above the ground, as they come and by column.
pub struct Scratch {
    listed: [u32; POINTS_MAX],
    order: [u32; POINTS_MAX],
}

impl Scratch {
    pub(super) const fn new() -> Scratch {
        Scratch { listed: [0; POINTS_MAX], order: [0; POINTS_MAX] }
    }
}

/// Bits of a weight, all zero until it is asked for: that takes no room in a program. Threads that ask
/// at the same time find the same.
struct Memo([AtomicU32; 6]);

impl Memo {
    const fn unknown() -> Memo {
        Memo([const { AtomicU32::new(0) }; 6])
    }

    /// The weight, or what `find` says it is.
    fn get(&self, find: impl FnOnce() -> Weight) -> Weight {
        // That of a known weight is positive. It is written last and read first.
        let [first, rest @ ..] = &self.0;
        let known = first.load(Acquire);
        if known != 0 {
            let [a, b, c, d, e] = rest.each_ref().map(|bits| bits.load(Relaxed));
            return [known, a, b, c, d, e].map(f32::from_bits);
        }
        let weight = find();
        let [known, more @ ..] = weight.map(f32::to_bits);
        rest.iter().zip(more).for_each(|(to, bits)| to.store(bits, Relaxed));
        first.store(known, Release);
        weight
    }
}

/// Thinned returns of one sweep, voxels from the window's corner.
pub struct Cloud {
    /// Columns along an axis of the window.
    pub side: usize,
    /// Lattice index of the window's first voxel.
    pub corner: [i32; 3],
    /// Time of the sweep, s.
    pub stamp_s: f64,
    ground: Ground,
    places: Places,
    /// When each was, s after the sweep's stamp: seldom asked for.
    offset_s: [f32; CLOUD_MAX],
    start: [u32; COLUMNS_MAX + 1],
    /// What each return tells of its surface, once asked for: the upper half of a symmetric matrix.
    weights: [Memo; CLOUD_MAX],
    /// Levels above the ground of each column in which something was hit, a bit each.
    levels: [u16; COLUMNS_MAX],
}

impl Cloud {
    pub(super) const fn new() -> Cloud {
        Cloud {
            side: 0,
            corner: [0; 3],
            stamp_s: 0.0,
            ground: Ground::new(),
            places: Places::new(),
            offset_s: [0.0; CLOUD_MAX],
            start: [0; COLUMNS_MAX + 1],
            weights: [const { Memo::unknown() }; CLOUD_MAX],
            levels: [0; COLUMNS_MAX],
        }
    }

    /// Takes over a sweep. `apart` becomes whether a return is of the ground, or higher than things
    /// are. Returns how many returns were left out for want of room: those of the last columns.
    pub(super) fn fill(
        &mut self,
        profile: &Profile,
        points: &[Point],
        placed: &[Placed],
        columns: &[u32],
        apart: &mut [bool],
        scratch: &mut Scratch,
    ) -> usize {
        let side = profile.side as usize;
        self.side = side;
        let middle = central(profile).map(|c| c as f32 + 0.5);
        let level = middle[2] - (ANCHOR_ABOVE_GROUND_M / profile.voxel_m) as f32;
        let found = columns.iter().zip(placed).filter(|(column, _)| **column != NONE);
        let found = found.map(|(column, placed)| (*column as usize, placed.at));
        self.ground.estimate(side, [middle[0], middle[1], level], found);
        let ground = &self.ground;
        let height = |n: usize| ground.above(columns[n] as usize, placed[n].at[2]);
        // A counting sort keeps the source's order within a column.
        let columns_used = side * side;
        let start = &mut self.start[..columns_used + 1];
        start.fill(0);
        let Scratch { listed, order } = scratch;
        let (mut count, mut all_sensors) = (0, 0u32);
        for (n, (&column, apart)) in columns.iter().zip(apart).enumerate() {
            *apart = false;
            if column == NONE {
                continue;
            }
            let height = height(n);
            *apart = !(GROUND_RETURN..THING_HEIGHT).contains(&height);
            if (GROUND_HEIGHT..THING_HEIGHT).contains(&height) {
                start[column as usize + 1] += 1;
                listed[count] = n as u32;
                all_sensors |= 1 << points[n].sensor;
                count += 1;
            }
        }
        for c in 0..columns_used {
            start[c + 1] += start[c];
        }
        for &n in &listed[..count] {
            let at = &mut start[columns[n as usize] as usize];
            order[*at as usize] = n;
            *at += 1;
        }
        // By column they are looked up far apart: only where there are several.
        let only = all_sensors.is_power_of_two().then(|| all_sensors.trailing_zeros());
        let sensor_of = |n: u32| only.unwrap_or_else(|| points[n as usize].sensor);
        // Each start has become its end; what is kept is written from the front again.
        self.places.clear();
        let (mut from, mut dropped) = (0, 0);
        for (c, end) in start[..columns_used].iter_mut().enumerate() {
            let listed = &order[from..*end as usize];
            from = *end as usize;
            *end = self.places.len() as u32;
            self.levels[c] = 0;
            let corner = [(c / side) as f32, (c % side) as f32];
            let sensors = listed.iter().fold(0u32, |s, n| s | 1 << sensor_of(*n));
            for sensor in (0..SENSORS_MAX as u32).filter(|s| sensors & 1 << s != 0) {
                let mut taken = [0u32; MASK_WORDS];
                for &n in listed {
                    if sensor_of(n) != sensor {
                        continue;
                    }
                    let Placed { at: p, offset_s } = placed[n as usize];
                    let part = |v: f32| (v * THINNED).clamp(0.0, THINNED - 1.0) as usize;
                    let level = (height(n as usize) * THINNED) as usize;
                    let bit = (level * 3 + part(p[0] - corner[0])) * 3 + part(p[1] - corner[1]);
                    let word = &mut taken[(bit / 32).min(MASK_WORDS - 1)];
                    if *word & 1 << (bit % 32) == 0 {
                        *word |= 1 << (bit % 32);
                        let kept = self.places.len();
                        if self.places.push(p, sensor) {
                            self.offset_s[kept] = offset_s;
                            self.levels[c] |= 1 << height(n as usize) as u32;
                        } else {
                            dropped += 1;
                        }
                    }
                }
            }
        }
        start[columns_used] = self.places.len() as u32;
        self.weights[..self.places.len()].fill_with(Memo::unknown);
        dropped
    }

    /// Levels of a column in which something was hit, a bit each.
    pub fn levels(&self, column: usize) -> u16 {
        self.levels[column]
    }

    /// Whether something was hit in the voxel of a place.
    pub fn is_hit(&self, at: [f32; 3]) -> bool {
        let side = self.side as f32;
        let inside = at[0] >= 0.0 && at[0] < side && at[1] >= 0.0 && at[1] < side;
        if !inside {
            return false;
        }
        let column = at[0] as usize * self.side + at[1] as usize;
        let height = self.ground.above(column, at[2]);
        (0.0..LEVELS_MAX as f32).contains(&height) && self.levels[column] >> height as u32 & 1 != 0
    }

    /// Indices of the thinned returns in a column.
    pub fn column(&self, column: usize) -> Range<usize> {
        self.start[column] as usize..self.start[column + 1] as usize
    }

    /// Indices of the thinned returns in columns `j_from..j_to` of row `i`: they lie side by side.
    fn row(&self, i: usize, j_from: usize, j_to: usize) -> Range<usize> {
        let row = i * self.side;
        self.start[row + j_from] as usize..self.start[row + j_to] as usize
    }

    /// The nearest return of a sensor closer than a voxel's edge to `at`: its squared distance
    /// (voxels²) and itself; of two as near one, always the same. One closer than `enough` will do.
    pub fn nearest(&self, at: [f32; 3], sensor: u32, enough: f32) -> Option<(f32, Sample)> {
        let side = self.side as f32;
        let near = |v: f32| v > -1.0 && v < side + 1.0;
        if !(near(at[0]) && near(at[1])) {
            return None;
        }
        // One beyond the window on either side would still have neighbours inside.
        let (i, j) = ((at[0] + 1.0) as usize, (at[1] + 1.0) as usize);
        let (j_from, j_to) = (j.saturating_sub(2), (j + 1).min(self.side));
        let (mut least, mut best) = (1.0, None);
        let (in_row, in_column) = (at[0] + 1.0 - i as f32, at[1] + 1.0 - j as f32);
        // The row it lies in first: what is found there often excludes the others.
        for (row, gap) in [(i, 0.0), (i.wrapping_sub(1), in_row), (i + 1, 1.0 - in_row)] {
            let row = row.wrapping_sub(1);
            if row >= self.side || gap * gap >= least {
                continue;
            }
            // In a column so far off nothing can be nearer.
            let left = gap * gap + in_column * in_column < least;
            let right = gap * gap + (1.0 - in_column) * (1.0 - in_column) < least;
            let from = if left { j_from } else { j.saturating_sub(1).max(j_from) };
            let to = if right { j_to } else { j.min(j_to) };
            let row = self.row(row, from, to.max(from));
            if let Some((d2, n)) = self.places.nearest(row, at, sensor, least) {
                (least, best) = (d2, Some(n));
                if d2 < enough * enough {
                    break;
                }
            }
        }
        best.map(|n| (least, self.sample(n)))
    }

    /// A return.
    pub fn sample(&self, n: usize) -> Sample {
        let (at, sensor) = (self.places.at(n), self.places.sensor(n));
        Sample { at, sensor, offset_s: self.offset_s[n], index: n as u32 }
    }

    /// What the returns around a return tell about the surface it lies on.
    pub fn weight(&self, n: u32) -> Weight {
        let n = n as usize;
        self.weights[n].get(|| self.surface(self.places.at(n), self.places.sensor(n)))
    }

    /// Inverse covariance of the returns around a place and of their noise, relative to the noise's.
    fn surface(&self, at: [f32; 3], sensor: u32) -> Weight {
        let mut spread = self.spread(at, sensor, AROUND[0]);
        if across(&spread) < LINE {
            spread = self.spread(at, sensor, AROUND[1]);
        }
        // Positive definite by the noise.
        let noise = Matrix3::from_diagonal_element(NOISE * NOISE);
        let w = (spread + noise).try_inverse().unwrap_or_default() * (NOISE * NOISE);
        [w[(0, 0)], w[(0, 1)], w[(0, 2)], w[(1, 1)], w[(1, 2)], w[(2, 2)]]
    }

    /// Covariance of the returns of a sensor around a place, voxels².
    fn spread(&self, at: [f32; 3], sensor: u32, radius: f32) -> Matrix3<f32> {
        let [i, j] = [at[0] as usize, at[1] as usize];
        let reach = radius as usize;
        let mut sums = [0.0; 10];
        for a in i.saturating_sub(reach)..(i + reach + 1).min(self.side) {
            let row = self.row(a, j.saturating_sub(reach), (j + reach + 1).min(self.side));
            self.places.add_around(row, at, sensor, radius, &mut sums);
        }
        let [n, x, y, z, square @ ..] = sums;
        let [x, y, z] = [x, y, z].map(|m| m / n);
        let products = [x * x, x * y, x * z, y * y, y * z, z * z];
        let [xx, xy, xz, yy, yz, zz] = core::array::from_fn(|k| square[k] / n - products[k]);
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }
}

/// Variance across the longest direction, voxels²: the middle eigenvalue where the least is small.
fn across(spread: &Matrix3<f32>) -> f32 {
    let minor =
        |a: usize, b: usize| spread[(a, a)] * spread[(b, b)] - spread[(a, b)] * spread[(b, a)];
    let trace = spread.trace();
    if trace > 0.0 { (minor(0, 1) + minor(0, 2) + minor(1, 2)) / trace } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_told_from_a_surface() {
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -0.7, 1.1);
        let turned = |variances: [f32; 3]| {
            let spread = Matrix3::from_diagonal(&variances.into());
            across(&(turn * spread * turn.inverse()))
        };
        // One ring with its noise, two rings 0.3 m apart, a single return.
        assert!(turned([0.5, 0.005, 0.005]) < LINE);
        assert!(turned([0.5, 0.25, 0.005]) > LINE);
        assert!(turned([0.0; 3]) < LINE);
    }
}
