//! A device that fails: during set-up the program reports which call failed; during a run the
//! scalar backend takes over, with the bits it would produce from there on.

#![cfg(unix)]

#[allow(dead_code)]
mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use common::{Outcome, SMALL, Temp};
use raywake_faulty_layer::{BUSY, FAULT, GARBAGE, NAME, NAMES, NULL, environment};

/// Vulkan result codes.
const OUT_OF_HOST_MEMORY: i32 = -1;
const OUT_OF_DEVICE_MEMORY: i32 = -2;
const LOST: i32 = -4;
const TIMEOUT: i32 = 2;

const SWEEPS: usize = 8;

/// `raywake run DRIVE` on the device, with a fault in the form of [`FAULT`], or without one.
fn run(t: &Temp, fault: &str, more: &[&str]) -> Outcome {
    let config = t.write("small.toml", SMALL);
    let data = t.path().join("drive");
    let mut command = common::command(&["run", data.to_str().unwrap()]);
    command.args(["--config", config.to_str().unwrap(), "--backend", "vulkan"]).args(more);
    command.envs(environment(t.path(), &common::faulty_layer()).unwrap()).env(FAULT, fault);
    if let Some(layers) = under_validation(t.path()) {
        command.envs(layers);
    }
    let o = Outcome::of(command.output().unwrap());
    assert!(!o.stdout.contains("has not been destroyed"), "{fault}: {}", o.stdout);
    o
}

/// Variables that also enable the validation layer, if it is installed. It tracks objects, and
/// reports on standard output those left at the end.
fn under_validation(folder: &Path) -> Option<[(&'static str, String); 2]> {
    let installed = Path::new("/usr/share/vulkan/explicit_layer.d");
    if !installed.join("VkLayer_khronos_validation.json").is_file() {
        eprintln!("skipped: an account of Vulkan objects, as there is no validation layer");
        return None;
    }
    let folders = format!("{}:{}", folder.display(), installed.display());
    let layers = format!("VK_LAYER_KHRONOS_validation:{NAME}");
    Some([("VK_LAYER_PATH", folders), ("VK_INSTANCE_LAYERS", layers)])
}

/// A drive, if there is a device to run on.
fn drive() -> Option<Temp> {
    let t = Temp::new();
    t.drive(SWEEPS);
    let o = run(&t, "", &[]);
    if o.code == Some(5) && o.stderr.contains("Vulkan") {
        eprintln!("skipped: {}", o.stderr);
        return None;
    }
    o.succeeded();
    Some(t)
}

#[test]
fn every_call_of_the_set_up() {
    let Some(t) = drive() else { return };
    let asked_later = "vkGetQueryPoolResults";
    let names = NAMES.iter().chain(&["vkCreateInstance", "vkCreateDevice"]);
    for name in names.filter(|name| **name != asked_later) {
        for result in [OUT_OF_HOST_MEMORY, OUT_OF_DEVICE_MEMORY, LOST] {
            let o = run(&t, &format!("{name} 1 {result}"), &[]);
            assert_eq!(o.code, Some(5), "{name} {result}: {}{}", o.stdout, o.stderr);
            let reported = [*name, "heap cannot hold", "device lost during"];
            assert!(reported.iter().any(|text| o.stderr.contains(text)), "{name}: {}", o.stderr);
        }
    }
    run(&t, &format!("vkMapMemory 1 {NULL}"), &[]).failed(5, &["vkMapMemory"]);
}

/// What exists by then is destroyed.
#[test]
fn the_second_call_of_the_set_up() {
    let Some(t) = drive() else { return };
    let mut failed = Vec::new();
    for name in NAMES {
        let o = run(&t, &format!("{name} 2 {OUT_OF_DEVICE_MEMORY}"), &[]);
        match o.code {
            Some(5) => failed.push(*name),
            // There is no second call, or it belongs to a sweep.
            _ => o.succeeded(),
        }
    }
    for name in ["vkAllocateMemory", "vkCreateBuffer", "vkMapMemory", "vkCreateComputePipelines"] {
        assert!(failed.contains(&name), "{name} is not among {failed:?}");
    }
}

/// Then no times are reported, not even those of the run before; and the results do not depend on
/// them.
#[test]
fn times_that_cannot_be_read() {
    let Some(t) = drive() else { return };
    let json = t.path().join("s.json");
    // From the fourth run on: the second sweep's, which completes the first pair.
    let [all, fewer] = ["", &format!("vkGetQueryPoolResults 4 {LOST}")].map(|fault| {
        let o = run(&t, fault, &["--summary", json.to_str().unwrap()]);
        o.succeeded();
        let summary = o.summary(&json);
        assert!(summary["device_failure"].is_null(), "{fault}: {summary}");
        summary
    });
    assert_eq!(all["digest"], fewer["digest"]);
    let kernel = |summary: &serde_json::Value| summary["stage_ms"].get("ray_trace").is_some();
    assert!(kernel(&all) && !kernel(&fewer), "{}", fewer["stage_ms"]);
}

/// Tables of a run's results by name, starting at a frame.
fn tables(out: &Path, from: usize) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for kind in ["columns", "points", "tracklets"] {
        for entry in fs::read_dir(out.join(kind)).unwrap() {
            let path = entry.unwrap().path();
            let frame: usize = path.file_stem().unwrap().to_str().unwrap().parse().unwrap();
            // Tracklets belong to a pair's second sweep.
            if frame >= from + usize::from(kind == "tracklets") {
                found.insert(format!("{kind} {frame}"), fs::read(path).unwrap());
            }
        }
    }
    found
}

