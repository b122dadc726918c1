#![forbid(unsafe_code)]
//! What targets do with bytes: read them as a recording or as weights. Whatever the bytes are, this
//! ends with an error or a sweep.

use raywake_core::encoder::EncoderWeights;
use raywake_core::stages::{background_filter, occupancy_constancy};
use raywake_io::source::decoder::damaged;
use raywake_io::source::{OpenOptions, SweepData, Unlocated, open};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::{LazyLock, Mutex, PoisonError};
use tempfile::TempDir;

pub mod bundle;
use bundle::Bundle;

/// Maximum number of sweeps read from each recording.
const SWEEPS: usize = 3;
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
