#![forbid(unsafe_code)]
//! What targets do with bytes: read them as a recording, packets, poses, weights or other files.
//! Whatever the bytes are, this ends with an error or a result.

use raywake::args::ProfileChoice;
use raywake::live::poses::RecentPoses;
use raywake::track::Ground;
use raywake::{budget, config};
use raywake_core::encoder::EncoderWeights;
use raywake_core::stages::{background_filter, occupancy_constancy};
use raywake_io::source::capture::assembly::Assembler;
use raywake_io::source::capture::live::{LiveSensor, SensorModel};
use raywake_io::source::decoder::damaged;
use raywake_io::source::simulated::Simulated;
use raywake_io::source::{OpenOptions, SweepData, Unlocated, open};
use raywake_lab::labels;
use raywake_lab::toy::digits;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::{LazyLock, Mutex, PoisonError};
use std::time::Instant;
use tempfile::TempDir;

pub mod bundle;
pub mod packet;
use bundle::Bundle;
use packet::velodyne;

/// Maximum number of sweeps read from each recording.
const SWEEPS: usize = 3;
/// Number of sweeps of the drive that labels belong to.
const SWEEPS_LABELLED: usize = 20;
/// Number of levels that weights are read for.
const LEVELS: usize = 10;

/// Holds the files of one recording after another.
static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    ignore_guarded_panics();
    TempDir::new().expect("a temporary folder")
});

/// A panic in a third-party decoder is caught and does not count as a finding.
fn ignore_guarded_panics() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if damaged().is_none() {
            usual(panic);
        }
    }));
}

/// Reads a [`Bundle`] as a recording.
pub fn recording(bytes: &[u8]) {
    let Some(Bundle { root, topics, files }) = Bundle::parse(bytes) else { return };
    if replace(files).is_ok() {
        read(&FOLDER.path().join(root), topics);
    }
}

/// Reads a [`Bundle`] as what the name of its root says: settings (`.toml`), a map of the ground
/// (`.asc`), digits (`digits`) or, with another name, labels of a drive of [`SWEEPS_LABELLED`]
/// sweeps.
pub fn files(bytes: &[u8]) {
    let Some(Bundle { root, files, .. }) = Bundle::parse(bytes) else { return };
    if replace(files).is_err() {
        return;
    }
    let path = FOLDER.path().join(&root);
    match path.extension().and_then(|e| e.to_str()) {
        Some("toml") => settings(&path),
        Some("asc") => drop(Ground::read(&path)),
        _ if root.starts_with("digits") => drop(digits::open(&path, 1)),
        _ => label(&path),
    }
}

fn settings(path: &Path) {
    let choice = ProfileChoice { config: Some(path.to_path_buf()), ..ProfileChoice::default() };
    let Ok(settings) = config::settings(&choice) else { return };
    // What was accepted can be planned for.
    let _ = budget::host_bytes(&settings.profile, true) + budget::device_bytes(&settings.profile);
}

fn label(path: &Path) {
    static DRIVE: LazyLock<Mutex<Simulated>> =
        LazyLock::new(|| Mutex::new(Simulated::new(1, SWEEPS_LABELLED)));
    let drive = DRIVE.lock().unwrap_or_else(PoisonError::into_inner);
    let Ok(Some(found)) = labels::find(path, &*drive) else { return };
    for trajectory in labels::trajectories(&found, &*drive) {
        for state in trajectory.states() {
            assert!(state.velocity.is_finite(), "{state:?}");
        }
    }
}

/// Takes poses: every 72 bytes are a datagram. Whatever they are, the pose at any time is finite.
pub fn poses(bytes: &[u8]) {
    let mut poses = RecentPoses::default();
    for datagram in bytes.chunks(72) {
        poses.take(datagram);
        let stamp =
            datagram.get(8..16).and_then(|b| b.try_into().ok()).map_or(0, u64::from_le_bytes);
        for (at, sweep) in [(stamp, 100_000_000), (stamp.saturating_add(50_000_000), 1)] {
            if let Some((pose, twist)) = poses.at(at, sweep) {
                let numbers = [pose.translation, twist.linear, twist.angular];
                assert!(numbers.iter().all(|v| v.is_finite()), "{pose:?} {twist:?}");
            }
        }
    }
}