#[test]
fn the_scalar_backend_takes_over_during_a_run() {
    let Some(t) = drive() else { return };
    let json = t.path().join("s.json");
    let results = |name: &str, fault: &str, from: usize| {
        let (out, sweeps) = (t.path().join(name), format!("{from}.."));
        let to = ["--out", out.to_str().unwrap(), "--summary", json.to_str().unwrap()];
        let o = run(&t, fault, &[&to[..], &["--sweeps", &sweeps]].concat());
        o.succeeded();
        (out, o.summary(&json), o.stderr)
    };
    for failing in [0, 3] {
        let (out, s, _) = results(&format!("from {failing}"), "", failing);
        assert!(s["device_failure"].is_null());
        let host_bytes = s["host_bytes"].as_u64();
        let wanted = tables(&out, failing);
        assert_eq!(wanted.len(), 3 * (SWEEPS - 1 - failing));
        // Two programs have run before the first sweep.
        let call = failing + 3;
        for (n, (name, result, reported)) in [
            ("vkQueueSubmit", LOST, "device lost during `flow`, reported by vkQueueSubmit"),
            ("vkWaitForFences", LOST, "device lost during `flow`, reported by vkWaitForFences"),
            ("vkWaitForFences", TIMEOUT, "`flow` did not finish within 10s"),
            ("vkResetFences", OUT_OF_HOST_MEMORY, "vkResetFences failed"),
            ("vkWaitForFences", GARBAGE, "`flow` left invalid results behind"),
        ]
        .into_iter()
        .enumerate()
        {
            let fault = format!("{name} {call} {result}");
            let (out, s, stderr) = results(&format!("{failing} {n}"), &fault, 0);
            assert!(s["device_failure"].as_str().unwrap().contains(reported), "{fault}: {s}");
            assert!(
                stderr.contains(reported) && stderr.contains("continuing on the scalar backend")
            );
            assert_eq!(tables(&out, failing), wanted, "{fault}");
            // Both backends are held then.
            assert!(s["host_bytes"].as_u64() > host_bytes.map(|bytes| 2 * bytes), "{fault}: {s}");
            // The pair completed by the sweep in which the device failed is lost.
            let pairs = (SWEEPS - 1 - usize::from(failing > 0)) as u64;
            assert_eq!(s["pairs"].as_u64(), Some(pairs), "{fault}");
        }
    }
}

/// A driver that reports a lost device which is still working, as late as in the last sweep: its
/// memory is not freed under it.
#[test]
fn a_lost_device_that_is_still_working() {
    let Some(t) = drive() else { return };
    // Long enough for the program to end meanwhile.
    let slow = ["--set", "em_rounds=100"];
    let last = format!("vkWaitForFences {} {BUSY}", SWEEPS + 2);
    let o = run(&t, &last, &slow);
    o.succeeded();
    assert!(o.stderr.contains("device lost during `flow`"), "{}", o.stderr);
}
