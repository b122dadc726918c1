//! `.bin` files: little-endian float32 x, y, z, intensity per return.

use std::path::Path;

use raywake_core::sweep::Point;

use super::returns::load;
use crate::Error;

/// Bytes of one return.
const RETURN: usize = 16;

/// Replaces `points` by the returns of a `.bin` file; an empty file has none.
///
/// Fails, leaving no points, where the file cannot be read or ends within a return.
pub(super) fn read(path: &Path, points: &mut Vec<Point>) -> Result<(), Error> {
    points.clear();
    let bytes = load(path)?;
    let (returns, rest) = bytes.as_chunks::<RETURN>();
    if !rest.is_empty() {
        let what = format!(
            "{} bytes, not a multiple of {RETURN} (float32 x, y, z, intensity): truncated?",
            bytes.len()
        );
        return Err(Error::input(path, "", what));
    }
    points.extend(returns.iter().map(decode));
    Ok(())
}

/// One return.
fn decode(bytes: &[u8; RETURN]) -> Point {
    let (floats, _) = bytes.as_chunks::<4>();
    let value = |i: usize| f32::from_le_bytes(floats[i]);
    Point { position: [value(0), value(1), value(2)], intensity: value(3), ..Point::default() }
}
