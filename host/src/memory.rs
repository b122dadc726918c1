//! Lack of memory is an error with an exit code of its own.

use std::io::Write;

use raywake_alloc_guard::is_granted;

use crate::error::RunError;

/// Requests memory from the system and frees it again: refused here, only the command fails;
/// refused later, the process ends.
///
/// # Errors
/// [`RunError::NoMemory`].
pub fn probe_memory(bytes: u64) -> Result<(), RunError> {
    let granted = usize::try_from(bytes).is_ok_and(is_granted);
    granted.then_some(()).ok_or(RunError::NoMemory { bytes })
}

/// Ends the process with the error and the exit code of [`RunError::NoMemory`]. For the allocator
/// to call: it allocates nothing.
pub extern "C" fn end(bytes: usize) {
    let e = RunError::NoMemory { bytes: bytes as u64 };
    let _ = writeln!(std::io::stderr(), "raywake: {e}");
    std::process::exit(e.exit_code().into());
}
