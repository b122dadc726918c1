//! Clouds in `.bin` files: little-endian float32 x, y, z, intensity.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use raywake_core::pose::Pose;
use raywake_core::sweep::{Point, Rig};

use super::poses::Track;
use super::{Dropped, Source, SweepData};
use crate::error::Error;

/// Bytes of one return.
const RETURN: usize = 16;

/// Bytes read at once, a multiple of [`RETURN`].
const CHUNK: usize = 1 << 16;

/// A folder of `.bin` clouds with the track of the vehicle.
pub(super) struct Bins {
    pub name: String,
    /// Format and folder, for [`Source::describe`].
    pub kind: String,
    /// Where the poses are from, for [`Source::describe`].
    pub poses_from: String,
    /// Frame number and file, in order.
    pub files: Vec<(u64, PathBuf)>,
    pub track: Track,
    pub rig: Rig,
    pub notes: Vec<String>,
}

impl Source for Bins {
    fn name(&self) -> &str {
        &self.name
    }

    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn len(&self) -> usize {
        self.files.len()
    }

    fn describe(&self) -> String {
        let (sweeps, span) = (self.files.len(), self.track.duration_s());
        format!("{}: {sweeps} sweeps, {span:.1} s, poses from {}", self.kind, self.poses_from)
    }

    fn frame(&self, index: usize) -> u64 {
        self.files[index].0
    }

    fn stamp_s(&self, index: usize) -> f64 {
        self.track.stamps_s[index]
    }

    fn pose(&self, index: usize) -> Pose {
        self.track.poses[index]
    }

    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error> {
        let (frame, path) = &self.files[index];
        let before = index.checked_sub(1).map_or(*frame, |i| self.files[i].0 + 1);
        into.frame = *frame;
        into.dropped = Dropped { sweeps_before: frame - before, null_rows: 0 };
        into.stamp_s = self.track.stamps_s[index];
        into.world_from_vehicle = self.track.poses[index];
        into.twist = self.track.twist(index);
        read_bin(path, &mut into.points)
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }
}

/// Largest file that is read: 16 million returns, a hundred times what a sweep has.
const SIZE_MAX: u64 = 256 << 20;

/// Replaces `points` by the returns of a `.bin` file; an empty file has none.
///
/// Fails, leaving no points, where the file cannot be read or ends within a return.
pub(super) fn read_bin(path: &Path, points: &mut Vec<Point>) -> Result<(), Error> {
    points.clear();
    let mut file = File::open(path).map_err(Error::reading(path))?;
    let size = file.metadata().map_err(Error::reading(path))?.len();
    if size > SIZE_MAX {
        let what = format!("{size} bytes are more than any sweep has ({SIZE_MAX} at most)");
        return Err(Error::input(path, "", what));
    }
    points.reserve((size / RETURN as u64) as usize);
    let mut chunk = vec![0; CHUNK];
    let mut total = 0;
    loop {
        let read = match fill(&mut file, &mut chunk) {
            Ok(read) => read,
            Err(e) => {
                points.clear();
                return Err(Error::reading(path)(e));
            }
        };
        total += read;
        let (returns, rest) = chunk[..read].as_chunks::<RETURN>();
        if !rest.is_empty() {
            points.clear();
            let what = format!("truncated: {total} bytes are no multiple of {RETURN}");
            return Err(Error::input(path, "", what));
        }
        points.extend(returns.iter().map(decode));
        if read < CHUNK {
            return Ok(());
        }
    }
}

/// One return.
fn decode(bytes: &[u8; RETURN]) -> Point {
    let (floats, _) = bytes.as_chunks::<4>();
    let value = |i: usize| f32::from_le_bytes(floats[i]);
    Point { position: [value(0), value(1), value(2)], intensity: value(3), ..Point::default() }
}

/// Fills the buffer as far as the file goes.
fn fill(file: &mut File, buffer: &mut [u8]) -> std::io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match file.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(n) => filled += n,
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(filled)
}
