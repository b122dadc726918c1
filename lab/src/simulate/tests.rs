//! Drives written, and read back by the readers of recordings.

use super::calibration::Camera;
use super::drive::{Motion, Poses, Recipe};
use super::{Written, truth, write};
use crate::scratch::Scratch;
use glam::DVec3;
use raywake_core::sweep::Timing;
use raywake_io::source::{OpenOptions, SweepData, open};
use raywake_sim::{Clutter, Scenery, SimSweep};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

fn recipe(sensor: &str, motion: Motion, sweeps: usize) -> Recipe {
    Recipe { seed: 5, sweeps, sensor: sensor.into(), motion, density: 0.6, ..Recipe::default() }
}

fn drive_folder(out: &Path, number: usize) -> PathBuf {
    out.join(format!("2000_01_01/2000_01_01_drive_{number:04}_sync"))
}

/// Every file below a folder with its content.
fn files(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![root.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => folders.push(path),
                false => {
                    let name = path.strip_prefix(root).unwrap().to_path_buf();
                    found.insert(name, fs::read(&path).unwrap());
                }
            }
        }
    }
    found
}

/// Writes drive 0 and checks all that can be read back against the simulator.
fn round_trip(sensor: &str, motion: Motion, sweeps: usize) {
    let t = Scratch::new();
    let recipe = recipe(sensor, motion, sweeps);
    write(t.path(), &recipe, 1, 2, true).unwrap();
    let folder = drive_folder(t.path(), 0);
    let mut source = open(&folder, &OpenOptions::default()).unwrap();
    assert!(source.notes().is_empty(), "{:?}", source.notes());
    assert_eq!(source.len(), sweeps);
    let drive = recipe.drive(0, 2).unwrap();
    check_rig(source.rig(), &drive.rig());
    let sidecars = source.rig().timing == drive.rig().timing;
    assert_eq!(sidecars, sensor != "hdl64");
    let first = drive.world_from_vehicle(0.0).inverse();
    let objects = truth::read_objects(&truth::objects_path(&folder)).unwrap();
    let mut read = SweepData::default();
    for n in 0..sweeps {
        source.read(n, &mut read).unwrap();
        let cast = drive.sweep(n);
        assert!((read.stamp_s - cast.stamp_s).abs() < 1e-12);
        let expected = first * cast.world_from_vehicle;
        let off = expected.inverse() * read.world_from_vehicle;
        assert!(off.translation.length() < 1e-6, "{:e} m", off.translation.length());
        let turn = off.twist(1.0).angular.length();
        assert!(turn < 1e-9, "{turn:e} rad");
        assert_eq!(read.points.len(), cast.points.len());
        for (a, b) in read.points.iter().zip(&cast.points) {
            assert_eq!(a.position.map(f32::to_bits), b.position.map(f32::to_bits));
            assert_eq!(a.intensity.to_bits(), b.intensity.to_bits());
            assert_eq!(
                (a.offset_s, a.sensor),
                if sidecars { (b.offset_s, b.sensor) } else { (0.0, 0) }
            );
        }
        let points = truth::read_points(&truth::points_path(&folder, n as u64)).unwrap();
        check_points(&points, &cast);
        let of_frame = objects.iter().filter(|o| o.frame == n as u64);
        for (o, state) in of_frame.zip(drive.objects(cast.stamp_s)) {
            assert_eq!((o.id, o.class, o.size), (state.id, state.class, state.size));
            let there = cast.world_from_vehicle * o.vehicle_from_box;
            let off = state.world_from_object.inverse() * there;
            assert!(off.translation.length() < 1e-9 && off.rotation.w.abs() > 1.0 - 1e-12);
            let velocity = cast.world_from_vehicle.rotation * o.velocity;
            assert!((velocity - state.velocity_world).length() < 1e-9);
            let [before, after] = [-0.01, 0.01].map(|s| {
                let then = drive.objects(cast.stamp_s + s)[o.id as usize - 1].world_from_object;
                (then.yaw_rad() - state.world_from_object.yaw_rad()).sin() / s
            });
            // A turn may begin or end within this interval.
            let within = before.min(after) - 0.05..before.max(after) + 0.05;
            assert!(within.contains(&o.yaw_rate), "{before} to {after}: {o:?}");
        }
    }
    assert_eq!(objects.len(), sweeps * drive.objects(0.0).len());
    // The exact poses can be used, too.
    let poses = Some(folder.join("truth/poses.txt"));
    let mut source = open(&folder, &OpenOptions { poses, ..OpenOptions::default() }).unwrap();
    source.read(sweeps - 1, &mut read).unwrap();
    let exact = drive.sweep(sweeps - 1).world_from_vehicle;
    assert!((read.world_from_vehicle.translation - exact.translation).length() < 1e-12);
}

