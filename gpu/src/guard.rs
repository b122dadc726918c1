//! Proof that a piece of code allocates nothing: a global allocator that watches threads.
//!
//! Scope: allocations that Rust code makes through the global allocator, on a thread that is
//! inside [`guarded`]. Other threads, and what a driver or another C library takes from its own
//! `malloc`, are not seen.

use std::alloc::{GlobalAlloc, Layout};
use std::cell::Cell;
use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

thread_local! {
    // Constant and without a destructor, so that reading it cannot itself allocate.
    static INSIDE: Cell<bool> = const { Cell::new(false) };
}

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);
static ABORT: AtomicBool = AtomicBool::new(false);

/// Wraps the global allocator and counts what guarded threads ask of it. Reallocations count,
/// releases do not.
///
/// ```
/// use raywake_gpu::guard::{self, Guard};
/// #[global_allocator]
/// static ALLOCATOR: Guard<std::alloc::System> = Guard(std::alloc::System);
///
/// let words = guard::guarded(|| vec![0; 8]);
/// assert_eq!((words.len(), guard::allocations()), (8, 1));
/// ```
pub struct Guard<A: GlobalAlloc>(
    /// The allocator that does the work.
    pub A,
);

/// Runs `f` with this thread under guard. Sections nest, and end when `f` unwinds.
pub fn guarded<R>(f: impl FnOnce() -> R) -> R {
    struct Restore(bool);
    impl Drop for Restore {
        fn drop(&mut self) {
            INSIDE.set(self.0);
        }
    }
    let _restore = Restore(INSIDE.replace(true));
    f()
}

/// Allocations seen in guarded sections of all threads since the process started.
pub fn allocations() -> u64 {
    ALLOCATIONS.load(Ordering::Relaxed)
}

/// Whether an allocation in a guarded section ends the process. Off at the start.
pub fn abort_on_allocation(abort: bool) {
    ABORT.store(abort, Ordering::Relaxed);
}

fn witness(bytes: usize) {
    // A thread that is being torn down has left every section.
    if !INSIDE.try_with(Cell::get).unwrap_or(false) {
        return;
    }
    ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
    if ABORT.load(Ordering::Relaxed) {
        INSIDE.set(false);
        // Not `eprintln`: a test harness may capture it into a growing buffer.
        let _ = writeln!(std::io::stderr(), "allocation of {bytes} bytes in a guarded section");
        std::process::abort();
    }
}

// SAFETY: every call is passed on unchanged; `witness` neither allocates nor unwinds.
unsafe impl<A: GlobalAlloc> GlobalAlloc for Guard<A> {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        witness(layout.size());
        // SAFETY: the caller's promise, passed on.
        unsafe { self.0.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        witness(layout.size());
        // SAFETY: the caller's promise, passed on.
        unsafe { self.0.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        witness(bytes);
        // SAFETY: the caller's promise, passed on.
        unsafe { self.0.realloc(block, layout, bytes) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise, passed on.
        unsafe { self.0.dealloc(block, layout) }
    }
}
