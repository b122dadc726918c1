//! The returns of a sweep that rise above the ground, thinned and sorted by column.

use super::places::{Nearest, Places};
use super::sample::{CloudPoint, SurfaceWeight};
use super::scaled::Scaled;
use super::sightlines::{Listed, Sightlines};
use super::surface::{self, LazyWeight};
use crate::frame::central;
use crate::ground::{GroundEstimator, GroundHeights};
use crate::params::{
    ANCHOR_ABOVE_GROUND_M, CLOUD_MAX, CLUSTER_LEVELS_MAX, COLUMNS_MAX, POINTS_MAX, Profile,
    SENSORS_MAX, SUBVOXELS_MAX,
};
use crate::record::NONE;
use crate::sensor_paths::SensorPaths;
use crate::sweep::Placed;
use crate::thinning::TakenPoints;
use core::ops::{Deref, Range};
use raywake_simd::Simd;

/// Words of a mask of the sub-voxels of a column.
const MASK_WORDS: usize =
    (SUBVOXELS_MAX * SUBVOXELS_MAX * SUBVOXELS_MAX * CLUSTER_LEVELS_MAX).div_ceil(32);

/// The returns of a sweep.
#[derive(Clone, Copy)]
pub struct SweepReturns<'a> {
    /// Lattice index of the window's first voxel.
    pub corner: [i32; 3],
    /// Time of the sweep, s.
    pub stamp_s: f64,
    pub points: TakenPoints<'a>,
    /// Their places in the window, voxels.
    pub placed: &'a [Placed],
    /// Their columns, or [`NONE`].
    pub columns: &'a [u32],
    pub sensors: &'a SensorPaths,
}

/// Scratch of [`Cloud::fill`]: indices of returns, as they come and by column, and where those of
/// each column end; of [`Sightlines`], as they come, and their directions.
pub struct Scratch {
    ground: GroundEstimator,
    listed: [u32; POINTS_MAX],
    order: [u32; POINTS_MAX],
    end: [u32; COLUMNS_MAX],
}

impl Scratch {
    pub(super) const fn new() -> Scratch {
        Scratch {
            ground: GroundEstimator::new(),
            listed: [0; POINTS_MAX],
            order: [0; POINTS_MAX],
            end: [0; COLUMNS_MAX],
        }
    }

    /// Lists the returns of clusters and adds them to the counts by column. `apart` becomes whether
    /// a return is of the ground, or higher than clusters are. Returns how many there are, and the
    /// sensors that saw them, a bit each.
    fn count(
        &mut self,
        ground: &GroundHeights,
        scaled: &Scaled,
        returns: SweepReturns,
        apart: &mut [bool],
    ) -> (usize, u32) {
        let SweepReturns { points, placed, columns, .. } = returns;
        let (mut count, mut sensors) = (0, 0u32);
        for (n, (&column, apart)) in columns.iter().zip(apart).enumerate() {
            *apart = false;
            if column == NONE {
                continue;
            }
            let height = ground.above(column as usize, placed[n].at[2]);
            *apart = !(scaled.ground_height..scaled.height_max).contains(&height);
            if (scaled.height_min..scaled.height_max).contains(&height) {
                self.end[column as usize] += 1;
                self.listed[count] = n as u32;
                sensors |= 1 << points.get(n).sensor;
                count += 1;
            }
        }
        (count, sensors)
    }

    /// A counting sort of `count` listed returns into so many columns, `column` of each, which
    /// keeps the source's order within a column.
    fn sort(&mut self, columns: usize, column: &[u32], count: usize) {
        let mut total = 0;
        for end in &mut self.end[..columns] {
            total += core::mem::replace(end, total);
        }
        for &n in &self.listed[..count] {
            let end = &mut self.end[column[n as usize] as usize];
            self.order[*end as usize] = n;
            *end += 1;
        }
    }
}

/// Thinned returns of one sweep, voxels from the window's corner, and its rays: what clusters of
/// another sweep are compared with.
pub struct Cloud {
    /// Columns along an axis of the window.
    pub side: usize,
    /// Lattice index of the window's first voxel.
    pub corner: [i32; 3],
    /// Time of the sweep, s.
    pub stamp_s: f64,
    /// The instructions it is searched with.
    pub simd: Simd,
    places: Places,
    /// Where the returns of each column begin, and those of the last one end.
    start: [u16; COLUMNS_MAX + 1],
    /// Its rays, those of the ground among them.
    pub sightlines: Sightlines,
}

const _: () = assert!(CLOUD_MAX <= u16::MAX as usize);

