//! Times and sensors in files next to the clouds.

use raywake_core::sweep::Timing;

use super::*;

const SENSORS: &str = "span: -0.05 0.1\nground: -0.3\n\
                       sensor: 1 0 0 1.5 0 1 0 0 0 0 1 1.6\nsensor: 1 0 0 0 0 1 0 0.7 0 0 1 1.5\n";

/// The drive with two returns per sweep, and sidecars.
pub(super) fn with_sidecars() -> Temp {
    let t = drive();
    t.write("velodyne_points/sensors.txt", SENSORS);
    for frame in [3, 4, 6] {
        let times = [-0.04f32, 0.05].map(f32::to_le_bytes).concat();
        t.write(&format!("velodyne_points/offset_s/{frame:010}.bin"), times);
        t.write(&format!("velodyne_points/sensor/{frame:010}.bin"), [1, 0]);
    }
    t
}

/// The message of the error on reading the first sweep, which then holds no points.
fn broken(t: &Temp) -> String {
    let mut sweep = SweepData::default();
    let e = opened(t.path()).read(0, &mut sweep).unwrap_err();
    assert!(sweep.points.is_empty() && e.exit_code() == 3);
    e.to_string()
}

#[test]
fn times_and_sensors() {
    let t = with_sidecars();
    let mut source = opened(t.path());
    let rig = source.rig().clone();
    assert_eq!(rig.timing, Timing::Offset { from_s: -0.05, span_s: 0.1 });
    assert!(rig.sensors.len() == 2 && rig.ground_m == -0.3 && rig.own_vehicle.is_none());
    assert_eq!(rig.sensors[1].translation.to_array(), [0.0, 0.7, 1.5]);
    let points = read(source.as_mut(), 1).unwrap().points;
    assert_eq!(points.iter().map(|p| p.sensor).collect::<Vec<_>>(), [1, 0]);
    assert_eq!(points.iter().map(|p| p.offset_s).collect::<Vec<_>>(), [-0.04, 0.05]);
    assert_eq!(points[0].position, [2.0, -2.0, 0.5]);
    let height = OpenOptions { ground_m: Some(-1.0), ..OpenOptions::default() };
    assert_eq!(open(t.path(), &height).unwrap().rig().ground_m, -1.0);
}

#[test]
fn damaged_sensors() {
    let t = with_sidecars();
    let refuse = |content: &str, with: &str| {
        t.write("velodyne_points/sensors.txt", content);
        let text = refused(t.path());
        assert!(text.contains("sensors.txt") && text.contains(with), "{content}: {text}");
    };
    refuse("", "lines `span:` and `ground:`");
    refuse("span: 0 0.1\nground: 0\n", "no line `sensor:`");
    refuse("span: 0 0.1\nground: 0\nsensor: 1 0 0\n", "line 3: 12 numbers");
    refuse(&SENSORS.replace("1.6", "nan"), "line 3: a pose with a NaN");
    refuse(&SENSORS.replace("0 1 0 0.7", "0 2 0 0.7"), "line 4: the 3x3 part");
    refuse(&SENSORS.replace("-0.3", "inf"), "line 2: the height");
    for span in ["0 0", "0 -0.1", "0 nan", "nan 0.1", "0 5", "-99 0.1"] {
        refuse(&SENSORS.replace("-0.05 0.1", span), "line 1: a sweep from");
    }
    refuse(&(SENSORS.to_owned() + &"sensor: 1 0 0 0 0 1 0 0 0 0 1 0\n".repeat(7)), "more than 8");
    t.remove("velodyne_points/sensors.txt");
    assert!(refused(t.path()).contains("belong together"));
}

#[test]
fn damaged_sidecars() {
    let (times, sensors) =
        ("velodyne_points/offset_s/0000000003.bin", "velodyne_points/sensor/0000000003.bin");
    let t = with_sidecars();
    t.write(sensors, [0, 2]);
    assert!(broken(&t).contains("sensor/0000000003.bin, return 1: sensor 2 of 2"));
    t.write(sensors, [0]);
    assert!(broken(&t).contains("1 bytes, 2 expected for 2 returns"));
    t.remove(sensors);
    assert!(broken(&t).contains("sensor/0000000003.bin"));
    for value in [f32::NAN, f32::INFINITY, 0.051, -0.051] {
        t.write(times, [0.0, value].map(f32::to_le_bytes).concat());
        let text = broken(&t);
        assert!(text.contains("offset_s/0000000003.bin, return 1: "), "{text}");
    }
    t.write(times, [0; 9]);
    assert!(broken(&t).contains("9 bytes, 8 expected for 2 returns"));
    fs::remove_dir_all(t.path().join("velodyne_points/offset_s")).unwrap();
    assert!(refused(t.path()).contains("belong together"));
}
