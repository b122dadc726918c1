//! `raywake track` from the user's side.

#[allow(dead_code)]
mod common;

use std::fs;

use common::{Outcome, Temp, raywake};

/// Writes a drive of twenty sweeps past a parked car, with a car driving ahead at 8 m/s.
fn drive(t: &Temp) {
    for n in 0..20 {
        t.write(&format!("drive/velodyne_points/data/{n:010}.bin"), cloud(n));
    }
    let lines = |line: &dyn Fn(usize) -> String| (0..20).map(line).collect::<String>();
    t.write("drive/poses.txt", lines(&|n| common::row(n as f64 * 0.5)));
    t.write("drive/times.txt", lines(&|n| format!("{}\n", n as f64 * 0.1)));
}

/// Ground 1.73 m below, and two boxes, all seen from the vehicle's position at the stamp.
fn cloud(n: usize) -> Vec<u8> {
    let own = n as f32 * 0.5;
    let mut points: Vec<[f32; 4]> = Vec::new();
    let at = |n: usize| n as f32 * 0.5 - 20.0;
    points.extend((0..80 * 80).map(|n| [at(n / 80) + 0.1, at(n % 80) + 0.1, -1.73, 0.1]));
    for middle in [[20.0, 4.0], [10.0 + n as f32 * 0.8, -3.0]] {
        for k in 0..7 {
            for i in 0..=20 {
                for j in (0..=9).filter(|j| i % 20 == 0 || j % 9 == 0) {
                    let [x, y] = [i as f32 * 0.2 - 2.0, j as f32 * 0.2 - 0.9];
                    let place = [middle[0] + x - own, middle[1] + y, k as f32 * 0.2 - 1.5];
                    points.push([place[0], place[1], place[2], 0.5]);
                }
            }
        }
    }
    points.iter().flatten().flat_map(|v| v.to_le_bytes()).collect()
}

fn track(t: &Temp, more: &[&str]) -> Outcome {
    let data = t.path().join("drive");
    let head = ["track", data.to_str().unwrap(), "--deskew", "off", "--backend", "scalar"];
    // Hollow boxes resemble nothing that was learned: with the encoder they would move some sweeps
    // late.
    let bare = ["--encoder", "none"];
    raywake(&[&head[..], &bare, more].concat())
}

#[test]
fn figures_and_files() {
    let t = Temp::new();
    drive(&t);
    for kind in ["variance", "flow"] {
        let out = t.path().join(kind);
        let bag = t.path().join("objects.mcap");
        let more = ["--front-end", kind, "--fixed-lag", "--out", out.to_str().unwrap()];
        let o = track(&t, &[&more[..], &["--mcap", bag.to_str().unwrap()]].concat());
        o.succeeded();
        for text in ["memory budget", "updates", "dropped", "digest"] {
            assert!(o.stdout.contains(text), "{text} in {}", o.stdout);
        }
        let s = o.summary(&out.join("summary.json"));
        assert_eq!((&s["front_end"], &s["sweeps"]), (&kind.into(), &20.into()));
        assert_eq!(s["interrupted"], false);
        let tracks = s["tracks"].as_array().unwrap();
        let seen_throughout = || tracks.iter().filter(|l| l["updates"] == 20);
        assert_eq!(seen_throughout().count(), 2, "{s}");
        for line in seen_throughout() {
            let speed = line["speed_mps"].as_f64().unwrap().abs();
            assert!((speed - 8.0).abs() < 0.5 || speed < 0.2, "{line}");
            let size = [0, 1].map(|a| line["size_m"][a].as_f64().unwrap());
            assert!((size[0] - 4.0).abs() < 0.3 && (size[1] - 1.8).abs() < 0.3, "{line}");
            let told = line["p_moves"].as_f64();
            assert_eq!(told.map(|p| p > 0.5), (kind == "flow").then_some(speed > 1.0), "{line}");
            assert_eq!(line["class"], serde_json::Value::Null);
            let cloud = format!("clouds/{:05}.ply", line["track"].as_u64().unwrap());
            assert!(fs::read(out.join(cloud)).unwrap().starts_with(b"ply\n"));
        }
        assert!(out.join("tracks.feather").is_file());
        assert_eq!(fs::read_dir(out.join("returns")).unwrap().count(), 20);
        // The output is a recording, too.
        let o = raywake(&[
            "odometry",
            bag.to_str().unwrap(),
            "--out",
            out.join("p.txt").to_str().unwrap(),
        ]);
        o.succeeded();
        assert!(o.stdout.contains("20 sweeps"), "{}", o.stdout);

        let again = t.path().join("again.json");
        let more = ["--front-end", kind, "--fixed-lag", "--quiet"];
        let o = track(&t, &[&more[..], &["--summary", again.to_str().unwrap()]].concat());
        o.succeeded();
        assert_eq!((o.stdout.as_str(), o.stderr.as_str()), ("", ""));
        assert_eq!(o.summary(&again)["digest"], s["digest"]);
    }
}