fn check_rig(read: &raywake_core::sweep::Rig, cast: &raywake_core::sweep::Rig) {
    assert!(read.distorted && (read.ground_m - cast.ground_m).abs() < 1e-12);
    assert_eq!(read.sensors.len(), cast.sensors.len());
    for (a, b) in read.sensors.iter().zip(&cast.sensors) {
        let off = a.inverse() * *b;
        assert!(off.translation.length() < 1e-12 && off.rotation.w.abs() > 1.0 - 1e-12);
    }
    if let Timing::Azimuth { span_s } = read.timing {
        assert!((span_s - 0.1).abs() < 1e-9);
    }
}

fn check_points(rows: &[truth::PointTruth], cast: &SimSweep) {
    assert_eq!(rows.len(), cast.points.len());
    let mut moving = 0;
    for ((row, p), t) in rows.iter().zip(&cast.points).zip(&cast.truth) {
        assert_eq!((row.offset_s, row.sensor as u32), (p.offset_s, p.sensor));
        assert_eq!((row.object, row.class), (t.object, t.class));
        let flow = DVec3::from_array(row.flow.map(f64::from));
        let world = cast.world_from_vehicle.rotation * flow;
        assert!((world - DVec3::from_array(t.flow_world.map(f64::from))).length() < 1e-6);
        moving += (flow != DVec3::ZERO) as usize;
    }
    assert!(moving > 0 && moving < rows.len() / 2, "{moving} of {} move", rows.len());
}

#[test]
fn an_hdl64_is_read_back() {
    round_trip("hdl64", Motion::Turn, 3);
}

#[test]
fn several_sensors_are_read_back() {
    round_trip("vlp32x2", Motion::Straight, 2);
    round_trip("hdl32x4", Motion::Standing, 1);
}

#[test]
fn azimuth_determines_the_time_of_an_hdl64() {
    let sweep = recipe("hdl64", Motion::Straight, 1).drive(0, 2).unwrap().sweep(0);
    let off = |p: &raywake_core::sweep::Point| {
        let azimuth = f64::from(p.position[1]).atan2(p.position[0].into());
        (-0.1 * azimuth / std::f64::consts::TAU - f64::from(p.offset_s)).abs()
    };
    let worst = sweep.points.iter().map(off).fold(0.0, f64::max);
    // The lasers' own azimuth offsets, at most 0.08 degrees.
    assert!(worst < 23e-6 && worst > 15e-6, "{worst} s");
}

/// A labelled box.
struct Label {
    kind: String,
    size: [f64; 3],
    frame: u64,
    centre: DVec3,
    yaw: f64,
    seen: bool,
}

fn labels(xml: &str) -> Vec<Label> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let document = roxmltree::Document::parse_with_options(xml, options).unwrap();
    let child = |node: roxmltree::Node<'_, '_>, name: &str| -> String {
        let found = node.children().find(|n| n.has_tag_name(name));
        found.unwrap_or_else(|| panic!("no {name}")).text().unwrap().to_owned()
    };
    let number = |node, name: &str| child(node, name).parse::<f64>().unwrap();
    let tracklets = document.root_element().first_element_child().unwrap();
    assert!(tracklets.has_tag_name("tracklets"));
    let items: Vec<_> = tracklets.children().filter(|n| n.has_tag_name("item")).collect();
    assert_eq!(number(tracklets, "count") as usize, items.len());
    assert_eq!(items[0].attribute("class_id"), Some("1"));
    let mut all = Vec::new();
    for item in items {
        let poses = item.children().find(|n| n.has_tag_name("poses")).unwrap();
        let rows: Vec<_> = poses.children().filter(|n| n.has_tag_name("item")).collect();
        assert_eq!(number(poses, "count") as usize, rows.len());
        let size = ["l", "w", "h"].map(|name| number(item, name));
        for (n, row) in rows.into_iter().enumerate() {
            let [x, y, z, yaw] = ["tx", "ty", "tz", "rz"].map(|name| number(row, name));
            let seen = number(row, "state") == 2.0;
            assert!(!seen || number(row, "truncation") < 2.0 && number(row, "occlusion") == 0.0);
            all.push(Label {
                kind: child(item, "objectType"),
                size,
                frame: number(item, "first_frame") as u64 + n as u64,
                centre: DVec3::new(x, y, z + 0.5 * size[2]),
                yaw,
                seen,
            });
        }
    }
    all
}

