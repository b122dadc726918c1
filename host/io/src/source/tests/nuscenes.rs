//! A synthetic nuScenes scene.

use super::*;
use crate::source::Unlocated;
use raywake_core::sweep::Point;

const SWEEPS: usize = 3;

/// A scene of three sweeps, another one whose files are missing, and a camera. The lidar is 1 m
/// ahead, 2 m to the right and 1.8 m above the vehicle's origin, turned right by 90 degrees. Each
/// sweep is 0.5 m further along +x.
pub(super) fn scenes() -> Temp {
    let t = Temp::new();
    let table = |name: &str, rows: Vec<String>| {
        t.write(&format!("v1.0-mini/{name}.json"), format!("[\n{}\n]", rows.join(",\n")));
    };
    let named = |token: &str, key: &str, value: &str| {
        format!(r#"{{"token": "{token}", "{key}": "{value}", "description": "rain"}}"#)
    };
    table("scene", vec![named("a", "name", "scene-0061"), named("b", "name", "scene-0103")]);
    table("sample", ["a", "b"].map(|s| named(&format!("of-{s}"), "scene_token", s)).to_vec());
    table("sensor", vec![named("top", "channel", "LIDAR_TOP"), named("cam", "channel", "CAM")]);
    let turned = "[0.7071067811865476, 0, 0, -0.7071067811865476]";
    let mounted = |token: &str, sensor: &str| {
        format!(
            r#"{{"token": "{token}", "sensor_token": "{sensor}", "translation": [1, -2, 1.8],
                "rotation": {turned}, "camera_intrinsic": []}}"#
        )
    };
    table("calibrated_sensor", vec![mounted("mt", "top"), mounted("mc", "cam")]);
    let (mut rows, mut poses) = (Vec::new(), Vec::new());
    // Not in order of time.
    for n in (0..SWEEPS).rev() {
        let (us, name) =
            (1_532_402_927_000_000 + 50_000 * n, format!("sweeps/LIDAR_TOP/{n}.pcd.bin"));
        let row = |of: &str, calibration: &str, name: &str| {
            format!(
                r#"{{"token": "s{n}", "sample_token": "of-{of}", "ego_pose_token": "p{n}",
                "calibrated_sensor_token": "{calibration}", "timestamp": {us}, "prev": "",
                "filename": "{name}", "is_key_frame": false}}"#
            )
        };
        rows.extend([row("a", "mt", &name), row("a", "mc", "x.jpg"), row("b", "mt", "other")]);
        let x = 1000.0 + 0.5 * n as f64;
        poses.push(format!(
            r#"{{"token": "p{n}", "timestamp": {us}, "rotation": [1, 0, 0, 0],
                "translation": [{x}, 20, 0]}}"#
        ));
        let cloud = [[3.0f32, 4.0, -1.0, 51.0, 7.0], [1.0, 0.0, 0.0, 255.0, 31.0]];
        t.write(
            &name,
            cloud.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>(),
        );
    }
    table("sample_data", rows);
    table("ego_pose", poses);
    t
}

pub(super) fn asked(scene: &str) -> OpenOptions {
    OpenOptions { topics: vec![scene.into()], ..OpenOptions::default() }
}

#[test]
fn a_scene_is_read() {
    let t = scenes();
    let mut source = open(t.path(), &asked("scene-0061")).unwrap();
    assert_eq!((source.name(), source.len(), source.rig().ground_m), ("scene-0061", SWEEPS, 0.0));
    assert!(source.describe().contains("nuScenes scene-0061") && !source.rig().distorted);
    assert_eq!(source.overview().epoch_ns, 1_532_402_927_000_000_000);
    let mut sweep = SweepData::default();
    source.read(1, &mut sweep).unwrap();
    assert!((sweep.stamp_s - 0.05).abs() < 1e-9);
    assert_eq!(sweep.world_from_vehicle.translation.to_array(), [1000.5, 20.0, 0.0]);
    assert!((sweep.twist.linear.x - 10.0).abs() < 1e-9, "{:?}", sweep.twist);
    // A point 3 m along +x and 4 m along +y of the lidar, which looks to the right.
    let [first, second] = [sweep.points[0], sweep.points[1]];
    let apart = |p: &Point, at: [f32; 3]| (0..3).all(|a| (p.position[a] - at[a]).abs() < 1e-5);
    assert!(apart(&first, [5.0, -5.0, 0.8]) && apart(&second, [1.0, -3.0, 1.8]), "{first:?}");
    assert!((first.intensity - 0.2).abs() < 1e-6 && second.intensity == 1.0);
    // The folder of tables works too.
    let tables = t.path().join("v1.0-mini");
    assert_eq!(open(&tables, &asked("scene-0061")).unwrap().len(), SWEEPS);
    let unlocated = OpenOptions { unlocated: Unlocated::Always, ..asked("scene-0061") };
    assert!(!open(t.path(), &unlocated).unwrap().is_located());
}

#[test]
fn errors_in_scenes_are_reported() {
    let t = scenes();
    let error = |options: &OpenOptions| open(t.path(), options).err().unwrap().to_string();
    let says = error(&OpenOptions::default());
    assert!(says.contains("2 scenes, choose with --topic: scene-0061, scene-0103"), "{says}");
    assert!(error(&asked("scene-1")).contains("no scene scene-1; available: scene-0061"));
    let missing = open(t.path(), &asked("scene-0103")).unwrap().read(0, &mut SweepData::default());
    assert!(missing.unwrap_err().to_string().contains("other"));
    let poses = OpenOptions { poses: Some("p.txt".into()), ..asked("scene-0061") };
    assert!(error(&poses).contains("contain their own poses"));
    let changes = [
        ("ego_pose", "\"p2\"", "\"q\"", "has no token p2"),
        ("ego_pose", "[1, 0, 0, 0]", "[1, 1, 0, 0]", "token p"),
        ("ego_pose", "[1, 0, 0, 0]", "[1, 0, 0]", "line"),
        (
            "sample_data",
            "\"timestamp\": 1532402927050000",
            "\"timestamp\": 1532402927000000",
            "sweep 1",
        ),
        ("sample_data", "]", "", "EOF"),
        ("sensor", "LIDAR_TOP", "LIDAR", "scene-0061 has no sweeps of LIDAR_TOP"),
        ("calibrated_sensor", "\"translation\"", "\"place\"", "translation"),
    ];
    for (table, of, by, what) in changes {
        let t = scenes();
        let path = t.path().join(format!("v1.0-mini/{table}.json"));
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(of), "{of} in {table}");
        std::fs::write(&path, text.replace(of, by)).unwrap();
        let e = open(t.path(), &asked("scene-0061")).err().unwrap().to_string();
        assert!(e.contains(what) && e.contains(".json"), "{what} in {e}");
    }
}
