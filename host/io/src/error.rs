//! Errors in inputs, in outputs and in requests for them.

use std::io;
use std::path::{Path, PathBuf};

/// A failure the user can act on. Its message names the file and the place in it.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The command line asks for something inconsistent.
    #[error("{0}")]
    Usage(String),
    /// This build lacks a feature the input or output needs.
    #[error("{0}")]
    Unsupported(String),
    /// An input file or folder can be read but makes no sense.
    #[error("{}{}{place}: {what}", .path.display(), if .place.is_empty() { "" } else { ", " })]
    Input {
        /// File or folder.
        path: PathBuf,
        /// Line, row or byte ("line 3"); empty if the whole file is meant.
        place: String,
        /// What is wrong there.
        what: String,
    },
    /// The operating system refused to read.
    #[error("cannot read {}: {source}", .path.display())]
    Read {
        /// File or folder.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The operating system refused to write (disk full, permission).
    #[error("cannot write {}: {source}", .path.display())]
    Write {
        /// File or folder.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
}

impl Error {
    /// [`Error::Input`] about a place in a file; an empty `place` means all of it.
    pub fn input(path: &Path, place: impl Into<String>, what: impl Into<String>) -> Error {
        Error::Input { path: path.to_path_buf(), place: place.into(), what: what.into() }
    }

    /// [`Error::Unsupported`] because a feature is not compiled in.
    pub fn missing_feature(what: impl std::fmt::Display, feature: &str) -> Error {
        let text = format!(
            "{what} needs the feature `{feature}`, which is not compiled in: build raywake with \
             --all-features"
        );
        Error::Unsupported(text)
    }

    /// Maps an I/O error in reading `path`, for `map_err`.
    pub fn reading(path: &Path) -> impl FnOnce(io::Error) -> Error + '_ {
        move |source| Error::Read { path: path.to_path_buf(), source }
    }

    /// Maps an I/O error in writing `path`, for `map_err`.
    pub fn writing(path: &Path) -> impl FnOnce(io::Error) -> Error + '_ {
        move |source| Error::Write { path: path.to_path_buf(), source }
    }

    /// Exit code of a program that ends with this error: 2 for usage (and features this build
    /// lacks), 3 for input, 4 for output.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Usage(_) | Error::Unsupported(_) => 2,
            Error::Input { .. } | Error::Read { .. } => 3,
            Error::Write { .. } => 4,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_and_codes() {
        let path = Path::new("a/poses.txt");
        let e = Error::input(path, "line 3", "12 numbers expected, 11 found");
        assert_eq!(e.to_string(), "a/poses.txt, line 3: 12 numbers expected, 11 found");
        assert_eq!(e.exit_code(), 3);
        assert_eq!(Error::input(path, "", "empty").to_string(), "a/poses.txt: empty");
        let full = Error::writing(path)(io::Error::other("disk full"));
        assert_eq!(full.to_string(), "cannot write a/poses.txt: disk full");
        assert_eq!(full.exit_code(), 4);
        assert_eq!(Error::Usage("x".into()).exit_code(), 2);
    }
}
