//! Sequences of any length in fixed memory.

/// Every k-th element of a sequence, with k doubled whenever there is no room for more; none if N
/// is 0.
#[derive(Clone, Debug)]
pub struct Thinned<T, const N: usize> {
    kept: heapless::Vec<T, N>,
    /// k is two to the power of this.
    doublings: u32,
    seen: u64,
}

impl<T: Copy, const N: usize> Thinned<T, N> {
    /// An empty sequence.
    pub const fn new() -> Thinned<T, N> {
        // Kept elements stay at even multiples when every other one is dropped.
        assert!(N.is_multiple_of(2));
        Thinned { kept: heapless::Vec::new(), doublings: 0, seen: 0 }
    }

    /// Adds the next element.
    pub fn push(&mut self, item: T) {
        if N > 0 && self.seen.is_multiple_of(1 << self.doublings) {
            if self.kept.is_full() {
                for n in 0..N / 2 {
                    self.kept[n] = self.kept[2 * n];
                }
                self.kept.truncate(N / 2);
                self.doublings += 1;
            }
            // There is room.
            let _ = self.kept.push(item);
        }
        self.seen += 1;
    }

    /// The kept elements, in order.
    pub fn kept(&self) -> &[T] {
        &self.kept
    }

    /// The kept elements, mutable.
    pub(super) fn kept_mut(&mut self) -> &mut [T] {
        &mut self.kept
    }

    /// Number of elements added.
    pub fn seen(&self) -> u64 {
        self.seen
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.kept.clear();
        (self.doublings, self.seen) = (0, 0);
    }
}

impl<T: Copy, const N: usize> Default for Thinned<T, N> {
    fn default() -> Self {
        Thinned::new()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    #[test]
    fn every_kth_is_kept() {
        for count in [0, 1, 8, 9, 16, 17, 33, 1000] {
            let mut thinned = Thinned::<usize, 8>::new();
            (0..count).for_each(|n| thinned.push(n));
            let every = 1 << thinned.doublings;
            let wanted: Vec<usize> = (0..count).step_by(every).collect();
            assert_eq!(thinned.kept(), wanted, "{count}");
            assert_eq!(thinned.seen(), count as u64);
            assert!(every == 1 || wanted.len() > 4, "{count}: one of {every}");
            let mut none = Thinned::<usize, 0>::new();
            (0..count).for_each(|n| none.push(n));
            assert_eq!((none.kept(), none.seen()), (&[][..], count as u64));
        }
    }
}
