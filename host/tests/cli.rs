//! The program from the user's side: exit codes, messages, files.

#[allow(dead_code)]
mod common;

use std::fs;

use common::{BACKEND, Temp, raywake, run, weights};

/// Shape of a background filter, and its number of weights before the bias.
const FILTER: [usize; 3] = [25, 2, 14];
const FILTER_WEIGHTS: usize = 25 * 2 * 14;
#[test]
fn figures_and_files() {
    let t = Temp::new();
    t.drive(6);
    let out = t.path().join("out");
    let more =
        ["--out", out.to_str().unwrap(), "--png", "--export", "argoverse", "--filter", "none"];
    let first = run(&t, &more);
    first.succeeded();
    assert!(first.stdout.contains("memory budget") && first.stdout.contains("100 ms per sweep"));
    for text in ["ray_trace", "median", "tracklets", "dropped", "digest"] {
        assert!(first.stdout.contains(text), "{text} in {}", first.stdout);
    }
    for folder in ["columns", "points", "png"] {
        assert_eq!(fs::read_dir(out.join(folder)).unwrap().count(), 5, "{folder}");
    }
    assert!(out.join("columns/0000000000.feather").is_file());
    assert!(out.join("tracklets/0000000005.feather").is_file());
    assert!(out.join("argoverse/drive/4.feather").is_file());
    let s = first.summary(&out.join("summary.json"));
    let wanted = "version source profile backend device threads filter interrupted sweeps pairs \
        digest valid_flows valid_flows_per_sweep foreground_columns solid_columns points distinct_rays \
        stage_ms total_ms share_under_100_ms device_bytes host_bytes vulkan_allocations \
        dropped tracklets_by_age resets";
    for key in wanted.split_whitespace() {
        assert!(s.get(key).is_some(), "{key}");
    }
    assert_eq!((&s["sweeps"], &s["pairs"], &s["profile"]), (&6.into(), &5.into(), &"small".into()));
    assert_eq!(s["interrupted"], false);
    assert!(s["valid_flows"].as_u64() > Some(100) && s["stage_ms"]["expectation"]["p99"].is_f64());
    let digest = s["digest"].as_str().unwrap();
    assert!(digest.len() == 16 && u64::from_str_radix(digest, 16).is_ok());

    let file = t.path().join("again.json");
    let again = run(&t, &["--filter", "none", "--quiet", "--summary", file.to_str().unwrap()]);
    again.succeeded();
    assert_eq!((again.stdout.as_str(), again.stderr.as_str()), ("", ""));
    assert_eq!(again.summary(&file)["digest"], s["digest"]);
}

#[test]
fn ranges_of_sweeps() {
    let t = Temp::new();
    t.drive(6);
    let json = t.path().join("s.json");
    let sweeps = |more: &[&str]| {
        let o = run(&t, &[more, &["--summary", json.to_str().unwrap()]].concat());
        o.succeeded();
        let s = o.summary(&json);
        (s["sweeps"].as_u64().unwrap(), s["total_ms"].is_null(), s["resets"][0]["sweep"].as_u64())
    };
    assert_eq!(sweeps(&["--sweeps", "2..5"]), (3, false, Some(2)));
    assert_eq!(sweeps(&["--sweeps", "1..", "-n", "2"]), (2, false, Some(1)));
    assert_eq!(sweeps(&["-n", "1"]), (1, true, Some(0)));
    run(&t, &["--sweeps", "3..7"]).failed(2, &["--sweeps 3..7", "6 sweeps"]);
    run(&t, &["--sweeps", "6.."]).failed(2, &["--sweeps 6..", "6 sweeps"]);
    run(&t, &["--sweeps", "4..4"]).failed(2, &["--sweeps", "4..4"]);
}

