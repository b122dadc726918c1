//! Files that are read at once: regular ones, no longer than any of their kind.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use raywake_core::sweep::Point;

use crate::Error;

/// Longest file that is read at once, bytes: 16 million returns of a `.bin`, a hundred times those
/// of a sweep, and the poses of two million sweeps. The limit also holds while the file is read: a
/// file may grow.
pub(super) const SIZE_MAX: u64 = 256 << 20;

/// Longest file of settings, or of a sensor's metadata, bytes. An Ouster's has 7 to 11 KB
/// (`tests/packets`); the TOML parser needs up to 75 bytes of memory for each byte of the file.
const SETTINGS_MAX: u64 = 1 << 20;

/// What a packed file may unpack to: this many bytes, plus this many times its own size. Files of
/// an Argoverse 2 log unpack to at most six times their size; zeros pack to nothing, and 16 MiB are
/// 64 bytes for each return of the largest sweep.
const UNPACKED_BASE: u64 = 16 << 20;
const UNPACKED_RATIO: u64 = 64;
/// Minimum size of a row, however little it unpacks to.
const ROW: u64 = size_of::<Point>() as u64;

/// Maximum number of bytes to which this many packed bytes may unpack.
pub(super) fn unpacked_max(packed: u64) -> u64 {
    packed.saturating_mul(UNPACKED_RATIO).saturating_add(UNPACKED_BASE)
}

/// Checks that a file that is read at once, of `packed` bytes, may unpack to this many bytes and
/// rows.
pub(super) fn check_unpacked(packed: usize, bytes: u64, rows: u64) -> Result<(), String> {
    let most = unpacked_max(packed as u64).min(SIZE_MAX);
    match bytes.max(rows.saturating_mul(ROW)) {
        bytes if bytes > most => Err(format!("unpacks to {bytes} bytes, at most {most} are read")),
        _ => Ok(()),
    }
}

/// The contents of a file of at most [`SIZE_MAX`] bytes.
///
/// # Errors
/// If it is not a regular file, and so may never end or never begin, and if it is too long.
pub fn read(path: &Path) -> Result<Vec<u8>, Error> {
    read_up_to(path, SIZE_MAX)
}

/// Opens a regular file and returns it with its length, bytes.
///
/// # Errors
/// As for [`read`], except that it may have any length.
pub(super) fn open(path: &Path) -> Result<(File, u64), Error> {
    // Checked before it is opened: opening a pipe waits for its other end.
    let metadata = path.metadata().map_err(Error::reading(path))?;
    if metadata.is_dir() {
        return Err(Error::reading(path)(io::ErrorKind::IsADirectory.into()));
    }
    if !metadata.is_file() {
        return Err(Error::input(path, "", "is not a regular file, but a device or a pipe"));
    }
    Ok((File::open(path).map_err(Error::reading(path))?, metadata.len()))
}

/// The contents of a file of at most this many bytes, see [`read`].
pub(super) fn read_up_to(path: &Path, most: u64) -> Result<Vec<u8>, Error> {
    let too_long = |size: u64| {
        Error::input(path, "", format!("has {size} bytes or more, at most {most} are read"))
    };
    let (file, length) = open(path)?;
    if length > most {
        return Err(too_long(length));
    }
    let mut bytes = Vec::new();
    let room = bytes.try_reserve_exact(length as usize);
    room.map_err(|_| Error::reading(path)(io::ErrorKind::OutOfMemory.into()))?;
    file.take(most + 1).read_to_end(&mut bytes).map_err(Error::reading(path))?;
    if bytes.len() as u64 > most {
        return Err(too_long(most + 1));
    }
    Ok(bytes)
}

/// The contents of a text file.
pub fn read_text(path: &Path) -> Result<String, Error> {
    utf8(path, read(path)?)
}

/// The contents of a file of settings.
pub fn read_settings(path: &Path) -> Result<String, Error> {
    utf8(path, read_up_to(path, SETTINGS_MAX)?)
}

fn utf8(path: &Path, bytes: Vec<u8>) -> Result<String, Error> {
    String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        Error::input(path, format!("byte {at}"), "is not UTF-8 text")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::tests::Temp;

    #[test]
    fn files_of_any_kind() {
        let t = Temp::new();
        let path = t.write("a", [0x61; 10]);
        assert_eq!(read_up_to(&path, 10).unwrap().len(), 10);
        assert_eq!(read_text(&path).unwrap(), "aaaaaaaaaa");
        assert_eq!(read_settings(&path).unwrap(), "aaaaaaaaaa");
        let long = t.write("long", vec![b'#'; SETTINGS_MAX as usize + 1]);
        assert!(read_settings(&long).unwrap_err().to_string().contains("at most 1048576 are read"));
        let e = read_up_to(&path, 9).unwrap_err();
        assert!(e.to_string().ends_with("a: has 10 bytes or more, at most 9 are read"), "{e}");
        t.write("a", [0x61, 0xff]);
        let e = read_text(&path).unwrap_err().to_string();
        assert!(e.ends_with("a, byte 1: is not UTF-8 text"), "{e}");
        assert!(matches!(read(t.path()), Err(Error::Read { .. })));
        assert!(matches!(read(&t.path().join("absent")), Err(Error::Read { .. })));
    }

    #[cfg(unix)]
    #[test]
    fn endless_files() {
        let t = Temp::new();
        let endless = t.path().join("a.bin");
        std::os::unix::fs::symlink("/dev/zero", &endless).unwrap();
        let e = read(&endless).unwrap_err();
        assert!(e.to_string().ends_with("a device or a pipe") && e.exit_code() == 3, "{e}");
    }
}
