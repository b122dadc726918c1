//! One digest, however the program is run: on any backend, vector width, number of threads or
//! build. `RAYWAKE_DIGEST_OF` names further builds to compare, separated by `:`.

#[allow(dead_code)]
mod common;

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use common::{Outcome, Temp};
use raywake_sim::{Drive, Ego, Options, SimSweep};
use raywake_simd::Simd;

/// Vector widths of software Vulkan, bits.
const WIDTHS: [u32; 3] = [128, 256, 512];
/// Its numbers of threads besides the calling one, and the width they are tested at.
const THREADS: [u32; 3] = [0, 1, 2];
const THREADS_AT: u32 = 256;
/// Maximum device memory of a run of the default profile, bytes.
const DEVICE_BYTES: u64 = 40 << 20;

/// A left turn on the simulated street, in KITTI's layout.
fn drive(t: &Temp) -> PathBuf {
    for (n, sweep) in sweeps().iter().enumerate() {
        let values = sweep.points.iter().flat_map(|p| {
            let [x, y, z] = p.position;
            [x, y, z, p.intensity]
        });
        let cloud: Vec<u8> = values.flat_map(f32::to_le_bytes).collect();
        t.write(&format!("drive/velodyne_points/data/{n:010}.bin"), cloud);
    }
    t.write("drive/times.txt", rows(&|s| format!("{}\n", s.stamp_s)));
    t.write("drive/poses.txt", rows(&|sweep| pose(sweep, 0.0)));
    t.path().join("drive")
}

/// The sweeps of that drive.
fn sweeps() -> &'static [SimSweep] {
    static SWEEPS: OnceLock<Vec<SimSweep>> = OnceLock::new();
    let ego = Ego::Turn { left: true, speed: 6.0 };
    let options = Options { sweeps: 4, ego, ..Options::default() };
    SWEEPS.get_or_init(|| Drive::new(3, options).collect())
}

/// One row per sweep.
fn rows(row: &dyn Fn(&SimSweep) -> String) -> String {
    sweeps().iter().map(row).collect()
}

/// A row of `poses.txt`, with the world's origin shifted by `away`, m, along each axis.
fn pose(sweep: &SimSweep, away: f64) -> String {
    let pose = sweep.world_from_vehicle;
    let (turn, place) = (pose.matrix(), (pose.translation + away).to_array());
    let row = |n: usize| {
        let [a, b, c] = turn.row(n).to_array();
        format!("{a} {b} {c} {}", place[n])
    };
    format!("{} {} {}\n", row(0), row(1), row(2))
}

/// How to run.
#[derive(Clone, Copy, Debug)]
enum RunMode {
    Scalar,
    /// Vulkan. If the device is a CPU: its vector width and number of threads.
    Vulkan(u32, Option<u32>),
}

impl RunMode {
    /// The command of a program, run this way.
    fn command(self, program: &Path, what: &str, data: &Path) -> Command {
        let mut command = Command::new(program);
        command.arg(what).arg(data);
        let RunMode::Vulkan(width, threads) = self else {
            command.args(["--backend", "scalar"]);
            return command;
        };
        command.args(["--backend", "vulkan", "--timeout", "120"]);
        command.env("LP_NATIVE_VECTOR_WIDTH", width.to_string());
        // Kept across tests, but one per width: the driver does not distinguish them.
        let cache = env::temp_dir().join(format!("raywake-shaders-{width}"));
        command.env("MESA_SHADER_CACHE_DIR", cache);
        match threads {
            Some(n) => command.env("LP_NUM_THREADS", n.to_string()),
            None => command.env_remove("LP_NUM_THREADS"),
        };
        command
    }
}

/// The program of this package.
fn own() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_raywake"))
}

/// Whether a program finds a Vulkan device. With `RAYWAKE_VULKAN=required` ours must.
fn vulkan(program: &Path) -> bool {
    let devices = Outcome::of(Command::new(program).arg("devices").output().unwrap());
    devices.succeeded();
    let found = !devices.stdout.starts_with("No Vulkan");
    if !found {
        let required = env::var("RAYWAKE_VULKAN").is_ok_and(|v| v == "required");
        assert!(!required || program != own(), "{}", devices.stdout);
        eprintln!("skipped: no Vulkan device for {}", program.display());
    }
    found
}