/// The estimate as printed starts from other parameters, which `--set` still changes.
#[test]
fn chapter_2_as_printed() {
    let t = Temp::new();
    drive(&t);
    let run = |name: &str, more: &[&str]| {
        let out = t.path().join(name);
        let all = ["--front-end", "variance", "--quiet", "--out", out.to_str().unwrap()];
        let o = track(&t, &[&all[..], more].concat());
        o.succeeded();
        let settings = fs::read_to_string(out.join("settings.toml")).unwrap();
        (settings, o.summary(&out.join("summary.json"))["digest"].clone())
    };
    let (printed, digest) = run("printed", &["--estimate", "printed"]);
    for line in ["basis_s = 0.5\n", "return_sigma_m = 0.5\n", "surfaces = false\n"] {
        assert!(printed.contains(line), "{line} in {printed}");
    }
    assert_ne!(digest, run("refined", &[]).1);
    let more = ["--estimate", "printed", "--set", "objects.basis_s=0.7"];
    assert!(run("set", &more).0.contains("basis_s = 0.7\n"));
    track(&t, &["--estimate", "exact"]).failed(2, &["printed"]);
}

/// A map with the ground above everything leaves nothing to track.
#[test]
fn a_map_of_the_ground() {
    let t = Temp::new();
    drive(&t);
    let json = t.path().join("s.json");
    for (height, segments) in [("-1.73", true), ("5", false)] {
        let head = "ncols 1\nnrows 1\nxllcorner -100\nyllcorner -100\ncellsize 200\n";
        let map = t.write("ground.asc", format!("{head}{height}\n"));
        let map = ["--ground-map", map.to_str().unwrap(), "-n", "3"];
        let o = track(&t, &[&map[..], &["--summary", json.to_str().unwrap()]].concat());
        o.succeeded();
        let s = o.summary(&json);
        assert_eq!(s["tally"]["segments"].as_u64() > Some(0), segments, "{s}");
    }
}

#[test]
fn bad_input() {
    let t = Temp::new();
    raywake(&["track", "no/such/folder"]).failed(3, &["no/such/folder"]);
    raywake(&["track"]).failed(2, &["<DATA>"]);
    drive(&t);
    track(&t, &["--sweeps", "3..21"]).failed(2, &["--sweeps 3..21", "20 sweeps"]);
    track(&t, &["--front-end", "none"]).failed(2, &["variance"]);
    let below = t.write("file", "").join("out");
    track(&t, &["--out", below.to_str().unwrap()]).failed(4, &[below.to_str().unwrap()]);
    track(&t, &["--ground-map", "absent.asc"]).failed(3, &["absent.asc"]);
    // Empty sweeps, NaN, jumps in time.
    t.write("drive/velodyne_points/data/0000000003.bin", []);
    let nan: Vec<u8> = (0..400).flat_map(|_| f32::NAN.to_le_bytes()).collect();
    t.write("drive/velodyne_points/data/0000000004.bin", nan);
    let stamp = |n: usize| n as f64 * 0.1 + if n < 10 { 0.0 } else { 2.0 };
    t.write("drive/times.txt", (0..20).map(|n| format!("{}\n", stamp(n))).collect::<String>());
    let json = t.path().join("s.json");
    for kind in ["variance", "flow"] {
        let more = ["--front-end", kind, "--fixed-lag", "--summary", json.to_str().unwrap()];
        let o = track(&t, &more);
        o.succeeded();
        let s = o.summary(&json);
        assert_eq!((&s["dropped"]["not_finite"], &s["sweeps"]), (&100.into(), &20.into()), "{s}");
        // The gap ends all tracks.
        let spans = s["tracks"].as_array().unwrap().iter().map(|l| l["for_s"].as_f64().unwrap());
        assert!(spans.fold(0.0, f64::max) < 1.0, "{s}");
        assert!(s["tracks"].as_array().unwrap().len() >= 4, "{s}");
    }
    t.write("drive/velodyne_points/data/0000000005.bin", [0; 17]);
    track(&t, &[]).failed(3, &["0000000005.bin", "truncated"]);
}
