//! What an estimator pointer points to.

use std::mem::MaybeUninit;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use raywake_embed::TeamEstimator;

use crate::status::{CallStatus, Refusal};

/// An estimator in the caller's memory.
pub struct Handle {
    /// [`Handle::LIVE`] from creation to destruction.
    mark: AtomicU64,
    /// Set while a thread is in a call.
    busy: AtomicBool,
    team: TeamEstimator,
}

/// Exclusive use of an estimator, until this is dropped.
pub(crate) struct ExclusiveUse(NonNull<Handle>);

impl Handle {
    /// Number of bytes it takes, at any alignment.
    pub(crate) const BYTES: usize = size_of::<Handle>() + align_of::<Handle>() - 1;

    const LIVE: u64 = u64::from_le_bytes(*b"raywake1");

    /// Puts an estimator into [`Handle::BYTES`] bytes of memory.
    pub(crate) fn put(team: TeamEstimator, memory: &'static mut [MaybeUninit<u8>]) -> *mut Handle {
        let skip = memory.as_ptr().align_offset(align_of::<Handle>());
        let place = memory[skip..][..size_of::<Handle>()].as_mut_ptr().cast::<Handle>();
        // SAFETY: enough bytes, aligned, that belong to this library.
        unsafe { place.write(Handle::new(team)) };
        place
    }

    fn new(team: TeamEstimator) -> Handle {
        Handle { mark: AtomicU64::new(Handle::LIVE), busy: AtomicBool::new(false), team }
    }

    /// # Safety
    /// `handle` is null, or was an estimator once and its memory still exists.
    pub(crate) unsafe fn enter(handle: *mut Handle) -> Result<ExclusiveUse, Refusal> {
        let place = NonNull::new(handle).ok_or_else(|| Refusal::null("estimator"))?;
        let not_created = || Refusal::new(CallStatus::NotCreated, "there is no estimator here");
        if !place.is_aligned() {
            return Err(not_created());
        }
        // SAFETY: guaranteed by the caller; it may hold any bits.
        let mark = unsafe { &(*place.as_ptr()).mark };
        if mark.load(Ordering::Acquire) != Handle::LIVE {
            return Err(not_created());
        }
        // SAFETY: the estimator is live, so this is a bool.
        let busy = unsafe { &(*place.as_ptr()).busy };
        if busy.swap(true, Ordering::Acquire) {
            return Err(Refusal::new(CallStatus::Busy, "another thread is in a call"));
        }
        Ok(ExclusiveUse(place))
    }
}

impl ExclusiveUse {
    pub(crate) fn team(&mut self) -> &mut TeamEstimator {
        // SAFETY: `busy` keeps all others out.
        unsafe { &mut (*self.0.as_ptr()).team }
    }
}

impl Drop for ExclusiveUse {
    fn drop(&mut self) {
        // SAFETY: as above.
        unsafe { (*self.0.as_ptr()).busy.store(false, Ordering::Release) }
    }
}

/// Destroys an estimator and ends its threads. Its memory is the caller's again.
///
/// # Safety
/// `estimator` is null, or was an estimator once and its memory still exists.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn raywake_destroy(estimator: *mut Handle) -> CallStatus {
    // SAFETY: guaranteed by the caller.
    match unsafe { Handle::enter(estimator) } {
        Ok(turn) => {
            let handle = turn.0.as_ptr();
            std::mem::forget(turn);
            // SAFETY: no other thread is in a call, and none can enter one.
            unsafe {
                (*handle).mark.store(0, Ordering::Release);
                std::ptr::drop_in_place(&raw mut (*handle).team);
            }
            CallStatus::Ok
        }
        Err(refusal) => refusal.status(),
    }
}
