//! Folders of labels.

use super::*;
use raywake::source::simulated::Simulated;
use raywake::source::{OpenOptions, Source};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// A folder that goes away with the value.
pub(super) struct Temp(PathBuf);

impl Temp {
    pub fn new() -> Temp {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let n = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("raywake-labels-{}-{n}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Temp(path)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Writes a file and the folders above it.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, content).unwrap();
        path
    }
}

impl Drop for Temp {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_drive_without_labels() {
    let t = Temp::new();
    fs::create_dir_all(t.path().join("velodyne_points/data")).unwrap();
    let e = open(t.path(), &Simulated::new(1, 1)).unwrap_err().to_string();
    assert!(e.contains("no labels found"), "{e}");
    t.write("boxes.csv", "frame,track_id,class,x,y,z,l,w,h,yaw\n0,1,Car,9,0,0,4,2,2,0\n");
    assert_eq!(open(t.path(), &Simulated::new(1, 1)).unwrap().tracks.len(), 1);
}

fn data(name: &str) -> (Box<dyn Source>, Labels) {
    let root = std::env::var_os("RAYWAKE_DATA").expect("RAYWAKE_DATA names the folder of the data");
    let path = PathBuf::from(root).join(name);
    let source = raywake::source::open(&path, &OpenOptions::default()).unwrap();
    let labels = open(&path, source.as_ref()).unwrap();
    (source, labels)
}

#[test]
#[ignore = "needs RAYWAKE_DATA"]
fn recorded_drives() {
    let (_, kitti) = data("kitti_raw_0005");
    let boxes = |labels: &Labels| labels.tracks.iter().map(|t| t.boxes.len()).sum::<usize>();
    assert_eq!((kitti.tracks.len(), boxes(&kitti), kitti.view), (15, 711, View::Camera));
    let (source, log) = data("av2_log");
    let (_, pair) = data("av2_7fab2350");
    assert_eq!((pair.view, log.view), (View::All, View::All));
    assert_eq!(boxes(&pair), 162);
    for index in 0..2u64 {
        let frame = source.frame(index as usize);
        let mut found = 0;
        for (a, b) in log.tracks.iter().filter_map(|t| Some((t, t.boxes.get(&frame)?))) {
            let same = |t: &&Track| {
                let near = |b2: &Pose| (b2.translation - b.translation).length() < 1e-3;
                t.class == a.class && t.boxes.get(&index).is_some_and(near)
            };
            found += usize::from(pair.tracks.iter().any(|t| same(&t)));
        }
        assert_eq!(found, pair.tracks.iter().filter(|t| t.boxes.contains_key(&index)).count());
    }
}
