//! A global allocator that checks that memory is allocated during set-up and never again.
//!
//! A value under this rule goes through three states, each a type:
//!
//! 1. **starting**: a plain value, under construction, which allocates what it needs;
//! 2. **sealed**: [`Sealed`], whose value can be changed only in [`Sealed::step`]. An allocation
//!    there, by this thread or by one that helps it ([`watch`]), turns the step into an error;
//! 3. **finished**: the plain value again, after [`Sealed::finish`].
//!
//! ```
//! use raywake_alloc_guard::{Allocation, Guard, Sealed};
//! #[global_allocator]
//! static ALLOCATOR: Guard<std::alloc::System> = Guard(std::alloc::System);
//!
//! let mut list = Sealed::new("append", Vec::with_capacity(1));
//! let mut append = |word: u32| {
//!     list.step(|list| {
//!         list.push(word);
//!         Ok::<_, Allocation>(())
//!     })
//! };
//! assert!(append(1).is_ok());
//! let error = append(2).unwrap_err();
//! assert_eq!((error.section, error.bytes), ("append", 16));
//! assert_eq!(list.finish(), [1, 2]);
//! ```
//!
//! # Scope
//!
//! Allocations and reallocations through the global allocator, on threads inside a step or inside
//! [`watch`]. Other threads, and what a driver or another C library takes from its own `malloc`,
//! are not seen. Nothing is seen if [`Guard`] is not the global allocator. Releases are allowed.
//!
//! An allocator cannot make the code that called it fail without ending the process. It therefore
//! notes the first allocation and serves it; the step that ends next returns the note.
//!
//! # Memory that is refused
//!
//! Code that requests memory cannot handle this either, unless it uses `try_reserve`: [`OnRefusal`]
//! lets the program say so and end, [`is_granted`] asks beforehand.
#![deny(missing_docs)]

mod boxed;
mod refusal;

pub use boxed::{Constant, boxed};
pub use refusal::{OnRefusal, is_granted};

use std::alloc::{GlobalAlloc, Layout};
use std::backtrace::{Backtrace, BacktraceStatus};
use std::cell::Cell;
use std::error::Error;
use std::fmt;
use std::ops::Deref;
use std::sync::{Mutex, PoisonError};

thread_local! {
    // Constant and without a destructor, so that reading it cannot itself allocate.
    static SECTION: Cell<Option<&'static str>> = const { Cell::new(None) };
}

/// The first allocation that no step has returned yet. Like the allocator it is global to the
/// process: if two threads step at once, either may return what the other did.
static NOTED: Mutex<Option<Allocation>> = Mutex::new(None);

/// An allocation where there must be none: a bug in the program.
#[derive(Debug)]
pub struct Allocation {
    /// The name given to [`Sealed::new`] or [`watch`].
    pub section: &'static str,
    /// The requested size.
    pub bytes: usize,
    /// The code that requested it; empty unless `RUST_BACKTRACE` is set.
    pub backtrace: Backtrace,
}

impl fmt::Display for Allocation {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Allocation { section, bytes, backtrace } = self;
        write!(f, "{bytes} bytes allocated in the section `{section}`, which must not allocate")?;
        match backtrace.status() {
            BacktraceStatus::Captured => write!(f, "\n{backtrace}"),
            _ => Ok(()),
        }
    }
}

impl Error for Allocation {}

/// A value whose set-up is over; see the [crate] for its states.
pub struct Sealed<T> {
    section: &'static str,
    value: T,
}

impl<T> Sealed<T> {
    /// Goes from starting to sealed. `section` names the steps in errors. What watched threads have
    /// allocated so far counts as set-up.
    pub fn new(section: &'static str, value: T) -> Self {
        noted();
        Self { section, value }
    }

    /// Does `work` on the value; the only way to change it.
    ///
    /// # Errors
    /// That of `work`; otherwise an [`Allocation`] in this step, or by a watched thread since the
    /// previous step. The value is then as `work` left it.
    pub fn step<'a, R, E: From<Allocation>>(
        &'a mut self,
        work: impl FnOnce(&'a mut T) -> Result<R, E>,
    ) -> Result<R, E> {
        let result = watch(self.section, || work(&mut self.value));
        match noted() {
            Some(allocation) => result.and(Err(allocation.into())),
            None => result,
        }
    }

    /// Goes from sealed to finished.
    pub fn finish(self) -> T {
        self.value
    }
}

impl<T> Deref for Sealed<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

/// Takes the note.
fn noted() -> Option<Allocation> {
    NOTED.lock().unwrap_or_else(PoisonError::into_inner).take()
}

/// Does `work` with this thread watched: whichever step ends next returns an [`Allocation`] made
/// here. For threads that help with steps. Sections nest, and also end when `work` unwinds.
pub fn watch<R>(section: &'static str, work: impl FnOnce() -> R) -> R {
    struct Restore(Option<&'static str>);
    impl Drop for Restore {
        fn drop(&mut self) {
            SECTION.set(self.0);
        }
    }
    let _restore = Restore(SECTION.replace(Some(section)));
    work()
}

/// Wraps the global allocator; see the [crate].
pub struct Guard<A: GlobalAlloc>(
    /// The allocator that does the work.
    pub A,
);

fn note(bytes: usize) {
    // A thread that is being torn down has left every section.
    let Ok(Some(section)) = SECTION.try_with(Cell::get) else { return };
    // The following may allocate.
    SECTION.set(None);
    let mut noted = NOTED.lock().unwrap_or_else(PoisonError::into_inner);
    noted.get_or_insert_with(|| Allocation { section, bytes, backtrace: Backtrace::capture() });
    drop(noted);
    SECTION.set(Some(section));
}

// SAFETY: every call is passed on unchanged; `note` does not unwind.
unsafe impl<A: GlobalAlloc> GlobalAlloc for Guard<A> {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout.size());
        // SAFETY: the caller's promise, passed on.
        unsafe { self.0.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note(layout.size());
        // SAFETY: the caller's promise, passed on.
        unsafe { self.0.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        note(bytes);
        // SAFETY: the caller's promise, passed on.
        unsafe { self.0.realloc(block, layout, bytes) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise, passed on.
        unsafe { self.0.dealloc(block, layout) }
    }
}
