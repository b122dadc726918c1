//! Returns of clouds with named fields (of PCD and PLY files and others).
//!
//! | field | names | as |
//! |---|---|---|
//! | position | `x`, `y`, `z` | m, in the vehicle frame |
//! | intensity | `intensity`, `i`, `reflectivity` | 0..1, or 0..255 if any is above 1 |
//! | time | `offset_time`, `t`, `time`, `timestamp`, `time_stamp` | unit by type, as in drivers |
//!
//! Integer times are ns (Ouster `t`, Livox `offset_time`), float times are s (Velodyne `time`,
//! Hesai and RoboSense `timestamp`), or ns if they are too large for any date (Livox `timestamp`).
//! They count from the sweep's stamp, but if the earliest is more than a second away from it they
//! are clock times, and count from that earliest one, or from the stamp if that is of the same
//! clock. Other fields, including `ring`, are ignored.

use std::path::Path;

use raywake_core::sweep::Point;

use super::text;
use crate::Error;

/// Seconds beyond any date: larger times are ns.
const SECONDS_MAX: f64 = 1e12;

/// Times farther than this from the stamp are those of a clock, s.
const OFFSET_MAX_S: f64 = 1.0;

/// How a number is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    Unsigned(usize),
    Signed(usize),
    F32,
    F64,
}

impl Number {
    /// Its size in bytes.
    pub fn size(self) -> usize {
        match self {
            Number::Unsigned(size) | Number::Signed(size) => size,
            Number::F32 => 4,
            Number::F64 => 8,
        }
    }

    /// The number at the start of `bytes`, which are long enough; `big` for big-endian.
    pub fn read(self, bytes: &[u8], big: bool) -> f64 {
        let size = self.size();
        let mut word = [0; 8];
        word[..size].copy_from_slice(&bytes[..size]);
        if big {
            word[..size].reverse();
        }
        let word = u64::from_le_bytes(word);
        match self {
            Number::Unsigned(_) => word as f64,
            Number::Signed(size) => {
                let unused = 64 - 8 * size as u32;
                ((word << unused) as i64 >> unused) as f64
            }
            Number::F32 => f32::from_bits(word as u32).into(),
            Number::F64 => f64::from_bits(word),
        }
    }
}

/// The fields that make up a return.
pub(super) struct Fields {
    /// Indices of x, y, z, intensity and time among all fields.
    places: [Option<usize>; 5],
    /// Seconds per unit of time.
    unit_s: f64,
    /// The sweep's stamp, s, if it is known.
    stamp_s: Option<f64>,
}

impl Fields {
    /// Finds them by name. Fails if a coordinate is missing.
    pub fn find(all: &[(String, Number)]) -> Result<Fields, String> {
        let find = |names: &[&str]| {
            let at = |name: &&str| all.iter().position(|f| f.0.eq_ignore_ascii_case(name));
            names.iter().find_map(at)
        };
        let mut places = ["x", "y", "z"].map(|name| find(&[name])).to_vec();
        if let Some(missing) = places.iter().position(Option::is_none) {
            return Err(format!("has no field `{}`", ["x", "y", "z"][missing]));
        }
        let time = find(&["offset_time", "t", "time", "timestamp", "time_stamp"]);
        places.extend([find(&["intensity", "i", "reflectivity"]), time]);
        let float = |n: usize| matches!(all[n].1, Number::F32 | Number::F64);
        let unit_s = if time.is_some_and(float) { 1.0 } else { 1e-9 };
        Ok(Fields { places: [0, 1, 2, 3, 4].map(|n| places[n]), unit_s, stamp_s: None })
    }

    /// The same for a sweep whose stamp is known.
    #[cfg(feature = "mcap")]
    pub fn stamped(self, stamp_ns: i64) -> Fields {
        Fields { stamp_s: Some(stamp_ns as f64 * 1e-9), ..self }
    }

