//! A sweep thinned by a hash table of voxels: faster than sorting, and in place.

use super::voxel::{hash, index_of};
use crate::deskew::TimedPoint;
use glam::DVec3;
use heapless::Vec;
use raywake_core::sweep::{Point, Rig};

/// Side of the voxels that keep one return each, m.
const VOXEL_M: f64 = 0.25;
/// Maximum number of voxels of a sweep that keep a return; an HDL-64E fills 20,000 to 40,000.
const KEPT_MAX: usize = 1 << 16;
/// Number of slots in the table: at most half of them are taken.
const SLOTS: usize = 2 * KEPT_MAX;

/// One return per voxel, the first of each, in the order of the sweep.
pub struct ThinnedSweep {
    points: Vec<TimedPoint, KEPT_MAX>,
    /// Voxel that took a slot, and the filling it did so in.
    slots: [([i32; 3], u32); SLOTS],
    filling: u32,
}

impl ThinnedSweep {
    /// No sweep yet.
    pub const fn new() -> ThinnedSweep {
        ThinnedSweep { points: Vec::new(), slots: [([0; 3], 0); SLOTS], filling: 0 }
    }

    /// Replaces the points with those of a sweep. Points beyond the capacity are left out.
    pub fn fill(&mut self, points: &[Point], rig: &Rig) {
        self.points.clear();
        self.filling += 1;
        for point in points.iter().filter(|p| TimedPoint::is_usable(p, rig)) {
            if self.points.is_full() {
                return;
            }
            if self.is_new(point) {
                // There is room.
                let _ = self.points.push(TimedPoint::of(point, rig));
            }
        }
    }

    /// Takes the voxel of a point, unless it is already taken. Returns whether it was free.
    fn is_new(&mut self, point: &Point) -> bool {
        let voxel = index_of(DVec3::from_array(point.position.map(f64::from)), VOXEL_M);
        let mut slot = hash(voxel) as usize % SLOTS;
        while self.slots[slot].1 == self.filling {
            if self.slots[slot].0 == voxel {
                return false;
            }
            slot = (slot + 1) % SLOTS;
        }
        self.slots[slot] = (voxel, self.filling);
        true
    }

    /// The points.
    pub fn points(&self) -> &[TimedPoint] {
        &self.points
    }
}
