//! Bytes and text, encoded for the files of a report.

use base64::prelude::{BASE64_STANDARD, Engine};

/// Text for XML content and double-quoted attributes; characters that XML forbids become U+FFFD.
pub(super) fn xml(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' => out.push(c),
            '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// Rows of comma-separated values (RFC 4180, but lines end in `\n`).
pub(super) fn csv(rows: &[Vec<String>]) -> String {
    let mut writer = csv::WriterBuilder::new().flexible(true).from_writer(Vec::new());
    rows.iter().for_each(|row| writer.write_record(row).expect("memory takes any row"));
    let bytes = writer.into_inner().expect("memory can be flushed");
    String::from_utf8(bytes).expect("text in, text out")
}

/// Base64 with padding (RFC 4648).
pub(super) fn base64(bytes: &[u8]) -> String {
    BASE64_STANDARD.encode(bytes)
}

/// A number with this many decimals and commas between thousands.
pub(super) fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return if value.is_nan() { "–".into() } else { format!("{value}") };
    }
    let text = format!("{:.decimals$}", value.abs());
    let (whole, rest) = text.split_at(text.find('.').unwrap_or(text.len()));
    let negative = value < 0.0 && text.contains(|c: char| c.is_ascii_digit() && c != '0');
    format!("{}{}{rest}", if negative { "\u{2212}" } else { "" }, grouped(whole))
}

/// Digits with commas between thousands.
pub(super) fn grouped(digits: &str) -> String {
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// A number with three significant digits or, above a thousand, its whole part.
pub(super) fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return fixed(value, 0);
    }
    let decimals = (2 - value.abs().log10().floor() as i32).clamp(0, 6);
    fixed(value, decimals as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_and_control_characters_are_escaped() {
        assert_eq!(xml("a<b & \"c\">\u{1}"), "a&lt;b &amp; &quot;c&quot;&gt;\u{fffd}");
    }

    #[test]
    fn fields_are_quoted_where_they_must_be() {
        let rows = vec![vec!["a,b".into(), "c".into()], vec!["d\"e".into(), String::new()]];
        assert_eq!(csv(&rows), "\"a,b\",c\n\"d\"\"e\",\n");
    }

    #[test]
    fn numbers_for_people() {
        assert_eq!(fixed(1234567.891, 1), "1,234,567.9");
        assert_eq!((fixed(-0.04, 1), fixed(-1234.0, 0)), ("0.0".into(), "\u{2212}1,234".into()));
        assert_eq!((fixed(f64::NAN, 2), fixed(f64::INFINITY, 2)), ("–".into(), "inf".into()));
        assert_eq!(
            (short(0.01234), short(20.31), short(12345.6)),
            ("0.0123".into(), "20.3".into(), "12,346".into())
        );
    }
}