#[test]
fn many_recordings() {
    let t = Temp::new();
    t.drive(2);
    let (drive, out) = (t.path().join("drive"), t.path().join("out"));
    let list = t.write("list", format!("# one\n{}\n", drive.display()));
    let [list, to] = [&list, &out].map(|path| path.to_str().unwrap());
    let with = |more: &[&str]| {
        raywake(&[&["run", "--list", list, "--out", to], &BACKEND[..], more].concat())
    };
    with(&["--shard", "1/2"]).succeeded();
    assert!(!out.exists());
    let first = with(&["--shard", "0/2"]);
    first.succeeded();
    assert!(first.stdout.contains("part 0 of 2: 1 of 1 recordings"), "{}", first.stdout);
    assert!(first.stdout.contains("1 done, 0 already done, 0 failed"), "{}", first.stdout);
    let place = out.join(drive.strip_prefix("/").unwrap());
    assert!(place.join("done").is_file() && place.join("summary.json").is_file());
    assert!(with(&["--quiet"]).stdout.is_empty());
    assert!(with(&[]).stdout.contains("0 done, 1 already done"));
    with(&["-n", "9", "--filter", "none"]).failed(2, &["holds other results"]);
    with(&["--set", "side=100"]).failed(2, &["must be odd"]);
    with(&["--mcap", "x.mcap"]).failed(2, &["--mcap is for a single recording"]);
    with(&["--shard", "2/2"]).failed(2, &["0 to N-1"]);
    raywake(&["run", "--list", list]).failed(2, &["--out"]);
    // Inside the second one: nothing is done, not even for the first.
    let second = t.path().join("second");
    std::fs::create_dir(&second).unwrap();
    let two = t.write("two", format!("{}\n{}\n", drive.display(), second.display()));
    let inside = second.join("results/of/it");
    let [two, inside] = [&two, &inside].map(|path| path.to_str().unwrap());
    let names = ["is inside", second.to_str().unwrap()];
    raywake(&["run", "--list", two, "--out", inside]).failed(2, &names);
    assert!(!second.join("results").exists());
    raywake(&["run", list, "--shard", "0/2"]).failed(2, &["--list"]);
    raywake(&["run"]).failed(2, &["<DATA>"]);
    let missing = t.write("missing", "/nowhere/drive\n");
    let missing = missing.to_str().unwrap();
    raywake(&["clean", "--list", missing, "--out", to]).failed(3, &["line 1", "/nowhere/drive"]);
}

#[test]
fn mistakes_in_profiles() {
    let t = Temp::new();
    t.drive(2);
    let data = t.path().join("drive");
    let with = |text: &str| {
        let config = t.write("p.toml", text);
        raywake(&["run", data.to_str().unwrap(), "--config", config.to_str().unwrap()])
    };
    with("side = 61\nsied = 3\n").failed(3, &["p.toml", "line 2", "`sied`"]);
    with("side = 339\n").failed(3, &["p.toml", "`side`", "337"]);
    with("levels = 12\n").failed(2, &["12 levels", "--filter"]);
    let data = data.to_str().unwrap();
    raywake(&["run", data, "--profile", "nosuch"]).failed(2, &["`nosuch`", "hdl64"]);
    raywake(&["run", data, "--config", "absent.toml"]).failed(3, &["absent.toml"]);
}

#[test]
fn mistakes_in_weights() {
    let t = Temp::new();
    t.drive(3);
    let with = |text: &str| {
        let file = t.write("filter.txt", text);
        run(&t, &["--filter", file.to_str().unwrap()])
    };
    let good = weights("background", &FILTER, |n| if n == FILTER_WEIGHTS { "1" } else { "0" });
    let o = with(&good);
    o.succeeded();
    assert!(o.stdout.contains("background filter: made up"), "{}", o.stdout);
    let flipped = good.replacen("\n0\n", "\n4\n", 1);
    with(&flipped).failed(3, &["filter.txt", "checksum"]);
    let nan = weights("background", &FILTER, |n| if n == 3 { "NaN" } else { "0" });
    with(&nan).failed(3, &["filter.txt", "value 3"]);
    let shape = weights("background", &[25, 2, 13], |_| "0");
    with(&shape).failed(3, &["filter.txt", "shape"]);
    let file = t.write("filter.txt", [b'r', 0xff]);
    run(&t, &["--filter", file.to_str().unwrap()]).failed(3, &["filter.txt", "byte 1"]);
    run(&t, &["--filter", "absent.txt"]).failed(3, &["absent.txt"]);
    run(&t, &["--constancy", file.to_str().unwrap()]).failed(3, &["filter.txt"]);
}

#[test]
fn unreadable_and_unwritable() {
    let t = Temp::new();
    raywake(&["run", "no/such/folder"]).failed(3, &["no/such/folder"]);
    raywake(&["run", t.path().to_str().unwrap()]).failed(3, &[t.path().to_str().unwrap()]);
    t.drive(3);
    let file = t.write("file", "");
    let below = file.join("out");
    run(&t, &["--out", below.to_str().unwrap()]).failed(4, &[below.to_str().unwrap()]);
    let below = file.join("s.json");
    run(&t, &["--summary", below.to_str().unwrap()]).failed(4, &[file.to_str().unwrap()]);
    if std::path::Path::new("/dev/full").exists() {
        run(&t, &["--summary", "/dev/full"]).failed(4, &["/dev/full", "No space"]);
    }
    t.write("drive/velodyne_points/data/0000000002.bin", [0; 17]);
    let out = t.path().join("out");
    run(&t, &["--out", out.to_str().unwrap()]).failed(3, &["0000000002.bin", "truncated"]);
    assert!(out.join("columns/0000000000.feather").is_file());
    assert!(!out.join("summary.json").exists());
}