#[test]
fn labels_hold_what_the_camera_sees() {
    let (t, sweeps) = (Scratch::new(), 4);
    let recipe = Recipe { density: 1.0, ..recipe("hdl64", Motion::Turn, sweeps) };
    write(t.path(), &recipe, 1, 2, true).unwrap();
    let folder = drive_folder(t.path(), 0);
    let labels = labels(&fs::read_to_string(folder.join("tracklet_labels.xml")).unwrap());
    let objects = truth::read_objects(&truth::objects_path(&folder)).unwrap();
    let drive = recipe.drive(0, 2).unwrap();
    let camera = Camera::new(&drive.rig());
    let mut total = 0;
    for n in 0..sweeps {
        let sweep = drive.sweep(n);
        let visible: BTreeSet<u32> = sweep
            .points
            .iter()
            .zip(&sweep.truth)
            .filter(|(p, _)| camera.sees(DVec3::from_array(p.position.map(f64::from))))
            .map(|(_, t)| t.object)
            .filter(|&id| id != 0)
            .collect();
        let of_frame: Vec<_> = labels.iter().filter(|l| l.frame == n as u64 && l.seen).collect();
        assert_eq!(of_frame.len(), visible.len());
        total += visible.len();
        let of = |o: &&truth::ObjectTruth| o.frame == n as u64 && visible.contains(&o.id);
        for o in objects.iter().filter(of) {
            let there = o.vehicle_from_box.translation;
            let label = of_frame.iter().find(|l| (l.centre - there).length() < 1e-9);
            let label = label.unwrap_or_else(|| panic!("no label of {o:?}"));
            assert_eq!(label.size, o.size);
            assert!((label.yaw - o.vehicle_from_box.yaw_rad()).abs() < 1e-12);
            let nameless = matches!(truth::class_name(o.class), "Bus" | "Motorcycle");
            assert_eq!(label.kind, if nameless { "Misc" } else { truth::class_name(o.class) });
        }
    }
    assert!(total > 4 * sweeps, "{total} labels");
}

#[test]
fn the_same_seed_writes_the_same_bytes() {
    let (a, b) = (Scratch::new(), Scratch::new());
    let recipe = recipe("vlp32x2", Motion::Any, 1);
    assert_eq!(write(a.path(), &recipe, 2, 2, true).unwrap(), Written { drives: 2, skipped: 0 });
    assert_eq!(write(b.path(), &recipe, 1, 1, true).unwrap(), Written { drives: 1, skipped: 0 });
    // Left behind by a run that was stopped.
    let partial = b.path().join("2000_01_01/.2000_01_01_drive_0001_sync.partial");
    fs::create_dir_all(&partial).unwrap();
    fs::write(partial.join("rubbish"), "x").unwrap();
    assert_eq!(write(b.path(), &recipe, 2, 1, true).unwrap(), Written { drives: 1, skipped: 1 });
    let (a, b) = (files(a.path()), files(b.path()));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, content) in &a {
        assert!(*content == b[name], "{} differs", name.display());
    }
    assert!(a.len() > 2 * 10);
    let cloud =
        |n: usize| &a[&drive_folder(Path::new(""), n).join("velodyne_points/data/0000000000.bin")];
    assert_ne!(cloud(0), cloud(1));
}

