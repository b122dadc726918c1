//! How a call ended.

use std::ffi::{CStr, c_char};
use std::fmt::{self, Display, Write as _};

use raywake_embed::{CreateError, StepError};

/// How a call ended.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CallStatus {
    /// The call succeeded.
    Ok = 0,
    /// A pointer that must not be null is null.
    NullPointer = 1,
    /// An argument is invalid.
    InvalidArgument = 2,
    /// The program was compiled with a header of another ABI.
    OtherAbi = 3,
    /// The memory given is smaller than `raywake_memory_needed` says.
    MemoryTooSmall = 4,
    /// The system has no more threads.
    NoThreads = 5,
    /// There is no estimator at this address: it was not created, or was destroyed.
    NotCreated = 6,
    /// Another thread is in a call with this estimator.
    Busy = 7,
    /// A defect of the library ended a sweep early; the estimator can only be destroyed.
    Failed = 8,
}

/// Room for an error message.
#[repr(C)]
pub struct ErrorText {
    /// UTF-8, NUL-terminated; empty if there was no error.
    pub text: [c_char; 240],
}

/// Returns what a status means, as a string.
#[unsafe(no_mangle)]
pub extern "C" fn raywake_status_text(status: i32) -> *const c_char {
    let text: &CStr = match status {
        0 => c"ok",
        1 => c"a pointer is null",
        2 => c"an argument is invalid",
        3 => c"compiled with a header of another ABI",
        4 => c"the memory is too small",
        5 => c"the system has no more threads",
        6 => c"there is no estimator at this address",
        7 => c"another thread is in a call with this estimator",
        8 => c"an internal error ended a sweep early",
        _ => c"unknown status",
    };
    text.as_ptr()
}

impl CallStatus {
    pub(crate) fn of(result: Result<(), Refusal>) -> CallStatus {
        result.map_or_else(|refusal| refusal.status, |()| CallStatus::Ok)
    }
}

impl ErrorText {
    const EMPTY: ErrorText = ErrorText { text: [0; 240] };
}

/// Text that does not fit is dropped.
impl fmt::Write for ErrorText {
    fn write_str(&mut self, more: &str) -> fmt::Result {
        let end = self.text.iter().position(|c| *c == 0).unwrap_or(0);
        // The last byte stays NUL.
        let room = &mut self.text[end..239];
        let fits = more.floor_char_boundary(room.len());
        let bytes = more.as_bytes()[..fits].iter();
        room.iter_mut().zip(bytes).for_each(|(to, byte)| *to = *byte as c_char);
        Ok(())
    }
}

/// A status with its error message. Making it allocates nothing.
pub(crate) struct Refusal {
    status: CallStatus,
    why: ErrorText,
}

impl Refusal {
    pub fn new(status: CallStatus, why: impl Display) -> Refusal {
        let mut refusal = Refusal { status, why: ErrorText::EMPTY };
        // It never fails.
        let _ = write!(refusal.why, "{why}");
        refusal
    }

    pub fn status(&self) -> CallStatus {
        self.status
    }

    pub fn null(what: &str) -> Refusal {
        Refusal::new(CallStatus::NullPointer, format_args!("`{what}` is null"))
    }

    pub fn invalid(why: impl Display) -> Refusal {
        Refusal::new(CallStatus::InvalidArgument, why)
    }
}

impl From<CreateError> for Refusal {
    fn from(e: CreateError) -> Refusal {
        let status = match e {
            CreateError::Memory(_) => CallStatus::MemoryTooSmall,
            _ => CallStatus::InvalidArgument,
        };
        Refusal::new(status, e)
    }
}

impl From<StepError> for Refusal {
    fn from(e: StepError) -> Refusal {
        let status = match e {
            StepError::Sweep(_) => CallStatus::InvalidArgument,
            StepError::Failed => CallStatus::Failed,
        };
        Refusal::new(status, e)
    }
}

/// Writes the result of a call.
///
/// # Safety
/// `to` is null or writable.
pub(crate) unsafe fn put<T>(value: T, to: *mut T, what: &str) -> Result<(), Refusal> {
    if to.is_null() {
        return Err(Refusal::null(what));
    }
    // SAFETY: guaranteed by the caller.
    unsafe { to.write_unaligned(value) };
    Ok(())
}

/// Returns the status of a call and writes its message, if there is room for it.
///
/// # Safety
/// `error` is null or writable.
pub(crate) unsafe fn report(result: Result<(), Refusal>, error: *mut ErrorText) -> CallStatus {
    let (status, why) = match result {
        Ok(()) => (CallStatus::Ok, ErrorText::EMPTY),
        Err(refusal) => (refusal.status, refusal.why),
    };
    if !error.is_null() {
        // SAFETY: guaranteed by the caller.
        unsafe { error.write_unaligned(why) };
    }
    status
}
