//! Height of the ground under a window of square columns, from the returns in it.
//!
//! The third-lowest return of each cell, or of its neighbours where the ground descends that way:
//! returns mirrored by glass or puddles come from below, but seldom together. Whatever rises from
//! there, such as a bank or a kerb, is climbed column by column, as long as it is thin and no
//! steeper than ground can be.
//!
//! Parameters are in metres; positions and heights are in the caller's unit, the edge of a column.

use crate::column_set::ColumnSet;
use crate::neighbours::columns_near;
use crate::params::{COLUMNS_MAX, GroundParams, SIDE_MAX};
use core::ops::Range;

/// Minimum number of columns along an edge of a cell: bounds the number of cells.
const CELL_COLUMNS_MIN: usize = 4;
/// Maximum number of cells along an axis.
const CELLS_SIDE_MAX: usize = SIDE_MAX.div_ceil(CELL_COLUMNS_MIN);
const CELLS_MAX: usize = CELLS_SIDE_MAX * CELLS_SIDE_MAX;

/// Returns this much higher than the lowest of their column overhang it, m. Not measured in
/// isolation.
const OVERHANGING_M: f64 = 1.5;
/// Number of passes over the columns, each forward and back: one climbs a bank, a winding one takes
/// more. Not measured in isolation.
const CLIMBS: usize = 2;

/// Height of the ground under every column; infinite where unknown.
pub struct GroundHeights([f32; COLUMNS_MAX]);

impl Default for GroundHeights {
    fn default() -> Self {
        GroundHeights::new()
    }
}

impl GroundHeights {
    /// No ground.
    pub const fn new() -> GroundHeights {
        GroundHeights([0.0; COLUMNS_MAX])
    }

    /// Height of the ground under a column; infinite where unknown.
    pub fn height(&self, column: usize) -> f32 {
        self.0[column]
    }

    /// Height above the ground of a point in a column.
    pub fn above(&self, column: usize, z: f32) -> f32 {
        z - self.height(column)
    }
}

/// Estimates [`GroundHeights`]; holds the scratch memory.
pub struct GroundEstimator {
    /// Columns along an axis of the window and along an edge of a cell for which `cell` is valid.
    columns: [usize; 2],
    /// Cells along an axis of the window.
    side: usize,
    cell: [u16; COLUMNS_MAX],
    /// The three lowest returns of each cell.
    lowest: [[f32; 3]; CELLS_MAX],
    height: [f32; CELLS_MAX],
    extrapolated: [f32; CELLS_MAX],
    /// The lowest return of every column; infinite where it has none.
    low: [f32; COLUMNS_MAX],
    /// Columns whose returns are too far apart vertically to be ground.
    thick: ColumnSet,
}

impl Default for GroundEstimator {
    fn default() -> Self {
        GroundEstimator::new()
    }
}

impl GroundEstimator {
    /// Before the first sweep.
    pub const fn new() -> GroundEstimator {
        GroundEstimator {
            columns: [0; 2],
            side: 0,
            cell: [0; COLUMNS_MAX],
            lowest: [[0.0; 3]; CELLS_MAX],
            height: [0.0; CELLS_MAX],
            extrapolated: [0.0; CELLS_MAX],
            low: [0.0; COLUMNS_MAX],
            thick: ColumnSet::new(),
        }
    }

    /// Lists the cell of every column: a look-up is faster than the divisions.
    fn list_cells(&mut self, side: usize, edge: usize) {
        if self.columns == [side, edge] {
            return;
        }
        self.columns = [side, edge];
        self.side = side.div_ceil(edge);
        for i in 0..side {
            for j in 0..side {
                let cell = i / edge * self.side + j / edge;
                self.cell[i * side + j] = cell as u16;
            }
        }
    }

