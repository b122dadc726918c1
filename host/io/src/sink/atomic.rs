//! Files that are whole or absent.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
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
/// everything is in it; whatever has that name stays until then. Dropped before, it is removed.
///
/// Nothing is forced onto the disk: after a power failure a file just written may be empty or
/// absent. Two writers of one path must not run at once, as they share the temporary name.
pub struct Partial {
    path: PathBuf,
    partial: PathBuf,
}

impl Partial {
    /// Creates the temporary file of `path`.
    pub fn create(path: &Path) -> Result<(Partial, BufWriter<File>), Error> {
        let partial = partial_path(path)?;
        let file = File::create(&partial).map_err(Error::writing(path))?;
        let this = Partial { path: path.to_path_buf(), partial };
        Ok((this, BufWriter::with_capacity(1 << 18, file)))
    }

    /// An error in writing it.
    pub fn error(&self, e: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Error {
        Error::writing(&self.path)(io::Error::other(e))
    }

    /// Gives it its name. All must have been written.
    pub fn keep(self) -> Result<(), Error> {
        fs::rename(&self.partial, &self.path).map_err(Error::writing(&self.path))
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        // It has its name, or is of no use. The first failure is the one to tell.
        let _ = fs::remove_file(&self.partial);
    }
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
