//! Requests to Valgrind's Callgrind from the program it watches: instructions that do nothing on a
//! processor and that Valgrind recognises (`valgrind.h`, "client requests").

#![no_std]
#![deny(missing_docs)]

use core::ffi::CStr;

/// `VG_USERREQ__RUNNING_ON_VALGRIND`.
const RUNNING_ON_VALGRIND: usize = 0x1001;
/// `VG_USERREQ__DUMP_STATS_AT`: the tool's letters, "CT", and its number.
const DUMP_STATS_AT: usize = (b'C' as usize) << 24 | (b'T' as usize) << 16 | 3;

/// Whether Valgrind is watching; always false on processors other than x86-64, where it is not
/// asked.
pub fn is_under_valgrind() -> bool {
    // SAFETY: it has no argument.
    unsafe { request(RUNNING_ON_VALGRIND, core::ptr::null()) != 0 }
}

/// Has the instruction counts since the last dump written out under a name. Does nothing if not
/// watched.
pub fn dump(name: &CStr) {
    // SAFETY: the argument is a null-terminated string and is only read.
    unsafe { request(DUMP_STATS_AT, name.as_ptr()) };
}

/// Makes a request with its argument. Returns the answer, 0 if not watched.
///
/// # Safety
/// The argument must be what that request takes.
#[cfg(target_arch = "x86_64")]
unsafe fn request(number: usize, argument: *const core::ffi::c_char) -> usize {
    let words = [number, argument as usize, 0, 0, 0, 0];
    let mut answer = 0;
    // SAFETY: rotations by 128 bits in total leave `rdi` unchanged, and exchanging a register with
    // itself changes nothing. Valgrind reads the words; the caller is responsible for what they
    // point to.
    unsafe {
        core::arch::asm!(
            "rol rdi, 3", "rol rdi, 13", "rol rdi, 61", "rol rdi, 51", "xchg rbx, rbx",
            in("rax") words.as_ptr(), inout("rdx") answer, options(nostack),
        );
    }
    answer
}

#[cfg(not(target_arch = "x86_64"))]
unsafe fn request(_: usize, _: *const core::ffi::c_char) -> usize {
    0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A register not as it was before, or a word that was written to, would show in the values
    /// kept around it.
    #[test]
    fn nothing_changes_without_a_viewer() {
        let around: [u64; 16] = core::array::from_fn(|n| u64::MAX / (n as u64 + 1));
        let kept = core::hint::black_box(around);
        (0..1000).for_each(|_| dump(c"stage"));
        assert!(!is_under_valgrind());
        assert_eq!(core::hint::black_box(kept), around);
    }
}
