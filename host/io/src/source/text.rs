//! Small text files of numbers; errors give the place of the mistake.

use std::path::Path;

use crate::Error;

/// The lines that are not empty, each with its number counted from 1.
pub fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let numbered = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    numbered.filter(|(_, line)| !line.is_empty())
}

/// The numbers of one line, whatever their count.
pub fn numbers(path: &Path, line: usize, text: &str) -> Result<Vec<f64>, Error> {
    let wrong = |word: &str| {
        Error::input(path, format!("line {line}"), format!("`{word}` is not a number"))
    };
    let number = |word: &str| word.parse().map_err(|_| wrong(word));
    text.split_ascii_whitespace().map(number).collect()
}

/// Exactly `N` numbers from one line.
pub fn exactly<const N: usize>(path: &Path, line: usize, text: &str) -> Result<[f64; N], Error> {
    let found = numbers(path, line, text)?;
    found.try_into().map_err(|found: Vec<f64>| {
        let what = format!("{N} numbers expected, {} found", found.len());
        Error::input(path, format!("line {line}"), what)
    })
}

/// The `N` numbers after `key` at the start of a line (`Tr: 1 2 …`), with the line's number; `None`
/// if no line starts with it.
pub fn keyed<const N: usize>(
    path: &Path,
    text: &str,
    key: &str,
) -> Result<Option<(usize, [f64; N])>, Error> {
    for (line, content) in lines(text) {
        if let Some(rest) = content.strip_prefix(key).and_then(|r| r.strip_prefix(':')) {
            return Ok(Some((line, exactly(path, line, rest)?)));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_their_places() {
        let path = Path::new("f.txt");
        assert_eq!(exactly::<2>(path, 1, " 1 2e0 ").unwrap(), [1.0, 2.0]);
        let e = exactly::<2>(path, 4, "1 2 3").unwrap_err().to_string();
        assert_eq!(e, "f.txt, line 4: 2 numbers expected, 3 found");
        let e = exactly::<1>(path, 5, "x1").unwrap_err().to_string();
        assert_eq!(e, "f.txt, line 5: `x1` is not a number");
        let text = "P0: 1\n\nTr: 5 6\n";
        assert_eq!(keyed::<2>(path, text, "Tr").unwrap(), Some((3, [5.0, 6.0])));
        assert_eq!(keyed::<2>(path, text, "T").unwrap(), None);
        assert_eq!(lines(text).count(), 2);
    }
}
