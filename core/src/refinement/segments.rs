//! Segmentation: columns of the first sweep that touch and may move together form one cluster.

use super::scans::Scans;
use crate::groups::DisjointSets;
use crate::params::COLUMNS_MAX;
use crate::record::{Flow, VALID, flow_displacement};

/// Connected components of columns.
pub struct Segments(DisjointSets<COLUMNS_MAX>);

impl Segments {
    pub(super) const fn new() -> Segments {
        Segments(DisjointSets::new())
    }

    /// Finds the segments of those columns of the first sweep that may be `part` of one. Neighbours
    /// that touch are in one segment if they may go `together`.
    pub(super) fn find(
        &mut self,
        scans: &Scans,
        part: impl Fn(usize) -> bool,
        together: impl Fn(usize, usize) -> bool,
    ) {
        let (cloud, side) = (scans.first, scans.first.side);
        self.0.start(side * side, |c| cloud.levels(c) != 0 && part(c));
        for c in 0..side * side {
            if !self.0.contains(c) {
                continue;
            }
            let gap = 0..scans.scaled.gap_levels;
            let near = gap.fold(cloud.levels(c), |near, _| near | near << 1 | near >> 1);
            let (i, j) = (c / side, c % side);
            // The four neighbours before it in scan order.
            for (di, dj) in [(1, 1), (1, 0), (1, -1), (0, 1)] {
                let b = j as i32 - dj;
                if i < di || b < 0 || b as usize >= side {
                    continue;
                }
                let other = (i - di) * side + b as usize;
                if self.0.contains(other) && cloud.levels(other) & near != 0 && together(c, other) {
                    self.0.join(c as u32, other as u32);
                }
            }
        }
        self.0.list(side * side);
    }

    /// The number of segments.
    pub fn len(&self) -> usize {
        self.0.count()
    }

    /// Columns of a segment, ascending.
    pub fn columns(&self, segment: usize) -> &[u32] {
        self.0.members(segment)
    }
}

/// Whether the matches of two columns, 0 for none, let these go together: they differ by at most
/// `cluster_disparity_cells` along each axis, or one is missing.
pub fn agree(scans: &Scans, a: Flow, b: Flow) -> bool {
    if a & b & VALID == 0 {
        return true;
    }
    let (a, b) = (flow_displacement(a), flow_displacement(b));
    let disparity = a[0].abs_diff(b[0]).max(a[1].abs_diff(b[1]));
    disparity <= scans.scaled.params.cluster_disparity_cells
}
