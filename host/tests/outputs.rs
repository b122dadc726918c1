//! What the program writes, where something is already.

#[allow(dead_code)]
mod common;

use std::process::Command;

use common::{Temp, run};

#[test]
fn outputs_do_not_replace_inputs() {
    let t = Temp::new();
    t.drive(2);
    let data = t.path().join("drive");
    let poses = data.join("poses.txt");
    let before = std::fs::read(&poses).unwrap();
    run(&t, &["--summary", poses.to_str().unwrap()]).failed(2, &["--summary", "in the recording"]);
    run(&t, &["--out", data.to_str().unwrap()]).failed(2, &["--out", "is an input"]);
    let clouds = data.join("velodyne_points/data");
    run(&t, &["--out", clouds.to_str().unwrap()]).failed(2, &["is a folder of the recording"]);
    let config = t.path().join("small.toml");
    run(&t, &["--mcap", config.to_str().unwrap()]).failed(2, &["--mcap", "is an input"]);
    assert_eq!(std::fs::read(&poses).unwrap(), before);
    // Results may go to a folder of their own, repeatedly.
    let out = data.join("results");
    for _ in 0..2 {
        run(&t, &["--out", out.to_str().unwrap()]).succeeded();
    }
    let folder = t.path().join("folder");
    std::fs::create_dir(&folder).unwrap();
    run(&t, &["--summary", folder.to_str().unwrap()]).failed(4, &["folder: is a directory"]);
}

/// What a folder has is neither replaced by results nor mixed with them, and earlier results are
/// only kept if they are still right.
#[test]
fn what_is_there_stays() {
    let t = Temp::new();
    t.drive(4);
    let theirs = t.write("out/columns/0000000000.feather", "theirs");
    let out = t.path().join("out");
    let to = |out: &std::path::Path| ["--out".to_string(), out.display().to_string()];
    let to_out = to(&out);
    let options = to_out.each_ref().map(String::as_str);
    run(&t, &options).failed(2, &["out has `columns`, but no results"]);
    assert_eq!(std::fs::read(&theirs).unwrap(), b"theirs");
    // A recording inside the output folder.
    let inside = to(t.path());
    run(&t, &inside.each_ref().map(String::as_str)).failed(2, &["but no results"]);
    std::fs::remove_dir_all(&out).unwrap();
    run(&t, &options).succeeded();
    run(&t, &options).succeeded();
    // One sweep has lost half of its returns since; then poses differ.
    let sweep = t.path().join("drive/velodyne_points/data/0000000002.bin");
    let whole = std::fs::read(&sweep).unwrap();
    std::fs::write(&sweep, &whole[..whole.len() / 32 * 16]).unwrap();
    run(&t, &options).failed(2, &["feather differs from this run's result"]);
    std::fs::write(&sweep, &whole).unwrap();
    run(&t, &options).succeeded();
    let trusting = [&options[..], &["--trust-poses"]].concat();
    run(&t, &trusting).failed(2, &["holds other results", "sensors, stamps and poses"]);
    t.write("drive/poses.txt", (0..4).map(|n| common::row(f64::from(n) * 0.6)).collect::<String>());
    run(&t, &options).failed(2, &["holds other results", "sensors, stamps and poses"]);
    // A pipe would be replaced by a file.
    let pipe = t.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    run(&t, &["--mcap", pipe.to_str().unwrap()]).failed(4, &["pipe: not a regular file"]);
    let page = t.path().join("a").display().to_string();
    run(&t, &["--film", &page, "--page", &page]).failed(2, &["--film and --page are both"]);
}

/// Results of another process are neither mixed with ours nor replaced.
#[test]
fn one_process_writes_at_a_time() {
    let t = Temp::new();
    t.drive(3);
    let (out, film) = (t.path().join("out"), t.path().join("a.mcap"));
    std::fs::create_dir(&out).unwrap();
    let partial = t.write(".a.mcap.partial", "theirs");
    let options = [["--out", out.to_str().unwrap()], ["--mcap", film.to_str().unwrap()]];
    let held = [&out, &partial].map(|path| std::fs::File::open(path).unwrap());
    for (option, lock) in options.iter().zip(&held) {
        lock.try_lock().unwrap();
        run(&t, option).failed(4, &[option[1], "another process is writing"]);
        lock.unlock().unwrap();
    }
    assert!(std::fs::read_dir(&out).unwrap().next().is_none() && !film.exists());
    assert_eq!(std::fs::read(&partial).unwrap(), b"theirs");
    // What a process left behind that was killed is in nobody's way.
    run(&t, options.as_flattened()).succeeded();
    assert!(out.join("columns").is_dir() && film.is_file() && !partial.exists());
}
