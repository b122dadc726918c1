//! Height of the ground under a window of square columns, from the returns in it.
//!
//! The third-lowest return of each cell, or of its neighbours where the ground descends that way:
//! returns mirrored by glass or puddles come from below, but seldom together. Parameters are in
//! metres, places and heights in the caller's unit, the edge of a column.

use crate::params::{COLUMNS_MAX, GroundParams, SIDE_MAX};

/// Least number of columns along an edge of a cell: bounds the number of cells.
const CELL_COLUMNS_MIN: usize = 4;
/// Cells along an axis at most.
const CELLS_SIDE_MAX: usize = SIDE_MAX.div_ceil(CELL_COLUMNS_MIN);
const CELLS_MAX: usize = CELLS_SIDE_MAX * CELLS_SIDE_MAX;

/// Height of the ground in cells of several columns.
pub struct GroundGrid {
    /// Columns along an axis of the window, and along an edge of a cell, that `cell` is for.
    columns: [usize; 2],
    /// Cells along an axis of the window.
    side: usize,
    cell: [u16; COLUMNS_MAX],
    /// The three lowest returns of each.
    lowest: [[f32; 3]; CELLS_MAX],
    height: [f32; CELLS_MAX],
    extrapolated: [f32; CELLS_MAX],
}

impl Default for GroundGrid {
    fn default() -> Self {
        GroundGrid::new()
    }
}

impl GroundGrid {
    /// No ground.
    pub const fn new() -> GroundGrid {
        GroundGrid {
            columns: [0; 2],
            side: 0,
            cell: [0; COLUMNS_MAX],
            lowest: [[0.0; 3]; CELLS_MAX],
            height: [0.0; CELLS_MAX],
            extrapolated: [0.0; CELLS_MAX],
        }
    }

    /// Lists the cell of every column: divisions take longer than looking it up.
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
    /// whose edges measure `column_m`. `returns` are given by column and place, `under` is the
    /// place of the ground beneath the vehicle.
    pub fn estimate(
        &mut self,
        params: &GroundParams,
        column_m: f64,
        side: usize,
        under: [f32; 3],
        returns: impl Iterator<Item = (usize, [f32; 3])>,
    ) {
        let edge = libm::round(params.ground_cell_m / column_m);
        let edge = (edge as usize).max(CELL_COLUMNS_MIN);
        self.list_cells(side, edge);
        let drop = (params.ground_drop_m / column_m) as f32;
        self.lowest.fill([f32::INFINITY; 3]);
        for (column, p) in returns {
            let away = (p[0] - under[0]).abs().max((p[1] - under[1]).abs());
            if p[2] < under[2] - drop - params.ground_drop_slope * away {
                continue;
            }
            self.lower(column, p[2]);
        }
        let fall = (params.ground_fall_slope * edge as f64) as f32;
        self.height.iter_mut().zip(&self.lowest).for_each(|(height, lowest)| *height = lowest[2]);
        (0..params.ground_passes).for_each(|_| self.extrapolate(fall));
    }

    /// Keeps the height of a return in a column if it is among the three lowest of its cell.
    fn lower(&mut self, column: usize, mut z: f32) {
        for low in &mut self.lowest[self.cell[column] as usize] {
            (*low, z) = (low.min(z), low.max(z));
        }
    }

    /// Lowers each cell to what its lowest neighbour allows, which may fall by `fall` to it.
    fn extrapolate(&mut self, fall: f32) {
        let n = self.side;
        for i in 0..n {
            for j in 0..n {
                let mut height = self.height[i * n + j];
                for a in i.saturating_sub(1)..(i + 2).min(n) {
                    for b in j.saturating_sub(1)..(j + 2).min(n) {
                        height = height.min(self.height[a * n + b] + fall);
                    }
                }
                self.extrapolated[i * n + j] = height;
            }
        }
        core::mem::swap(&mut self.height, &mut self.extrapolated);
    }

    /// Height of the ground under a column; infinite where nothing tells it.
    pub fn height(&self, column: usize) -> f32 {
        self.height[self.cell[column] as usize]
    }

    /// Height above the ground of a place in a column.
    pub fn above(&self, column: usize, z: f32) -> f32 {
        z - self.height(column)
    }
}
