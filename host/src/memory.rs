//! A check that the system has enough memory.

use crate::error::RunError;

/// Requests memory from the system and frees it again: refused here, only the command fails;
/// refused later, the process aborts.
///
/// # Errors
/// [`RunError::NoMemory`].
pub fn probe_memory(bytes: u64) -> Result<(), RunError> {
    let mut room = Vec::<u8>::new();
    let given = room.try_reserve_exact(usize::try_from(bytes).unwrap_or(usize::MAX));
    // Otherwise the compiler may remove the unused allocation.
    std::hint::black_box(&room);
    given.map_err(|_| RunError::NoMemory { bytes })
}
