//! Which format a folder holds.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::clouds::EXTENSIONS;
use super::{FORMATS, Format, FormatRow};
use crate::Error;

/// Extension of ROS recordings.
pub(super) const MCAP: &str = "mcap";

/// The folder of a Waymo segment's images, next to that of their calibration.
pub(super) const WAYMO_LASERS: &str = "lidar";

/// The table by which nuScenes scenes are recognised.
pub(super) const SCENES: &str = "sample_data.json";

/// Levels of folders below the given one that are searched for a recording.
const DEPTH: usize = 2;

/// Format and folder of the recording at `path`, or of the only one up to two levels below.
///
/// Fails if there is none, if there are several, and if `path` cannot be read.
pub fn recognise(path: &Path) -> Result<(Format, PathBuf), Error> {
    let meta = fs::metadata(path).map_err(Error::reading(path))?;
    if !meta.is_dir() {
        return format_of_file(path).map(|format| (format, path.to_path_buf()));
    }
    if let Some(format) = format_of(path)? {
        return Ok((format, path.to_path_buf()));
    }
    let mut found = below(path, DEPTH)?;
    match found.len() {
        1 => Ok(found.remove(0)),
        0 => {
            let marks: Vec<&str> = FORMATS.iter().flat_map(|row| row.marks).copied().collect();
            let what = format!("no recording found: none of `{}`", marks.join("`, `"));
            Err(Error::input(path, "", what + " (a `.pcap` must be named itself)"))
        }
        n => {
            let some: Vec<_> = found.iter().take(3).map(|f| f.1.display().to_string()).collect();
            let what = format!("contains {n} recordings, choose one: {}", some.join(", "));
            Err(Error::input(path, "", what))
        }
    }
}

/// The format of a single-file recording, by its extension.
fn format_of_file(path: &Path) -> Result<Format, Error> {
    let extension = path.extension().and_then(|e| e.to_str());
    let is_of = |row: &&FormatRow| extension.is_some_and(|e| row.files.contains(&e));
    if let Some(row) = FORMATS.iter().find(is_of) {
        return Ok(row.kind);
    }
    let what = match extension {
        Some("bag") => "a ROS 1 bag, convert it: mcap convert IN.bag OUT.mcap",
        Some("db3") => "a ROS 2 bag in SQLite, convert it to MCAP: ros2 bag convert",
        Some(e) if EXTENSIONS.contains(&e) => {
            "a single cloud, expected the folder it is in; for two clouds: raywake flow A B"
        }
        _ => "expected a folder, an .mcap or a .pcap file, found a file of another kind",
    };
    Err(Error::input(path, "", what))
}

/// Recordings in the folders below, sorted by path.
fn below(path: &Path, depth: usize) -> Result<Vec<(Format, PathBuf)>, Error> {
    let mut found = Vec::new();
    if depth == 0 {
        return Ok(found);
    }
    for folder in entries(path)?.into_iter().filter(|p| p.is_dir()) {
        match format_of(&folder)? {
            Some(format) => found.push((format, folder)),
            None => found.extend(below(&folder, depth - 1)?),
        }
    }
    Ok(found)
}

/// The format of a folder by the names in it.
fn format_of(path: &Path) -> Result<Option<Format>, Error> {
    for row in FORMATS {
        if (row.holds)(path)? {
            return Ok(Some(row.kind));
        }
    }
    Ok(None)
}

/// Whether a folder holds Waymo segments.
pub(super) fn is_waymo(path: &Path) -> Result<bool, Error> {
    Ok(path.join(WAYMO_LASERS).is_dir() && path.join("lidar_calibration").is_dir())
}

/// Whether a folder, or one in it, holds nuScenes tables.
pub(super) fn is_nuscenes(path: &Path) -> Result<bool, Error> {
    let has_tables = |p: &PathBuf| p.join(SCENES).is_file();
    Ok(has_tables(&path.to_path_buf()) || entries(path)?.iter().any(has_tables))
}

/// Whether a folder has a file with this extension.
pub(super) fn has_extension(path: &Path, extension: &str) -> Result<bool, Error> {
    Ok(entries(path)?.iter().any(|p| p.extension().is_some_and(|e| e == extension)))
}

/// Extensions of the clouds in a folder, each once.
pub(super) fn extensions(path: &Path) -> Result<impl Iterator<Item = &'static str>, Error> {
    let files = entries(path)?;
    let there = move |e: &&str| files.iter().any(|p| p.extension().is_some_and(|x| x == *e));
    Ok(EXTENSIONS.into_iter().filter(there))
}

/// Entries of a folder, sorted by name.
pub(super) fn entries(path: &Path) -> Result<Vec<PathBuf>, Error> {
    let listed = fs::read_dir(path).map_err(Error::reading(path))?;
    let of = |entry: io::Result<fs::DirEntry>| Ok(entry.map_err(Error::reading(path))?.path());
    let mut entries: Vec<PathBuf> = listed.map(of).collect::<Result<_, Error>>()?;
    entries.sort();
    Ok(entries)
}

/// Files of a folder with this extension and their numbers (`0000000012.bin` is 12), in numerical
/// order; if a name is not a number, in the order of names and counted from 0.
///
/// The second value is false in that case. Fails if there are none, or if two files have the same
/// number.
pub(super) fn numbered(path: &Path, extension: &str) -> Result<(Vec<(u64, PathBuf)>, bool), Error> {
    let mut files = entries(path)?;
    files.retain(|p| p.extension().is_some_and(|e| e == extension));
    if files.is_empty() {
        return Err(Error::input(path, "", format!("no sweeps: no `.{extension}` file")));
    }
    let number = |p: &PathBuf| p.file_stem()?.to_str()?.parse::<u64>().ok();
    let numbers: Option<Vec<u64>> = files.iter().map(number).collect();
    let Some(numbers) = numbers else {
        return Ok(((0..).zip(files).collect(), false));
    };
    let mut files: Vec<_> = numbers.into_iter().zip(files).collect();
    files.sort();
    if let Some(pair) = files.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        let what = format!("has the same number as {}", pair[0].1.display());
        return Err(Error::input(&pair[1].1, "", what));
    }
    Ok((files, true))
}

/// Adds a note on numbers missing from the sequence.
pub(super) fn note_gaps(frames: &[u64], notes: &mut Vec<String>) {
    let gaps: Vec<_> = frames.windows(2).filter(|w| w[1] > w[0] + 1).collect();
    if gaps.is_empty() {
        return;
    }
    let missing: u64 = gaps.iter().map(|w| w[1] - w[0] - 1).sum();
    let mut text: Vec<_> = gaps
        .iter()
        .take(4)
        .map(|w| match (w[0] + 1, w[1] - 1) {
            (a, b) if a == b => a.to_string(),
            (a, b) => format!("{a} to {b}"),
        })
        .collect();
    if gaps.len() > text.len() {
        text.push("…".into());
    }
    notes.push(format!("{missing} sweeps missing: frames {}", text.join(", ")));
}