/// What is kept besides of the two sweeps of a pair.
pub struct CloudDetail {
    ground: GroundHeights,
    /// Levels above the ground of each column in which something was hit, a bit each.
    levels: [u32; COLUMNS_MAX],
    weights: [LazyWeight; CLOUD_MAX],
}

impl CloudDetail {
    pub(super) const fn new() -> CloudDetail {
        CloudDetail {
            ground: GroundHeights::new(),
            levels: [0; COLUMNS_MAX],
            weights: [const { LazyWeight::unknown() }; CLOUD_MAX],
        }
    }

    fn find_ground(
        &mut self,
        profile: &Profile,
        returns: SweepReturns,
        estimator: &mut GroundEstimator,
    ) {
        let middle = central(profile).map(|c| c as f32 + 0.5);
        let level = middle[2] - (ANCHOR_ABOVE_GROUND_M / profile.voxel_m) as f32;
        let found = returns.columns.iter().zip(returns.placed);
        let found = found.filter(|(column, _)| **column != NONE);
        let found = found.map(|(column, placed)| (*column as usize, placed.at));
        let under = [middle[0], middle[1], level];
        let (params, side) = (&profile.ground, profile.side as usize);
        estimator.estimate(params, profile.voxel_m, side, under, found, &mut self.ground);
    }
}

/// A cloud of one of the two sweeps of a pair.
#[derive(Clone, Copy)]
pub struct DetailedCloud<'a> {
    pub cloud: &'a Cloud,
    pub detail: &'a CloudDetail,
}

impl Deref for DetailedCloud<'_> {
    type Target = Cloud;

    fn deref(&self) -> &Cloud {
        self.cloud
    }
}

impl DetailedCloud<'_> {
    /// Levels of a column in which something was hit, a bit each.
    pub fn levels(&self, column: usize) -> u32 {
        self.detail.levels[column]
    }

    /// Whether something was hit in the voxel of a place.
    pub fn is_hit(&self, at: [f32; 3]) -> bool {
        let Some(column) = self.column_at([at[0], at[1]]) else { return false };
        let height = self.detail.ground.above(column, at[2]);
        let in_levels = (0.0..CLUSTER_LEVELS_MAX as f32).contains(&height);
        in_levels && self.levels(column) >> height as u32 & 1 != 0
    }

    /// What the returns of its sensor around a return tell about the surface it lies on.
    pub fn weight(&self, scaled: &Scaled, n: u32) -> SurfaceWeight {
        let around = |radius| self.sums_around(n as usize, radius);
        self.detail.weights[n as usize].get(|| surface::weight(scaled, around))
    }
}

impl Cloud {
    pub(super) const fn new() -> Cloud {
        Cloud {
            side: 0,
            corner: [0; 3],
            stamp_s: 0.0,
            simd: Simd::BASELINE,
            places: Places::new(),
            start: [0; COLUMNS_MAX + 1],
            sightlines: Sightlines::new(),
        }
    }

    /// Takes over a sweep. `apart` becomes whether a return is of the ground, or higher than
    /// clusters are. Returns how many returns were left out for want of room: those of the
    /// last columns.
    pub(super) fn fill(
        &mut self,
        detail: &mut CloudDetail,
        profile: &Profile,
        scaled: &Scaled,
        returns: SweepReturns,
        apart: &mut [bool],
        scratch: &mut Scratch,
    ) -> usize {
        self.side = profile.side as usize;
        (self.corner, self.stamp_s) = (returns.corner, returns.stamp_s);
        let SweepReturns { points, placed, sensors, .. } = returns;
        let listed = Listed { index: &mut scratch.listed, bin: &mut scratch.order };
        self.sightlines.fill(sensors, points, placed, listed);
        detail.find_ground(profile, returns, &mut scratch.ground);
        scratch.end[..self.side * self.side].fill(0);
        let (count, sensors) = scratch.count(&detail.ground, scaled, returns, apart);
        scratch.sort(self.side * self.side, returns.columns, count);
        let dropped = self.thin(detail, scaled.subvoxels, returns, scratch, sensors);
        detail.weights[..self.places.len()].fill_with(LazyWeight::unknown);
        dropped
    }

