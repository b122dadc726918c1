//! Every mistake in a folder is reported with its file and place.

use super::super::{PosesFrame, Unlocated};
use super::*;
use raywake_core::pose::Pose;

#[test]
fn folders() {
    let t = Temp::new();
    assert!(refused(&t.path().join("absent")).contains("absent: "));
    assert!(refused(t.path()).contains("no recording found"));
    let file = t.write("file.txt", "");
    assert!(refused(&file).contains("found a file"));
    fs::create_dir_all(t.path().join("d/velodyne_points/data")).unwrap();
    assert!(refused(t.path()).contains("velodyne_points/data: no sweeps"));
    t.write("e/0.bin", []);
    assert!(refused(t.path()).contains("contains 2 recordings, choose one"));
    t.write("e/00.bin", []);
    assert!(refused(&t.path().join("e")).contains("has the same number as"));
}

#[test]
fn poses() {
    let t = drive();
    let two = row(0.0, 0.0, 0.0) + &row(1.0, 0.0, 0.0);
    t.write("poses.txt", &two);
    let two_of_three = opened(t.path());
    assert_eq!((two_of_three.len(), two_of_three.pose(1).translation.x), (2, 1.0));
    let noted = two_of_three.notes().iter().any(|n| n == "1 sweeps skipped: no pose in poses.txt");
    assert!(noted, "{:?}", two_of_three.notes());
    t.write("poses.txt", two.repeat(2));
    assert!(refused(t.path()).ends_with("poses.txt: 4 poses, expected 3"));
    t.write("poses.txt", two.clone() + "1 0 0 0 0 1 0 0 0 0 nan 0\n");
    assert!(refused(t.path()).contains("poses.txt, line 3: a pose with a NaN"));
    t.write("poses.txt", two.clone() + "\n1 0 0 0 0 2 0 0 0 0 1 0\n");
    assert!(refused(t.path()).contains("poses.txt, line 4: the 3x3 part"));
    t.write("poses.txt", two.clone() + "1 0 0 0\n");
    assert!(
        refused(t.path())
            .contains("line 3: 12 numbers (a 3x4 matrix) or 8 (time and pose) expected, 4 found")
    );
    t.write("poses.txt", [0xff, 0xfe]);
    assert!(refused(t.path()).contains("poses.txt, byte 0: is not UTF-8 text"));
    t.remove("poses.txt");
    assert!(refused(t.path()).contains("neither `poses.txt` nor `oxts/data`"));
    let absent = t.path().join("absent.txt");
    let options = OpenOptions { poses: Some(absent), ..OpenOptions::default() };
    assert!(refused_with(t.path(), &options).contains("absent.txt"));
}

#[test]
fn times() {
    let t = drive();
    t.write("times.txt", "0\n0.1\n0.1\n");
    assert!(refused(t.path()).contains("times.txt, line 3: time 0.1 s is equal to"));
    t.write("times.txt", "0\n0.1\n\n0.05\n");
    assert!(refused(t.path()).contains("times.txt, line 4: time 0.05 s is before"));
    t.write("times.txt", "0\nnan\n0.3\n");
    assert!(refused(t.path()).contains("line 2: the time is not finite"));
    t.write("times.txt", "0\n0.1\n");
    assert!(refused(t.path()).contains("2 times for 3 sweeps"));
    t.write("times.txt", "0\n12:00\n0.3\n");
    assert!(refused(t.path()).contains("line 2: `12:00` is not a date"));
    // More lines than sweeps: by frame number.
    t.write("times.txt", "0\n1\n2\n3\n4\n5\n6\n7\n");
    let mut source = opened(t.path());
    assert_eq!(read(source.as_mut(), 2).unwrap().stamp_s, 6.0);
}