/// The digest of `run`, whose summary is checked.
fn digest(t: &Temp, program: &Path, mode: RunMode, more: &[&str]) -> String {
    let file = t.path().join("summary.json");
    let mut command = mode.command(program, "run", &t.path().join("drive"));
    command.args(["--quiet", "--no-points", "--summary"]).arg(&file).args(more);
    let outcome = Outcome::of(command.output().unwrap());
    outcome.succeeded();
    let s = outcome.summary(&file);
    let number = |key: &str| s[key].as_u64().unwrap_or_else(|| panic!("{key} in {s}"));
    let on_device = matches!(mode, RunMode::Vulkan(..));
    assert_eq!(s["backend"], if on_device { "vulkan" } else { "scalar" });
    if let (RunMode::Vulkan(width, _), Some(device)) = (mode, s["device"].as_str()) {
        let right = !device.starts_with("llvmpipe") || device.contains(&format!("{width} bits"));
        assert!(right, "{device} for {width} bits");
    }
    assert!(number("device_bytes") <= DEVICE_BYTES, "{s}");
    assert!(number("vulkan_allocations") <= 3, "{s}");
    assert_eq!(on_device, number("device_bytes") > 0 && number("vulkan_allocations") > 0, "{s}");
    assert!(number("pairs") == 3 && number("valid_flows") > 0, "{s}");
    s["digest"].as_str().unwrap().to_string()
}

/// The bytes of a table, if the program can write one.
fn table(t: &Temp, program: &Path) -> Option<Vec<u8>> {
    let out = t.path().join("tables");
    let _ = fs::remove_dir_all(&out);
    let mut command = RunMode::Scalar.command(program, "run", &t.path().join("drive"));
    let outcome = Outcome::of(command.args(["--quiet", "--out"]).arg(&out).output().unwrap());
    if outcome.stderr.contains("needs the feature `arrow`") {
        return None;
    }
    outcome.succeeded();
    Some(fs::read(out.join("columns/0000000001.feather")).unwrap())
}

/// The digest that `map` prints.
fn map_digest(t: &Temp, mode: RunMode) -> String {
    let mut command = mode.command(own(), "map", &t.path().join("drive"));
    command.arg("--out").arg(t.path().join("map")).args(["-n", "2"]);
    let outcome = Outcome::of(command.output().unwrap());
    outcome.succeeded();
    let digest = outcome.stdout.lines().find_map(|line| line.strip_prefix("digest     "));
    digest.unwrap_or_else(|| panic!("{}", outcome.stdout)).to_string()
}

/// The digest of `track`, whose summary is checked.
fn track_digest(t: &Temp, program: &Path, mode: RunMode, front_end: &str) -> String {
    let file = t.path().join("tracks.json");
    let mut command = mode.command(program, "track", &t.path().join("drive"));
    command.args(["--quiet", "--fixed-lag", "--front-end", front_end, "--summary"]).arg(&file);
    let outcome = Outcome::of(command.output().unwrap());
    outcome.succeeded();
    let s = outcome.summary(&file);
    assert_eq!(s["sweeps"], 4, "{s}");
    assert!(s["tracks"].as_array().unwrap().len() > 10, "{s}");
    s["digest"].as_str().unwrap().to_string()
}

#[test]
fn tracks() {
    let t = Temp::new();
    drive(&t);
    let [variance, flow] =
        ["variance", "flow"].map(|kind| track_digest(&t, own(), RunMode::Scalar, kind));
    assert_ne!(variance, flow, "the flow does something");
    assert_eq!(track_digest(&t, own(), RunMode::Scalar, "variance"), variance, "again");
    if vulkan(own()) {
        assert_eq!(track_digest(&t, own(), RunMode::Vulkan(THREADS_AT, None), "flow"), flow);
    }
}

#[test]
fn widths_and_threads() {
    let t = Temp::new();
    drive(&t);
    let scalar = digest(&t, own(), RunMode::Scalar, &[]);
    assert_eq!(digest(&t, own(), RunMode::Scalar, &[]), scalar, "scalar again");
    if !vulkan(own()) {
        return;
    }
    let widths = WIDTHS.map(|width| RunMode::Vulkan(width, None));
    let threads = THREADS.map(|n| RunMode::Vulkan(THREADS_AT, Some(n)));
    for mode in widths.into_iter().chain(threads) {
        assert_eq!(digest(&t, own(), mode, &[]), scalar, "{mode:?}");
    }
}

#[test]
fn independent_of_the_world_origin() {
    let t = Temp::new();
    drive(&t);
    for profile in ["hdl64", "dissertation"] {
        let found = [0.0, 1e5, -1e6].map(|away| {
            t.write("drive/poses.txt", rows(&|sweep| pose(sweep, away)));
            digest(&t, own(), RunMode::Scalar, &["--profile", profile])
        });
        assert!(found.iter().all(|digest| *digest == found[0]), "{profile}: {found:?}");
    }
}

