//! The program and the system: signals, and lack of memory.

#![cfg(unix)]

#[allow(dead_code)]
mod common;

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use common::{BACKEND, Outcome, SMALL, Temp, run};

/// The outcome with this much memory. Linux only, where the shell can limit it.
#[cfg(target_os = "linux")]
fn within(mib: u32, arguments: &str) -> Outcome {
    let line =
        format!("ulimit -v {}; exec {} {arguments}", mib << 10, env!("CARGO_BIN_EXE_raywake"));
    let mut shell = Command::new("sh");
    // A backtrace must not be printed where there is no memory for one.
    shell.args(["-c", &line]).env("RUST_BACKTRACE", "1");
    Outcome::of(shell.output().unwrap())
}

/// The outcome of a command that is interrupted `after` a file of its results exists, and how long
/// it took from there.
fn interrupted(mut command: Command, file: &Path, after: Duration) -> (Outcome, Duration) {
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let since = Instant::now();
    while !file.exists() {
        assert!(since.elapsed() < Duration::from_secs(30) && child.try_wait().unwrap().is_none());
        thread::sleep(Duration::from_millis(2));
    }
    thread::sleep(after);
    let since = Instant::now();
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.unwrap().success());
    let o = Outcome::of(child.wait_with_output().unwrap());
    assert_eq!(o.code, Some(130), "{}", o.stderr);
    (o, since.elapsed())
}

#[cfg(target_os = "linux")]
#[test]
fn too_little_memory_is_reported_before_the_first_sweep() {
    let t = Temp::new();
    t.drive(2);
    let [data, out] = ["drive", "out"].map(|name| t.path().join(name).display().to_string());
    // The program starts within 20 MB; the memory requested fits from 50 MB (registration) or from
    // 75 MB and more.
    for (mib, arguments) in [
        (68, format!("run {data} --backend scalar")),
        (39, format!("odometry {data} --out {out}")),
        (39, format!("map {data} --backend scalar --out {out}")),
        (58, format!("track {data} --front-end variance --out {out}")),
    ] {
        within(mib, &arguments).failed(6, &["MB needed, which the system cannot provide"]);
    }
}

/// Nor is the process aborted where memory runs out later: in reading, in a thread, in writing.
#[cfg(target_os = "linux")]
#[test]
fn no_lack_of_memory_aborts() {
    let t = Temp::new();
    t.drive(2);
    let [data, out] = ["drive", "out"].map(|name| t.path().join(name).display().to_string());
    // From a little more than the program takes to start to more than a run needs.
    let codes: Vec<_> = (40..260)
        .step_by(5)
        .chain([4096])
        .map(|mib| {
            let o = within(mib, &format!("run {data} --backend scalar --out {out}"));
            assert!(matches!(o.code, Some(0 | 6)), "{mib} MiB: {:?}, {}", o.code, o.stderr);
            o.code.unwrap()
        })
        .collect();
    assert!(codes.starts_with(&[6]) && codes.ends_with(&[0]), "{codes:?}");
}

#[test]
fn a_second_interrupt_ends_at_once() {
    let t = Temp::new();
    t.drive(3);
    // Nobody reads the figures, so the program waits forever once it has printed everything.
    let pipe = t.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let mut child = common::command(&["run", t.path().join("drive").to_str().unwrap()])
        .args(BACKEND)
        .args(["--summary", pipe.to_str().unwrap()])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(said.any(|line| line.unwrap().starts_with("digest")));
    let id = child.id().to_string();
    let since = Instant::now();
    let end = loop {
        if let Some(end) = child.try_wait().unwrap() {
            break end;
        }
        assert!(since.elapsed() < Duration::from_secs(30));
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        thread::sleep(Duration::from_millis(100));
    };
    assert_eq!(end.code(), Some(130));
}

/// Open tracks are solved with what is known, and everything is written.
#[test]
fn an_interrupt_ends_tracking_in_order() {
    let t = Temp::new();
    t.drive(1200);
    let [data, out] = ["drive", "out"].map(|name| t.path().join(name));
    let mut track = common::command(&["track", data.to_str().unwrap(), "--front-end", "variance"]);
    track.args(["--out", out.to_str().unwrap()]);
    // Signals are listened to right after this file is written.
    let (o, took) = interrupted(track, &out.join("settings.toml"), Duration::from_secs(1));
    assert!(took < Duration::from_secs(10), "{took:?}");
    assert!(out.join("tracks.feather").is_file());
    assert_eq!(o.summary(&out.join("summary.json"))["interrupted"], true);
}

#[test]
fn an_interrupt_ends_the_run_in_order() {
    let t = Temp::new();
    t.drive(1200);
    let out = t.path().join("out");
    let config = t.write("small.toml", SMALL);
    let mut flow = common::command(&["run", t.path().join("drive").to_str().unwrap()]);
    flow.args(BACKEND);
    flow.args(["--out", out.to_str().unwrap(), "--config", config.to_str().unwrap()]);
    let (o, _) = interrupted(flow, &out.join("columns/0000000001.feather"), Duration::ZERO);
    assert!(o.stdout.contains("INTERRUPTED") && o.stdout.contains("digest"), "{}", o.stdout);
    let s = o.summary(&out.join("summary.json"));
    assert_eq!(s["interrupted"], true);
    let (sweeps, pairs) = (s["sweeps"].as_u64().unwrap(), s["pairs"].as_u64().unwrap());
    assert!(sweeps > 1 && sweeps < 1200 && pairs == sweeps - 1, "{sweeps}");
    for folder in ["columns", "points", "tracklets"] {
        let names: Vec<_> = fs::read_dir(out.join(folder)).unwrap().collect();
        assert_eq!(names.len() as u64, pairs, "{folder}");
        let whole = |name: &str| !name.ends_with(".partial");
        assert!(names.iter().all(|n| whole(n.as_ref().unwrap().file_name().to_str().unwrap())));
    }
    // It continues where it was, and leaves the same files as a single run.
    let kept = out.join("points/0000000000.feather");
    let written = fs::metadata(&kept).unwrap().modified().unwrap();
    let count = (sweeps + 3).to_string();
    let whole = t.path().join("whole");
    for out in [&out, &whole] {
        run(&t, &["--out", out.to_str().unwrap(), "-n", &count]).succeeded();
    }
    assert_eq!(fs::metadata(&kept).unwrap().modified().unwrap(), written);
    for folder in ["columns", "points", "tracklets"] {
        let files: Vec<_> = fs::read_dir(whole.join(folder)).unwrap().collect();
        assert_eq!(files.len() as u64, sweeps + 2, "{folder}");
        for file in files {
            let path = file.unwrap().path();
            let same = out.join(folder).join(path.file_name().unwrap());
            assert!(fs::read(&path).unwrap() == fs::read(&same).unwrap(), "{}", path.display());
        }
    }
}