/// Makes the folder hold these files. Most inputs differ from the previous one in one file.
fn replace(files: BTreeMap<String, Vec<u8>>) -> std::io::Result<()> {
    static WRITTEN: Mutex<BTreeMap<String, Vec<u8>>> = Mutex::new(BTreeMap::new());
    let mut written = WRITTEN.lock().unwrap_or_else(PoisonError::into_inner);
    let old = std::mem::take(&mut *written);
    let mut gone = old.keys().filter(|place| !files.contains_key(*place));
    let removed = gone.try_for_each(|place| fs::remove_file(FOLDER.path().join(place)));
    let mut changed = files.iter().filter(|(place, content)| old.get(*place) != Some(content));
    let write = |()| changed.try_for_each(|(place, content)| write(place, content));
    if let Err(error) = removed.and_then(write) {
        // The path of one file is the folder of another.
        fs::remove_dir_all(FOLDER.path())?;
        fs::create_dir_all(FOLDER.path())?;
        return Err(error);
    }
    *written = files;
    Ok(())
}

fn write(place: &str, content: &[u8]) -> std::io::Result<()> {
    let path = FOLDER.path().join(place);
    path.parent().map_or(Ok(()), fs::create_dir_all)?;
    fs::write(path, content)
}

fn read(path: &Path, topics: Vec<String>) {
    let (unlocated, ground_m) = (Unlocated::Accept, Some(-1.7));
    let options = OpenOptions { unlocated, ground_m, topics, ..OpenOptions::default() };
    let Ok(mut source) = open(path, &options) else { return };
    let mut sweep = SweepData::default();
    for index in 0..source.len().min(SWEEPS) {
        let read = source.read(index, &mut sweep);
        assert!(read.is_ok() || sweep.points.is_empty(), "returns of a sweep that failed");
        let pose = &sweep.world_from_vehicle;
        assert!(pose.rotation.is_finite() && pose.translation.is_finite(), "{pose:?}");
    }
}

/// Assembles sweeps from packets of the sensor that the first byte names. Every five bytes after it
/// say how many packets follow, how many are lost before them, and which byte of each is replaced:
/// a few make a revolution.
pub fn packets(bytes: &[u8]) {
    let Some((model, records)) = bytes.split_first() else { return };
    let models =
        [SensorModel::Vlp16, SensorModel::PuckHiRes, SensorModel::Vlp32c, SensorModel::Hdl32e];
    let sensor = LiveSensor::of(models[usize::from(*model) % models.len()], None).expect("a model");
    let (most, arrived, mut sent) = (sensor.returns_max(), Instant::now(), 0);
    let (mut assembler, mut number) = (Assembler::new(sensor), 0);
    for &[count, lost, low, high, value] in records.as_chunks().0 {
        number += u32::from(lost);
        for _ in 0..count {
            let mut packet = velodyne(number);
            match packet.get_mut(usize::from(u16::from_le_bytes([low, high]))) {
                Some(byte) => *byte = value,
                None => packet.truncate(usize::from(high) * usize::from(value)),
            }
            assembler.take(&packet, arrived, u64::from(number) * 1_327_000, |sweep| {
                assert!(sweep.data.points.len() <= most, "more returns than there is room for");
            });
            (number, sent) = (number + 1, sent + 1);
        }
    }
    let counts = assembler.counts();
    assert_eq!(counts.packets + counts.foreign + counts.unsound, sent, "{counts:?}");
}

/// Reads bytes as weights of each kind.
pub fn weights(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let _ = background_filter::load(text, LEVELS, &mut vec![0; background_filter::TABLE_WORDS]);
    constancy(text);
    let _ = EncoderWeights::new().load(text, LEVELS);
}

fn constancy(text: &str) {
    let mut weights = vec![0; occupancy_constancy::WEIGHT_WORDS];
    let mut costs = vec![0; occupancy_constancy::SCORES_MAX];
    let _ = occupancy_constancy::load(text, LEVELS, &mut weights, &mut costs);
}
