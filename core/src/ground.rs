//! Height of the ground under a window, from the returns in it. Lengths are in edges of a column.

use crate::params::COLUMNS_MAX;

/// Columns along an axis of a cell of the ground: 1.5 m at 0.30 m.
const GROUND_CELL: usize = 5;
/// Ground cells along an axis at most.
const GROUND_SIDE: usize = 256usize.div_ceil(GROUND_CELL);
/// How far below the vehicle's ground another may begin, and by how much it may fall from
/// there: what lies lower is mirrored.
const STEP: f32 = 1.5;
const SLOPE: f32 = 0.1;
/// How far the ground of a cell follows from others, cells: nothing is seen of it behind cars.
const GROUND_PASSES: usize = 3;
/// By how much the ground may fall from one of its cells to the next: 7 %.
const GROUND_FALL: f32 = 0.33;

/// Height of the ground, by cells of [`GROUND_CELL`] columns.
pub struct Ground {
    side: usize,
    /// Columns along an axis of the window that `cell` is for.
    columns: usize,
    cell: [u16; COLUMNS_MAX],
    /// The three lowest returns of each.
    lowest: [[f32; 3]; GROUND_SIDE * GROUND_SIDE],
    height: [f32; GROUND_SIDE * GROUND_SIDE],
    followed: [f32; GROUND_SIDE * GROUND_SIDE],
}

impl Default for Ground {
    fn default() -> Ground {
        Ground::new()
    }
}

impl Ground {
    /// No ground yet.
    pub const fn new() -> Ground {
        let none = [0.0; GROUND_SIDE * GROUND_SIDE];
        let lowest = [[0.0; 3]; GROUND_SIDE * GROUND_SIDE];
        Ground { side: 0, columns: 0, cell: [0; COLUMNS_MAX], lowest, height: none, followed: none }
    }

    /// Lists the cell of every column: divisions take longer than looking it up.
    fn list_cells(&mut self, side: usize) {
        if self.columns == side {
            return;
        }
        self.columns = side;
        self.side = side.div_ceil(GROUND_CELL);
        for i in 0..side {
            for j in 0..side {
                let cell = i / GROUND_CELL * self.side + j / GROUND_CELL;
                self.cell[i * side + j] = cell as u16;
            }
        }
    }

    /// The third-lowest return of each cell, or of its neighbours if the ground falls that way:
    /// mirrored returns come from below, but seldom together. `returns` are given by their column
    /// and place; `under` is the place of the vehicle's ground.
    pub fn estimate(
        &mut self,
        side: usize,
        under: [f32; 3],
        returns: impl Iterator<Item = (usize, [f32; 3])>,
    ) {
        self.list_cells(side);
        self.lowest.fill([f32::INFINITY; 3]);
        for (column, p) in returns {
            let away = (p[0] - under[0]).abs().max((p[1] - under[1]).abs());
            if p[2] < under[2] - STEP - SLOPE * away {
                continue;
            }
            let cell = self.cell[column] as usize;
            let mut z = p[2];
            for low in &mut self.lowest[cell] {
                (*low, z) = (low.min(z), low.max(z));
            }
        }
        for (height, lowest) in self.height.iter_mut().zip(&self.lowest) {
            *height = lowest[2];
        }
        let n = self.side;
        for _ in 0..GROUND_PASSES {
            for i in 0..n {
                for j in 0..n {
                    let mut height = self.height[i * n + j];
                    for a in i.saturating_sub(1)..(i + 2).min(n) {
                        for b in j.saturating_sub(1)..(j + 2).min(n) {
                            height = height.min(self.height[a * n + b] + GROUND_FALL);
                        }
                    }
                    self.followed[i * n + j] = height;
                }
            }
            core::mem::swap(&mut self.height, &mut self.followed);
        }
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
