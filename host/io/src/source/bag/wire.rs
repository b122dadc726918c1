//! ROS messages as bytes: CDR, used by ROS 2, and the packed serialisation of ROS 1.

use crate::source::returns::Number;

/// Length of CDR's own header: the kind of encapsulation and two bytes of options.
const ENCAPSULATION: usize = 4;

/// A message being read, field by field. Every read fails if the message ends early.
pub(super) struct Wire<'a> {
    bytes: &'a [u8],
    /// Next byte, counted from the first field.
    at: usize,
    /// Whether numbers are big-endian.
    big: bool,
    /// Numbers are aligned to their size, but at most to this.
    alignment: usize,
    /// Whether this is ROS 1: headers have a sequence number, strings no terminating zero.
    ros1: bool,
}

impl<'a> Wire<'a> {
    /// A message in the encoding given by its channel.
    pub fn new(encoding: &str, bytes: &'a [u8]) -> Result<Wire<'a>, String> {
        if encoding == "ros1" {
            return Ok(Wire { bytes, at: 0, big: false, alignment: 1, ros1: true });
        }
        let (head, bytes) = bytes.split_at_checked(ENCAPSULATION).ok_or("truncated")?;
        let (big, alignment) = match head[..2] {
            [0, 0] => (true, 8),
            [0, 1] => (false, 8),
            // Version 2 of the encoding.
            [0, 6] => (true, 4),
            [0, 7] => (false, 4),
            _ => return Err(format!("unknown encapsulation {:02x}{:02x}", head[0], head[1])),
        };
        Ok(Wire { bytes, at: 0, big, alignment, ros1: false })
    }

    fn take(&mut self, size: usize) -> Result<&'a [u8], String> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let taken = rest.get(..size);
        self.at += size;
        taken.ok_or_else(|| format!("truncated: {size} bytes expected, {} left", rest.len()))
    }

    fn number(&mut self, number: Number) -> Result<f64, String> {
        self.at = self.at.next_multiple_of(number.size().min(self.alignment));
        let big = self.big;
        Ok(number.read(self.take(number.size())?, big))
    }

    /// An unsigned 8-bit number.
    pub fn byte(&mut self) -> Result<u8, String> {
        Ok(self.take(1)?[0])
    }

    /// An unsigned 32-bit number.
    pub fn word(&mut self) -> Result<u32, String> {
        Ok(self.number(Number::Unsigned(4))? as u32)
    }

    /// A double-precision number.
    pub fn double(&mut self) -> Result<f64, String> {
        self.number(Number::F64)
    }

    /// Bytes preceded by their count.
    pub fn bytes(&mut self) -> Result<&'a [u8], String> {
        let length = self.word()? as usize;
        self.take(length)
    }

    /// Whether numbers are big-endian.
    pub fn is_big_endian(&self) -> bool {
        self.big
    }

    /// This many records that begin with a four-byte number, and the distance in bytes from one to
    /// the next.
    pub fn records(&mut self, count: usize, size: usize) -> Result<(&'a [u8], usize), String> {
        let alignment = self.alignment.min(4);
        self.at = self.at.next_multiple_of(alignment);
        let step = size.next_multiple_of(alignment);
        let before = count.saturating_sub(1).checked_mul(step);
        let all = before.and_then(|before| before.checked_add(if count > 0 { size } else { 0 }));
        Ok((self.take(all.ok_or("an impossible number of records")?)?, step))
    }

    /// A string.
    pub fn text(&mut self) -> Result<&'a str, String> {
        let bytes = self.bytes()?;
        let bytes = if self.ros1 { bytes } else { bytes.strip_suffix(&[0]).unwrap_or(bytes) };
        std::str::from_utf8(bytes).map_err(|_| "a string that is not UTF-8".into())
    }

    /// A header: time, ns, and frame name.
    pub fn header(&mut self) -> Result<(i64, &'a str), String> {
        // ROS 1 headers have a sequence number.
        let _ = self.ros1.then(|| self.word()).transpose()?;
        // Seconds are signed in ROS 2; none is before 1970.
        let [seconds, ns] = [self.word()?, self.word()?];
        let frame = self.text()?;
        Ok((i64::from(seconds) * 1_000_000_000 + i64::from(ns), frame.trim_start_matches('/')))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_lie_where_the_encoding_puts_them() {
        // A byte, a gap of seven, a double; in ROS 1 and version 2 the gap is shorter.
        let double = 2.5f64;
        for (head, gap, big) in [(1, 7, false), (0, 7, true), (7, 3, false), (6, 3, true)] {
            let mut bytes = vec![0, head, 0, 0, 9];
            bytes.resize(5 + gap, 0xff);
            bytes.extend(if big { double.to_be_bytes() } else { double.to_le_bytes() });
            let mut wire = Wire::new("cdr", &bytes).unwrap();
            assert_eq!((wire.byte(), wire.double()), (Ok(9), Ok(2.5)), "{head}");
            assert!(wire.byte().is_err());
        }
        let packed = [&[9][..], &double.to_le_bytes()].concat();
        let mut wire = Wire::new("ros1", &packed).unwrap();
        assert_eq!((wire.byte(), wire.double()), (Ok(9), Ok(2.5)));
    }

    #[test]
    fn valid_and_invalid_strings() {
        let cdr = [0, 1, 0, 0, 3, 0, 0, 0, b'a', b'b', 0];
        assert_eq!(Wire::new("cdr", &cdr).unwrap().text(), Ok("ab"));
        assert_eq!(Wire::new("ros1", &[2, 0, 0, 0, b'a', b'b']).unwrap().text(), Ok("ab"));
        assert!(Wire::new("cdr", &cdr[..9]).unwrap().text().unwrap_err().contains("truncated"));
        assert!(Wire::new("ros1", &[1, 0, 0, 0, 0xff]).unwrap().text().is_err());
        let long = [0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff];
        assert!(Wire::new("cdr", &long).unwrap().bytes().is_err());
        assert!(Wire::new("cdr", &[0, 9, 0, 0]).is_err() && Wire::new("cdr", &[0]).is_err());
    }
}
