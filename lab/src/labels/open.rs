//! Finds and reads the labels in a drive's folder.

use super::sweeps::{Sweeps, fit};
use super::{Error, Labels, boxes_csv, feather, kitti_tracking, tracklets};
use raywake_io::source::{Source, recognise};
use std::fs;
use std::path::{Path, PathBuf};

/// Reads the labels of the drive at `path` (or of the only one in a folder below it), whose sweeps
/// are in `source`: the first found of
///
/// | file | source | view |
/// |---|---|---|
/// | `truth/objects.feather` | simulated drives, exact | all round |
/// | `tracklet_labels.xml` | KITTI raw | the camera's |
/// | `boxes.csv` | converted boxes | inferred from its boxes |
/// | `annotations.feather` | Argoverse 2 | all round |
/// | `label_02/NNNN.txt`, `calib/NNNN.txt` | KITTI tracking | the camera's |
///
/// The last are searched for in the drive (a single file), and as distributed: if the drive is
/// `velodyne/NNNN`, in `../../label_02` and `../../calib`.
///
/// Invalid boxes are left out, and so are those of frames without a sweep; tracks are cut where
/// they jump: if something moves faster over ground than 15 m/s (people), 30 m/s (cyclists) or 70
/// m/s, or turns by more than a right angle from one box to the next. The notes count all of these.
///
/// Fails if there are no labels or they cannot be read.
pub fn open(path: &Path, source: &dyn Source) -> Result<Labels, Error> {
    let names = "`truth/objects.feather`, `tracklet_labels.xml`, `boxes.csv`, \
                 `annotations.feather`, `label_02/NNNN.txt`";
    let missing = || Error::input(path, "", format!("no labels found: none of {names}"));
    find(path, source)?.ok_or_else(missing)
}

/// The same; `None` if there are no labels.
pub fn find(path: &Path, source: &dyn Source) -> Result<Option<Labels>, Error> {
    // Labels lie in the folder that has the clouds, or in the one named if that is not recognised.
    let root = recognise(path).map_or_else(|_| path.to_path_buf(), |found| found.1);
    let mut labels = read(&root).transpose()?;
    labels.iter_mut().for_each(|labels| fit(labels, &Sweeps::of(source)));
    Ok(labels)
}

/// The labels in a folder; `None` if there are none.
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
