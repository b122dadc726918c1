//! Memory that the system gives, or not.

use crate::error::RunError;

/// Asks the system for memory and gives it back: a refusal ends the process later, and here the
/// command.
///
/// # Errors
/// [`RunError::NoMemory`].
pub fn ask_for(bytes: u64) -> Result<(), RunError> {
    let mut room = Vec::<u8>::new();
    let given = room.try_reserve_exact(usize::try_from(bytes).unwrap_or(usize::MAX));
    // Else the compiler may leave out what is not used.
    std::hint::black_box(&room);
    given.map_err(|_| RunError::NoMemory { bytes })
}
