//! `.bin` files: little-endian float32, a fixed number per return. And `.npy`: floats in rows.

use std::path::Path;

use raywake_core::sweep::Point;

use super::returns::{Fields, Number};
use super::{npy, whole};
use crate::Error;

/// Bytes of a number.
const NUMBER: usize = 4;
/// Maximum accepted count of numbers per return.
const NUMBERS_MAX: usize = 64;
/// A file with a larger share of negative intensities is taken to hold other numbers.
const NEGATIVE_MAX: f64 = 0.05;

/// What the numbers of a return are, in order: names from [`super::returns`], or others for numbers
/// to skip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BinFields(Vec<String>);

impl BinFields {
    /// Parses the text of an option: names separated by commas.
    ///
    /// # Errors
    /// If a coordinate is missing, a name occurs twice, or there are too many names.
    pub fn parse(text: &str) -> Result<BinFields, String> {
        let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).collect();
        if names.len() > NUMBERS_MAX {
            return Err(format!("{} numbers per return, at most {NUMBERS_MAX}", names.len()));
        }
        if let Some(n) = (0..names.len()).find(|&n| names[..n].contains(&names[n])) {
            return Err(format!("`{}` is given twice", names[n]));
        }
        let fields = BinFields(names);
        fields.find().map_err(|what| format!("{what}: expected x,y,z,..."))?;
        Ok(fields)
    }

    /// KITTI's fields, or nuScenes' if the file name ends like its files'.
    fn default_fields(path: &Path) -> BinFields {
        let nuscenes = path.to_string_lossy().ends_with(".pcd.bin");
        let names = ["x", "y", "z", "intensity", "ring"].map(str::to_owned);
        BinFields(names[..if nuscenes { 5 } else { 4 }].to_vec())
    }

    fn find(&self) -> Result<Fields, String> {
        let named: Vec<_> = self.0.iter().map(|name| (name.clone(), Number::F32)).collect();
        Fields::find(&named)
    }
}

/// Replaces `points` with the returns of a `.bin` file; an empty file has none. Returns whether
/// they have times.
///
/// Fails, leaving no points, if the file cannot be read, ends within a return, or, if no fields are
/// given, seems to have others.
pub(super) fn read(
    path: &Path,
    given: Option<&BinFields>,
    points: &mut Vec<Point>,
) -> Result<bool, Error> {
    points.clear();
    let bytes = whole::read(path)?;
    let (default_fields, wrong) =
        (BinFields::default_fields(path), |what| Error::input(path, "", what));
    let fields = given.unwrap_or(&default_fields);
    let (numbers, rest) = bytes.as_chunks::<NUMBER>();
    let (width, names) = (fields.0.len(), fields.0.join(", "));
    if !rest.is_empty() || numbers.len() % width != 0 {
        return Err(wrong(format!(
            "{} bytes, not a multiple of {} (float32 {names}): truncated, or other fields \
             (--bin-fields)?",
            bytes.len(),
            NUMBER * width,
        )));
    }
    let value = |row: usize, field: usize| f32::from_le_bytes(numbers[row * width + field]);
    let rows = numbers.len() / width;
    let negative = (0..rows).filter(|row| given.is_none() && value(*row, 3) < 0.0).count();
    if negative as f64 > NEGATIVE_MAX * rows as f64 {
        let what = format!("{negative} of {rows} intensities are negative: other fields than");
        return Err(wrong(format!("{what} float32 {names}? (--bin-fields)")));
    }
    let found = fields.find().map_err(wrong)?;
    Ok(found.returns(rows, |row, field| value(row, field).into(), points))
}

/// The same for a `.npy` file, whose columns are x, y, z and intensity unless fields are given.
pub(super) fn read_npy(
    path: &Path,
    given: Option<&BinFields>,
    points: &mut Vec<Point>,
) -> Result<bool, Error> {
    points.clear();
    let array = npy::read(path)?;
    let (default_fields, width) = (BinFields::default_fields(path), array.columns);
    let fields =
        given.map_or(&default_fields.0[..default_fields.0.len().min(width)], |given| &given.0);
    let wrong = |what| Error::input(path, "", what);
    if fields.len() > width {
        return Err(wrong(format!("{width} columns, expected {}", fields.join(", "))));
    }
    let found = BinFields(fields.to_vec()).find().map_err(wrong)?;
    let value = |row: usize, field: usize| array.values[row * width + field];
    Ok(found.returns(array.rows, value, points))
}

#[cfg(test)]
mod tests {
    use super::super::tests::Temp;
    use super::*;

    fn floats(numbers: &[f32]) -> Vec<u8> {
        numbers.iter().flat_map(|v| v.to_le_bytes()).collect()
    }

    #[test]
    fn numbers_of_a_return() {
        let t = Temp::new();
        let five: Vec<f32> = (0..20).flat_map(|n| [-1.0, 2.0, -3.0, 51.0, n as f32]).collect();
        let mut points = Vec::new();
        // Read as four floats each, every fifth intensity would be x.
        let path = t.write("a.bin", floats(&five));
        let what = read(&path, None, &mut points).unwrap_err().to_string();
        assert!(what.contains("of 25 intensities are negative: other fields"), "{what}");
        let what = read(&t.write("b.bin", floats(&five[..5])), None, &mut points);
        let what = what.unwrap_err().to_string();
        assert!(what.contains("20 bytes, not a multiple of 16 (float32 x, y, z, i"), "{what}");
        let fields = BinFields::parse("x,y,z,intensity,ring").unwrap();
        let nuscenes = t.write("a__1.pcd.bin", floats(&five));
        for (path, given) in [(&path, Some(&fields)), (&nuscenes, None)] {
            assert!(!read(path, given, &mut points).unwrap());
            let Point { position, intensity, .. } = points[19];
            assert_eq!((points.len(), position, intensity), (20, [-1.0, 2.0, -3.0], 0.2));
        }
        let timed = BinFields::parse("time, x, y, z").unwrap();
        let path = t.write("c.bin", floats(&[0.05, 1.0, 2.0, -3.0]));
        assert!(read(&path, Some(&timed), &mut points).unwrap());
        assert_eq!((points[0].offset_s, points[0].position), (0.05, [1.0, 2.0, -3.0]));
        let refused = |text: &str| BinFields::parse(text).unwrap_err();
        assert_eq!(refused("x,y,i"), "has no field `z`: expected x,y,z,...");
        assert_eq!(refused("x,y,z,x"), "`x` is given twice");
    }

    #[test]
    fn arrays() {
        let t = Temp::new();
        let npy = |columns: usize, numbers: &[f32]| {
            let (rows, kind) = (numbers.len() / columns, "'descr': '<f4'");
            let header =
                format!("{{{kind}, 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
            let length = (header.len() as u16).to_le_bytes();
            [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), &floats(numbers)].concat()
        };
        let mut points = Vec::new();
        read_npy(&t.write("a.npy", npy(3, &[1.0, 2.0, 3.0])), None, &mut points).unwrap();
        assert_eq!((points[0].position, points[0].intensity), ([1.0, 2.0, 3.0], 0.0));
        let path = t.write("a.npy", npy(5, &[1.0, 2.0, 3.0, 0.5, 9.0]));
        read_npy(&path, None, &mut points).unwrap();
        assert_eq!(points[0].intensity, 0.5);
        let what = read_npy(&t.write("a.npy", npy(2, &[1.0, 2.0])), None, &mut points);
        assert!(what.unwrap_err().to_string().ends_with("has no field `z`"));
    }
}