#[test]
fn nothing_seen() {
    let t = Temp::new();
    t.drive(3);
    for n in 0..3 {
        t.write(&format!("drive/velodyne_points/data/{n:010}.bin"), []);
    }
    let json = t.path().join("s.json");
    let out = t.path().join("out");
    let o = run(
        &t,
        &["--summary", json.to_str().unwrap(), "--out", out.to_str().unwrap(), "--png=ego"],
    );
    o.succeeded();
    let s = o.summary(&json);
    assert_eq!((&s["points"], &s["valid_flows"], &s["pairs"]), (&0.0.into(), &0.into(), &2.into()));
}

#[test]
fn gaps_and_jumps() {
    let t = Temp::new();
    t.drive(9);
    let stamp = |n: usize| n as f64 * 0.1 + if n < 3 { 0.0 } else { 1.0 };
    let place = |n: usize| n as f64 * 0.5 + if n < 6 { 0.0 } else { 100.0 };
    t.write("drive/times.txt", (0..9).map(|n| format!("{}\n", stamp(n))).collect::<String>());
    t.write("drive/poses.txt", (0..9).map(|n| common::row(place(n))).collect::<String>());
    let json = t.path().join("s.json");
    let o = run(&t, &["--summary", json.to_str().unwrap()]);
    o.succeeded();
    assert!(o.stdout.contains("sweep 3 (frame 3): gap of 1.100 s"), "{}", o.stdout);
    assert!(o.stdout.contains("sweep 6 (frame 6): poses jump at 1005 m/s"), "{}", o.stdout);
    let s = o.summary(&json);
    let reasons: Vec<_> = s["resets"].as_array().unwrap().iter().map(|r| &r["reason"]).collect();
    assert_eq!(reasons, ["first", "gap", "jump"]);
    assert_eq!(s["pairs"], 6);
}

/// The vehicle does not take on the speed of a jump, neither in that sweep nor in the next pair.
#[test]
fn results_recover_after_a_jump() {
    let t = Temp::new();
    t.drive(9);
    let figures = |t: &Temp| {
        let json = t.path().join("s.json");
        let o =
            run(t, &["--sweeps", "4..9", "--filter", "none", "--summary", json.to_str().unwrap()]);
        o.succeeded();
        let s = o.summary(&json);
        assert!(s["valid_flows"].as_u64().unwrap() > 0, "{s}");
        (s["distinct_rays"].clone(), s["solid_columns"].clone(), s["valid_flows"].clone())
    };
    let rows = |jump: f64| {
        let place = |n: usize| n as f64 * 0.5 + if n < 4 { 0.0 } else { jump };
        (0..9).map(|n| common::row(place(n))).collect::<String>()
    };
    t.write("drive/poses.txt", rows(0.0));
    let wanted = figures(&t);
    t.write("drive/poses.txt", rows(120.0));
    assert_eq!(figures(&t), wanted);
}

#[test]
fn poses_that_flip_reset_the_tracklets() {
    let t = Temp::new();
    t.drive(5);
    let row = |n: usize| match n {
        0..3 => common::row(n as f64 * 0.5),
        _ => format!("0 -1 0 {} 1 0 0 0 0 0 1 0\n", n as f64 * 0.5),
    };
    t.write("drive/poses.txt", (0..5).map(row).collect::<String>());
    let o = run(&t, &[]);
    o.succeeded();
    assert!(o.stdout.contains("sweep 3 (frame 3): poses turn at 15.7 rad/s"), "{}", o.stdout);
}

#[test]
fn absurd_files_are_refused() {
    let t = Temp::new();
    t.drive(3);
    t.write("drive/poses.txt", [0.0, 0.5, 1e300].map(common::row).concat());
    let o = run(&t, &[]);
    o.failed(3, &["poses.txt, line 3", "from the first pose"]);
    t.write("drive/poses.txt", [0.0, 0.5, 1.0].map(common::row).concat());
    let cloud = t.path().join("drive/velodyne_points/data/0000000001.bin");
    std::fs::File::create(&cloud).unwrap().set_len(1 << 40).unwrap();
    let o = run(&t, &[]);
    o.failed(3, &["0000000001.bin", "1099511627776 bytes or more, at most 268435456 are read"]);
}

