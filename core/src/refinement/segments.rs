//! Things: columns of the first sweep that touch and may move together.

use super::cloud::Cloud;
use crate::params::COLUMNS_MAX;
use crate::record::{Flow, NONE, VALID, flow_displacement};

/// Matched neighbours that differ by more cells than this do not touch.
const DIFFERENT: i32 = 2;

/// Disjoint sets of columns, then lists of them.
pub struct Segments {
    parent: [u32; COLUMNS_MAX],
    columns: heapless::Vec<u32, COLUMNS_MAX>,
    /// Where each segment ends in `columns`.
    ends: heapless::Vec<u32, COLUMNS_MAX>,
}

impl Segments {
    pub(super) const fn new() -> Segments {
        Segments {
            parent: [0; COLUMNS_MAX],
            columns: heapless::Vec::new(),
            ends: heapless::Vec::new(),
        }
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
        for c in 0..side * side {
            self.parent[c] = if cloud.levels(c) != 0 && part(c) { c as u32 } else { NONE };
        }
        for c in 0..side * side {
            let near = cloud.levels(c);
            if self.parent[c] == NONE {
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
                if self.parent[other] != NONE
                    && cloud.levels(other) & near != 0
                    && together(flow(c), flow(other))
                {
                    self.join(c as u32, other as u32);
                }
            }
        }
        self.list(side * side);
    }

    fn root(&mut self, mut c: u32) -> u32 {
        while self.parent[c as usize] != c {
            let up = self.parent[c as usize];
            self.parent[c as usize] = self.parent[up as usize];
            c = up;
        }
        c
    }

    /// The earlier column stays the root.
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }

    /// Columns sorted by the root of their segment.
    fn list(&mut self, columns: usize) {
        self.columns.clear();
        self.ends.clear();
        for c in 0..columns as u32 {
            if self.parent[c as usize] != NONE {
                let root = self.root(c);
                self.parent[c as usize] = root;
                // As many as there are columns at most: there is room.
                let _ = self.columns.push(c);
            }
        }
        let parent = &self.parent;
        self.columns.sort_unstable_by_key(|c| (parent[*c as usize], *c));
        for n in 1..=self.columns.len() {
            let root = |n: usize| self.columns.get(n).map(|c| self.parent[*c as usize]);
            if root(n) != root(n - 1) {
                let _ = self.ends.push(n as u32);
            }
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Columns of a segment, ascending.
    pub fn columns(&self, segment: usize) -> &[u32] {
        let from = if segment == 0 { 0 } else { self.ends[segment - 1] };
        &self.columns[from as usize..self.ends[segment] as usize]
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
