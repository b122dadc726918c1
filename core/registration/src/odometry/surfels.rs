//! The local map: planes in cells of three sizes (a normal distributions transform, Magnusson
//! 2009), in a table that forgets what has not been seen for longest.

use super::voxel::{hash, index_of};
use crate::gauss_newton::Correspondence;
use crate::moments::PointMoments;
use glam::DVec3;

/// Sides of the cells, m, from fine to coarse: a fine one locates a surface more exactly, a coarse
/// one gets enough returns of distant surfaces and reaches farther.
pub const SIDES_M: [f64; 3] = [0.5, 1.0, 2.0];
/// Number of cells of all sizes together.
const CELLS: usize = 1 << 17;
/// Number of slots that a cell may be put into.
const PROBES: usize = 8;
/// Minimum number of returns in a cell for a normal.
const COUNT_MIN: f64 = 6.0;
/// Beyond this many returns the older ones count half: a cell follows the drift of the pose.
const COUNT_MAX: f64 = 120.0;
/// Normals whose direction has a larger variance do not count, rad^2 (2 degrees). In a tunnel they
/// would appear to show how far the vehicle has moved.
const UNSURE: f64 = 1.2e-3;
/// A plane is recomputed when its cell has this many times the returns it was found from.
const GROWTH: f64 = 1.3;

/// Which cell it is and when it was hit: separate from its contents, as most of a search reads no
/// more than this.
#[derive(Clone, Copy)]
struct Key {
    index: [i32; 3],
    level: u8,
    /// Sweep that hit it last; 0 if empty.
    seen: u32,
}

impl Key {
    const NONE: Key = Key { index: [0; 3], level: 0, seen: 0 };

    fn is(&self, level: u8, index: [i32; 3]) -> bool {
        self.seen > 0 && self.level == level && self.index == index
    }

    fn corner(&self) -> DVec3 {
        let [x, y, z] = self.index.map(f64::from);
        DVec3::new(x, y, z) * SIDES_M[self.level as usize]
    }
}

#[derive(Clone, Copy)]
struct Surfel {
    /// Moments of its returns, relative to its corner.
    moments: PointMoments,
    /// Number of returns the normal was found from.
    planned: f64,
    /// Zero if there is no plane.
    normal: DVec3,
}

impl Surfel {
    const EMPTY: Surfel = Surfel { moments: PointMoments::NONE, planned: 0.0, normal: DVec3::ZERO };

    /// A point on the plane, relative to the corner, and its normal.
    fn plane(&mut self) -> Option<(DVec3, DVec3)> {
        if self.moments.count < COUNT_MIN {
            return None;
        }
        if self.moments.count >= GROWTH * self.planned {
            self.planned = self.moments.count;
            let known = self.moments.normal().filter(|(_, variance)| *variance < UNSURE);
            self.normal = known.map_or(DVec3::ZERO, |(normal, _)| normal);
        }
        (self.normal != DVec3::ZERO).then(|| (self.moments.mean(), self.normal))
    }

    fn add(&mut self, offset: DVec3) {
        self.moments.add(offset);
        if self.moments.count > COUNT_MAX {
            self.moments.halve();
            self.planned = 0.0;
        }
    }
}

/// The cells.
pub struct Surfels {
    keys: [Key; CELLS],
    cells: [Surfel; CELLS],
}

impl Surfels {
    /// An empty map.
    pub const fn new() -> Surfels {
        Surfels { keys: [Key::NONE; CELLS], cells: [Surfel::EMPTY; CELLS] }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.keys.fill(Key::NONE);
    }

    /// Adds a return of a sweep (counted from 1) to its cells.
    pub fn add(&mut self, at: DVec3, sweep: u32) {
        for level in 0..SIDES_M.len() as u8 {
            let index = index_of(at, SIDES_M[level as usize]);
            let slot = self.slot(level, index);
            let key = &mut self.keys[slot];
            if !key.is(level, index) {
                *key = Key { index, level, ..Key::NONE };
                self.cells[slot] = Surfel::EMPTY;
            }
            key.seen = sweep;
            self.cells[slot].add(at - key.corner());
        }
    }

    /// The finest plane at a place.
    pub fn plane(&mut self, at: DVec3) -> Option<Correspondence> {
        for level in 0..SIDES_M.len() as u8 {
            let index = index_of(at, SIDES_M[level as usize]);
            let slot = self.slot(level, index);
            let key = &self.keys[slot];
            if key.is(level, index)
                && let Some((on, normal)) = self.cells[slot].plane()
            {
                return Some(Correspondence {
                    point: at,
                    on: key.corner() + on,
                    normal,
                    weight: 1.0,
                });
            }
        }
        None
    }

    /// Where a cell is or may be put: a free slot, or that of the cell unseen for longest.
    fn slot(&self, level: u8, index: [i32; 3]) -> usize {
        let first = hash(index).wrapping_add(u32::from(level) << 13) as usize;
        let mut stalest = first % CELLS;
        for probe in 0..PROBES {
            let slot = (first + probe) % CELLS;
            let key = &self.keys[slot];
            if key.seen == 0 || key.is(level, index) {
                return slot;
            }
            if key.seen < self.keys[stalest].seen {
                stalest = slot;
            }
        }
        stalest
    }
}
