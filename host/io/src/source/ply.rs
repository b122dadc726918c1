//! PLY files: text or binary of either byte order; the vertices are the points.
//!
//! The properties are those of [`super::returns`].

use std::path::Path;

use raywake_core::sweep::Point;

use super::returns::{Attribute, Fields, Head, Number, records, table};
use super::whole;
use crate::Error;

/// Replaces `points` with the vertices of a file; returns whether they have times.
///
/// Fails, leaving no points, if the file cannot be read, its header is inconsistent, other elements
/// come before the vertices, or it ends early.
pub(super) fn read(path: &Path, points: &mut Vec<Point>) -> Result<bool, Error> {
    points.clear();
    let bytes = whole::read(path)?;
    let mut head = Head::new(path, &bytes);
    let header = PlyHeader::read(&mut head)?;
    let fields = Fields::find(&header.fields).map_err(|what| Error::input(path, "", what))?;
    let (rows, width) = (header.rows, header.fields.len());
    let Some(big) = header.big else {
        let numbers = table(path, &bytes, head.next, rows, width)?;
        return Ok(fields.returns(rows, |row, f| numbers[row * width + f], points));
    };
    let size = header.fields.iter().map(|f| f.1.size()).sum();
    let records = records(path, &bytes, head.next.0, rows, size)?;
    let mut start = 0;
    let column = |&(_, number): &(String, Number)| {
        start += number.size();
        Attribute { number, start: start - number.size(), step: size }
    };
    let columns: Vec<Attribute> = header.fields.iter().map(column).collect();
    Ok(fields.returns(rows, |row, f| columns[f].value(records, row, big), points))
}

struct PlyHeader {
    /// Name and type of each property of a vertex.
    fields: Vec<(String, Number)>,
    rows: usize,
    /// Whether numbers are big-endian; `None` for text.
    big: Option<bool>,
}

/// The element that a header line belongs to.
#[derive(PartialEq)]
enum Element {
    None,
    Vertex,
    After,
}

impl PlyHeader {
    fn read(head: &mut Head) -> Result<PlyHeader, Error> {
        if head.words()? != ["ply"] {
            return Err(head.wrong("is not a PLY file (it does not start with `ply`)"));
        }
        let (mut big, mut rows, mut fields) = (None, 0, Vec::new());
        let mut element = Element::None;
        loop {
            let words = head.words()?;
            match words[..] {
                [] | ["comment" | "obj_info", ..] => {}
                ["format", "ascii", "1.0"] => big = Some(None),
                ["format", "binary_little_endian", "1.0"] => big = Some(Some(false)),
                ["format", "binary_big_endian", "1.0"] => big = Some(Some(true)),
                ["element", "vertex", count] if element == Element::None => {
                    let bad = |_| head.wrong(format!("`{count:.20}` is not a count"));
                    (rows, element) = (count.parse().map_err(bad)?, Element::Vertex);
                }
                ["element", ..] if element == Element::None => {
                    return Err(head.wrong("another element comes before the vertices"));
                }
                ["element", ..] => element = Element::After,
                ["property", ..] if element == Element::After => {}
                ["property", kind, name] if element == Element::Vertex => {
                    let unknown = || head.wrong(format!("unknown type `{kind:.20}`"));
                    fields.push((name.to_owned(), number(kind).ok_or_else(unknown)?));
                }
                ["property", "list", ..] => {
                    return Err(head.wrong("a vertex with a list is not supported"));
                }
                ["end_header"] if element != Element::None => {
                    let big = big.ok_or_else(|| head.wrong("no format before end_header"))?;
                    return Ok(PlyHeader { fields, rows, big });
                }
                _ => {
                    let text = words.join(" ");
                    return Err(head.wrong(format!("`{text:.40}` makes no sense here")));
                }
            }
        }
    }
}

fn number(kind: &str) -> Option<Number> {
    Some(match kind {
        "char" | "int8" => Number::Signed(1),
        "uchar" | "uint8" => Number::Unsigned(1),
        "short" | "int16" => Number::Signed(2),
        "ushort" | "uint16" => Number::Unsigned(2),
        "int" | "int32" => Number::Signed(4),
        "uint" | "uint32" => Number::Unsigned(4),
        "float" | "float32" => Number::F32,
        "double" | "float64" => Number::F64,
        _ => return None,
    })
}
