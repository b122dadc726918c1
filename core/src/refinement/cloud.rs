//! What clusters are made of and compared with: the returns of a sweep and its rays.

use super::cloud_detail::CloudDetail;
use super::places::{MomentSums, Moments, Nearest};
use super::sample::{CloudPoint, SurfaceWeight};
use super::scaled::Scaled;
use super::sightlines::{Sightlines, Unsorted, UnsortedRay};
use super::surface::{self, LazyWeight};
use super::sweep_returns::SweepReturns;
use super::thinned_returns::{ColumnSort, ThinnedReturns};
use crate::ground::GroundEstimator;
use crate::params::{CLUSTER_LEVELS_MAX, SIGHTLINES_MAX};
use crate::team::Team;
use core::ops::{Deref, Range};
use raywake_simd::{Simd, integer_part};

/// Scratch of [`Cloud::fill`].
pub struct Scratch {
    rays: Unsorted,
    ground: GroundEstimator,
    columns: ColumnSort,
}

impl Scratch {
    pub(super) const fn new() -> Scratch {
        Scratch {
            rays: [UnsortedRay::NONE; SIGHTLINES_MAX],
            ground: GroundEstimator::new(),
            columns: ColumnSort::new(),
        }
    }
}

/// Thinned returns of one sweep, in voxels from the window's corner, and its rays: what clusters of
/// another sweep are compared with.
pub struct Cloud {
    /// Columns along an axis of the window.
    pub side: usize,
    /// Lattice index of the window's first voxel.
    pub corner: [i32; 3],
    /// Time of the sweep, s.
    pub stamp_s: f64,
    /// The instruction set it is searched with.
    pub simd: Simd,
    thinned: ThinnedReturns,
    /// Its rays, including those that hit the ground.
    pub sightlines: Sightlines,
}

/// A cloud of one of the two sweeps of a pair.
#[derive(Clone, Copy)]
pub struct DetailedCloud<'a> {
    pub cloud: &'a Cloud,
    pub detail: &'a CloudDetail,
}

/// A place whose nearest return of a sensor is sought.
struct Sought {
    at: [f32; 3],
    sensor: u32,
    /// The column after the one it lies in.
    j: i32,
    /// How far it is from the lower edge of the column it lies in.
    in_column: f32,
}

impl Deref for DetailedCloud<'_> {
    type Target = Cloud;

    fn deref(&self) -> &Cloud {
        self.cloud
    }
}

