//! NumPy files of rows of floats: clouds, poses, height rasters.

use std::path::Path;

use half::f16;

use super::whole;
use crate::Error;

/// First bytes of the format.
const MAGIC: &[u8] = b"\x93NUMPY";

/// Rows of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Number of rows, at least 1.
    pub rows: usize,
    /// Numbers per row, at least 1; if there are more dimensions, the product of all but the first.
    pub columns: usize,
    /// Row after row.
    pub values: Vec<f64>,
}

/// Reads `<f2`, `<f4` or `<f8` in row-major order, in versions 1 to 3 of the format.
///
/// # Errors
/// If the file cannot be read, is too large for a cloud, or holds something else.
pub fn read(path: &Path) -> Result<Array, Error> {
    parse(&whole::read(path)?).map_err(|what| Error::input(path, "", what))
}

/// Parses a file; `Err` says what is wrong.
fn parse(bytes: &[u8]) -> Result<Array, String> {
    let rest = bytes.strip_prefix(MAGIC).ok_or("is not a NumPy file")?;
    let (header, data) = split(rest).ok_or("truncated within the header")?;
    let header = std::str::from_utf8(header).map_err(|_| "the header is not UTF-8 text")?;
    let kind = value(header, "descr")?.trim_matches(['\'', '"']);
    let number: fn(&[u8]) -> f64 = match kind {
        "<f2" => |b| f16::from_le_bytes(all(b)).into(),
        "<f4" => |b| f32::from_le_bytes(all(b)).into(),
        "<f8" => |b| f64::from_le_bytes(all(b)),
        other => return Err(format!("holds `{other}`; expected <f2, <f4 or <f8")),
    };
    if value(header, "fortran_order")? != "False" {
        return Err("is stored in column-major order; row-major expected".into());
    }
    let [rows, columns] = shape(header)?;
    let width = usize::from(kind.as_bytes()[2] - b'0');
    let size = rows.checked_mul(columns).and_then(|n| n.checked_mul(width));
    if size != Some(data.len()) {
        let found = data.len();
        return Err(format!(
            "{found} bytes of data for {rows} x {columns} numbers of {width} bytes"
        ));
    }
    Ok(Array { rows, columns, values: data.chunks_exact(width).map(number).collect() })
}

/// A chunk as an array; chunks have the width of the type.
fn all<const N: usize>(bytes: &[u8]) -> [u8; N] {
    bytes.try_into().expect("a chunk of another width")
}

/// Header and data after the magic.
fn split(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (version, rest) = bytes.split_first_chunk::<2>()?;
    if version[0] == 1 {
        let (length, rest) = rest.split_first_chunk()?;
        rest.split_at_checked(u16::from_le_bytes(*length).into())
    } else {
        let (length, rest) = rest.split_first_chunk()?;
        rest.split_at_checked(u32::from_le_bytes(*length) as usize)
    }
}

/// The text between a key of the header and the next comma.
fn value<'a>(header: &'a str, key: &str) -> Result<&'a str, String> {
    let missing = || format!("the header has no `{key}`");
    let (_, after) = header.split_once(&format!("'{key}':")).ok_or_else(missing)?;
    Ok(after.split([',', '}']).next().unwrap_or_default().trim())
}

fn shape(header: &str) -> Result<[usize; 2], String> {
    let (_, after) = header.split_once("'shape':").ok_or("the header has no `shape`")?;
    let inside = after.trim_start().strip_prefix('(').and_then(|s| Some(s.split_once(')')?.0));
    let inside = inside.ok_or("the shape is invalid")?;
    let size = |s: &str| s.trim().parse().ok();
    let sizes: Option<Vec<usize>> = inside.split(',').map(size).collect();
    let columns = |rest: &[usize]| rest.iter().try_fold(1_usize, |n, size| n.checked_mul(*size));
    match sizes.as_deref() {
        Some([rows, rest @ ..]) if !rest.is_empty() && !rest.contains(&0) => {
            Ok([*rows, columns(rest).ok_or("the shape is too large")?])
        }
        _ => Err(format!("has shape ({inside}); expected rows and columns, columns above zero")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, data: &[u8]) -> Vec<u8> {
        let length = (header.len() as u16).to_le_bytes();
        [MAGIC, &[1, 0], &length, header.as_bytes(), data].concat()
    }

    #[test]
    fn floats_of_three_widths() {
        let header = |kind: &str| {
            format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': (1, 2), }}  \n")
        };
        let want = Array { rows: 1, columns: 2, values: vec![1.5, -2.0] };
        // 1.5 and -2.0 as halves.
        assert_eq!(parse(&file(&header("<f2"), &[0x00, 0x3e, 0x00, 0xc0])), Ok(want.clone()));
        let singles: Vec<u8> = [1.5f32, -2.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(parse(&file(&header("<f4"), &singles)), Ok(want.clone()));
        let doubles: Vec<u8> = [1.5f64, -2.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(parse(&file(&header("<f8"), &doubles)), Ok(want.clone()));
        // Version 2 has a longer length field.
        let mut longer = file(&header("<f8"), &doubles);
        longer[MAGIC.len()] = 2;
        longer.splice(MAGIC.len() + 4..MAGIC.len() + 4, [0, 0]);
        assert_eq!(parse(&longer), Ok(want));
    }

    #[test]
    fn what_is_refused() {
        let refused = |header: &str, data: &[u8]| parse(&file(header, data)).unwrap_err();
        let good = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1), }";
        assert!(parse(&file(good, &[0; 4])).is_ok());
        assert!(refused(good, &[0; 3]).starts_with("3 bytes of data for 1 x 1"));
        assert!(refused(&good.replace("<f4", "<i4"), &[0; 4]).starts_with("holds `<i4`"));
        assert!(refused(&good.replace("False", "True"), &[0; 4]).contains("column-major"));
        assert!(refused(&good.replace("(1, 1)", "(1, 0)"), &[]).contains("above zero"));
        assert!(refused(&good.replace("(1, 1)", "(1,)"), &[0; 4]).contains("shape (1,)"));
        assert!(refused(&good.replace("(1, 1)", "1"), &[0; 4]).contains("shape is invalid"));
        let huge = good.replace("(1, 1)", "(4294967296, 4294967296)");
        assert!(refused(&huge, &[0; 4]).contains("4 bytes of data"));
        assert!(refused("{}", &[]).contains("no `descr`"));
        assert_eq!(parse(b"PK").unwrap_err(), "is not a NumPy file");
        let whole = file(good, &[0; 4]);
        assert!((0..whole.len()).all(|cut| parse(&whole[..cut]).is_err()));
    }
}