    /// Estimates the ground of a window of `side` columns along an axis (at most [`SIDE_MAX`]),
    /// whose edges measure `column_m`. `returns` are given by column and position; `under` is the
    /// position of the ground beneath the vehicle.
    pub fn estimate(
        &mut self,
        params: &GroundParams,
        column_m: f64,
        side: usize,
        under: [f32; 3],
        returns: impl Iterator<Item = (usize, [f32; 3])> + Clone,
        ground: &mut GroundHeights,
    ) {
        let edge = libm::round(params.ground_cell_m / column_m);
        let edge = (edge as usize).max(CELL_COLUMNS_MIN);
        self.list_cells(side, edge);
        let length = |metres: f64| (metres / column_m) as f32;
        let drop = length(params.ground_drop_m);
        let returns = returns.filter(|(_, p)| {
            // Comparisons rather than `max` here and `min` in the loop below: no position is NaN,
            // and being right for NaN takes several times as many instructions.
            let [x, y] = [(p[0] - under[0]).abs(), (p[1] - under[1]).abs()];
            let away = if x > y { x } else { y };
            p[2] >= under[2] - drop - params.ground_drop_slope * away
        });
        self.lowest.fill([f32::INFINITY; 3]);
        self.low[..side * side].fill(f32::INFINITY);
        for (column, [_, _, z]) in returns.clone() {
            let low = &mut self.low[column];
            *low = if z < *low { z } else { *low };
            self.lower(column, z);
        }
        let fall = (params.ground_fall_slope * edge as f64) as f32;
        self.height.iter_mut().zip(&self.lowest).for_each(|(height, lowest)| *height = lowest[2]);
        (0..params.ground_passes).for_each(|_| self.extrapolate(fall));
        for (height, cell) in ground.0.iter_mut().zip(&self.cell[..side * side]) {
            *height = self.height[*cell as usize];
        }
        let thick = length(params.ground_thickness_m)..length(OVERHANGING_M);
        self.find_thick(returns, thick);
        let [tolerance, slope] = [length(params.ground_tolerance_m), params.ground_slope];
        // Only thin columns whose lowest return is above their ground can be raised.
        let mut above = ColumnSet::new();
        for (c, (low, height)) in self.low[..side * side].iter().zip(&ground.0).enumerate() {
            let is_above = (*low > *height + tolerance) & low.is_finite();
            above.insert_if(c, is_above & !self.thick.contains(c));
        }
        for _ in 0..CLIMBS {
            above.iter().for_each(|c| self.climb(side, c, slope, tolerance, ground));
            above.iter().rev().for_each(|c| self.climb(side, c, slope, tolerance, ground));
        }
    }

    /// Finds columns with returns that are higher than their lowest by an amount within `by`.
    fn find_thick(&mut self, returns: impl Iterator<Item = (usize, [f32; 3])>, by: Range<f32>) {
        self.thick.clear();
        for (column, [_, _, z]) in returns {
            self.thick.insert_if(column, by.contains(&(z - self.low[column])));
        }
    }

    /// Raises the ground of a thin column to its lowest return, if that is above it and the ground
    /// of a column beside it continues there.
    fn climb(
        &self,
        side: usize,
        column: usize,
        slope: f32,
        tolerance: f32,
        ground: &mut GroundHeights,
    ) {
        let is_thin = |c: usize| !self.thick.contains(c);
        let low = self.low[column];
        if ground.0[column] == low {
            return;
        }
        let (i, j) = (column / side, column % side);
        for beside in columns_near(column, 1, side) {
            let rise = low - self.low[beside];
            let run2 = (i.abs_diff(beside / side) + j.abs_diff(beside % side)) as f32;
            let is_ground = self.low[beside] <= ground.0[beside] + tolerance && is_thin(beside);
            if is_ground && rise * rise <= slope * slope * run2 {
                ground.0[column] = low;
                return;
            }
        }
    }

    /// Keeps the height of a return in a column if it is among the three lowest of its cell.
    fn lower(&mut self, column: usize, mut z: f32) {
        let lowest = &mut self.lowest[self.cell[column] as usize];
        // Few are.
        if z < lowest[2] {
            for low in lowest {
                (*low, z) = (low.min(z), low.max(z));
            }
        }
    }

    /// Lowers each cell to at most `fall` above its lowest neighbour.
    fn extrapolate(&mut self, fall: f32) {
        let n = self.side;
        for cell in 0..n * n {
            let around = columns_near(cell, 1, n).map(|beside| self.height[beside] + fall);
            self.extrapolated[cell] = around.fold(self.height[cell], f32::min);
        }
        self.height[..n * n].copy_from_slice(&self.extrapolated[..n * n]);
    }
}
