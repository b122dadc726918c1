//! Files that are whole or absent.

use std::ffi::OsStr;
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::Error;

/// Writes `path` whole or not at all, see [`Partial`].
///
/// Fails with the system's reason (disk full, permission, no such folder), or with what `content`
/// returned; the temporary file is then gone.
pub fn write(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Error> {
    let (partial, mut writer) = Partial::create(path)?;
    let result = content(&mut writer).and_then(|()| writer.flush());
    result.map_err(|e| partial.error(e))?;
    partial.keep()
}

/// A temporary file `.NAME.partial` beside the file that it will be, which takes the name only when
/// everything is in it and on the disk; whatever has that name stays until then. Dropped before, it
/// is removed; what a process that was killed has left is removed by the next one.
pub struct Partial {
    path: PathBuf,
    partial: PathBuf,
    /// The open file again, for what is done at the end. While it is open it is locked.
    file: File,
    kept: bool,
}

/// How often another process may remove a temporary file just before it is locked.
const ATTEMPTS: usize = 8;

impl Partial {
    /// Creates the temporary file of `path`. Fails where another process is writing it.
    pub fn create(path: &Path) -> Result<(Partial, BufWriter<File>), Error> {
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

    /// Gives it its name. All must have been written.
    pub fn keep(mut self) -> Result<(), Error> {
        match self.file.sync_data() {
            // Some file systems cannot.
            Err(e) if !matches!(e.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported) => {
                return Err(Error::writing(&self.path)(e));
            }
            _ => (),
        }
        fs::rename(&self.partial, &self.path).map_err(Error::writing(&self.path))?;
        self.kept = true;
        Ok(())
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        // With its own name it is done; by now another process may use the temporary one. Without,
        // it is of no use. The first failure is the one to tell.
        if !self.kept {
            let _ = fs::remove_file(&self.partial);
        }
    }
}

/// Creates a file that was not there and locks it. One that is there is left by a process that was
/// killed, unless it is locked; it is removed, and not opened for writing: it may be a link.
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
                // While it is locked here nobody else removes it.
                match LeftOver::at(path)? {
                    LeftOver::Gone => (),
                    LeftOver::Locked => return Err(busy()),
                    LeftOver::Free(_locked) => fs::remove_file(path)?,
                }
            }
            Err(e) => return Err(e),
        }
    }
    Err(busy())
}

/// What is where a temporary file is to be.
enum LeftOver {
    /// Nothing any more: it has got its name, or another process has removed it.
    Gone,
    /// What another process is writing.
    Locked,
    /// What nobody writes, locked while this lives where it is an ordinary file.
    Free(Option<File>),
}

impl LeftOver {
    fn at(path: &Path) -> io::Result<LeftOver> {
        let gone = |e: &io::Error| e.kind() == ErrorKind::NotFound;
        // Opening a pipe would wait for its other end.
        match path.symlink_metadata() {
            Ok(there) if there.is_file() => (),
            Err(e) if gone(&e) => return Ok(LeftOver::Gone),
            other => return other.map(|_| LeftOver::Free(None)),
        }
        Ok(match File::open(path) {
            Err(e) if gone(&e) => LeftOver::Gone,
            Ok(file) if !lock(&file) => LeftOver::Locked,
            Ok(file) if !is_at(&file, path) => LeftOver::Gone,
            file => LeftOver::Free(file.ok()),
        })
    }
}

/// Locks a file or folder, unless another process has: then `false`. Where there are no locks, none
/// has.
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

/// Open files cannot be removed there.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

/// A folder that no other process writes results to, while this value lives.
#[derive(Debug)]
pub struct FolderClaim {
    /// None where folders cannot be opened.
    _locked: Option<File>,
}

/// Creates a folder, with those above it, and claims it. Fails where another process has.
pub fn claim_folder(path: &Path) -> Result<FolderClaim, Error> {
    create_folder(path)?;
    let folder = File::open(path).ok();
    if folder.as_ref().is_some_and(|folder| !lock(folder)) {
        let what = "another process is writing results into it";
        return Err(Error::writing(path)(io::Error::new(ErrorKind::ResourceBusy, what)));
    }
    Ok(FolderClaim { _locked: folder })
}

/// Creates a folder and those above it.
pub fn create_folder(path: &Path) -> Result<(), Error> {
    fs::create_dir_all(path).map_err(Error::writing(path))
}

/// The temporary name.
fn partial_path(path: &Path) -> Result<PathBuf, Error> {
    let name = path.file_name().ok_or_else(|| {
        Error::writing(path)(io::Error::new(io::ErrorKind::InvalidInput, "is not a file name"))
    })?;
    let partial = [OsStr::new("."), name, OsStr::new(".partial")].join(OsStr::new(""));
    Ok(path.with_file_name(partial))
}
