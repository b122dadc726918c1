//! Scans the headers of Parquet, in Thrift's compact protocol, before they are decoded. The decoder
//! goes through as many booleans of a list as the file states, though they take no bytes: nested
//! lists of two billion would keep it busy for hours. It reads a field that it knows without regard
//! to the type that the file states, so the scan refuses those of another type than Parquet's:
//! otherwise the two would read different structures.

use super::format::{self, FieldType, HeaderNumber};

/// Maximum nesting of structures; Parquet has 8.
const DEPTH_MAX: usize = 32;

/// The header of a page.
#[derive(Debug, PartialEq)]
pub(super) struct PageHeader {
    /// Its length in bytes.
    pub length: usize,
    /// Number of bytes that follow.
    pub packed: usize,
    /// Number of bytes to which these unpack.
    pub unpacked: usize,
    /// Number of values, missing ones included, or of a dictionary's entries.
    pub values: usize,
}

/// Whether a footer is as Parquet declares it, and every element takes bytes of its own.
pub(super) fn is_footer(bytes: &[u8]) -> bool {
    Elements { left: bytes, see: |_, _| {} }.fields(format::FOOTER, 0).is_some()
}

/// The page header at the start of some bytes. `None` for types other than data and dictionaries
/// too: the decoder takes the data of an index for another header.
pub(super) fn page_header(bytes: &[u8]) -> Option<PageHeader> {
    let mut numbers = [None; HeaderNumber::COUNT];
    let see = |number, value: i64| numbers[number as usize] = usize::try_from(value).ok();
    let mut elements = Elements { left: bytes, see };
    elements.fields(format::PAGE_HEADER, 0)?;
    let length = bytes.len() - elements.left.len();
    let number = |number: HeaderNumber| numbers[number as usize];
    let values = match number(HeaderNumber::PageType)? {
        0 => number(HeaderNumber::Values)?,
        2 => number(HeaderNumber::Entries)?,
        3 => number(HeaderNumber::ValuesV2)?,
        _ => return None,
    };
    let (packed, unpacked) = (number(HeaderNumber::Packed)?, number(HeaderNumber::Unpacked)?);
    Some(PageHeader { length, packed, unpacked, values })
}

/// Bytes not yet scanned.
struct Elements<'a, F> {
    left: &'a [u8],
    /// Sees the numbers that are needed.
    see: F,
}

