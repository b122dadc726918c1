//! Files that are complete or absent.

use std::ffi::OsStr;
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::Error;

/// Writes `path` completely or not at all, see [`Partial`].
///
/// Fails with the system's reason (disk full, permission, no such folder), or with what `content`
/// returned; the temporary file is removed.
pub fn write(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Error> {
    let (partial, mut writer) = Partial::create(path)?;
    let result = content(&mut writer).and_then(|()| writer.flush());
    result.map_err(|e| partial.error(e))?;
    partial.keep()
}

/// A temporary file `.NAME.partial` next to the final one. It takes the final name only once
/// everything is written and on disk; until then, any existing file of that name stays. If dropped
/// earlier, it is removed; one left by a killed process is removed by the next process.
pub struct Partial {
    path: PathBuf,
    partial: PathBuf,
    /// A second handle of the open file, for the last steps. The file is locked while it is open.
    file: File,
    kept: bool,
}

/// Maximum number of attempts, as another process may remove a temporary file just before it is
/// locked.
const ATTEMPTS: usize = 8;

impl Partial {
    /// Creates the temporary file of `path`. Fails if another process is writing it.
    pub fn create(path: &Path) -> Result<(Partial, BufWriter<File>), Error> {
        // A device or pipe would be replaced by a file.
        if path.metadata().is_ok_and(|there| !there.is_file() && !there.is_dir()) {
            let what = io::Error::new(ErrorKind::InvalidInput, "not a regular file");
            return Err(Error::writing(path)(what));
        }
        let partial = partial_path(path)?;
        let file = create_locked(&partial).map_err(Error::writing(path))?;
        let again = file.try_clone().map_err(Error::writing(path))?;
        let this = Partial { path: path.to_path_buf(), partial, file: again, kept: false };
        Ok((this, BufWriter::with_capacity(1 << 18, file)))
    }

    /// An error in writing it.
    pub fn error(&self, e: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Error {
        Error::writing(&self.path)(io::Error::other(e))
    }

    /// Gives the file its final name. Everything must have been written.
    pub fn keep(mut self) -> Result<(), Error> {
        match self.file.sync_data() {
            // Some file systems do not support it.
            Err(e) if !matches!(e.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported) => {
                return Err(Error::writing(&self.path)(e));
            }
            _ => (),
        }
        fs::rename(&self.partial, &self.path).map_err(Error::writing(&self.path))?;
        self.kept = true;
        Ok(())
    }

    /// Keeps what has been written, next to the path: `a.incomplete.mcap` for `a.mcap`. Returns
    /// where it is.
    pub fn keep_incomplete(mut self) -> Result<PathBuf, Error> {
        let extension = self.path.extension().map(|e| e.display().to_string());
        let extension = extension.map_or("incomplete".into(), |e| format!("incomplete.{e}"));
        let path = self.path.with_extension(extension);
        fs::rename(&self.partial, &path).map_err(Error::writing(&path))?;
        self.kept = true;
        Ok(path)
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        // Once renamed, the file is done, and another process may be using the temporary name. If
        // not, it is of no use. The first failure is the one to report.
        if !self.kept {
            let _ = fs::remove_file(&self.partial);
        }
    }
}

/// Creates a file that did not exist and locks it. An existing one was left by a killed process
/// unless it is locked; it is removed rather than opened for writing, as it may be a link.
fn create_locked(path: &Path) -> io::Result<File> {
    let busy = || io::Error::new(ErrorKind::ResourceBusy, "another process is writing it");
    for _ in 0..ATTEMPTS {
        match File::options().write(true).create_new(true).open(path) {
            Ok(file) => {
                if lock(&file) && is_at(&file, path) {
                    return Ok(file);
                }
            }
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {
                // While it is locked here, nobody else removes it.
                match Leftover::at(path)? {
                    Leftover::Gone => (),
                    Leftover::Locked => return Err(busy()),
                    Leftover::Free(_locked) => fs::remove_file(path)?,
                }
            }
            Err(e) => return Err(e),
        }
    }
    Err(busy())
}

/// What already exists at the path of a temporary file.
enum Leftover {
    /// Nothing any more: it was renamed, or another process removed it.
    Gone,
    /// A file that another process is writing.
    Locked,
    /// A file that nobody is writing; if it is a regular file, it is locked while this lives.
    Free(Option<File>),
}

impl Leftover {
    fn at(path: &Path) -> io::Result<Leftover> {
        let gone = |e: &io::Error| e.kind() == ErrorKind::NotFound;
        // Opening a pipe would wait for its other end.
        match path.symlink_metadata() {
            Ok(there) if there.is_file() => (),
            Err(e) if gone(&e) => return Ok(Leftover::Gone),
            other => return other.map(|_| Leftover::Free(None)),
        }
        Ok(match File::open(path) {
            Err(e) if gone(&e) => Leftover::Gone,
            Ok(file) if !lock(&file) => Leftover::Locked,
            Ok(file) if !is_at(&file, path) => Leftover::Gone,
            file => Leftover::Free(file.ok()),
        })
    }
}

/// Locks a file or folder; `false` if another process has locked it. Where locks are not supported,
/// none has.
fn lock(file: &File) -> bool {
    !matches!(file.try_lock(), Err(TryLockError::WouldBlock))
}

/// Whether a file is still at the path where it was opened.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let of = |metadata: io::Result<fs::Metadata>| metadata.map(|m| (m.dev(), m.ino())).ok();
    of(file.metadata()) == of(path.symlink_metadata())
}

/// Open files cannot be removed on these systems.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

/// A folder to which no other process writes results while this value lives.
#[derive(Debug)]
pub struct FolderClaim {
    /// `None` if folders cannot be opened.
    _locked: Option<File>,
}

/// Creates a folder and its parents, and claims it. Fails if another process has claimed it.
pub fn claim_folder(path: &Path) -> Result<FolderClaim, Error> {
    create_folder(path)?;
    let folder = File::open(path).ok();
    if folder.as_ref().is_some_and(|folder| !lock(folder)) {
        let what = "another process is writing results into it";
        return Err(Error::writing(path)(io::Error::new(ErrorKind::ResourceBusy, what)));
    }
    Ok(FolderClaim { _locked: folder })
}

/// Creates a folder and its parents.
pub fn create_folder(path: &Path) -> Result<(), Error> {
    fs::create_dir_all(path).map_err(Error::writing(path))
}

/// The temporary path.
fn partial_path(path: &Path) -> Result<PathBuf, Error> {
    let name = path.file_name().ok_or_else(|| {
        Error::writing(path)(io::Error::new(io::ErrorKind::InvalidInput, "not a file name"))
    })?;
    let partial = [OsStr::new("."), name, OsStr::new(".partial")].join(OsStr::new(""));
    Ok(path.with_file_name(partial))
}
