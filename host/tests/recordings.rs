//! ROS recordings written and read back, and what `clean` leaves of a recording.

#[allow(dead_code)]
mod common;

use std::fs;

use common::{Temp, raywake};

const BACKEND: [&str; 2] = ["--backend", "scalar"];

#[test]
#[cfg(feature = "mcap")]
fn mcap_is_read_back() {
    let t = Temp::new();
    t.drive(4);
    let [drive, mcap] = ["drive", "flow.mcap"].map(|name| t.path().join(name));
    let [drive, mcap] = [drive.to_str().unwrap(), mcap.to_str().unwrap()];
    raywake(&[&["run", drive, "--mcap", mcap], &BACKEND[..]].concat()).succeeded();
    let first = fs::read(mcap).unwrap();
    assert!(first.starts_with(b"\x89MCAP0\r\n") && first.ends_with(b"\x89MCAP0\r\n"));
    raywake(&[&["run", drive, "--mcap", mcap], &BACKEND[..]].concat()).succeeded();
    assert!(first == fs::read(mcap).unwrap(), "not the same bytes twice");
    // The returns of three pairs, in the vehicle's frame, with the poses.
    let again = raywake(&[&["run", mcap, "--ground", "-1.7"], &BACKEND[..]].concat());
    again.succeeded();
    let says = "3 sweeps, 0.2 s of /raywake/points, poses from /tf (vehicle in world)";
    assert!(again.stdout.contains(says), "{}", again.stdout);
    assert!(again.stdout.contains("3 sweeps, 2 pairs"), "{}", again.stdout);
    let wrong = raywake(&["run", mcap, "--topic", "/other"]);
    wrong.failed(3, &["no clouds on /other", "/raywake/points (3 clouds"]);
    raywake(&["run", drive, "--topic", "/other"]).failed(2, &["--topic"]);
}

/// Three sweeps of an OS1 on the road: motion is found from the file alone.
#[test]
#[cfg(feature = "pcap")]
fn packets_of_a_sensor() {
    let t = Temp::new();
    let (out, packets) =
        (t.path().join("out"), concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/packets"));
    let capture = format!("{packets}/OS-1-128_v2.3.0_1024x10_lb_n3.pcap");
    let o = raywake(&[&["run", &capture, "-o", out.to_str().unwrap()], &BACKEND[..]].concat());
    o.succeeded();
    for says in [
        "3 sweeps, 0.2 s of OS-1-128 127.0.0.1:7502",
        "ground estimated at -2.0",
        "2 sweeps located",
    ] {
        assert!(o.stdout.contains(says), "{says} in {}", o.stdout);
    }
    let s = o.summary(&out.join("summary.json"));
    assert!(s["valid_flows_per_sweep"].as_f64() > Some(1000.0), "{s}");
}

#[test]
fn a_recording_is_cleaned() {
    let t = Temp::new();
    t.drive(4);
    let [drive, out] = ["drive", "clean"].map(|name| t.path().join(name));
    let line = ["clean", drive.to_str().unwrap(), "-o", out.to_str().unwrap()];
    let cleaned = raywake(&[&line, &BACKEND[..]].concat());
    cleaned.succeeded();
    assert!(cleaned.stdout.contains("4 sweeps: ") && cleaned.stdout.contains("map.ply"));
    for n in 0..4 {
        let size = |file: String| fs::metadata(out.join(file)).unwrap().len();
        let labels = size(format!("labels/{n:06}.label")) / 4;
        let kept = ["static", "moving"].map(|folder| size(format!("{folder}/{n:010}.bin")) / 16);
        let there = fs::metadata(drive.join(format!("velodyne_points/data/{n:010}.bin"))).unwrap();
        assert_eq!(labels, there.len() / 16, "{n}");
        assert!(kept[0] > 100 && kept.iter().sum::<u64>() <= labels, "{n}: {kept:?} of {labels}");
    }
    let onto_itself = ["clean", drive.to_str().unwrap(), "-o", drive.to_str().unwrap()];
    raywake(&onto_itself).failed(2, &["is an input, which would be overwritten"]);
    raywake(&["clean", drive.to_str().unwrap(), "-o", "x", "--voxel", "0"]).failed(2, &["--voxel"]);
}

/// What is left of a bag is a bag, in time order; other clouds leave clouds of the same format.
#[test]
#[cfg(feature = "mcap")]
fn clean_input_is_stored_unchanged() {
    let t = Temp::new();
    t.drive(4);
    let [drive, mcap, out] = ["drive", "flow.mcap", "clean"].map(|name| t.path().join(name));
    let [drive, mcap, out] = [&drive, &mcap, &out].map(|path| path.to_str().unwrap());
    raywake(&[&["run", drive, "--mcap", mcap], &BACKEND[..]].concat()).succeeded();
    let line = ["clean", mcap, "-o", out, "--ground", "-1.7"];
    raywake(&[&line, &BACKEND[..]].concat()).succeeded();
    let still = t.path().join("clean/static.mcap");
    assert!(
        t.path().join("clean/moving.mcap").is_file() && !t.path().join("clean/static").exists()
    );
    let again =
        raywake(&[&["run", still.to_str().unwrap(), "--ground", "-1.7"], &BACKEND[..]].concat());
    again.succeeded();
    let says = "3 sweeps, 0.2 s of /points, poses from /tf (vehicle in world)";
    assert!(again.stdout.contains(says), "{}", again.stdout);
    let clouds = t.path().join("clouds");
    fs::create_dir(&clouds).unwrap();
    let x = |n: usize| common::row(0.5 * n as f64);
    for n in 0..3 {
        let rows: String = (0..400).map(|i| format!("{} {} -1.7\n", i % 20, i / 20 - 10)).collect();
        let head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 400\n\
                    HEIGHT 1\nPOINTS 400\nDATA ascii\n";
        fs::write(clouds.join(format!("{n}.pcd")), [head, &rows].concat()).unwrap();
    }
    fs::write(clouds.join("poses.txt"), (0..3).map(x).collect::<String>()).unwrap();
    let line = ["clean", clouds.to_str().unwrap(), "-o", out, "--ground", "-1.7"];
    raywake(&line).failed(2, &["holds other results"]);
    let other = t.path().join("other");
    let line =
        ["clean", clouds.to_str().unwrap(), "-o", other.to_str().unwrap(), "--ground", "-1.7"];
    raywake(&[&line, &BACKEND[..]].concat()).succeeded();
    let pcd = fs::read(other.join("static/0000000001.pcd")).unwrap();
    assert!(pcd.starts_with(b"# .PCD v0.7\n") && pcd.len() > 300 * 20);
}

#[test]
fn a_command_is_suggested_for_a_bare_recording() {
    let t = Temp::new();
    t.drive(2);
    let drive = t.path().join("drive");
    let drive = drive.to_str().unwrap();
    raywake(&[drive]).failed(2, &[&format!("raywake run {drive} --out")]);
    raywake(&["no-such-thing"]).failed(2, &["unrecognized subcommand"]);
}
