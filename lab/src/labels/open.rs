//! Which labels a drive's folder holds.

use super::{Error, Labels, boxes_csv, feather};
use raywake::source::{Source, recognise};
use std::path::Path;

/// Reads the labels of the drive at `path` (or of the only one in a folder below it), whose sweeps
/// `source` has: the first that is there of
///
/// | file | of | view |
/// |---|---|---|
/// | `truth/objects.feather` | simulated drives | all around |
/// | `boxes.csv` | converted boxes | as its boxes show |
/// | `annotations.feather` | Argoverse 2 | all around |
///
/// Fails where there are none, and where they cannot be read.
pub fn open(path: &Path, source: &dyn Source) -> Result<Labels, Error> {
    let (_, root) = recognise(path)?;
    let _ = source;
    let there = |name: &str| Some(root.join(name)).filter(|file| file.is_file());
    if let Some(file) = there("truth/objects.feather") {
        return feather::objects(&file);
    }
    if let Some(file) = there("boxes.csv") {
        return boxes_csv::read(&file);
    }
    if let Some(file) = there("annotations.feather") {
        return feather::annotations(&file);
    }
    Err(Error::input(&root, "", "no labels found"))
}