#[test]
fn budgets() {
    let all = raywake(&["budget"]);
    all.succeeded();
    assert!(all.stdout.contains("| hdl64 | wide | far | dissertation |"));
    let one = raywake(&["budget", "--profile", "wide", "--limit", "1000000000"]);
    one.succeeded();
    assert!(one.stdout.contains("`ray") && !one.stdout.contains("dissertation"));
    let over = raywake(&["budget", "--limit", "1kB"]);
    over.failed(6, &["MB needed, over the limit of 1000 B"]);
    assert!(over.stdout.contains("## Totals"));
    raywake(&["budget", "--profile", "wide", "--limit", "1GiB"]).succeeded();
    raywake(&["budget", "--limit", "1 parsec"]).failed(2, &["--limit", "KiB"]);
    let json = raywake(&["budget", "--profile", "wide", "--json"]);
    json.succeeded();
    let json: serde_json::Value = serde_json::from_str(&json.stdout).unwrap();
    let sum = |list: &str| -> u64 {
        let rows = json[0][list].as_array().unwrap();
        rows.iter().map(|row| row["bytes"].as_u64().unwrap()).sum()
    };
    let of = |name: &str| json[0][name].as_u64().unwrap();
    assert_eq!((json[0]["profile"].as_str(), sum("host_parts")), (Some("wide"), of("host_bytes")));
    // There may be padding between buffers.
    assert!((0..1000).contains(&(of("device_bytes") - sum("buffers"))), "{json}");
}

#[test]
fn help_and_devices() {
    let help = raywake(&["run", "--help"]);
    help.succeeded();
    assert!(help.stdout.contains("130  interrupted") && help.stdout.contains("--ground"));
    raywake(&["devices"]).succeeded();
    let devices: serde_json::Value =
        serde_json::from_str(&raywake(&["devices", "--json"]).stdout).unwrap();
    assert!(devices.as_array().unwrap().iter().all(|d| d["name"].is_string()), "{devices}");
    raywake(&["run"]).failed(2, &["<DATA>"]);
    raywake(&["run", "x", "--png"]).failed(2, &["--out"]);
}

#[cfg(feature = "shell")]
#[test]
fn completions_and_manual_pages() {
    let bash = raywake(&["completions", "bash"]);
    bash.succeeded();
    assert!(bash.stdout.contains("--bin-fields") && bash.stdout.contains("complete -F"));
    let page = raywake(&["man", "run"]);
    page.succeeded();
    assert!(page.stdout.contains(".SH OPTIONS") && page.stdout.contains("bin\\-fields"));
    assert!(raywake(&["man"]).stdout.contains("raywake"));
    raywake(&["man", "nothing"]).failed(2, &["no command `nothing`"]);
}

#[test]
fn a_run_without_outputs_says_so() {
    let t = Temp::new();
    t.drive(2);
    let says = "no output, only timings";
    assert!(run(&t, &[]).stdout.contains(says));
    let out = t.path().join("o");
    assert!(!run(&t, &["-o", out.to_str().unwrap()]).stdout.contains(says));
    assert!(out.join("summary.json").is_file());
    // Results of other settings are rejected, and the existing ones stay.
    let other = run(&t, &["-o", out.to_str().unwrap(), "--set", "em_rounds=2"]);
    other.failed(2, &["holds other results", "`em_rounds = 3`, not `em_rounds = 2`"]);
    assert!(out.join("summary.json").is_file());
}

#[cfg(feature = "demo")]
#[test]
fn a_demo() {
    let t = Temp::new();
    let out = t.path().join("demo");
    let o = raywake(&[&["demo", "--out", out.to_str().unwrap()], &BACKEND[..]].concat());
    o.succeeded();
    assert!(o.stdout.contains("median speed error"), "{}", o.stdout);
    // If results have changed, earlier work must not count as done.
    let digest = format!("{:016x}", raywake::batch::DEMO_DIGEST);
    assert!(o.stdout.contains(&digest), "{digest} is not in {}", o.stdout);
    assert!(o.summary(&out.join("summary.json"))["valid_flows"].as_u64() > Some(1000));
    assert!(out.join("columns/0000000000.feather").is_file());
    assert!(out.join("png/0000000018.png").is_file());
}
