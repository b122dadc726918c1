//! Third-party decoders that panic on damaged files.
//!
//! Parquet's panics if a page's levels are cut short, Arrow's if a buffer ends within a number, and
//! MCAP's if a record is longer than its chunk, as our profiles enable overflow checks. The file
//! being decoded is recorded meanwhile, so that the program can say which file is damaged, however
//! its panics end.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use crate::Error;

thread_local! {
    static DECODED: RefCell<Option<PathBuf>> = const { RefCell::new(None) };
}

/// The error for the file whose decoder is panicking on this thread, for the program's panic hook.
pub fn damaged() -> Option<Error> {
    DECODED.with_borrow(|path| path.as_deref().map(error))
}

fn error(path: &Path) -> Error {
    Error::input(path, "", "is damaged: it cannot be decoded")
}

/// Runs a decoder on a file. If it panics, the error is that of [`damaged`], provided panics
/// unwind.
pub(super) fn guarded<T>(path: &Path, decode: impl FnOnce() -> T) -> Result<T, Error> {
    DECODED.set(Some(path.to_path_buf()));
    let decoded = catch_unwind(AssertUnwindSafe(decode));
    DECODED.set(None);
    decoded.map_err(|_| error(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_names_the_file() {
        let path = Path::new("some.parquet");
        assert_eq!((guarded(path, || 1).unwrap(), damaged().is_none()), (1, true));
        let e = guarded(path, || assert!(damaged().is_none(), "named")).unwrap_err();
        assert!(e.to_string().contains("some.parquet: is damaged") && e.exit_code() == 3, "{e}");
        assert!(damaged().is_none());
    }
}
