//! Which labels a drive's folder holds.

use super::sweeps::{Sweeps, fit};
use super::{Error, Labels, boxes_csv, feather, kitti_tracking, tracklets};
use raywake_io::source::{Source, recognise};
use std::fs;
use std::path::{Path, PathBuf};

/// Reads the labels of the drive at `path` (or of the only one in a folder below it), whose sweeps
/// `source` has: the first that is there of
///
/// | file | of | view |
/// |---|---|---|
/// | `truth/objects.feather` | simulated drives, exact | all around |
/// | `tracklet_labels.xml` | KITTI raw | the camera's |
/// | `boxes.csv` | converted boxes | as its boxes show |
/// | `annotations.feather` | Argoverse 2 | all around |
/// | `label_02/NNNN.txt`, `calib/NNNN.txt` | KITTI tracking | the camera's |
///
/// The last are looked for in the drive (one file alone), and as distributed, the drive being
/// `velodyne/NNNN`, in `../../label_02` and `../../calib`.
///
/// Boxes that make no sense are left out, those of frames without a sweep too; tracks are cut where
/// they jump: where something is faster over ground than 15 m/s (people), 30 m/s (cyclists) or
/// 70 m/s, or turns by more than a right angle from one box to the next. The notes count all that.
///
/// Fails where there are no labels, and where they cannot be read.
pub fn open(path: &Path, source: &dyn Source) -> Result<Labels, Error> {
    let names = "`truth/objects.feather`, `tracklet_labels.xml`, `boxes.csv`, \
                 `annotations.feather`, `label_02/NNNN.txt`";
    let missing = || Error::input(path, "", format!("no labels found: none of {names}"));
    find(path, source)?.ok_or_else(missing)
}

/// The same; none where there are none.
pub fn find(path: &Path, source: &dyn Source) -> Result<Option<Labels>, Error> {
    // Labels lie in the folder that has the clouds, the one named where that is not to be told.
    let root = recognise(path).map_or_else(|_| path.to_path_buf(), |found| found.1);
    let mut labels = read(&root).transpose()?;
    labels.iter_mut().for_each(|labels| fit(labels, &Sweeps::of(source)));
    Ok(labels)
}

/// The labels in a folder; none where there are none.
fn read(root: &Path) -> Option<Result<Labels, Error>> {
    let there = |name: &str| Some(root.join(name)).filter(|file| file.is_file());
    if let Some(file) = there("truth/objects.feather") {
        return Some(feather::objects(&file));
    }
    if let Some(file) = there("tracklet_labels.xml") {
        return Some(tracklets::read(&file));
    }
    if let Some(file) = there("boxes.csv") {
        return Some(boxes_csv::read(&file));
    }
    if let Some(file) = there("annotations.feather") {
        return Some(feather::annotations(&file));
    }
    tracking(root).map(|(labels, calib)| kitti_tracking::read(&labels, &calib))
}

/// Labels and calibration of a sequence of the tracking benchmark.
fn tracking(root: &Path) -> Option<(PathBuf, PathBuf)> {
    let full = root.canonicalize().ok()?;
    let pair = |folder: &Path, name: &Path| {
        (folder.join("label_02").join(name), folder.join("calib").join(name))
    };
    if let Some(name) = only_file(&full.join("label_02")) {
        return Some(pair(&full, &name));
    }
    let name = PathBuf::from(full.file_name()?).with_extension("txt");
    let (labels, calib) = pair(full.parent()?.parent()?, &name);
    labels.is_file().then_some((labels, calib))
}

/// Name of the only file in a folder.
fn only_file(folder: &Path) -> Option<PathBuf> {
    let mut entries = fs::read_dir(folder).ok()?.filter_map(Result::ok);
    let (first, second) = (entries.next()?, entries.next());
    second.is_none().then(|| PathBuf::from(first.file_name()))
}
