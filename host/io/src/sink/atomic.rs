//! Files that are whole or absent.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::Error;

/// Writes `path` through a temporary file `.NAME.partial` in the same folder, which takes the name
/// only when everything is in it; whatever was at `path` stays until then.
///
/// Nothing is forced onto the disk: after a power failure a file just written may be empty or
/// absent. Two writers of one path must not run at once, as they share the temporary name.
///
/// Fails with the system's reason (disk full, permission, no such folder), or with what `content`
/// returned; the temporary file is then gone.
pub fn write(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Error> {
    let partial = partial_path(path)?;
    let result = write_partial(&partial, content).and_then(|()| fs::rename(&partial, path));
    result.map_err(|e| {
        // The first failure is the one to tell; a file that was never made cannot be removed.
        let _ = fs::remove_file(&partial);
        Error::writing(path)(e)
    })
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

fn write_partial(
    partial: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let mut writer = BufWriter::with_capacity(1 << 18, File::create(partial)?);
    content(&mut writer)?;
    writer.flush()
}
