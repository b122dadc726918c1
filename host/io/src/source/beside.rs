//! Files that are read with a recording, but lie outside it.

use std::path::{Path, PathBuf};

use super::recognise::{entries, recognise};
use super::{Format, kitti};
use crate::Error;

/// The files outside a recording at `path` that are read with it: those that describe the sensor
/// of a capture, the calibration of a KITTI raw drive's day, and the poses of a KITTI odometry
/// sequence as distributed. Not the clouds of nuScenes if `path` is the folder of its tables: these
/// name them. None if there is no recording, or what is beside it cannot be listed: opening it
/// fails.
pub fn beside(path: &Path) -> Vec<PathBuf> {
    let Ok((format, root)) = recognise(path) else { return Vec::new() };
    let read = match format {
        Format::KittiRaw => vec![kitti::calibration(&root).ok().flatten()],
        Format::KittiOdometry => vec![kitti::odometry_poses(&root)],
        Format::Pcap => ["json", "xml"].map(|e| companion_file(&root, e).ok().flatten()).into(),
        _ => Vec::new(),
    };
    let resolved = |path: &Path| path.canonicalize().ok();
    let outside = |file: &PathBuf| match (resolved(file), resolved(path)) {
        (Some(file), Some(path)) => !file.starts_with(path),
        _ => true,
    };
    read.into_iter().flatten().filter(outside).collect()
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
        for name in ["day.pcap", "day.json", "d.xml", "other.json"] {
            temp.write(name, "");
        }
        assert_eq!(beside(&at("day.pcap")), [at("day.json"), at("d.xml")]);
        assert!(beside(&at("d.xml")).is_empty());
        for (drive, cloud, file) in [
            ("a/sequences/04", "velodyne/000000.bin", "a/poses/04.txt"),
            ("b/drive", "velodyne_points/data/0.bin", "b/calib_imu_to_velo.txt"),
        ] {
            temp.write(&format!("{drive}/{cloud}"), "");
            let file = temp.write(file, "").canonicalize().unwrap();
            let found = beside(&at(drive));
            let found: Vec<_> = found.iter().map(|path| path.canonicalize().unwrap()).collect();
            assert_eq!(found, [file]);
            // Within the folder that has both, nothing lies outside.
            assert!(beside(&at(&drive[..1])).is_empty(), "{drive}");
        }
        // Its own come first.
        temp.write("a/sequences/04/poses.txt", "");
        assert!(beside(&at("a/sequences/04")).is_empty());
    }
}
