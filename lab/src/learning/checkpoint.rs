//! Files of numbers that record what they belong to and whose damage can be detected.

use raywake_core::digest::Digest;
use raywake_io::Error;
use std::io::{self, Write};
use std::ops::RangeInclusive;
use std::path::Path;

/// Writes a file: `magic`, a checksum, what it is `of`, and `body`.
pub fn write(to: &mut impl Write, magic: &[u8], of: u64, body: &[u8]) -> io::Result<()> {
    let bytes = [&of.to_le_bytes(), body].concat();
    to.write_all(magic)?;
    to.write_all(&Digest::of(&bytes).to_le_bytes())?;
    to.write_all(&bytes)
}

/// Returns the body of a file, which must be `lengths` bytes long. Fails if the file is of another
/// kind or length, is damaged, or does not belong to `of`.
pub fn read(
    file: &Path,
    magic: &[u8],
    of: u64,
    lengths: RangeInclusive<usize>,
) -> Result<Vec<u8>, Error> {
    let error = |what: &str| Error::input(file, "", what.to_string());
    let bytes = std::fs::read(file).map_err(Error::reading(file))?;
    let rest = bytes.strip_prefix(magic).ok_or_else(|| {
        let kind = String::from_utf8_lossy(magic);
        error(&format!("does not begin with '{}'", kind.trim_end()))
    })?;
    let body = rest.len().saturating_sub(16);
    if rest.len() < 16 || !lengths.contains(&body) {
        let wanted = lengths.start();
        return Err(error(&format!(
            "has another length than expected: {body} bytes, not {wanted}"
        )));
    }
    let word = |n: usize| u64::from_le_bytes(rest[8 * n..][..8].try_into().expect("8 bytes"));
    if Digest::of(&rest[8..]) != word(0) {
        return Err(error("checksum does not match: the file is damaged"));
    }
    if word(1) != of {
        return Err(error("from another training run: different inputs, seed or steps"));
    }
    Ok(rest[16..].to_vec())
}
