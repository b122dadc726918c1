//! Recordings of ROS out and in, and what `clean` leaves of one.

#[allow(dead_code)]
mod common;

use std::fs;

use common::{Temp, raywake};

const BACKEND: [&str; 2] = ["--backend", "scalar"];

#[test]
#[cfg(feature = "mcap")]
fn what_is_written_as_mcap_can_be_read() {
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

/// Three sweeps of an OS1 on the road: what moves there is found without anything but the file.
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
    raywake(&onto_itself).failed(2, &["--out is the recording"]);
    raywake(&["clean", drive.to_str().unwrap(), "-o", "x", "--voxel", "0"]).failed(2, &["--voxel"]);
}

#[test]
fn a_recording_without_a_command_is_told_one() {
    let t = Temp::new();
    t.drive(2);
    let drive = t.path().join("drive");
    let drive = drive.to_str().unwrap();
    raywake(&[drive]).failed(2, &[&format!("raywake run {drive} --out")]);
    raywake(&["no-such-thing"]).failed(2, &["unrecognized subcommand"]);
}
