//! The returns of a sweep above the ground, sorted by column, then thinned.

use super::cloud_detail::CloudDetail;
use super::places::Places;
use super::scaled::Scaled;
use super::sweep_returns::SweepReturns;
use crate::ground::GroundHeights;
use crate::params::{
    CLOUD_MAX, CLUSTER_LEVELS_MAX, COLUMNS_MAX, POINTS_MAX, SENSORS_MAX, SUBVOXELS_MAX,
};
use crate::record::NONE;
use crate::sweep::Placed;
use raywake_simd::integer_part;

/// Words in a mask of the sub-voxels of a column.
const MASK_WORDS: usize =
    (SUBVOXELS_MAX * SUBVOXELS_MAX * SUBVOXELS_MAX * CLUSTER_LEVELS_MAX).div_ceil(32);

/// Scratch: indices of returns, in source order and by column, and where those of a column end.
pub struct ColumnSort {
    listed: [u32; POINTS_MAX],
    order: [u32; POINTS_MAX],
    end: [u32; COLUMNS_MAX],
}

/// Thinned returns by column, voxels from the window's corner.
pub struct ThinnedReturns {
    pub places: Places,
    /// Where those of each column begin, and where those of the last one end.
    pub start: [u16; COLUMNS_MAX + 1],
}

const _: () = assert!(CLOUD_MAX <= u16::MAX as usize);

/// What is thinned, and how.
#[derive(Clone, Copy)]
struct ThinningSource<'a> {
    side: usize,
    subvoxels: usize,
    returns: SweepReturns<'a>,
    /// The sensors that saw any, one bit each.
    sensors: u32,
}

impl ColumnSort {
    pub const fn new() -> ColumnSort {
        ColumnSort { listed: [0; POINTS_MAX], order: [0; POINTS_MAX], end: [0; COLUMNS_MAX] }
    }

    /// Lists the returns that may be part of clusters and adds them to the counts by column.
    /// `apart` is set to whether each return is ground or above the height of clusters. Returns how
    /// many were listed, and the sensors that saw them, one bit each.
    fn count(
        &mut self,
        ground: &GroundHeights,
        scaled: &Scaled,
        returns: SweepReturns,
        apart: &mut [bool],
    ) -> (usize, u32) {
        let SweepReturns { points, placed, columns, sensors: paths, .. } = returns;
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
                sensors |= 1 << paths.sensor_of(points, n);
                count += 1;
            }
        }
        (count, sensors)
    }

    /// Counting sort of the `count` listed returns into `columns` columns, by the `column` of each;
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

impl ThinnedReturns {
    pub const fn new() -> ThinnedReturns {
        ThinnedReturns { places: Places::new(), start: [0; COLUMNS_MAX + 1] }
    }

    /// Takes over the returns of a sweep above the ground found in `detail`. `apart` is set to
    /// whether each return is ground or above the height of clusters. Returns how many had no room:
    /// those of the last columns.
    pub fn fill(
        &mut self,
        detail: &mut CloudDetail,
        side: usize,
        scaled: &Scaled,
        returns: SweepReturns,
        apart: &mut [bool],
        columns: &mut ColumnSort,
    ) -> usize {
        columns.end[..side * side].fill(0);
        let (count, sensors) = columns.count(&detail.ground, scaled, returns, apart);
        columns.sort(side * side, returns.columns, count);
        let source = ThinningSource { side, subvoxels: scaled.subvoxels, returns, sensors };
        self.thin(detail, source, columns)
    }

    /// Keeps the first return of each sensor in each sub-voxel. Returns how many had no room.
    fn thin(
        &mut self,
        detail: &mut CloudDetail,
        source: ThinningSource,
        sorted: &ColumnSort,
    ) -> usize {
        let ThinningSource { side, returns, sensors, .. } = source;
        // In column order these look-ups are scattered: only done if there are several sensors.
        let only = sensors.is_power_of_two().then(|| sensors.trailing_zeros());
        let sensor_of =
            |n: u32| only.unwrap_or_else(|| returns.sensors.sensor_of(returns.points, n as usize));
        self.places.clear();
        let (mut from, mut dropped) = (0, 0);
        for (c, &end) in sorted.end[..side * side].iter().enumerate() {
            let listed = &sorted.order[from..end as usize];
            from = end as usize;
            self.start[c] = self.places.len() as u16;
            detail.levels[c] = 0;
            let sensors = listed.iter().fold(0u32, |s, n| s | 1 << sensor_of(*n));
            for sensor in (0..SENSORS_MAX as u32).filter(|s| sensors & 1 << s != 0) {
                let own = listed.iter().filter(|n| sensor_of(**n) == sensor);
                let own = own.map(|n| returns.placed[*n as usize]);
                dropped += self.thin_column(detail, source, [c, sensor as usize], own);
            }
        }
        self.start[side * side] = self.places.len() as u16;
        dropped
    }

    /// The same for one column and sensor.
    fn thin_column(
        &mut self,
        detail: &mut CloudDetail,
        ThinningSource { side, subvoxels, .. }: ThinningSource,
        [column, sensor]: [usize; 2],
        returns: impl Iterator<Item = Placed>,
    ) -> usize {
        let corner = [(column / side) as f32, (column % side) as f32];
        let scale = subvoxels as f32;
        let mut taken = [0u32; MASK_WORDS];
        let mut dropped = 0;
        for Placed { at: p, offset_s } in returns {
            let part = |v: f32| integer_part((v * scale).clamp(0.0, scale - 1.0)).max(0) as usize;
            let height = detail.ground.above(column, p[2]);
            let level = integer_part(height * scale).max(0) as usize;
            let bit =
                (level * subvoxels + part(p[0] - corner[0])) * subvoxels + part(p[1] - corner[1]);
            let word = &mut taken[(bit / 32).min(MASK_WORDS - 1)];
            if *word & 1 << (bit % 32) == 0 {
                *word |= 1 << (bit % 32);
                if self.places.push(p, sensor as u32, offset_s) {
                    detail.levels[column] |= 1 << integer_part(height).max(0);
                } else {
                    dropped += 1;
                }
            }
        }
        dropped
    }
}