impl<F: FnMut(HeaderNumber, i64)> Elements<'_, F> {
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

    /// Scans the fields of a structure, of which the first are known.
    fn fields(&mut self, known: &[FieldType], depth: usize) -> Option<()> {
        let mut id = 0_i64;
        loop {
            let head = self.byte()?;
            let stated = head & 15;
            if stated == 0 {
                return Some(());
            }
            id = match head >> 4 {
                0 => self.signed()?,
                delta => id + i64::from(delta),
            };
            // The decoder's numbers of fields have 16 bits.
            let index = usize::try_from(i16::try_from(id).ok()?).ok()?.checked_sub(1)?;
            match (known.get(index).unwrap_or(&FieldType::Any), stated) {
                // The value of a boolean field is in its type.
                (FieldType::Any | FieldType::Boolean, 1 | 2) => {}
                (kind, _) => self.value(kind, stated, depth)?,
            }
        }
    }

    /// Scans a value, which takes at least a byte, of the type that the file states.
    fn value(&mut self, kind: &FieldType, stated: u8, depth: usize) -> Option<()> {
        let depth = (depth < DEPTH_MAX).then_some(depth + 1)?;
        match (kind, stated) {
            (FieldType::Any | FieldType::Byte, 3) => self.skip(1),
            (FieldType::Any | FieldType::Integer, 4..=6) => self.number().map(|_| ()),
            (FieldType::Needed(number), 4..=6) => {
                let value = self.signed()?;
                (self.see)(*number, value);
                Some(())
            }
            (FieldType::Any | FieldType::Double, 7) => self.skip(8),
            (FieldType::Any | FieldType::Bytes, 8) => {
                let length = self.number()?;
                self.skip(usize::try_from(length).ok()?)
            }
            (FieldType::Any, 9 | 10) => self.list(&FieldType::Any, depth),
            (FieldType::List(of), 9) => self.list(of, depth),
            (FieldType::Any, 11) => self.map(depth),
            (FieldType::Any, 12) => self.fields(&[], depth),
            (FieldType::Struct(known), 12) => self.fields(known, depth),
            (FieldType::Any, 13) => self.skip(16),
            _ => None,
        }
    }

    fn list(&mut self, of: &FieldType, depth: usize) -> Option<()> {
        let head = self.byte()?;
        let count = if head >> 4 == 15 { self.number()? } else { u64::from(head >> 4) };
        (0..count).try_for_each(|_| self.value(of, head & 15, depth))
    }

    fn map(&mut self, depth: usize) -> Option<()> {
        let count = self.number()?;
        let stated = if count > 0 { self.byte()? } else { 0 };
        (0..count).try_for_each(|_| {
            self.value(&FieldType::Any, stated >> 4, depth)?;
            self.value(&FieldType::Any, stated & 15, depth)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A data page: type 0; 512 bytes, 300 of them in the file; a structure that begins with the
    /// number of values, 7; field 16, which is not known: a string.
    const PAGE: [u8; 18] =
        [0x15, 0, 0x15, 0x80, 8, 0x15, 0xd8, 4, 0x2c, 0x15, 14, 0x15, 0, 0, 0xb8, 1, b'x', 0];

    #[test]
    fn a_header_and_the_length_of_its_data() {
        let long = [&PAGE[..], &[7; 9]].concat();
        let header = PageHeader { length: 18, packed: 300, unpacked: 512, values: 7 };
        assert_eq!(page_header(&long), Some(header));
        assert!((0..18).all(|end| page_header(&PAGE[..end]).is_none()));
        let with = |at: usize, byte| {
            let mut page = PAGE;
            page[at] = byte;
            page_header(&page)
        };
        // An index, and pages of types whose structures are missing.
        assert!([2, 4, 6, 8].iter().all(|kind| with(1, *kind).is_none()));
        // Negative lengths and numbers of values.
        assert!([(4, 9), (7, 5), (10, 16)].iter().all(|(at, byte)| with(*at, *byte).is_some()));
        assert!([(3, 0x81), (6, 0xd9), (10, 13)].iter().all(|(at, b)| with(*at, *b).is_none()));
        // A dictionary in place of data: two fields on.
        let mut page = PAGE;
        (page[1], page[8]) = (4, 0x4c);
        assert_eq!(page_header(&page).unwrap().values, 7);
    }

    /// Every known field as another type, and a field whose number the decoder takes for another.
    #[test]
    fn fields_of_other_types() {
        for at in [0, 2, 5, 8, 9, 11] {
            let mut page = PAGE;
            page[at] = page[at] & 0xf0 | 8;
            assert_eq!(page_header(&page), None, "{at}");
        }
        let numbered = |id: [u8; 3]| [&PAGE[..14], &[5], &id, &[0, 0]].concat();
        assert!(page_header(&numbered([0xa8, 0x80, 0])).is_some());
        // -20, 65,556, the least of 16 bits.
        for id in [[0xa7, 0x80, 0], [0xa8, 0x80, 8], [0xff, 0xff, 3]] {
            assert_eq!(page_header(&numbered(id)), None);
        }
        // A row group that is a number.
        assert!(is_footer(&[0x49, 0x1c, 0, 0]) && !is_footer(&[0x49, 0x15, 0, 0]));
    }

    /// In a field that is not known.
    #[test]
    fn elements_without_bytes() {
        let list =
            |kind: u8, count: [u8; 2]| [&[0xe9, 0xf0 | kind][..], &count, &[1, 2, 0]].concat();
        // Two one-byte numbers; three, one of which is missing.
        assert!(is_footer(&list(3, [0x82, 0])) && !is_footer(&list(3, [0x83, 0])));
        // Booleans, a map of them, and endlessly nested lists.
        assert!(!is_footer(&list(1, [0xff, 0x7f])));
        assert!(!is_footer(&[0xeb, 5, 0x11, 0, 0, 0]));
        assert!(!is_footer(&[&[0xe9][..], &[0x19; 1000], &[0; 9]].concat()));
        assert!(!is_footer(&[&[0xec][..], &[0x1c; 1000], &[0; 1001]].concat()));
    }
}
