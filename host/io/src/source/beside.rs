//! Files that are read with a recording, but lie outside it.

use std::path::{Path, PathBuf};

use super::recognise::{entries, recognise};
use super::{Format, kitti};
use crate::Error;

/// The files outside a recording that are read with it: those that describe the sensor of a
/// capture, and the poses of a KITTI odometry sequence as distributed. None if there is no
/// recording.
pub fn beside(path: &Path) -> Vec<PathBuf> {
    match recognise(path) {
        Ok((Format::KittiOdometry, sequence)) => {
            let poses = kitti::odometry_poses(&sequence);
            poses.into_iter().filter(|poses| poses.parent() != Some(&sequence)).collect()
        }
        Ok((Format::Pcap, capture)) => {
            let found = ["json", "xml"].map(|kind| companion_file(&capture, kind).ok().flatten());
            found.into_iter().flatten().collect()
        }
        _ => Vec::new(),
    }
}

/// The file that belongs to a capture: the one next to it with this extension and the longest name
/// that begins the capture's.
pub(super) fn companion_file(path: &Path, extension: &str) -> Result<Option<PathBuf>, Error> {
    let stem = |path: &Path| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    let mut files = entries(parent.unwrap_or(Path::new(".")))?;
    let own = stem(path);
    files.retain(|p| p.extension().is_some_and(|e| e == extension) && own.starts_with(&stem(p)));
    Ok(files.into_iter().max_by_key(|p| stem(p).len()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::tests::Temp;

    #[test]
    fn what_is_read_from_elsewhere() {
        let temp = Temp::new();
        let at = |name: &str| temp.path().join(name);
        for name in ["day.pcap", "day.json", "d.xml", "other.json", "poses/04.txt"] {
            temp.write(name, "");
        }
        temp.write("sequences/04/velodyne/000000.bin", "");
        assert_eq!(beside(&at("day.pcap")), [at("day.json"), at("d.xml")]);
        let sequence = at("sequences/04");
        assert_eq!(beside(&sequence), [sequence.join("../../poses/04.txt")]);
        temp.write("sequences/04/poses.txt", "");
        assert!(beside(&sequence).is_empty() && beside(&at("d.xml")).is_empty());
    }
}