impl DetailedCloud<'_> {
    /// Levels of a column in which something was hit, one bit each.
    pub fn levels(&self, column: usize) -> u32 {
        self.detail.levels[column]
    }

    /// Whether something was hit in the voxel that contains a place.
    pub fn is_hit(&self, at: [f32; 3]) -> bool {
        let Some(column) = self.column_at([at[0], at[1]]) else { return false };
        let height = self.detail.ground.above(column, at[2]);
        let in_levels = (0.0..CLUSTER_LEVELS_MAX as f32).contains(&height);
        in_levels && self.levels(column) >> height as u32 & 1 != 0
    }

    /// What the surrounding returns of the same sensor say about the surface a return lies on.
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
            thinned: ThinnedReturns::new(),
            sightlines: Sightlines::new(),
        }
    }

    /// Takes over a sweep. `apart` is set to whether each return is ground or above the height of
    /// clusters. Returns how many returns were dropped for lack of room: those of the last columns.
    pub(super) fn fill(
        &mut self,
        detail: &mut CloudDetail,
        team: &impl Team,
        scaled: &Scaled,
        returns: SweepReturns,
        apart: &mut [bool],
        scratch: &mut Scratch,
    ) -> usize {
        self.side = returns.profile.side as usize;
        self.simd = team.simd();
        (self.corner, self.stamp_s) = (returns.corner, returns.stamp_s);
        let (side, Scratch { rays, ground, columns }) = (self.side, scratch);
        let Cloud { thinned, sightlines, simd, .. } = self;
        let SweepReturns { points, placed, sensors, .. } = returns;
        let mut dropped = 0;
        let keep_returns = || {
            detail.find_ground(returns, ground);
            dropped = thinned.fill(detail, side, scaled, returns, apart, columns);
            detail.weights[..thinned.places.len()].fill_with(LazyWeight::unknown);
        };
        team.join(keep_returns, || sightlines.fill(sensors, points, placed, *simd, rays));
        dropped
    }

    /// The column of a place, if it lies in the window.
    pub fn column_at(&self, [x, y]: [f32; 2]) -> Option<usize> {
        let side = self.side as f32;
        let inside = x >= 0.0 && x < side && y >= 0.0 && y < side;
        inside.then(|| x as usize * self.side + y as usize)
    }

    /// All columns of the window.
    pub fn columns(&self) -> Range<usize> {
        0..self.side * self.side
    }

    /// The centre of a column, voxels.
    pub fn centre_of(&self, column: usize) -> [f32; 2] {
        [column / self.side, column % self.side].map(|c| c as f32 + 0.5)
    }

    /// Indices of the thinned returns in a column.
    pub fn column(&self, column: usize) -> Range<usize> {
        self.thinned.start[column] as usize..self.thinned.start[column + 1] as usize
    }

    /// Indices of the thinned returns in columns `j_from..j_to` of row `i`: they are contiguous.
    fn row(&self, i: usize, j_from: usize, j_to: usize) -> Range<usize> {
        let row = i * self.side;
        self.thinned.start[row + j_from] as usize..self.thinned.start[row + j_to] as usize
    }

    /// The nearest return of a sensor closer than `reach`, at most 1, to `at`, and its squared
    /// distance (voxels²). Ties are broken deterministically. The search may stop at the first
    /// return found within `enough`.
    pub fn nearest(&self, at: [f32; 3], sensor: u32, reach: [f32; 2]) -> Option<(f32, CloudPoint)> {
        let found = self.simd.run(
            #[inline(always)]
            move |_| self.find_nearest(at, sensor, reach),
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
        // A place up to one voxel outside the window still has neighbours inside. Signed, because
        // converting floats to unsigned integers and back takes several times as many instructions.
        let [x, y] = [at[0] + 1.0, at[1] + 1.0];
        let [i, j] = [x, y].map(integer_part);
        let (in_row, in_column) = (x - i as f32, y - j as f32);
        let sought = Sought { at, sensor, j, in_column };
        let mut nearest = Nearest::within(reach * reach);
        // Within reach: as long as nothing is found, nothing is near enough.
        let enough = enough.min(reach) * enough.min(reach);
        // The row it lies in first: what is found there often rules out the others.
        self.look_in_row(i - 1, 0.0, &sought, &mut nearest);
        if nearest.squared_distance() >= enough {
            self.look_in_row(i - 2, in_row, &sought, &mut nearest);
        }
        if nearest.squared_distance() >= enough {
            self.look_in_row(i, 1.0 - in_row, &sought, &mut nearest);
        }
        nearest.found()
    }

    /// Looks in a row, whose edge is `gap` away.
    #[inline(always)]
    fn look_in_row(&self, row: i32, gap: f32, sought: &Sought, nearest: &mut Nearest) {
        let (side, &Sought { at, sensor, j, in_column }) = (self.side as i32, sought);
        let least = nearest.squared_distance();
        if row < 0 || row >= side || gap * gap >= least {
            return;
        }
        let (j_from, j_to) = ((j - 2).max(0), (j + 1).min(side));
        // A column this far off cannot hold a nearer return.
        let left = gap * gap + in_column * in_column < least;
        let right = gap * gap + (1.0 - in_column) * (1.0 - in_column) < least;
        let from = if left { j_from } else { (j - 1).max(j_from) };
        let to = if right { j_to } else { j.min(j_to) };
        let [row, from, to] = [row, from, to.max(from)].map(|at| at as usize);
        self.thinned.places.look(self.row(row, from, to), at, sensor, nearest);
    }

    /// A return.
    pub fn sample(&self, n: usize) -> CloudPoint {
        let (sensor, offset_s) = self.thinned.places.seen(n);
        CloudPoint { at: self.thinned.places.at(n), sensor, offset_s, index: n as u32 }
    }

    fn sums_around(&self, n: usize, radius: f32) -> Moments {
        let (at, (sensor, _)) = (self.thinned.places.at(n), self.thinned.places.seen(n));
        let [i, j] = [at[0] as usize, at[1] as usize];
        let reach = radius as usize;
        let columns = j.saturating_sub(reach)..(j + reach + 1).min(self.side);
        self.simd.run(
            #[inline(always)]
            |_| {
                let mut sums = MomentSums::ZERO;
                for a in i.saturating_sub(reach)..(i + reach + 1).min(self.side) {
                    let row = self.row(a, columns.start, columns.end);
                    self.thinned.places.add_around(row, at, sensor, radius, &mut sums);
                }
                sums.total()
            },
        )
    }
}