    /// Replaces `into` with `rows` returns; `value(row, field)` is a number of the file. Returns
    /// whether they have times.
    pub fn returns(
        &self,
        rows: usize,
        value: impl Fn(usize, usize) -> f64,
        into: &mut Vec<Point>,
    ) -> bool {
        let get = |row: usize, n: usize| self.places[n].map_or(0.0, |field| value(row, field));
        let all = |n: usize| (0..rows).map(move |row| get(row, n)).filter(|v| v.is_finite());
        let scale = if all(3).any(|v| v > 1.0) { 255.0 } else { 1.0 };
        let earliest = all(4).fold(f64::INFINITY, f64::min);
        let unit_s = if earliest.abs() > SECONDS_MAX { 1e-9 } else { self.unit_s };
        let from = match self.stamp_s {
            _ if earliest.abs() * unit_s <= OFFSET_MAX_S => 0.0,
            Some(stamp_s) if (earliest * unit_s - stamp_s).abs() < OFFSET_MAX_S => stamp_s / unit_s,
            _ => earliest,
        };
        into.clear();
        into.extend((0..rows).map(|row| Point {
            position: [0, 1, 2].map(|axis| get(row, axis) as f32),
            intensity: (get(row, 3) / scale) as f32,
            // The difference first: a clock time leaves no precision for fractions.
            offset_s: ((get(row, 4) - from) * unit_s) as f32,
            sensor: 0,
        }));
        self.places[4].is_some()
    }
}

/// A column of numbers in bytes: the first at `start`, the others `step` bytes apart.
#[derive(Clone, Copy)]
pub(super) struct Attribute {
    pub number: Number,
    pub start: usize,
    pub step: usize,
}

impl Attribute {
    pub fn value(&self, bytes: &[u8], row: usize, big: bool) -> f64 {
        self.number.read(&bytes[self.start + row * self.step..], big)
    }
}

/// The `rows` records of `size` bytes at `at` in a file; what follows is ignored.
pub(super) fn records<'a>(
    path: &Path,
    bytes: &'a [u8],
    at: usize,
    rows: usize,
    size: usize,
) -> Result<&'a [u8], Error> {
    let rest = bytes.get(at..).unwrap_or_default();
    rows.checked_mul(size).and_then(|wanted| rest.get(..wanted)).ok_or_else(|| {
        let what = format!("truncated: {rows} points of {size} bytes, {} bytes left", rest.len());
        Error::input(path, format!("byte {at}"), what)
    })
}

/// The numbers of `rows` lines, `width` each, from the text at `at` in a file; the first line there
/// has the number `line`.
pub(super) fn table(
    path: &Path,
    bytes: &[u8],
    (at, line): (usize, usize),
    rows: usize,
    width: usize,
) -> Result<Vec<f64>, Error> {
    let text = std::str::from_utf8(bytes.get(at..).unwrap_or_default()).map_err(|e| {
        Error::input(path, format!("byte {}", at + e.valid_up_to()), "is not UTF-8 text")
    })?;
    let mut numbers = Vec::new();
    let mut found = 0;
    for (n, content) in text::lines(text).take(rows) {
        let before = numbers.len();
        numbers.extend(text::numbers(path, line + n - 1, content)?);
        if numbers.len() - before != width {
            let what = format!("{width} numbers expected, {} found", numbers.len() - before);
            return Err(Error::input(path, format!("line {}", line + n - 1), what));
        }
        found += 1;
    }
    if found < rows {
        let what = format!("truncated: {rows} points expected, {found} found");
        return Err(Error::input(path, "", what));
    }
    Ok(numbers)
}

/// Lines of a header at the start of a file.
pub(super) struct Head<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    /// First byte and number of the next line.
    pub next: (usize, usize),
}

