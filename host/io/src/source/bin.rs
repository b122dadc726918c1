//! `.bin` files: little-endian float32 x, y, z, intensity per return.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use raywake_core::sweep::Point;

use crate::Error;

/// Bytes of one return.
const RETURN: usize = 16;

/// Bytes read at once, a multiple of [`RETURN`].
const CHUNK: usize = 1 << 16;

/// Largest file that is read: 16 million returns, a hundred times what a sweep has.
pub(super) const SIZE_MAX: u64 = 256 << 20;

/// Replaces `points` by the returns of a `.bin` file; an empty file has none.
///
/// Fails, leaving no points, where the file cannot be read or ends within a return.
pub(super) fn read(path: &Path, points: &mut Vec<Point>) -> Result<(), Error> {
    points.clear();
    let mut file = File::open(path).map_err(Error::reading(path))?;
    let size = file.metadata().map_err(Error::reading(path))?.len();
    if size > SIZE_MAX {
        let what = format!("{size} bytes are too many for a sweep (at most {SIZE_MAX})");
        return Err(Error::input(path, "", what));
    }
    points.reserve((size / RETURN as u64) as usize);
    let mut chunk = vec![0; CHUNK];
    let mut total = 0;
    loop {
        let read = match fill(&mut file, &mut chunk) {
            Ok(read) => read,
            Err(e) => {
                points.clear();
                return Err(Error::reading(path)(e));
            }
        };
        total += read;
        let (returns, rest) = chunk[..read].as_chunks::<RETURN>();
        if !rest.is_empty() {
            points.clear();
            let what = format!(
                "{total} bytes, not a multiple of {RETURN} (float32 x, y, z, intensity): truncated?"
            );
            return Err(Error::input(path, "", what));
        }
        points.extend(returns.iter().map(decode));
        if read < CHUNK {
            return Ok(());
        }
    }
}

/// One return.
fn decode(bytes: &[u8; RETURN]) -> Point {
    let (floats, _) = bytes.as_chunks::<4>();
    let value = |i: usize| f32::from_le_bytes(floats[i]);
    Point { position: [value(0), value(1), value(2)], intensity: value(3), ..Point::default() }
}

/// Fills the buffer as far as the file goes.
fn fill(file: &mut File, buffer: &mut [u8]) -> std::io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match file.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(n) => filled += n,
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(filled)
}
