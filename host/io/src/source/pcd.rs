//! PCD files of the Point Cloud Library, version 0.7: text, binary or compressed.
//!
//! The fields are those of [`super::returns`]. `VIEWPOINT`, the pose of the sensor, gives the poses
//! of a folder of files that have it ([`super::viewpoints`]).

use std::io::Read;
use std::path::Path;

use raywake_core::pose::Pose;
use raywake_core::sweep::Point;

use super::poses::rigid;
use super::returns::{Attribute, Fields, Head, Number, records, table};
use super::{lzf, text, whole};
use crate::Error;

/// Replaces `points` with those of a file; returns whether they have times.
///
/// Fails, leaving no points, if the file cannot be read, its header is inconsistent, or it ends
/// early.
pub(super) fn read(path: &Path, points: &mut Vec<Point>) -> Result<bool, Error> {
    points.clear();
    let bytes = whole::read(path)?;
    let mut head = Head::new(path, &bytes);
    let header = PcdHeader::read(&mut head)?;
    let named: Vec<_> = header.fields.iter().map(|f| (f.name.clone(), f.number)).collect();
    let fields = Fields::find(&named).map_err(|what| Error::input(path, "", what))?;
    let (rows, at) = (header.rows, head.next.0);
    match header.data {
        Data::Text => {
            let width = header.fields.iter().map(|f| f.count).sum();
            let numbers = table(path, &bytes, head.next, rows, width)?;
            let first = header.before(|f| f.count);
            Ok(fields.returns(rows, |row, f| numbers[row * width + first[f]], points))
        }
        Data::Binary => {
            let size = header.record();
            let records = records(path, &bytes, at, rows, size)?;
            let before = header.before(Field::size);
            let columns = header.columns(|f| (before[f], size));
            Ok(fields.returns(rows, |row, f| columns[f].value(records, row, false), points))
        }
        Data::Compressed => {
            let unpacked = unpack(path, &bytes, at, rows, header.record())?;
            let before = header.before(Field::size);
            // Field after field, each for all points.
            let columns = header.columns(|f| (rows * before[f], header.fields[f].size()));
            Ok(fields.returns(rows, |row, f| columns[f].value(&unpacked, row, false), points))
        }
    }
}

/// Bytes of a file that are searched for its header.
const HEADER_MAX: u64 = 4096;

/// The pose of the sensor in a header, x, y, z and quaternion w, x, y, z; `None` if there is none.
///
/// Fails if the file cannot be read, and if the numbers are not a pose.
pub(super) fn viewpoint(path: &Path) -> Result<Option<Pose>, Error> {
    let (file, _) = whole::open(path)?;
    let mut bytes = Vec::new();
    file.take(HEADER_MAX).read_to_end(&mut bytes).map_err(Error::reading(path))?;
    for (n, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
        let line = String::from_utf8_lossy(line);
        if line.starts_with("DATA") {
            break;
        }
        let Some(numbers) = line.strip_prefix("VIEWPOINT") else { continue };
        let [x, y, z, w, a, b, c] = text::exactly(path, n + 1, numbers)?;
        let pose = rigid([x, y, z], [a, b, c, w]);
        return pose.map(Some).map_err(|what| Error::input(path, format!("line {}", n + 1), what));
    }
    Ok(None)
}

/// Unpacks the body of a compressed file: its packed and unpacked length, 32 bits each, and the
/// packed bytes.
fn unpack(
    path: &Path,
    bytes: &[u8],
    at: usize,
    rows: usize,
    record: usize,
) -> Result<Vec<u8>, Error> {
    let size = rows.saturating_mul(record);
    let wrong = |what: String| Error::input(path, format!("byte {at}"), what);
    whole::check_unpacked(bytes.len(), size as u64, rows as u64).map_err(wrong)?;
    let rest = bytes.get(at..).unwrap_or_default();
    let (lengths, rest) = rest.split_at_checked(8).ok_or_else(|| {
        wrong(format!("truncated: two lengths expected, {} bytes left", rest.len()))
    })?;
    let length = |n: usize| Number::Unsigned(4).read(&lengths[4 * n..], false) as usize;
    if length(1) != size {
        return Err(wrong(format!("unpacks to {} bytes, the header expects {size}", length(1))));
    }
    let packed = rest.get(..length(0)).ok_or_else(|| {
        wrong(format!("truncated: {} packed bytes, {} bytes left", length(0), rest.len()))
    })?;
    lzf::unpack(packed, size).map_err(|what| wrong(what.into()))
}

/// How the points are stored.
#[derive(Clone, Copy)]
enum Data {
    Text,
    Binary,
    Compressed,
}

/// A field of a point.
struct Field {
    name: String,
    number: Number,
    /// Its count of numbers; only the first is used.
    count: usize,
}

impl Field {
    fn size(&self) -> usize {
        self.number.size() * self.count
    }
}

