//! Ranges of sweeps.

use std::ops::Range;

use raywake_io::Error;

/// A half-open range of sweeps as typed: either end may be missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SweepRange {
    pub from: usize,
    /// Sweep after the last one.
    pub to: Option<usize>,
}

impl SweepRange {
    /// Parses `A..B`, `A..`, `..B` or `..`.
    pub(super) fn parse(text: &str) -> Result<SweepRange, String> {
        let (from, to) = text.split_once("..").ok_or("expected A..B, for example 10..20")?;
        let index = |s: &str| s.parse::<usize>().map_err(|_| format!("`{s}` is not a sweep index"));
        let from = if from.is_empty() { 0 } else { index(from)? };
        let to = if to.is_empty() { None } else { Some(index(to)?) };
        if to.is_some_and(|to| to <= from) {
            return Err(format!("{text} is an empty range"));
        }
        Ok(SweepRange { from, to })
    }

    /// Returns the range within a recording of `len` sweeps; fails if it reaches beyond.
    pub fn within(&self, len: usize) -> Result<Range<usize>, Error> {
        let to = self.to.unwrap_or(len);
        if self.from < len && to <= len {
            return Ok(self.from..to);
        }
        let end = self.to.map_or(String::new(), |to| to.to_string());
        let what =
            format!("--sweeps {}..{end}: the recording has {len} sweeps (0..{len})", self.from);
        Err(Error::Usage(what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_sweeps() {
        let within = |text: &str| SweepRange::parse(text).unwrap().within(10).ok();
        assert_eq!(within("2..5"), Some(2..5));
        assert_eq!(
            (within("..5"), within("9.."), within("..")),
            (Some(0..5), Some(9..10), Some(0..10))
        );
        assert_eq!((within("10.."), within("0..11")), (None, None));
        for wrong in ["3", "5..5", "-1..3", "a..", "..0"] {
            assert!(SweepRange::parse(wrong).is_err(), "{wrong}");
        }
        let text = SweepRange::parse("3..12").unwrap().within(10).unwrap_err().to_string();
        assert!(text.contains("--sweeps 3..12") && text.contains("10 sweeps"), "{text}");
    }
}
