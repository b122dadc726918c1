//! A folder of `.xyz` files: three numbers a return, a line each.

use std::path::{Path, PathBuf};

use raywake_core::pose::Pose;
use raywake_core::sweep::{Point, Rig, Timing};

use super::recognise::numbered;
use super::{OpenOptions, Overview, PoseTrack, Source, SweepData, apply, folder_name};
use crate::Error;

/// Time from one sweep to the next, as the files do not tell, s.
const PERIOD_S: f64 = 0.1;

pub struct XyzFolder {
    overview: Overview,
    files: Vec<PathBuf>,
}

impl XyzFolder {
    /// Opens a folder; poses are not known.
    pub fn open(root: &Path, options: &OpenOptions) -> Result<XyzFolder, Error> {
        options.go_without_poses(root, "no poses")?;
        let (frames, files): (Vec<u64>, Vec<PathBuf>) =
            numbered(root, "xyz")?.0.into_iter().unzip();
        let mut rig = Rig {
            sensors: [Pose::IDENTITY].into_iter().collect(),
            timing: Timing::AtStamp,
            distorted: false,
            ground_m: -1.73,
            own_vehicle: None,
        };
        apply(options, &mut rig);
        let stamps_s = (0..frames.len()).map(|n| n as f64 * PERIOD_S).collect();
        let overview = Overview {
            name: folder_name(root),
            rig,
            frames,
            track: PoseTrack { stamps_s, poses: Vec::new() },
            epoch_ns: 0,
            trusted: options.trusted,
            notes: vec![format!("sweeps taken to be {PERIOD_S} s apart")],
        };
        Ok(XyzFolder { overview, files })
    }
}

impl Source for XyzFolder {
    fn overview(&self) -> &Overview {
        &self.overview
    }

    fn describe(&self) -> String {
        format!("text clouds {}: {}", self.overview.name, self.overview.length())
    }

    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error> {
        let file = &self.files[index];
        into.points.clear();
        self.overview.begin(index, into);
        let text = std::fs::read_to_string(file).map_err(Error::reading(file))?;
        for (n, line) in text.lines().enumerate() {
            let numbers: Vec<f32> =
                line.split_whitespace().filter_map(|v| v.parse().ok()).collect();
            let Ok(position) = numbers.try_into() else {
                into.points.clear();
                return Err(Error::input(file, format!("line {}", n + 1), "not three numbers"));
            };
            into.points.push(Point { position, ..Point::default() });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{Unlocated, open};

    #[test]
    fn a_folder_of_text() {
        let folder = std::env::temp_dir().join(format!("raywake-xyz-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("3.xyz"), "1 2 3\n4 5 6\n").unwrap();
        std::fs::write(folder.join("4.xyz"), "1 2\n").unwrap();
        let options = OpenOptions { unlocated: Unlocated::Accept, ..OpenOptions::default() };
        let mut source = open(&folder, &options).unwrap();
        let mut sweep = SweepData::default();
        source.read(0, &mut sweep).unwrap();
        assert_eq!((source.len(), sweep.frame, sweep.points.len()), (2, 3, 2));
        assert_eq!(sweep.points[1].position, [4.0, 5.0, 6.0]);
        assert!(source.read(1, &mut sweep).unwrap_err().to_string().contains("line 1"));
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