#[test]
fn instruction_sets() {
    let t = Temp::new();
    drive(&t);
    let run = |more: &[&str]| {
        let found = digest(&t, own(), RunMode::Scalar, more);
        let summary = std::fs::read(t.path().join("summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
        (found, summary["simd"].clone())
    };
    let (wanted, widest) = run(&[]);
    assert_eq!(widest, Simd::widest().name());
    for simd in Simd::available() {
        let (found, reported) = run(&["--simd", simd.name()]);
        assert_eq!((found, reported), (wanted.clone(), simd.name().into()));
    }
    let mut command = RunMode::Scalar.command(own(), "run", &t.path().join("drive"));
    let refused = Outcome::of(command.args(["--simd", "avx3"]).output().unwrap());
    assert!(refused.stderr.contains(Simd::BASELINE.name()), "{}", refused.stderr);
}

#[test]
fn without_the_filter() {
    let t = Temp::new();
    drive(&t);
    let none = ["--filter", "none"];
    let scalar = digest(&t, own(), RunMode::Scalar, &none);
    assert_ne!(digest(&t, own(), RunMode::Scalar, &[]), scalar, "the filter does something");
    if vulkan(own()) {
        assert_eq!(digest(&t, own(), RunMode::Vulkan(THREADS_AT, None), &none), scalar);
    }
}

#[test]
fn maps() {
    let t = Temp::new();
    drive(&t);
    let scalar = map_digest(&t, RunMode::Scalar);
    assert_eq!(map_digest(&t, RunMode::Scalar), scalar, "scalar again");
    if vulkan(own()) {
        assert_eq!(map_digest(&t, RunMode::Vulkan(THREADS_AT, None)), scalar);
    }
}

#[test]
fn other_builds() {
    let Some(programs) = env::var_os("RAYWAKE_DIGEST_OF") else { return };
    let t = Temp::new();
    drive(&t);
    let wanted = digest(&t, own(), RunMode::Scalar, &[]);
    let tracks = track_digest(&t, own(), RunMode::Scalar, "flow");
    let table = table(&t, own()).expect("tests are built with tables");
    let mut written = 0;
    for program in env::split_paths(&programs).filter(|p| !p.as_os_str().is_empty()) {
        let name = program.display();
        assert_eq!(digest(&t, &program, RunMode::Scalar, &[]), wanted, "{name}, scalar");
        let found = track_digest(&t, &program, RunMode::Scalar, "flow");
        assert_eq!(found, tracks, "{name}, tracks");
        if let Some(found) = self::table(&t, &program) {
            assert!(found == table, "{name}, tables");
            written += 1;
        }
        if vulkan(&program) {
            let mode = RunMode::Vulkan(THREADS_AT, None);
            assert_eq!(digest(&t, &program, mode, &[]), wanted, "{name}, {mode:?}");
        }
    }
    assert!(written > 0, "none of them writes tables");
}

/// A whole recorded drive: equal digests, flow in every pair, nothing allocated.
#[test]
#[ignore = "needs RAYWAKE_DATA"]
fn a_recorded_drive() {
    let data = PathBuf::from(env::var_os("RAYWAKE_DATA").expect("RAYWAKE_DATA"));
    let data = data.join("kitti_raw_0005");
    let t = Temp::new();
    for more in [&[][..], &["--filter", "none"]] {
        let mut digests = Vec::new();
        let mut modes = vec![RunMode::Scalar];
        modes.extend(vulkan(own()).then_some(RunMode::Vulkan(THREADS_AT, None)));
        for mode in modes {
            let file = t.path().join("summary.json");
            let mut command = mode.command(own(), "run", &data);
            command.args(["--quiet", "--summary"]).arg(&file).args(more);
            let outcome = Outcome::of(command.output().unwrap());
            outcome.succeeded();
            let s = outcome.summary(&file);
            assert!(s["sweeps"] == 154, "{s}");
            assert!(s["device_bytes"].as_u64().unwrap() <= DEVICE_BYTES, "{s}");
            assert!(s["valid_flows_per_sweep"].as_f64().unwrap() >= 1000.0, "{s}");
            digests.push(s["digest"].to_string());
        }
        assert!(digests.iter().all(|d| *d == digests[0]), "{more:?}: {digests:?}");
    }
}
