//! Clouds and labels as plain binary files.

use std::io::Write;
use std::path::Path;

use raywake_core::sweep::Point;

use super::atomic;
use crate::Error;

/// Writes returns as KITTI does: little-endian float32 x, y, z, intensity each.
pub fn write_bin<'a>(
    path: &Path,
    returns: impl IntoIterator<Item = &'a Point>,
) -> Result<(), Error> {
    atomic::write(path, |out| {
        returns.into_iter().try_for_each(|point| {
            let [x, y, z] = point.position;
            [x, y, z, point.intensity].iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))
        })
    })
}

/// Writes rows of numbers with these names as a binary PLY file.
pub fn write_ply<const N: usize>(
    path: &Path,
    names: [&str; N],
    rows: &[[f32; N]],
) -> Result<(), Error> {
    atomic::write(path, |out| {
        write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", rows.len())?;
        names.iter().try_for_each(|name| writeln!(out, "property float {name}"))?;
        writeln!(out, "end_header")?;
        rows.as_flattened().iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))
    })
}

/// Writes a label a return as SemanticKITTI does: little-endian, 32 bits.
pub fn write_labels(path: &Path, labels: &[u32]) -> Result<(), Error> {
    atomic::write(path, |out| labels.iter().try_for_each(|l| out.write_all(&l.to_le_bytes())))
}
