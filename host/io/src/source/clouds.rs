//! A folder of clouds with the vehicle's trajectory.

use std::path::{Path, PathBuf};

use raywake_core::pose::Pose;
use raywake_core::sweep::Point;

use super::bin::{self, BinFields};
use super::sidecars::Sidecars;
use super::{Overview, Source, SourceGaps, SweepData, pcd, ply, viewpoints};
use crate::Error;

/// An open folder.
pub(super) struct Clouds {
    pub overview: Overview,
    /// Format and folder, for [`Source::describe`].
    pub kind: String,
    /// Where the poses are from, for [`Source::describe`].
    pub poses_from: String,
    /// File of every sweep.
    pub files: Vec<PathBuf>,
    /// Poses of the clouds, if their points are in the world and not in the vehicle's frame.
    pub world_from_cloud: Vec<Pose>,
    /// What the numbers of a return are, if the user says so.
    pub fields: Option<BinFields>,
    /// Files with the times and sensors of returns.
    pub sidecars: Option<Sidecars>,
}

impl Source for Clouds {
    fn overview(&self) -> &Overview {
        &self.overview
    }

    fn describe(&self) -> String {
        format!("{}: {}, poses from {}", self.kind, self.overview.length(), self.poses_from)
    }

    fn extension(&self) -> Option<&str> {
        self.files.first()?.extension()?.to_str()
    }

    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error> {
        self.overview.begin(index, into);
        let sweeps_before = self.overview.missing_before(index);
        into.dropped = SourceGaps { sweeps_before, null_rows: 0 };
        let path = &self.files[index];
        read_cloud(path, self.fields.as_ref(), &mut into.points)?;
        if let Some(pose) = self.world_from_cloud.get(index) {
            viewpoints::transform_from_world(&mut into.points, pose);
        }
        let Some(sidecars) = &self.sidecars else { return Ok(()) };
        sidecars.fill(path, &mut into.points).inspect_err(|_| into.points.clear())
    }
}

/// Replaces `points` with the returns of a file in the format of its extension: `bin`, `npy`,
/// `pcd`, `ply`, or `feather` with columns `x`, `y` and `z`; returns whether they have times.
/// `fields` are those of the first two formats, if they are not the usual ones.
///
/// Fails, leaving no points, if the extension is another one, and if the file cannot be read or is
/// damaged.
pub fn read_cloud(
    path: &Path,
    fields: Option<&BinFields>,
    points: &mut Vec<Point>,
) -> Result<bool, Error> {
    points.clear();
    match path.extension().and_then(|e| e.to_str()) {
        Some("bin") => bin::read(path, fields, points),
        Some("npy") => bin::read_npy(path, fields, points),
        Some("pcd") => pcd::read(path, points),
        Some("ply") => ply::read(path, points),
        Some("feather") => read_feather(path, points).map(|()| false),
        _ => {
            let what = "unknown extension, expected .bin, .npy, .pcd, .ply or .feather";
            Err(Error::input(path, "", what))
        }
    }
}

#[cfg(feature = "arrow")]
fn read_feather(path: &Path, points: &mut Vec<Point>) -> Result<(), Error> {
    let named = |names: [&'static str; 3]| {
        super::feather::FeatherTable::read(path, &names).map(|table| (table, names))
    };
    let (table, names) =
        named(["x", "y", "z"]).or_else(|e| named(["X", "Y", "Z"]).map_err(|_| e))?;
    let positions = table.vectors(names)?.into_iter();
    points.extend(positions.map(|position| Point { position, ..Point::default() }));
    Ok(())
}

#[cfg(not(feature = "arrow"))]
fn read_feather(path: &Path, _: &mut Vec<Point>) -> Result<(), Error> {
    Err(Error::missing_feature(format!("{}, a feather file,", path.display()), "arrow"))
}

/// Extensions of the clouds in a folder of clouds.
pub(super) const EXTENSIONS: [&str; 4] = ["bin", "npy", "pcd", "ply"];
