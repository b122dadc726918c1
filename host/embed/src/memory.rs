//! Memory given by someone else, cut into the parts needed. This crate's unsafe code is here,
//! except for one call in `team_estimator`.

use core::mem::MaybeUninit;

/// Memory for the rest of the program, or for as long as its owner says.
pub type Memory = &'static mut [MaybeUninit<u8>];

/// Heap memory, freed when this is dropped.
#[cfg(feature = "std")]
pub(crate) struct HeapMemory(*mut [MaybeUninit<u8>]);

// SAFETY: the only thing done with it is to free it, once.
#[cfg(feature = "std")]
unsafe impl Send for HeapMemory {}
// SAFETY: as above.
#[cfg(feature = "std")]
unsafe impl Sync for HeapMemory {}

#[cfg(feature = "std")]
impl HeapMemory {
    /// Allocates `bytes` bytes: returns their owner and the right to use them; none if that fails.
    ///
    /// # Safety
    /// Whatever is made in the memory is dropped before this.
    pub(crate) unsafe fn new(bytes: usize) -> Option<(HeapMemory, Memory)> {
        let mut place = Vec::<MaybeUninit<u8>>::new();
        place.try_reserve_exact(bytes).ok()?;
        place.resize(bytes, MaybeUninit::uninit());
        let place = Box::into_raw(place.into_boxed_slice());
        // SAFETY: it has just been allocated; the caller guarantees how long it is used.
        Some((HeapMemory(place), unsafe { &mut *place }))
    }
}

#[cfg(feature = "std")]
impl Drop for HeapMemory {
    fn drop(&mut self) {
        // SAFETY: it was a box; nobody uses it any more, as guaranteed to `new`.
        drop(unsafe { Box::from_raw(self.0) });
    }
}

/// A type with an initial value. The value is a constant, written in place: going through the
/// stack, states of tens of MiB would need as much of it.
pub(crate) trait AtRest {
    /// The initial value.
    const REST: Self;
}

/// Number of bytes that hold this many values, at any alignment.
pub(crate) const fn bytes_of<T>(count: usize) -> usize {
    count * size_of::<T>() + align_of::<T>() - 1
}

/// Cuts off room for this many values; none if there is not enough.
fn cut<T>(memory: &mut Memory, count: usize) -> Option<&'static mut [MaybeUninit<T>]> {
    let skip = memory.as_ptr().align_offset(align_of::<T>());
    let bytes = count.checked_mul(size_of::<T>())?;
    if skip.checked_add(bytes)? > memory.len() {
        return None;
    }
    let (_, rest) = core::mem::take(memory).split_at_mut(skip);
    let (place, rest) = rest.split_at_mut(bytes);
    *memory = rest;
    // SAFETY: bytes that may hold anything form values that may hold anything.
    let (before, place, after) = unsafe { place.align_to_mut::<MaybeUninit<T>>() };
    debug_assert!(before.is_empty() && after.is_empty() && place.len() == count);
    Some(place)
}

/// Cuts off an array of equal values.
pub(crate) fn array<T: Copy>(
    memory: &mut Memory,
    count: usize,
    value: T,
) -> Option<&'static mut [T]> {
    let place = cut::<T>(memory, count)?;
    for element in &mut *place {
        element.write(value);
    }
    // SAFETY: each element has just been written.
    Some(unsafe { place.assume_init_mut() })
}

/// Cuts off a state and sets it to its initial value.
pub(crate) fn state<T: AtRest>(memory: &mut Memory) -> Option<&'static mut T> {
    let [place] = cut::<T>(memory, 1)? else { return None };
    *place = const { MaybeUninit::new(T::REST) };
    // SAFETY: it has just been written.
    Some(unsafe { place.assume_init_mut() })
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use std::vec;

    #[test]
    fn parts_do_not_overlap_and_lie_where_they_may() {
        for skip in 0..16 {
            let bytes = bytes_of::<u8>(3) + bytes_of::<u64>(5) + bytes_of::<u16>(7);
            let mut memory = &mut vec![MaybeUninit::uninit(); bytes + skip].leak()[skip..];
            let bytes = array(&mut memory, 3, 1u8).unwrap();
            let words = array(&mut memory, 5, 2u64).unwrap();
            let halves = array(&mut memory, 7, 3u16).unwrap();
            assert!(words.as_ptr().is_aligned() && halves.as_ptr().is_aligned());
            words.fill(u64::MAX);
            assert_eq!((&*bytes, &*halves), (&[1; 3][..], &[3; 7][..]));
            assert!(array(&mut memory, usize::MAX, 0u16).is_none());
            assert!(array(&mut memory, 16, 0u8).is_none());
        }
    }
}
