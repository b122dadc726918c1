//! Finds which returns belong to objects: by the variance of z in 2-D cells, and by their height.

use super::batch::{Batch, BatchReturn};
use super::{CELL_M, CELLS, FrontEndParams, SIDE};
use raywake_core::ground::{GroundEstimator, GroundHeights};
use raywake_core::params::{GroundParams, POINTS_MAX};

/// Ground in cells of five columns.
const GROUND: GroundParams =
    GroundParams { ground_cell_m: 2.0, ground_drop_m: 0.6, ..GroundParams::DEFAULT };

/// Heights of the ground on a grid of square cells, computed in advance.
#[derive(Clone, Copy, Debug)]
pub struct GroundMap<'a> {
    /// World position of the corner of the first cell, m.
    pub corner: [f64; 2],
    /// Edge of a cell, m.
    pub cell_m: f64,
    /// Number of cells along x; along y, as many as there are heights for.
    pub columns: usize,
    /// Heights in the world, m, row after row of equal y; NaN where unknown.
    pub heights: &'a [f32],
}

impl GroundMap<'_> {
    /// Height of the ground at a point, m, if known.
    pub fn height(&self, x: f64, y: f64) -> Option<f32> {
        let [i, j] = [(x - self.corner[0]) / self.cell_m, (y - self.corner[1]) / self.cell_m];
        if !(i >= 0.0 && i < self.columns as f64 && j >= 0.0) {
            return None;
        }
        let row = (j as usize).checked_mul(self.columns)?;
        let height = self.heights.get(row.checked_add(i as usize)?)?;
        height.is_finite().then_some(*height)
    }
}

/// Count, mean (m) and sum of squared deviations (m²) of z (Welford).
#[derive(Clone, Copy)]
struct HeightVariance {
    count: f32,
    mean: f32,
    squares: f32,
}

impl HeightVariance {
    const NONE: HeightVariance = HeightVariance { count: 0.0, mean: 0.0, squares: 0.0 };

    fn add(&mut self, z: f32) {
        let off = z - self.mean;
        self.count += 1.0;
        self.mean += off / self.count;
        self.squares += off * (z - self.mean);
    }
}

pub(super) struct ObjectReturns {
    estimator: GroundEstimator,
    ground: GroundHeights,
    /// Height of the ground above the batch's corner, m; infinite where unknown.
    height: [f32; CELLS],
    variance: [HeightVariance; CELLS],
    is_object: [bool; POINTS_MAX],
}

impl ObjectReturns {
    pub const fn new() -> ObjectReturns {
        ObjectReturns {
            estimator: GroundEstimator::new(),
            ground: GroundHeights::new(),
            height: [0.0; CELLS],
            variance: [HeightVariance::NONE; CELLS],
            is_object: [false; POINTS_MAX],
        }
    }

    /// Finds the returns of objects: those in cells whose z varies and those well above the ground.
    /// What moves according to the flow belongs to an object in any cell. Ground and overhead
    /// returns belong to none, where the ground is known.
    pub fn find(&mut self, params: &FrontEndParams, batch: &Batch, map: Option<&GroundMap>) {
        self.find_ground(batch, map);
        self.variance.fill(HeightVariance::NONE);
        for one in &batch.returns {
            let cell = one.cell as usize;
            if self.above(cell, one).is_none_or(|h| h < params.overhead_m) {
                self.variance[cell].add(one.position[2]);
            }
        }
        for (n, one) in batch.returns.iter().enumerate() {
            let cell = one.cell as usize;
            let HeightVariance { count, squares, .. } = self.variance[cell];
            let varies = squares > params.variance_m2 * count;
            let is_object = varies || params.is_moving(one.velocity);
            self.is_object[n] = match self.above(cell, one) {
                None => is_object,
                Some(h) if (params.ground_clearance_m..params.overhead_m).contains(&h) => {
                    is_object || h >= params.object_height_m
                }
                Some(_) => false,
            };
        }
    }

    /// Whether a return of the batch belongs to an object.
    pub fn contain(&self, n: usize) -> bool {
        self.is_object[n]
    }

    fn find_ground(&mut self, batch: &Batch, map: Option<&GroundMap>) {
        let cells = batch.returns.iter().map(|r| (r.cell as usize, r.position.map(|v| v / CELL_M)));
        let middle = 0.5 * SIDE as f32;
        let under = [middle, middle, 0.0];
        let ground = &mut self.ground;
        self.estimator.estimate(&GROUND, f64::from(CELL_M), SIDE, under, cells, ground);
        for cell in 0..CELLS {
            let centre = |n: usize| (n as f64 + 0.5) * CELL_M as f64;
            let at = [batch.corner.x + centre(cell / SIDE), batch.corner.y + centre(cell % SIDE)];
            let mapped = map.and_then(|m| m.height(at[0], at[1]));
            self.height[cell] = match mapped {
                Some(z) => (z as f64 - batch.corner.z) as f32,
                None => self.ground.height(cell) * CELL_M,
            };
        }
    }

    /// Height above the ground, m, if that is known.
    fn above(&self, cell: usize, one: &BatchReturn) -> Option<f32> {
        let ground = self.height[cell];
        ground.is_finite().then(|| one.position[2] - ground)
    }
}
