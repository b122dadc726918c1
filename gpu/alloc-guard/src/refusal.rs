//! What happens if the system refuses memory.

use std::alloc::{GlobalAlloc, Layout};
use std::cell::Cell;

thread_local! {
    static HANDLED: Cell<bool> = const { Cell::new(false) };
}

/// Wraps an allocator and calls a function if it refuses memory, with the number of bytes. A
/// program can end there with a message and an exit code of its own, instead of being aborted. If
/// the function returns, so does the refusal.
///
/// The function is not called for [`is_granted`], nor for what it requests itself.
pub struct OnRefusal<A: GlobalAlloc>(
    /// The allocator that does the work.
    pub A,
    /// The function. As an allocator must not unwind, a panic in it aborts.
    pub extern "C" fn(usize),
);

impl<A: GlobalAlloc> OnRefusal<A> {
    fn checked(&self, block: *mut u8, bytes: usize) -> *mut u8 {
        // A thread that is being torn down handles nothing.
        if block.is_null() && matches!(HANDLED.try_with(|handled| handled.replace(true)), Ok(false))
        {
            (self.1)(bytes);
            HANDLED.set(false);
        }
        block
    }
}

// SAFETY: every call is passed on unchanged, and so is its result; nothing unwinds.
unsafe impl<A: GlobalAlloc> GlobalAlloc for OnRefusal<A> {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promise, passed on.
        self.checked(unsafe { self.0.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promise, passed on.
        self.checked(unsafe { self.0.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        // SAFETY: the caller's promise, passed on.
        self.checked(unsafe { self.0.realloc(block, layout, bytes) }, bytes)
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise, passed on.
        unsafe { self.0.dealloc(block, layout) }
    }
}

/// Requests memory from the system and frees it again. Returns whether it was granted.
pub fn is_granted(bytes: usize) -> bool {
    let before = HANDLED.replace(true);
    let mut room = Vec::<u8>::new();
    let granted = room.try_reserve_exact(bytes).is_ok();
    // Otherwise the compiler may remove the unused allocation.
    std::hint::black_box(&room);
    HANDLED.set(before);
    granted
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::alloc::System;

    /// Refuses blocks of more than 64 bytes.
    struct Small;

    // SAFETY: every call is passed on or refused.
    unsafe impl GlobalAlloc for Small {
        unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
            let refused = layout.size() > 64;
            // SAFETY: the caller's promise, passed on.
            if refused { std::ptr::null_mut() } else { unsafe { System.alloc(layout) } }
        }

        unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
            // SAFETY: the caller's promise, passed on.
            unsafe { System.dealloc(block, layout) }
        }
    }

    static ALLOCATOR: OnRefusal<Small> = OnRefusal(Small, note);

    thread_local! {
        static REFUSED: Cell<usize> = const { Cell::new(0) };
    }

    extern "C" fn note(bytes: usize) {
        REFUSED.set(bytes);
        // SAFETY: the size is not zero.
        assert!(unsafe { ALLOCATOR.alloc(layout(1000)) }.is_null());
    }

    fn layout(bytes: usize) -> Layout {
        Layout::from_size_align(bytes, 8).unwrap()
    }

    #[test]
    fn the_function_is_told_of_refusals() {
        // SAFETY: sizes are not zero, and what is granted is returned with its layout.
        unsafe {
            let granted = ALLOCATOR.alloc(layout(8));
            assert!(!granted.is_null() && REFUSED.take() == 0);
            assert!(ALLOCATOR.alloc(layout(65)).is_null() && REFUSED.take() == 65);
            assert!(ALLOCATOR.alloc_zeroed(layout(66)).is_null() && REFUSED.take() == 66);
            assert!(ALLOCATOR.realloc(granted, layout(8), 67).is_null() && REFUSED.take() == 67);
            ALLOCATOR.dealloc(granted, layout(8));
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "Miri ends where memory is refused")]
    fn what_is_granted() {
        assert!(is_granted(1 << 16));
        assert!(!is_granted(1 << 60));
    }
}
