//! Folders of labels.

use super::*;
use crate::scratch::Scratch;
use raywake_io::source::simulated::Simulated;
use raywake_io::source::{OpenOptions, Overview, PoseTrack, Source, SweepData};
use std::fs;
use std::path::PathBuf;

/// Sweeps without clouds.
pub(crate) struct Road(Overview);

impl Road {
    /// Stamps, s, and poses of the vehicle.
    pub fn of(moments: impl Iterator<Item = (f64, Pose)>) -> Road {
        let rig = Simulated::new(1, 1).rig().clone();
        let (stamps_s, poses): (Vec<f64>, Vec<Pose>) = moments.unzip();
        let (name, frames, notes) = ("road".into(), (0..poses.len() as u64).collect(), Vec::new());
        let track = PoseTrack { stamps_s, poses };
        Road(Overview { name, rig, frames, track, epoch_ns: 0, trusted: true, notes })
    }

    pub fn moment(&self, index: usize) -> (f64, Pose) {
        (self.stamp_s(index), self.pose(index))
    }
}

impl Source for Road {
    fn overview(&self) -> &Overview {
        &self.0
    }

    fn describe(&self) -> String {
        self.name().into()
    }

    fn read(&mut self, _: usize, _: &mut SweepData) -> Result<(), Error> {
        unreachable!("labels need no clouds")
    }
}

/// A car with these boxes.
pub(crate) fn track(id: &str, boxes: impl Iterator<Item = (u64, Pose)>) -> Track {
    let (id, class, kind) = (id.into(), "Car".into(), Kind::Car);
    Track { id, class, kind, size: [4.0, 2.0, 1.5], boxes: boxes.collect() }
}

pub(crate) fn labels_of(tracks: impl IntoIterator<Item = Track>) -> Labels {
    let tracks = tracks.into_iter().collect();
    Labels { tracks, view: View::All, exact: false, notes: Vec::new() }
}

#[test]
fn a_drive_without_labels() {
    let t = Scratch::new();
    fs::create_dir_all(t.path().join("velodyne_points/data")).unwrap();
    let e = open(t.path(), &Simulated::new(1, 1)).unwrap_err().to_string();
    assert!(e.contains("no labels found"), "{e}");
    let tracking = "0 7 Van 0 0 -1.8 1 2 3 4 2.0 1.8 4.4 -4.9 1.7 13.3 0\n";
    t.write("label_02/0004.txt", tracking);
    t.write("calib/0004.txt", "R_rect 1 0 0 0 1 0 0 0 1\nTr_velo_cam 0 -1 0 0 0 0 -1 0 1 0 0 0\n");
    let drive = t.path().join("velodyne/0004");
    t.write("velodyne/0004/000000.bin", []);
    for path in [t.path(), &drive] {
        assert_eq!(open(path, &Simulated::new(1, 1)).unwrap().tracks[0].kind, Kind::Van);
    }
    t.write("boxes.csv", "frame,track_id,class,x,y,z,l,w,h,yaw\n0,1,Car,9,0,0,4,2,2,0\n");
    assert_eq!(open(t.path(), &Simulated::new(1, 1)).unwrap().tracks.len(), 1);
}

fn data(name: &str) -> (Box<dyn Source>, Labels) {
    let root = std::env::var_os("RAYWAKE_DATA").expect("RAYWAKE_DATA names the folder of the data");
    let path = PathBuf::from(root).join(name);
    let source = raywake_io::source::open(&path, &OpenOptions::default()).unwrap();
    let labels = open(&path, source.as_ref()).unwrap();
    (source, labels)
}

#[test]
#[ignore = "needs RAYWAKE_DATA"]
fn recorded_drives() {
    let (source, kitti) = data("kitti_raw_0005");
    let boxes = |labels: &Labels| labels.tracks.iter().map(|t| t.boxes.len()).sum::<usize>();
    assert_eq!((kitti.tracks.len(), boxes(&kitti), kitti.view), (15, 711, View::Camera));
    assert!(kitti.notes.is_empty(), "{:?}", kitti.notes);
    for (track, path) in kitti.tracks.iter().zip(trajectories(&kitti, source.as_ref())) {
        let moves = ["0", "1", "2", "4", "12"].contains(&track.id.as_str());
        let expected = if moves { Motion::Moving } else { Motion::Parked };
        assert!(path.states().iter().all(|s| s.motion == expected), "{track:?}");
    }
    let (source, log) = data("av2_log");
    let (_, pair) = data("av2_7fab2350");
    assert_eq!((pair.view, log.view), (View::All, View::All));
    // The log has boxes of 156 sweeps, two of which are present.
    assert!(log.notes[0].ends_with("boxes left out: their frame has no sweep"), "{:?}", log.notes);
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
