//! Well-formed recordings of every format.

use glam::DVec3;
use raywake_core::sweep::Timing;

use super::super::{Format, PosesFrame};
use super::*;

fn near(a: DVec3, b: [f64; 3]) -> bool {
    (a - DVec3::from_array(b)).length() < 1e-6
}

#[test]
fn drive_with_poses() {
    let t = drive();
    let mut source = opened(t.path());
    assert_eq!((source.len(), source.is_empty(), source.frame(2)), (3, false, 6));
    assert_eq!(source.name(), t.path().file_name().unwrap().to_str().unwrap());
    assert_eq!(source.notes(), ["1 sweeps missing: frames 5"]);
    assert!(source.describe().ends_with("3 sweeps, 0.3 s, poses from poses.txt"));
    let rig = source.rig();
    assert!(rig.distorted && rig.ground_m == -1.73 && rig.sensors.len() == 1);
    // From frame 3 to 4; frame 5 is missing before frame 6.
    assert_eq!(rig.timing, Timing::Azimuth { span_s: 0.1 });
    let sweep = read(source.as_mut(), 2).unwrap();
    assert_eq!((sweep.frame, sweep.stamp_s, sweep.dropped.sweeps_before), (6, 0.3, 1));
    // NaN stays: the core counts what it drops.
    assert_eq!(sweep.points.len(), 2);
    assert_eq!(sweep.points[0].position, [3.0, -2.0, 0.5]);
    assert_eq!(sweep.points[0].intensity, 0.25);
    assert!(near(sweep.world_from_vehicle.translation, [3.0, 0.0, 0.0]));
    assert!(near(sweep.twist.linear, [10.0, 0.0, 0.0]));
    assert_eq!((source.stamp_s(2), source.pose(2)), (0.3, sweep.world_from_vehicle));
    let first = read(source.as_mut(), 0).unwrap();
    assert!(near(first.twist.linear, [10.0, 0.0, 0.0]) && first.dropped.sweeps_before == 0);
    assert_eq!(first.sweep().points.len(), 2);
}

#[test]
fn options_override_the_rig() {
    let t = drive();
    let options =
        OpenOptions { deskew: Some(false), ground_m: Some(-1.0), ..OpenOptions::default() };
    let source = open(t.path(), &options).unwrap();
    assert!(!source.rig().distorted && source.rig().ground_m == -1.0);
}

#[test]
fn a_sweep_of_many_chunks_and_an_empty_one() {
    let t = drive();
    let many: Vec<[f32; 4]> = (0..10_000).map(|i| [i as f32, 0.0, 0.0, 0.0]).collect();
    t.write("velodyne_points/data/0000000003.bin", bin(&many));
    // Exactly one chunk of the reader.
    t.write("velodyne_points/data/0000000004.bin", bin(&many[..4096]));
    t.write("velodyne_points/data/0000000006.bin", []);
    let mut source = opened(t.path());
    let mut sweep = SweepData::default();
    source.read(0, &mut sweep).unwrap();
    assert_eq!((sweep.points.len(), sweep.points[9999].position[0]), (10_000, 9999.0));
    source.read(1, &mut sweep).unwrap();
    assert_eq!(sweep.points.len(), 4096);
    source.read(2, &mut sweep).unwrap();
    assert!(sweep.points.is_empty());
}

/// A drive with OXTS packets: frames 0, 1 and 3, heading north at 5 m per frame.
pub(super) fn oxts_drive(t: &Temp, folder: &str) {
    let mut stamps = String::new();
    for frame in 0..4 {
        let second = 25.95 + 0.1 * f64::from(frame);
        stamps += &format!("2011-09-26 13:02:{second:012.9}\n");
        if frame == 2 {
            continue;
        }
        let name = format!("{folder}/velodyne_points/data/{frame:010}.bin");
        t.write(&name, bin(&[[1.0, 2.0, 3.0, 0.5]]));
        let latitude = 49.0 + (5.0 * f64::from(frame) / 6_378_137.0).to_degrees();
        let rest = "0 ".repeat(24);
        let packet =
            format!("{latitude:.14} 8.4 110 0 0 {} {rest}\n", core::f64::consts::FRAC_PI_2);
        t.write(&format!("{folder}/oxts/data/{frame:010}.txt"), packet);
    }
    t.write(&format!("{folder}/velodyne_points/timestamps.txt"), stamps);
}

#[test]
fn drive_with_oxts() {
    let t = Temp::new();
    oxts_drive(&t, "day/drive");
    // One recording, two levels below.
    let mut source = opened(t.path());
    assert_eq!((source.name(), source.len()), ("drive", 3));
    let notes = source.notes().join("; ");
    assert!(notes.contains("frames 2") && notes.contains("calib_imu_to_velo.txt"), "{notes}");
    let last = read(source.as_mut(), 2).unwrap();
    assert_eq!(last.frame, 3);
    // Frame 3 has the fourth line of timestamps although it is the third sweep.
    assert!((last.stamp_s - 0.3).abs() < 1e-9);
    // 15 m to the north are 15 m forward in the frame of the first sweep.
    assert!((last.world_from_vehicle.translation - DVec3::X * 15.0).length() < 1e-3);
    assert!((last.twist.linear - DVec3::X * 50.0).length() < 0.01);
}