    /// Keeps of each sub-voxel the first return of each sensor. Returns how many had no room.
    fn thin(
        &mut self,
        detail: &mut CloudDetail,
        subvoxels: usize,
        returns: SweepReturns,
        sorted: &Scratch,
        sensors: u32,
    ) -> usize {
        // By column they are looked up far apart: only where there are several.
        let only = sensors.is_power_of_two().then(|| sensors.trailing_zeros());
        let sensor_of = |n: u32| only.unwrap_or_else(|| returns.points.get(n as usize).sensor);
        self.places.clear();
        let (mut from, mut dropped) = (0, 0);
        for (c, &end) in sorted.end[..self.side * self.side].iter().enumerate() {
            let listed = &sorted.order[from..end as usize];
            from = end as usize;
            self.start[c] = self.places.len() as u16;
            detail.levels[c] = 0;
            let sensors = listed.iter().fold(0u32, |s, n| s | 1 << sensor_of(*n));
            for sensor in (0..SENSORS_MAX as u32).filter(|s| sensors & 1 << s != 0) {
                let own = listed.iter().filter(|n| sensor_of(**n) == sensor);
                let own = own.map(|n| returns.placed[*n as usize]);
                dropped += self.thin_column(detail, subvoxels, [c, sensor as usize], own);
            }
        }
        self.start[self.side * self.side] = self.places.len() as u16;
        dropped
    }

    /// The same of one column and sensor.
    fn thin_column(
        &mut self,
        detail: &mut CloudDetail,
        subvoxels: usize,
        [column, sensor]: [usize; 2],
        returns: impl Iterator<Item = Placed>,
    ) -> usize {
        let corner = [(column / self.side) as f32, (column % self.side) as f32];
        let scale = subvoxels as f32;
        let mut taken = [0u32; MASK_WORDS];
        let mut dropped = 0;
        for Placed { at: p, offset_s } in returns {
            let part = |v: f32| (v * scale).clamp(0.0, scale - 1.0) as usize;
            let height = detail.ground.above(column, p[2]);
            let level = (height * scale) as usize;
            let bit =
                (level * subvoxels + part(p[0] - corner[0])) * subvoxels + part(p[1] - corner[1]);
            let word = &mut taken[(bit / 32).min(MASK_WORDS - 1)];
            if *word & 1 << (bit % 32) == 0 {
                *word |= 1 << (bit % 32);
                if self.places.push(p, sensor as u32, offset_s) {
                    detail.levels[column] |= 1 << height as u32;
                } else {
                    dropped += 1;
                }
            }
        }
        dropped
    }

    /// The column of a place, if that lies in the window.
    pub fn column_at(&self, [x, y]: [f32; 2]) -> Option<usize> {
        let side = self.side as f32;
        let inside = x >= 0.0 && x < side && y >= 0.0 && y < side;
        inside.then(|| x as usize * self.side + y as usize)
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

    /// The nearest return of a sensor closer than `reach` to `at`, 1 at most: its squared distance
    /// (voxels²) and itself; of several as near, always the same. The first one found within
    /// `enough` will do.
    pub fn nearest(&self, at: [f32; 3], sensor: u32, reach: [f32; 2]) -> Option<(f32, CloudPoint)> {
        let found = self.simd.run(
            #[inline(always)]
            move || self.find_nearest(at, sensor, reach),
        );
        found.map(|(d2, n)| (d2, self.sample(n)))
    }

    #[inline(always)]
    fn find_nearest(
        &self,
        at: [f32; 3],
        sensor: u32,
        [reach, enough]: [f32; 2],
    ) -> Option<(f32, usize)> {
        let side = self.side as f32;
        let near = |v: f32| v > -1.0 && v < side + 1.0;
        if !(near(at[0]) && near(at[1])) {
            return None;
        }
        // One beyond the window on either side would still have neighbours inside.
        let (i, j) = ((at[0] + 1.0) as usize, (at[1] + 1.0) as usize);
        let (j_from, j_to) = (j.saturating_sub(2), (j + 1).min(self.side));
        let mut nearest = Nearest::within(reach * reach);
        let mut least = reach * reach;
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
            self.places.look(row, at, sensor, &mut nearest);
            least = nearest.squared_distance();
            if least < enough * enough {
                break;
            }
        }
        nearest.found()
    }

    /// A return.
    pub fn sample(&self, n: usize) -> CloudPoint {
        let (sensor, offset_s) = self.places.seen(n);
        CloudPoint { at: self.places.at(n), sensor, offset_s, index: n as u32 }
    }

    fn sums_around(&self, n: usize, radius: f32) -> [f32; 10] {
        let (at, (sensor, _)) = (self.places.at(n), self.places.seen(n));
        let [i, j] = [at[0] as usize, at[1] as usize];
        let reach = radius as usize;
        let mut sums = [0.0; 10];
        for a in i.saturating_sub(reach)..(i + reach + 1).min(self.side) {
            let row = self.row(a, j.saturating_sub(reach), (j + reach + 1).min(self.side));
            self.places.add_around(row, at, sensor, radius, &mut sums);
        }
        sums
    }
}
