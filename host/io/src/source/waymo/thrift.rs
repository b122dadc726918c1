//! Scans Thrift's compact protocol, in which Parquet's headers are written, before it is decoded.
//! The decoder goes through as many booleans of a list as the file states, though they take no
//! bytes: nested lists of two billion would keep it busy for hours.

/// Maximum nesting of structures; Parquet has 8.
const DEPTH_MAX: usize = 32;
/// The field of a page's header that gives the number of bytes after it.
const COMPRESSED_SIZE: i64 = 3;

/// The header of a page.
#[derive(Debug, PartialEq)]
pub(super) struct PageHeader {
    /// Its length in bytes.
    pub length: usize,
    /// Number of bytes that follow.
    pub compressed: usize,
}

/// Whether bytes begin with a structure in which every element takes bytes of its own.
pub(super) fn is_bounded(bytes: &[u8]) -> bool {
    Elements { left: bytes }.fields(0, |_, _| {}).is_some()
}

/// The page header at the start of some bytes.
pub(super) fn page_header(bytes: &[u8]) -> Option<PageHeader> {
    let (mut elements, mut compressed) = (Elements { left: bytes }, None);
    elements.fields(0, |id, value| {
        if id == COMPRESSED_SIZE {
            compressed = Some(value);
        }
    })?;
    let compressed = usize::try_from(compressed?).ok()?;
    Some(PageHeader { length: bytes.len() - elements.left.len(), compressed })
}

/// Bytes not yet scanned.
struct Elements<'a> {
    left: &'a [u8],
}

impl Elements<'_> {
    fn skip(&mut self, count: usize) -> Option<()> {
        self.left = self.left.get(count..)?;
        Some(())
    }

    fn byte(&mut self) -> Option<u8> {
        self.left.split_off_first().copied()
    }

    /// A number of one to ten bytes, seven bits each.
    fn number(&mut self) -> Option<u64> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(number);
            }
        }
        None
    }

    /// A signed number: the sign is the lowest bit.
    fn signed(&mut self) -> Option<i64> {
        self.number().map(|n| (n >> 1) as i64 ^ -((n & 1) as i64))
    }

    /// Scans the fields of a structure; whole numbers are passed to `see`, with the number of their
    /// field.
    fn fields(&mut self, depth: usize, mut see: impl FnMut(i64, i64)) -> Option<()> {
        let mut id = 0_i64;
        loop {
            let head = self.byte()?;
            let kind = head & 15;
            if kind == 0 {
                return Some(());
            }
            id = match head >> 4 {
                0 => self.signed()?,
                delta => id.wrapping_add(delta.into()),
            };
            match kind {
                // The value of a boolean field is in its kind.
                1 | 2 => {}
                4..=6 => see(id, self.signed()?),
                _ => self.value(kind, depth)?,
            }
        }
    }

    /// Scans a value of a kind, which takes at least a byte.
    fn value(&mut self, kind: u8, depth: usize) -> Option<()> {
        match kind {
            3 => self.skip(1),
            4..=6 => self.number().map(|_| ()),
            7 => self.skip(8),
            8 => {
                let length = self.number()?;
                self.skip(usize::try_from(length).ok()?)
            }
            9 | 10 => self.list(depth),
            11 => self.map(depth),
            12 if depth < DEPTH_MAX => self.fields(depth + 1, |_, _| {}),
            13 => self.skip(16),
            _ => None,
        }
    }

    fn list(&mut self, depth: usize) -> Option<()> {
        let head = self.byte()?;
        let count = if head >> 4 == 15 { self.number()? } else { u64::from(head >> 4) };
        (0..count).try_for_each(|_| self.value_below(head & 15, depth))
    }

    fn map(&mut self, depth: usize) -> Option<()> {
        let count = self.number()?;
        let kinds = if count > 0 { self.byte()? } else { 0 };
        (0..count).try_for_each(|_| {
            self.value_below(kinds >> 4, depth)?;
            self.value_below(kinds & 15, depth)
        })
    }

    fn value_below(&mut self, kind: u8, depth: usize) -> Option<()> {
        if depth < DEPTH_MAX { self.value(kind, depth + 1) } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Field 1: 2; field 2: -3; field 3: 300; field 5: a structure of one string; the end.
    const PAGE: [u8; 13] = [0x15, 4, 0x15, 5, 0x15, 0xd8, 4, 0x2c, 0x18, 1, b'x', 0, 0];

    #[test]
    fn a_header_and_the_length_of_its_data() {
        let long = [&PAGE[..], &[7; 9]].concat();
        assert_eq!(page_header(&long), Some(PageHeader { length: 13, compressed: 300 }));
        assert!(is_bounded(&PAGE) && (0..13).all(|end| page_header(&PAGE[..end]).is_none()));
        // A negative number of bytes follows, or the number is missing.
        assert_eq!(page_header(&[0x35, 1, 0]), None);
        assert_eq!(page_header(&[0x15, 2, 0]), None);
    }

    #[test]
    fn elements_without_bytes() {
        let list =
            |kind: u8, count: [u8; 2]| [&[0x19, 0xf0 | kind][..], &count, &[1, 2, 0]].concat();
        // Two one-byte numbers; three, one of which is missing.
        assert!(is_bounded(&list(3, [0x82, 0])) && !is_bounded(&list(3, [0x83, 0])));
        // Booleans, a map of them, and endlessly nested lists.
        assert!(!is_bounded(&list(1, [0xff, 0x7f])));
        assert!(!is_bounded(&[0x1b, 5, 0x11, 0, 0, 0]));
        assert!(!is_bounded(&[&[0x19][..], &[0x19; 1000], &[0; 9]].concat()));
        assert!(!is_bounded(&[&[0x1c; 1000][..], &[0; 1001]].concat()));
    }
}
