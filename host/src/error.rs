//! What can go wrong between the files of the user and the device, and the exit code of each.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use raywake_gpu::GpuError;

/// A failure the user can act on. Its text names the file and the place in it.
#[derive(Debug)]
pub enum Error {
    /// The command line asks for something that does not fit together.
    Usage(String),
    /// This build lacks a feature the input or output needs.
    Unsupported(String),
    /// An input file or folder that can be read but makes no sense.
    Input {
        /// File or folder.
        path: PathBuf,
        /// Line, row or byte ("line 3"); empty where the whole file is meant.
        place: String,
        /// What is wrong there.
        what: String,
    },
    /// The operating system refuses to read.
    Read {
        /// File or folder.
        path: PathBuf,
        /// Its reason.
        source: io::Error,
    },
    /// The operating system refuses to write (disk full, permission).
    Write {
        /// File or folder.
        path: PathBuf,
        /// Its reason.
        source: io::Error,
    },
    /// The Vulkan device, or the lack of one.
    Device(GpuError),
    /// More memory than the user allows.
    OverBudget {
        /// What is needed, bytes.
        bytes: u64,
        /// What is allowed, bytes.
        limit: u64,
    },
}

impl Error {
    /// [`Error::Input`] about a place in a file; an empty `place` means all of it.
    pub fn input(path: &Path, place: impl Into<String>, what: impl Into<String>) -> Error {
        Error::Input { path: path.to_path_buf(), place: place.into(), what: what.into() }
    }

    /// For `map_err` on reading `path`.
    pub fn reading(path: &Path) -> impl FnOnce(io::Error) -> Error + '_ {
        move |source| Error::Read { path: path.to_path_buf(), source }
    }

    /// For `map_err` on writing `path`.
    pub fn writing(path: &Path) -> impl FnOnce(io::Error) -> Error + '_ {
        move |source| Error::Write { path: path.to_path_buf(), source }
    }

    /// Exit code of the process: 2 for usage (and what this build cannot do), 3 for input, 4 for
    /// output, 5 for the device, 6 for memory over a limit.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Usage(_) | Error::Unsupported(_) => 2,
            Error::Input { .. } | Error::Read { .. } => 3,
            Error::Write { .. } => 4,
            Error::Device(_) => 5,
            Error::OverBudget { .. } => 6,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Usage(what) | Error::Unsupported(what) => f.write_str(what),
            Error::Input { path, place, what } if place.is_empty() => {
                write!(f, "{}: {what}", path.display())
            }
            Error::Input { path, place, what } => {
                write!(f, "{}, {place}: {what}", path.display())
            }
            Error::Read { path, source } => write!(f, "cannot read {}: {source}", path.display()),
            Error::Write { path, source } => write!(f, "cannot write {}: {source}", path.display()),
            Error::Device(e @ (GpuError::NoLoader | GpuError::NoDevice)) => {
                write!(f, "{e}: see `raywake devices`, or give --backend scalar")
            }
            Error::Device(e) => write!(f, "device: {e}"),
            Error::OverBudget { bytes, limit } => {
                write!(f, "{bytes} bytes are needed, the limit is {limit}")
            }
        }
    }
}

impl From<GpuError> for Error {
    fn from(e: GpuError) -> Error {
        Error::Device(e)
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Error::Read { source, .. } | Error::Write { source, .. } => Some(source),
            Error::Device(e) => Some(e),
            _ => None,
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
        let device = Error::from(GpuError::NoLoader);
        assert!(device.to_string().starts_with("no Vulkan loader found: see"));
        assert_eq!(device.exit_code(), 5);
        assert_eq!(Error::OverBudget { bytes: 2, limit: 1 }.exit_code(), 6);
    }
}
