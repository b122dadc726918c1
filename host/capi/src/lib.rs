//! `libraywake`: temporal scene flow from LIDAR for C and C++, with the header `raywake.h`.
//!
//! Nothing unwinds into the caller, nothing is allocated after `raywake_create`, and every call
//! checks its arguments as far as it can. See `raywake.h`, which is generated from this crate.
#![deny(missing_docs)]
#![expect(clippy::result_large_err, reason = "a refusal carries its text: it allocates nothing")]

mod create;
mod handle;
mod read;
mod status;
mod step;

use std::ffi::{CStr, c_char};

pub use create::*;
pub use handle::{Handle, raywake_destroy};
pub use read::*;
pub use status::*;
pub use step::*;

/// Version of this interface: structs, functions and their meaning. A different number is a
/// different interface; the shared library is named after it.
pub const RAYWAKE_ABI_VERSION: u32 = 2;

/// Returns `RAYWAKE_ABI_VERSION` of the library that is loaded.
#[unsafe(no_mangle)]
pub extern "C" fn raywake_abi_version() -> u32 {
    RAYWAKE_ABI_VERSION
}

/// Returns the version of the library as a string.
#[unsafe(no_mangle)]
pub extern "C" fn raywake_version() -> *const c_char {
    VERSION.as_ptr()
}

const VERSION: &CStr =
    match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
        Ok(version) => version,
        Err(_) => panic!("a version without a NUL"),
    };