#[test]
fn existing_files_are_respected() {
    let t = Scratch::new();
    let small = Recipe { density: 0.0, ..recipe("hdl64", Motion::Standing, 1) };
    let refused =
        |out: &Path, recipe: &Recipe| write(out, recipe, 1, 1, true).unwrap_err().to_string();
    fs::write(t.path().join("file"), "").unwrap();
    let text = refused(&t.path().join("file"), &small);
    assert!(text.starts_with("cannot write ") && text.contains("file/2000_01_01"), "{text}");
    write(t.path(), &small, 1, 1, true).unwrap();
    let text = refused(t.path(), &Recipe { seed: 6, ..small.clone() });
    assert!(text.contains("drive_0000_sync: holds another drive") && text.contains("\"seed\":6"));
    fs::rename(drive_folder(t.path(), 0), drive_folder(t.path(), 1)).unwrap();
    let text = refused(t.path(), &Recipe { sensor: "beam128".into(), ..small.clone() });
    assert!(text.contains("calib_velo_to_cam.txt: belongs to drives with other sensors"), "{text}");
    fs::create_dir(drive_folder(t.path(), 0)).unwrap();
    assert!(refused(t.path(), &small).contains("exists and is not a drive of this program"));
    let text = refused(t.path(), &Recipe { sensor: "hdl65".into(), ..small });
    assert!(text.contains("hdl65"));
    let there = Recipe { scenery: Scenery::Outskirts, ..recipe("hdl64", Motion::Turn, 1) };
    let text = refused(t.path(), &there);
    assert!(text.contains("--ego applies to the street only: outskirts"), "{text}");
}

#[test]
fn damaged_truth() {
    let t = Scratch::new();
    let path = t.path().join("points.feather");
    let row = truth::PointTruth {
        offset_s: -0.01,
        sensor: 1,
        object: 70_000,
        class: raywake_sim::Class::Cyclist,
        flow: [0.5, -0.25, 0.0],
    };
    truth::write_points(&path, &[row, row]).unwrap();
    assert_eq!(truth::read_points(&path).unwrap(), [row, row]);
    let bytes = fs::read(&path).unwrap();
    let refused = || truth::read_points(&path).unwrap_err().to_string();
    for cut in (0..bytes.len()).step_by(97) {
        fs::write(&path, &bytes[..cut]).unwrap();
        assert!(refused().contains("points.feather"));
    }
    let broken = truth::PointTruth { flow: [f32::NAN; 3], ..row };
    truth::write_points(&path, &[row, broken]).unwrap();
    assert!(refused().contains("points.feather, row 1: a number is null or not finite"));
    let text = truth::read_objects(&path).unwrap_err().to_string();
    assert!(text.contains("has no column `frame`"), "{text}");
}

#[test]
fn poses_with_the_errors_of_an_inertial_unit() {
    let t = Scratch::new();
    let recipe = Recipe { poses: Poses::Gnss, ..recipe("hdl64", Motion::Straight, 3) };
    let exact = Recipe { poses: Poses::Exact, ..recipe.clone() };
    write(&t.path().join("gnss"), &recipe, 1, 2, true).unwrap();
    write(&t.path().join("exact"), &exact, 1, 2, true).unwrap();
    let [gnss, exact] = ["gnss", "exact"].map(|name| files(&drive_folder(&t.path().join(name), 0)));
    for (name, content) in &exact {
        let differs = gnss[name] != *content;
        let of_poses = name.starts_with("oxts/data") || name == Path::new("manifest.json");
        assert_eq!(differs, of_poses, "{}", name.display());
    }
    let read = |name: &str| {
        let mut source =
            open(&drive_folder(&t.path().join(name), 0), &OpenOptions::default()).unwrap();
        let mut sweep = SweepData::default();
        source.read(2, &mut sweep).unwrap();
        sweep.world_from_vehicle
    };
    let off = read("exact").inverse() * read("gnss");
    let metres = off.translation.length();
    assert!((0.001..0.3).contains(&metres), "{metres} m over two sweeps");
}

#[test]
fn weather_and_place_are_recorded() {
    let t = Scratch::new();
    let recipe = Recipe {
        scenery: Scenery::Outskirts,
        clutter: Clutter::Fog,
        ..recipe("hdl64", Motion::Any, 2)
    };
    write(t.path(), &recipe, 1, 2, true).unwrap();
    let folder = drive_folder(t.path(), 0);
    let told = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
    let manifest = told("manifest.json");
    for part in ["\"scenery\":\"outskirts\"", "\"clutter\":\"fog\"", "\"place\":\""] {
        assert!(manifest.contains(part), "{manifest}");
    }
    assert!(told("truth/classes.txt").ends_with("13 Clutter\n"));
    let points = truth::read_points(&truth::points_path(&folder, 1)).unwrap();
    let clutter = points.iter().filter(|p| p.class == raywake_sim::Class::Clutter);
    assert!(clutter.inspect(|p| assert_eq!((p.object, p.flow), (0, [0.0; 3]))).count() > 500);
}