impl<'a> Head<'a> {
    pub fn new(path: &'a Path, bytes: &'a [u8]) -> Head<'a> {
        Head { path, bytes, next: (0, 1) }
    }

    /// The words of the next line. Fails if the file ends without one, or if it is not UTF-8 text.
    pub fn words(&mut self) -> Result<Vec<&'a str>, Error> {
        let (at, line) = self.next;
        let rest = &self.bytes[at..];
        let end = rest.iter().position(|&b| b == b'\n');
        let end = end.ok_or_else(|| self.error("truncated: the header does not end"))?;
        let text = std::str::from_utf8(&rest[..end]);
        let text = text.map_err(|_| self.error("the header is not UTF-8 text"))?;
        self.next = (at + end + 1, line + 1);
        Ok(text.split_ascii_whitespace().collect())
    }

    /// An error in the next line.
    fn error(&self, what: &str) -> Error {
        Error::input(self.path, format!("line {}", self.next.1), what)
    }

    /// An error in the line just read.
    pub fn wrong(&self, what: impl Into<String>) -> Error {
        Error::input(self.path, format!("line {}", self.next.1 - 1), what)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(names: [&str; 5], number: Number, rows: &[[f64; 5]]) -> (Vec<Point>, bool) {
        let all = names.map(|n| (n.to_owned(), if n.len() > 1 { number } else { Number::F32 }));
        let mut points = Vec::new();
        let fields = Fields::find(&all).unwrap();
        let timed = fields.returns(rows.len(), |row, field| rows[row][field], &mut points);
        (points, timed)
    }

    #[test]
    fn numbers() {
        assert_eq!(Number::Unsigned(2).read(&[1, 2, 9], false), 513.0);
        assert_eq!(Number::Unsigned(2).read(&[1, 2, 9], true), 258.0);
        assert_eq!(Number::Signed(1).read(&[0xfe], false), -2.0);
        assert_eq!(Number::Signed(8).read(&(-3i64).to_be_bytes(), true), -3.0);
        assert_eq!(Number::F32.read(&1.5f32.to_be_bytes(), true), 1.5);
        assert_eq!(Number::F64.read(&(-0.1f64).to_le_bytes(), false), -0.1);
    }

    #[test]
    fn units_of_time() {
        let offsets = |name: &str, number: Number, times: [f64; 2]| {
            let rows = times.map(|t| [1.0, 2.0, 3.0, t, 0.0]);
            let (points, timed) = points(["x", "y", "z", name, "other"], number, &rows);
            assert!(timed);
            [points[0].offset_s, points[1].offset_s]
        };
        let near = |a: [f32; 2], b: [f32; 2]| (0..2).all(|i| (a[i] - b[i]).abs() < 1e-6);
        assert!(near(offsets("offset_time", Number::Unsigned(4), [0.0, 5e7]), [0.0, 0.05]));
        assert!(near(offsets("time", Number::F32, [-0.1, -0.02]), [-0.1, -0.02]));
        let clock = offsets("timestamp", Number::F64, [1.7e9 + 0.25, 1.7e9 + 0.125]);
        assert!(near(clock, [0.125, 0.0]), "{clock:?}");
        assert!(near(offsets("timestamp", Number::F64, [1.7e18, 1.7e18 + 2.56e7]), [0.0, 0.0256]));
        assert!(near(
            offsets("TIME_STAMP", Number::Unsigned(8), [1.7e18 + 2.56e7, 1.7e18]),
            [0.0256, 0.0]
        ));
    }

    #[test]
    fn intensities_and_what_is_missing() {
        let (half, timed) =
            points(["z", "y", "x", "i", "ring"], Number::F32, &[[1.0, 2.0, 3.0, 0.5, 9.0]]);
        assert_eq!((half[0].position, half[0].intensity, timed), ([3.0, 2.0, 1.0], 0.5, false));
        let rows = [[1.0, 2.0, 3.0, 51.0, 0.0], [f64::NAN, 2.0, 3.0, f64::NAN, 0.0]];
        let (bytes, _) = points(["x", "y", "z", "intensity", "t"], Number::F32, &rows);
        assert!((bytes[0].intensity - 0.2).abs() < 1e-6 && bytes[1].position[0].is_nan());
        let all = ["x", "y"].map(|n| (n.to_owned(), Number::F32));
        assert_eq!(Fields::find(&all).err().unwrap(), "has no field `z`");
    }
}
