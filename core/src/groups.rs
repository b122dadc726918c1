//! Disjoint sets of the numbers below N (union-find with path halving), and lists of their members.

use crate::record::NONE;

/// Disjoint sets of numbers below `N`.
pub struct DisjointSets<const N: usize> {
    parent: [u32; N],
    members: heapless::Vec<u32, N>,
    /// Where each group ends in `members`.
    ends: heapless::Vec<u32, N>,
}

impl<const N: usize> Default for DisjointSets<N> {
    fn default() -> DisjointSets<N> {
        DisjointSets::new()
    }
}

impl<const N: usize> DisjointSets<N> {
    /// No numbers, no groups.
    pub const fn new() -> DisjointSets<N> {
        DisjointSets { parent: [0; N], members: heapless::Vec::new(), ends: heapless::Vec::new() }
    }

    /// Puts each number below `count` that is a `member` into a group of its own.
    pub fn start(&mut self, count: usize, member: impl Fn(usize) -> bool) {
        for (n, parent) in self.parent[..count].iter_mut().enumerate() {
            *parent = if member(n) { n as u32 } else { NONE };
        }
    }

    /// Whether a number is in a group.
    pub fn contains(&self, n: usize) -> bool {
        self.parent[n] != NONE
    }

    fn root(&mut self, mut n: u32) -> u32 {
        while self.parent[n as usize] != n {
            let up = self.parent[n as usize];
            self.parent[n as usize] = self.parent[up as usize];
            n = up;
        }
        n
    }

    /// Merges the groups of two members.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }

    /// Lists the members of every group; groups are ordered by their least member. `count` is the
    /// one passed to [`DisjointSets::start`].
    pub fn list(&mut self, count: usize) {
        self.members.clear();
        self.ends.clear();
        for n in 0..count as u32 {
            if self.parent[n as usize] != NONE {
                let root = self.root(n);
                self.parent[n as usize] = root;
                // At most as many as there are numbers, so there is room.
                let _ = self.members.push(n);
            }
        }
        let parent = &self.parent;
        self.members.sort_unstable_by_key(|n| (parent[*n as usize], *n));
        for n in 1..=self.members.len() {
            let root = |n: usize| self.members.get(n).map(|m| self.parent[*m as usize]);
            if root(n) != root(n - 1) {
                let _ = self.ends.push(n as u32);
            }
        }
    }

    /// Number of groups.
    pub fn count(&self) -> usize {
        self.ends.len()
    }

    /// Members of a group, ascending.
    pub fn members(&self, group: usize) -> &[u32] {
        let from = if group == 0 { 0 } else { self.ends[group - 1] };
        &self.members[from as usize..self.ends[group] as usize]
    }
}