#[test]
fn clouds() {
    let t = drive();
    t.write("velodyne_points/data/0000000004.bin", [0; 40]);
    let mut source = opened(t.path());
    let mut sweep = SweepData::default();
    source.read(0, &mut sweep).unwrap();
    let e = source.read(1, &mut sweep).unwrap_err();
    let text = e.to_string();
    assert!(text.contains("0000000004.bin: 40 bytes"), "{text}");
    assert!(sweep.points.is_empty() && e.exit_code() == 3);
    t.remove("velodyne_points/data/0000000006.bin");
    assert!(source.read(2, &mut sweep).unwrap_err().to_string().contains("0000000006.bin"));
}

#[test]
fn oxts() {
    let t = drive();
    t.remove("poses.txt");
    t.write("oxts/data/0000000099.txt", "49 8 110 0 0 0\n");
    assert!(refused(t.path()).contains("oxts/data: no packet has the number of a sweep"));
    t.write("oxts/data/0000000003.txt", "49 8 110 0 0\n");
    assert!(refused(t.path()).contains("0000000003.txt, line 1: 6 or more numbers"));
    t.write("oxts/data/0000000003.txt", "");
    assert!(refused(t.path()).contains("0000000003.txt: is empty"));
    t.write("oxts/data/0000000003.txt", "49 8 110 0 inf 0\n");
    assert!(refused(t.path()).contains("line 1: a NaN or infinite number"));
    t.write("oxts/data/0000000003.txt", "49 8 110 0 0 0\n");
    t.write("calib_imu_to_velo.txt", "R: 1 0 0 0 1 0 0 0 1\n");
    assert!(refused(t.path()).contains("calib_imu_to_velo.txt: lines `R:` and `T:`"));
    t.write("calib_imu_to_velo.txt", "R: 2 0 0 0 1 0 0 0 1\nT: 0 0 0\n");
    assert!(refused(t.path()).contains("calib_imu_to_velo.txt, line 1: the 3x3 part"));
}

/// Ignored poses are not even read.
#[test]
fn without_poses() {
    let t = Temp::new();
    t.write("velodyne/000000.bin", []);
    let open = |unlocated| open(t.path(), &OpenOptions { unlocated, ..OpenOptions::default() });
    assert!(open(Unlocated::Refuse).is_err());
    for unlocated in [Unlocated::Accept, Unlocated::Always] {
        let mut source = open(unlocated).unwrap();
        assert!(!source.is_located() && source.describe().contains("poses from registration"));
        assert_eq!(read(source.as_mut(), 0).unwrap().world_from_vehicle, Pose::IDENTITY);
    }
    t.write("poses.txt", "no pose");
    assert!(open(Unlocated::Accept).is_err());
    assert!(!open(Unlocated::Always).unwrap().is_located());
}

#[test]
fn camera_poses_need_calibration() {
    let t = Temp::new();
    t.write("velodyne/000000.bin", []);
    let poses = t.write("p.txt", row(0.0, 0.0, 0.0));
    assert!(refused(t.path()).contains("no `poses.txt`: poses are needed"));
    let mut options = OpenOptions { poses: Some(poses), ..OpenOptions::default() };
    let text = refused_with(t.path(), &options);
    assert!(text.contains("calib.txt") && text.contains("--poses-frame vehicle"), "{text}");
    t.write("calib.txt", "P0: 1\n");
    assert!(refused_with(t.path(), &options).contains("calib.txt: has no line `Tr:`"));
    options.poses_frame = Some(PosesFrame::Vehicle);
    assert!(open(t.path(), &options).is_ok());
    options.ground_m = Some(f64::NAN);
    assert!(refused_with(t.path(), &options).contains("ground"));
}

#[test]
fn clouds_alone() {
    let t = Temp::new();
    t.write("0.bin", []);
    assert!(refused(t.path()).contains("--poses"));
}

#[cfg(not(feature = "arrow"))]
#[test]
fn argoverse_needs_a_feature() {
    let t = Temp::new();
    fs::create_dir_all(t.path().join("log/sensors/lidar")).unwrap();
    assert!(refused(t.path()).contains("the feature `arrow`"));
}