struct PcdHeader {
    fields: Vec<Field>,
    rows: usize,
    data: Data,
}

/// Maximum accepted number of fields, and of numbers in a field.
const FIELDS_MAX: usize = 1 << 10;

impl PcdHeader {
    fn read(head: &mut Head) -> Result<PcdHeader, Error> {
        let (mut names, mut sizes, mut types) = (Vec::new(), Vec::new(), Vec::new());
        let (mut counts, mut width, mut height, mut points) = (None, None, None, None);
        loop {
            let words = head.words()?;
            let Some((&key, rest)) = words.split_first() else { continue };
            match key {
                "VERSION" | "VIEWPOINT" => {}
                "FIELDS" | "COLUMNS" => names = rest.iter().map(|n| n.to_string()).collect(),
                "SIZE" => sizes = whole(head, rest)?,
                "TYPE" => types = rest.iter().map(|t| t.to_string()).collect(),
                "COUNT" => counts = Some(whole(head, rest)?),
                "WIDTH" => width = Some(one(head, rest)?),
                "HEIGHT" => height = Some(one(head, rest)?),
                "POINTS" => points = Some(one(head, rest)?),
                "DATA" => {
                    let area = width.zip(height.or(Some(1)));
                    let area = area.and_then(|(w, h): (usize, usize)| w.checked_mul(h));
                    let rows =
                        points.or(area).ok_or_else(|| head.wrong("no POINTS before DATA"))?;
                    if area.is_some_and(|a| a != rows) {
                        let what = format!("{rows} POINTS are not WIDTH times HEIGHT");
                        return Err(head.wrong(what));
                    }
                    let fields = fields(&names, &sizes, &types, counts.as_deref());
                    let fields = fields.map_err(|what| head.wrong(what))?;
                    let data = match rest {
                        ["ascii"] => Data::Text,
                        ["binary"] => Data::Binary,
                        ["binary_compressed"] => Data::Compressed,
                        _ => return Err(head.wrong(format!("unknown DATA {}", rest.join(" ")))),
                    };
                    return Ok(PcdHeader { fields, rows, data });
                }
                _ if key.starts_with('#') => {}
                _ => return Err(head.wrong(format!("`{key:.20}` is not an entry of a PCD header"))),
            }
        }
    }

    /// Bytes of a point.
    fn record(&self) -> usize {
        self.fields.iter().map(Field::size).sum()
    }

    /// The sum of a quantity over the fields before each field.
    fn before(&self, of: impl Fn(&Field) -> usize) -> Vec<usize> {
        let mut sum = 0;
        let place = |f: &Field| {
            sum += of(f);
            sum - of(f)
        };
        self.fields.iter().map(place).collect()
    }

    /// The columns of the fields, by start and step.
    fn columns(&self, place: impl Fn(usize) -> (usize, usize)) -> Vec<Attribute> {
        let column = |(n, field): (usize, &Field)| {
            let (start, step) = place(n);
            Attribute { number: field.number, start, step }
        };
        self.fields.iter().enumerate().map(column).collect()
    }
}

fn fields(
    names: &[String],
    sizes: &[usize],
    types: &[String],
    counts: Option<&[usize]>,
) -> Result<Vec<Field>, String> {
    let n = names.len();
    if n == 0 || sizes.len() != n || types.len() != n || counts.is_some_and(|c| c.len() != n) {
        return Err("FIELDS, SIZE, TYPE and COUNT do not have the same number of entries".into());
    }
    let field = |i: usize| {
        let number = match (types[i].as_str(), sizes[i]) {
            ("F", 4) => Number::F32,
            ("F", 8) => Number::F64,
            ("U", size @ (1 | 2 | 4 | 8)) => Number::Unsigned(size),
            ("I", size @ (1 | 2 | 4 | 8)) => Number::Signed(size),
            (kind, size) => {
                return Err(format!(
                    "field `{}`: TYPE {kind} of SIZE {size} is not supported",
                    names[i]
                ));
            }
        };
        let count = counts.map_or(1, |c| c[i]);
        if n > FIELDS_MAX || !(1..=FIELDS_MAX).contains(&count) {
            return Err(format!(
                "field `{}`: COUNT {count} in {n} fields is out of range",
                names[i]
            ));
        }
        Ok(Field { name: names[i].clone(), number, count })
    };
    (0..n).map(field).collect()
}

/// Whole numbers of a header line.
fn whole(head: &Head, words: &[&str]) -> Result<Vec<usize>, Error> {
    let number = |w: &&str| w.parse().map_err(|_| head.wrong(format!("`{w:.20}` is not a count")));
    words.iter().map(number).collect()
}

fn one(head: &Head, words: &[&str]) -> Result<usize, Error> {
    match whole(head, words)?[..] {
        [number] => Ok(number),
        _ => Err(head.wrong("one number expected")),
    }
}
