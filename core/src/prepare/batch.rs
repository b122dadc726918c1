//! Placing several returns in the window at once.

use super::{Drift, FAR, ToVoxel};
use crate::params::{EXTENT_VOXELS, SLOTS};
use crate::record::NONE;
use crate::sweep::Point;
use core::array::from_fn;

/// Number of returns placed together.
pub(super) const LANES: usize = 8;

/// Returns waiting to be placed.
pub(super) struct ReturnBatch {
    pub len: usize,
    /// Position of each in the vehicle frame, by axis, m.
    position: [[f32; LANES]; 3],
    /// Time of each, slots from the beginning of the sweep.
    pub when: [f32; LANES],
    /// The slot whose motion is applied to it.
    pub slot: [usize; LANES],
    pub sensor: [usize; LANES],
    /// Whether it lies on the ego vehicle.
    pub own: [bool; LANES],
    /// Its index in the sweep.
    pub index: [usize; LANES],
}

/// Positions of the returns of a batch.
pub(super) struct PlacedBatch {
    /// Voxel of each, by axis.
    pub end: [[i32; LANES]; 3],
    /// Whether that is farther than rays can reach.
    pub far: [bool; LANES],
    /// Column of each, or [`NONE`].
    pub column: [u32; LANES],
    /// Position of each, by axis, voxels, at its own time.
    pub at: [[f32; LANES]; 3],
}

/// The window in which returns are placed.
pub(super) struct RayLattice {
    pub side: u32,
    pub levels: u32,
    /// Its central voxel.
    pub centre: [i32; 3],
    /// Transform to voxels relative to that one, for each slot.
    pub to_voxel: [ToVoxel; SLOTS],
    pub drift: Drift,
}

impl ReturnBatch {
    pub const fn new() -> ReturnBatch {
        ReturnBatch {
            len: 0,
            position: [[0.0; LANES]; 3],
            when: [0.0; LANES],
            slot: [0; LANES],
            sensor: [0; LANES],
            own: [false; LANES],
            index: [0; LANES],
        }
    }

    /// Adds a return to a batch that is not full. Returns whether it is full now.
    #[inline]
    pub fn push(&mut self, index: usize, point: &Point, own: bool, when: f32, slot: usize) -> bool {
        let n = self.len;
        for (axis, position) in self.position.iter_mut().zip(point.position) {
            axis[n] = position;
        }
        (self.when[n], self.slot[n], self.sensor[n]) = (when, slot, point.sensor as usize);
        (self.own[n], self.index[n]) = (own, index);
        self.len += 1;
        self.len == LANES
    }
}

impl RayLattice {
    /// Places a batch. Entries beyond its length are meaningless.
    #[inline(always)]
    pub fn place(&self, batch: &ReturnBatch) -> PlacedBatch {
        let mut out = PlacedBatch {
            end: [[0; LANES]; 3],
            far: [false; LANES],
            column: [NONE; LANES],
            at: [[0.0; LANES]; 3],
        };
        let [x, y, z] = &batch.position;
        for axis in 0..3 {
            let row: [[f32; 4]; LANES] = from_fn(|l| self.to_voxel[batch.slot[l]][axis]);
            let centre = self.centre[axis];
            for l in 0..LANES {
                let [rx, ry, rz, shift] = row[l];
                let v = (rx * x[l] + ry * y[l] + rz * z[l] + shift).clamp(-FAR, FAR);
                let cut = v as i32;
                // Truncation rounds up below zero.
                let end = cut - i32::from((cut as f32) > v) + centre;
                out.end[axis][l] = end;
                out.far[l] |= end.abs() > EXTENT_VOXELS;
                out.at[axis][l] = v + centre as f32;
            }
        }
        for l in 0..LANES {
            let [i, j, k] = out.end.map(|end| end[l] as u32);
            let inside = (i < self.side) & (j < self.side) & (k < self.levels);
            out.column[l] = if inside { i.wrapping_mul(self.side).wrapping_add(j) } else { NONE };
            let after = batch.when[l] - (batch.slot[l] as f32 + 0.5);
            let at = self.drift.place([out.at[0][l], out.at[1][l], out.at[2][l]], after);
            for (axis, at) in out.at.iter_mut().zip(at) {
                axis[l] = at;
            }
        }
        out
    }
}
