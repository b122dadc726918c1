//! Checks that the bytes of a feather file are complete before the Arrow reader sees them: that
//! reader trusts offsets and lengths in the file, and aborts the process on some wrong ones.

use arrow_ipc::{Block, RecordBatch, root_as_footer, root_as_message};

use super::whole::check_unpacked;

/// First and last bytes of a feather file.
const MAGIC: &[u8] = b"ARROW1";

/// Bytes of the footer's length and of [`MAGIC`], at the end of the file.
const TRAILER: usize = 10;

/// What record batches claim to contain. It is allocated before it is verified.
#[derive(Clone, Copy, Default)]
struct Claims {
    /// Bytes that their columns unpack to.
    bytes: u64,
    rows: u64,
}

impl Claims {
    fn with(self, more: Claims) -> Claims {
        Claims {
            bytes: self.bytes.saturating_add(more.bytes),
            rows: self.rows.saturating_add(more.rows),
        }
    }
}

/// Checks a file; `Err` says what is wrong.
pub(super) fn check(bytes: &[u8]) -> Result<(), String> {
    if !bytes.starts_with(MAGIC) {
        return Err("is not a feather file (it does not start with ARROW1)".into());
    }
    if bytes.len() < MAGIC.len() + TRAILER || !bytes.ends_with(MAGIC) {
        let what = "truncated: the feather file does not end with ARROW1";
        return Err(format!("{what} ({} bytes)", bytes.len()));
    }
    let body = &bytes[..bytes.len() - TRAILER];
    let length = bytes[body.len()..].first_chunk().map_or(0, |b| u32::from_le_bytes(*b));
    let start = body.len().checked_sub(length as usize);
    let start = start.ok_or("damaged: the footer is longer than the file")?;
    let footer = root_as_footer(&body[start..]).map_err(|e| format!("damaged footer: {e}"))?;
    // Dictionaries are unpacked even if their column is not requested, and none is needed here.
    if footer.dictionaries().is_some_and(|blocks| !blocks.is_empty()) {
        return Err("has dictionary-encoded columns: write them as plain columns".into());
    }
    let mut claims = Claims::default();
    for block in footer.recordBatches().into_iter().flatten() {
        claims = claims.with(check_block(&body[..start], block)?);
    }
    // A null column may have any number of rows.
    check_unpacked(bytes.len(), claims.bytes, claims.rows)
}

/// Checks that a block lies within the file and its message within the block. Returns what it
/// claims.
fn check_block(file: &[u8], block: &Block) -> Result<Claims, String> {
    let outside = || format!("damaged: a record batch at byte {} is cut off", block.offset());
    let size = |v: i64| usize::try_from(v).map_err(|_| outside());
    let offset = size(block.offset())?;
    let head = size(block.metaDataLength().into())?;
    let length = size(block.bodyLength())?;
    let rest = file.get(offset..).ok_or_else(outside)?;
    let (head, rest) = rest.split_at_checked(head).ok_or_else(outside)?;
    let body = rest.get(..length).ok_or_else(outside)?;
    // A marker of four bytes, in files newer than 2019, and the length of the message.
    let skip = if head.starts_with(&[0xff; 4]) { 8 } else { 4 };
    let message = head.get(skip..).ok_or_else(outside)?;
    let message = root_as_message(message)
        .map_err(|e| format!("damaged message at byte {}: {e}", block.offset()))?;
    let batch = message.header_as_record_batch();
    batch.map_or(Ok(Claims::default()), |batch| check_batch(&batch, body))
}

/// Checks that every buffer of a batch lies within its body and that no length is absurd. Returns
/// what it claims.
fn check_batch(batch: &RecordBatch<'_>, body: &[u8]) -> Result<Claims, String> {
    let sensible = |rows: i64| (0..=i64::from(i32::MAX)).contains(&rows);
    let nodes = batch.nodes().into_iter().flatten();
    let mut counts = nodes.flat_map(|n| [n.length(), n.null_count()]);
    if !sensible(batch.length()) || !counts.all(sensible) {
        return Err("damaged: invalid number of rows".into());
    }
    let mut claims = Claims { bytes: 0, rows: batch.length() as u64 };
    for buffer in batch.buffers().into_iter().flatten() {
        let range =
            usize::try_from(buffer.offset()).ok().zip(usize::try_from(buffer.length()).ok());
        let bytes = range.and_then(|(from, n)| body.get(from..)?.get(..n));
        let bytes = bytes.ok_or("damaged: a column reaches beyond its record batch")?;
        // Compressed buffers begin with their length; if negative, they are not compressed.
        let claimed = bytes.first_chunk().map(|b| i64::from_le_bytes(*b));
        let claimed = claimed.filter(|_| batch.compression().is_some());
        let length = claimed.and_then(|n| u64::try_from(n).ok()).unwrap_or(bytes.len() as u64);
        claims.bytes = claims.bytes.saturating_add(length);
    }
    Ok(claims)
}
