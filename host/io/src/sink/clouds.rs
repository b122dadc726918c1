//! Clouds and labels as files.

use std::io::{self, Write};
use std::path::Path;

use raywake_core::sweep::Point;

use super::atomic;
use super::table::TableWriter;
use crate::Error;

/// Numbers of a return in formats that name them: m, 0 to 1, and s after the sweep's stamp.
const NAMES: [&str; 5] = ["x", "y", "z", "intensity", "time"];

fn numbers(point: &Point) -> [f32; NAMES.len()] {
    let [x, y, z] = point.position;
    [x, y, z, point.intensity, point.offset_s]
}

/// Writes returns in the format of the path's extension: `npy`, `pcd`, `ply`, `feather`, or KITTI's
/// (`bin`: little-endian float32 x, y, z, intensity per return). `bin` and `npy` have no times.
pub fn write_cloud(path: &Path, points: &[Point]) -> Result<(), Error> {
    let rows: Vec<[f32; NAMES.len()]> = points.iter().map(numbers).collect();
    let bare = || rows.iter().flat_map(|[x, y, z, intensity, _]| [*x, *y, *z, *intensity]);
    match path.extension().and_then(|e| e.to_str()) {
        Some("npy") => atomic::write(path, |out| {
            out.write_all(&npy_head(rows.len()))?;
            bare().try_for_each(|v| out.write_all(&v.to_le_bytes()))
        }),
        Some("pcd") => atomic::write(path, |out| {
            out.write_all(pcd_head(rows.len()).as_bytes())?;
            rows.as_flattened().iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))
        }),
        Some("ply") => write_ply(path, NAMES, &rows),
        Some("feather") => {
            let mut table = TableWriter::default();
            table.array(NAMES, &rows, |row| *row);
            table.write(path, &[])
        }
        _ => atomic::write(path, |out| bare().try_for_each(|v| out.write_all(&v.to_le_bytes()))),
    }
}

/// The head of a numpy array of this many rows of four numbers, padded to a multiple of 64 bytes.
fn npy_head(rows: usize) -> Vec<u8> {
    let text = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, 4), }}");
    let before = 10;
    let length = (before + text.len() + 1).next_multiple_of(64) - before;
    let mut head = b"\x93NUMPY\x01\x00".to_vec();
    head.extend((length as u16).to_le_bytes());
    head.extend(format!("{text:<0$}\n", length - 1).into_bytes());
    head
}

fn pcd_head(points: usize) -> String {
    let [names, sizes, kinds, counts] =
        [NAMES, ["4"; 5], ["F"; 5], ["1"; 5]].map(|words| words.join(" "));
    format!(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS {names}\nSIZE {sizes}\nTYPE {kinds}\nCOUNT {counts}\n\
         WIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA binary\n"
    )
}

/// Writes rows of numbers with these names as a binary PLY file.
pub fn write_ply<const N: usize>(
    path: &Path,
    names: [&str; N],
    rows: &[[f32; N]],
) -> Result<(), Error> {
    atomic::write(path, |out| {
        ply_head(out, rows.len(), &names.map(|name| ("float", name)))?;
        rows.as_flattened().iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))
    })
}

/// Writes the head of a PLY file: the number of vertices, and their properties as type and name.
fn ply_head(out: &mut dyn Write, count: usize, properties: &[(&str, &str)]) -> io::Result<()> {
    write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {count}\n")?;
    properties.iter().try_for_each(|(kind, name)| writeln!(out, "property {kind} {name}"))?;
    writeln!(out, "end_header")
}

/// Writes a map of points in the world, where `float` would have steps of decimetres: `x`, `y`, `z`
/// (m) as `double`, and `intensity`.
pub fn write_map(path: &Path, points: &[([f64; 3], f32)]) -> Result<(), Error> {
    atomic::write(path, |out| {
        let place = ["x", "y", "z"].map(|name| ("double", name));
        ply_head(out, points.len(), &[&place[..], &[("float", "intensity")]].concat())?;
        points.iter().try_for_each(|(at, intensity)| {
            at.iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))?;
            out.write_all(&intensity.to_le_bytes())
        })
    })
}

/// Writes one label per return as SemanticKITTI does: little-endian, 32 bits.
pub fn write_labels(path: &Path, labels: &[u32]) -> Result<(), Error> {
    atomic::write(path, |out| labels.iter().try_for_each(|l| out.write_all(&l.to_le_bytes())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::read_cloud;
    use crate::source::tests::Temp;

    #[test]
    fn written_files_are_read_back() {
        let temp = Temp::new();
        let point = |n: u8| Point {
            position: [n.into(), -2.5, 1e-3 * f32::from(n)],
            intensity: 0.25,
            offset_s: 0.01 * f32::from(n),
            sensor: 0,
        };
        let points = [point(1), point(2), point(7)];
        for (extension, timed) in
            [("bin", false), ("npy", false), ("pcd", true), ("ply", true), ("feather", false)]
        {
            if extension == "feather" && !cfg!(feature = "arrow") {
                continue;
            }
            let path = temp.path().join(format!("a.{extension}"));
            for count in [3, 0] {
                write_cloud(&path, &points[..count]).unwrap();
                let mut read = Vec::new();
                let times = read_cloud(&path, None, &mut read).unwrap();
                assert_eq!((read.len(), times), (count, timed), "{extension}");
                for (read, point) in read.iter().zip(&points) {
                    assert_eq!(read.position, point.position, "{extension}");
                    let expected = if timed { point.offset_s } else { 0.0 };
                    assert!((read.offset_s - expected).abs() < 1e-6, "{extension}: {read:?}");
                }
            }
        }
    }
}
