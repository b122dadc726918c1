//! Things: columns of the first sweep that touch and may move together.

use super::cloud::Cloud;
use crate::groups::Groups;
use crate::params::COLUMNS_MAX;
use crate::record::{Flow, VALID, flow_displacement};

/// Matched neighbours that differ by more cells than this do not touch.
const DIFFERENT: i32 = 2;

/// Groups of columns.
pub struct Segments(Groups<COLUMNS_MAX>);

impl Segments {
    pub(super) const fn new() -> Segments {
        Segments(Groups::new())
    }

    /// Segments of the columns of a cloud that may be `part` of any. `flow` tells the flow of a
    /// column, as far as there is one.
    pub(super) fn find(
        &mut self,
        cloud: &Cloud,
        part: impl Fn(usize) -> bool,
        flow: impl Fn(usize) -> Flow,
    ) {
        let side = cloud.side;
        self.0.start(side * side, |c| cloud.levels(c) != 0 && part(c));
        for c in 0..side * side {
            let near = cloud.levels(c);
            if !self.0.contains(c) {
                continue;
            }
            let near = near | near << 1 | near >> 1;
            let near = near | near << 1 | near >> 1;
            let (i, j) = (c / side, c % side);
            // The four neighbours before it in scan order.
            for (di, dj) in [(1, 1), (1, 0), (1, -1), (0, 1)] {
                let b = j as i32 - dj;
                if i < di || b < 0 || b as usize >= side {
                    continue;
                }
                let other = (i - di) * side + b as usize;
                if self.0.contains(other)
                    && cloud.levels(other) & near != 0
                    && together(flow(c), flow(other))
                {
                    self.0.join(c as u32, other as u32);
                }
            }
        }
        self.0.list(side * side);
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.count()
    }

    /// Columns of a segment, ascending.
    pub fn columns(&self, segment: usize) -> &[u32] {
        self.0.members(segment)
    }
}

/// Whether two flows may be those of one thing.
fn together(a: Flow, b: Flow) -> bool {
    if a & b & VALID == 0 {
        return true;
    }
    let (a, b) = (flow_displacement(a), flow_displacement(b));
    (a[0] - b[0]).abs().max((a[1] - b[1]).abs()) <= DIFFERENT
}
