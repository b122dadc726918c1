//! LZF, the compression of Lehmann's liblzf that PCD files use.

/// Maximum number of bytes that one byte can become: three bytes stand for up to 264.
const GROWTH_MAX: usize = 88;

/// Unpacks `packed` to exactly `size` bytes.
///
/// A byte below 32 is the number of literal bytes that follow, minus one. Any other begins a
/// repetition: its upper three bits are the length minus two, where 7 means that the next byte is
/// added to it; the lower five bits and the byte after that are the distance back, minus one.
pub(super) fn unpack(packed: &[u8], size: usize) -> Result<Vec<u8>, &'static str> {
    // Before memory is allocated.
    if size / GROWTH_MAX > packed.len() {
        return Err("damaged: claims more bytes than it can hold");
    }
    let mut out = Vec::with_capacity(size);
    let mut bytes = packed.iter().map(|&b| usize::from(b));
    let mut next = || bytes.next().ok_or("damaged: compressed data end early");
    while out.len() < size {
        let control = next()?;
        if control < 32 {
            for _ in 0..=control {
                out.push(next()? as u8);
            }
        } else {
            let mut length = (control >> 5) + 2;
            if length == 9 {
                length += next()?;
            }
            let back = ((control & 31) << 8 | next()?) + 1;
            let from =
                out.len().checked_sub(back).ok_or("damaged: a back reference before the start")?;
            // One by one: it may repeat what it has just written.
            for at in from..from + length {
                out.push(out[at]);
            }
        }
        if out.len() > size {
            return Err("damaged: compressed data hold more than they claim");
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_and_repetitions() {
        assert_eq!(unpack(&[2, 97, 98, 99, 0x80, 2], 9).unwrap(), b"abcabcabc");
        // A run of one byte: 9 + 40 more.
        assert_eq!(unpack(&[0, 7, 0xe0, 40, 0], 50).unwrap(), [7; 50]);
        assert!(unpack(&[], 0).unwrap().is_empty());
        // As far back as possible.
        let mut far = vec![];
        for chunk in 0..256u32 {
            far.push(31);
            far.extend((0..32).map(|i| (chunk * 37 + i * 11) as u8));
        }
        far.extend([0x20 | 31, 255]);
        let out = unpack(&far, 8195).unwrap();
        assert_eq!(out[8192..], out[..3]);
    }

    #[test]
    fn damaged() {
        let refused = |packed: &[u8], size: usize| unpack(packed, size).unwrap_err();
        assert!(refused(&[2, 97, 98], 3).contains("end early"));
        assert!(refused(&[0, 97, 0x20], 4).contains("end early"));
        assert!(refused(&[0, 97, 0x20, 1], 4).contains("before the start"));
        assert!(refused(&[2, 97, 98, 99], 2).contains("more than they claim"));
        assert!(refused(&[0, 97], usize::MAX).contains("can hold"));
        assert!(refused(&[0, 97], 5).contains("end early"));
    }
}