#[test]
fn oxts_beyond_any_drive() {
    let t = Temp::new();
    oxts_drive(&t, "day/drive");
    let path = t.path().join("day/drive/oxts/data/0000000001.txt");
    let packet = fs::read_to_string(&path).unwrap();
    let mut numbers: Vec<&str> = packet.split_whitespace().collect();
    numbers[2] = "1e308";
    fs::write(&path, numbers.join(" ")).unwrap();
    assert!(refused(&t.path().join("day/drive")).contains("the pose of frame 1: "));
    fs::write(&path, packet).unwrap();
    // With a single one, the products do not overflow.
    for place in ["1e308 1e308 0", "1e308 0 0", "0 -1e300 0"] {
        let calibration = format!("R: 1 0 0 0 1 0 0 0 1\nT: {place}\n");
        t.write("day/calib_imu_to_velo.txt", calibration);
        let e = refused(&t.path().join("day/drive"));
        assert!(e.contains("calib_imu_to_velo.txt, line 2: at ["), "{e}");
    }
}

#[test]
fn oxts_with_calibration_of_the_day() {
    let t = Temp::new();
    oxts_drive(&t, "day/drive");
    // The Velodyne is mounted rotated to the left by 90 degrees: north is to its right.
    t.write("day/calib_imu_to_velo.txt", "calib_time: x\nR: 0 1 0 -1 0 0 0 0 1\nT: 0 0 0\n");
    let mut source = opened(&t.path().join("day/drive"));
    assert_eq!(source.notes().len(), 1, "{:?}", source.notes());
    let last = read(source.as_mut(), 2).unwrap();
    assert!((last.world_from_vehicle.translation + DVec3::Y * 15.0).length() < 1e-3);
    // A sweep without a packet is left out.
    t.remove("day/drive/oxts/data/0000000000.txt");
    let source = opened(&t.path().join("day/drive"));
    assert_eq!((source.len(), source.frame(0)), (2, 1));
    assert!(source.notes().iter().any(|n| n.starts_with("1 sweeps skipped")));
}

#[test]
fn poses_win_over_oxts() {
    let t = Temp::new();
    oxts_drive(&t, "d");
    t.write("d/poses.txt", row(0.0, 0.0, 0.0).repeat(3));
    assert!(opened(t.path()).describe().ends_with("poses from poses.txt"));
}

#[test]
fn odometry_sequence() {
    let t = Temp::new();
    for i in 0..2 {
        t.write(&format!("sequences/07/velodyne/{i:06}.bin"), bin(&[[1.0; 4]]));
    }
    // Forward for a camera is z.
    t.write("poses/07.txt", row(0.0, 0.0, 0.0) + &row(0.0, 0.0, 1.0));
    t.write("sequences/07/times.txt", "0.0\n1.036e-01\n");
    t.write("sequences/07/calib.txt", "P0: 1\nTr: 0 -1 0 0.1 0 0 -1 0.2 1 0 0 0.3\n");
    let root = t.path().join("sequences/07");
    let mut source = opened(&root);
    assert!(source.describe().starts_with("KITTI odometry"), "{}", source.describe());
    assert_eq!(source.rig().timing, Timing::Azimuth { span_s: 0.1036 });
    let sweep = read(source.as_mut(), 1).unwrap();
    assert!(near(sweep.world_from_vehicle.translation, [1.0, 0.0, 0.0]));
    let vehicle = OpenOptions { poses_frame: Some(PosesFrame::Vehicle), ..OpenOptions::default() };
    let mut source = open(&root, &vehicle).unwrap();
    let sweep = read(source.as_mut(), 1).unwrap();
    assert!(near(sweep.world_from_vehicle.translation, [0.0, 0.0, 1.0]));
}

#[test]
fn folder_of_clouds() {
    let t = Temp::new();
    t.write("b.bin", bin(&[[2.0; 4]]));
    t.write("a.bin", bin(&[[1.0; 4]]));
    let poses = t.write("elsewhere/p.txt", row(0.0, 0.0, 0.0) + &row(0.5, 0.0, 0.0));
    let options = OpenOptions { poses: Some(poses), ..OpenOptions::default() };
    let mut source = open(t.path(), &options).unwrap();
    assert_eq!((source.frame(0), source.frame(1)), (0, 1));
    let sweep = read(source.as_mut(), 1).unwrap();
    assert!(sweep.stamp_s == 0.1 && sweep.points[0].position == [2.0; 3]);
    assert!(near(sweep.twist.linear, [5.0, 0.0, 0.0]));
    let notes = source.notes().join("; ");
    assert!(notes.contains("10 Hz") && notes.contains("not numbers"), "{notes}");
    // A single sweep has no motion.
    t.remove("b.bin");
    let poses = t.write("elsewhere/p.txt", row(9.0, 0.0, 0.0));
    let format = Some(Format::Clouds);
    let options = OpenOptions { poses: Some(poses), format, ..OpenOptions::default() };
    let mut source = open(t.path(), &options).unwrap();
    assert_eq!(read(source.as_mut(), 0).unwrap().twist, raywake_core::pose::Twist::ZERO);
}

#[test]
fn revolution_time_is_the_mean_of_coarse_stamps() {
    let t = Temp::new();
    let mut times = String::new();
    // Revolutions of 0.104 s by a clock of 10 ms, one missing after the tenth.
    for i in 0..26 {
        t.write(&format!("velodyne_points/data/{i}.bin"), []);
        let turn = if i < 10 { i } else { i + 1 };
        times += &format!("{:.2}\n", f64::from(turn) * 0.104);
    }
    t.write("times.txt", times);
    t.write("poses.txt", row(0.0, 0.0, 0.0).repeat(26));
    let Timing::Azimuth { span_s } = opened(t.path()).rig().timing else { panic!() };
    assert!((span_s - 0.104).abs() < 0.001, "{span_s}");
}
