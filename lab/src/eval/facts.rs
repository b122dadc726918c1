//! Facts kept of a drive beside its rows: settings, times, notes.

use super::moving::ReturnCounts;
use super::points::PointScores;
use raywake::laps::Laps;
use raywake_io::Error;
use raywake_io::sink::atomic;
use serde::{Deserialize, Serialize};
use std::fs;
use std::io::Write;
use std::path::Path;

/// Times of one stage.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    /// Its name.
    pub name: String,
    /// One value per pair, ms.
    pub ms: Vec<f64>,
}

/// A picture of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Panel {
    /// File beside the facts.
    pub file: String,
    /// What it shows.
    pub caption: String,
}

/// One evaluated drive.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Facts {
    /// Name of the drive.
    pub drive: String,
    /// Everything that decides its rows; a run with equal settings need not be repeated.
    pub settings: serde_json::Value,
    /// Where objects are labelled; empty if none are.
    pub view: String,
    /// Whether labels come from a simulator, without noise.
    pub exact: bool,
    /// Labelled objects.
    pub tracks: usize,
    /// Boxes of all of them.
    pub boxes: usize,
    /// Sweeps.
    pub sweeps: u64,
    /// Sweeps that completed a pair.
    pub pairs: u64,
    /// Digest of the run.
    pub digest: String,
    /// Times by stage.
    pub stages: Vec<Stage>,
    /// Sum of the stages per pair, ms.
    pub totals: Vec<f64>,
    /// The same without the background filter, if requested.
    pub unfiltered: Vec<f64>,
    /// Returns of the first sweep of each pair.
    pub points: Vec<usize>,
    /// What was left out of data and labels.
    pub notes: Vec<String>,
    /// Scores of single returns, in the order of [`super::points::ESTIMATES`].
    pub scores: [PointScores; 3],
    /// Returns reported as moving, by what they are.
    pub returns: ReturnCounts,
    /// Pictures of its best and worst sweeps.
    pub panels: Vec<Panel>,
    /// Wall time of the evaluation, s.
    pub seconds: f64,
}

impl Facts {
    /// Records the times of a pair.
    pub fn pair(&mut self, points: usize, laps: &Laps) {
        let mut total = 0.0;
        for (name, ms) in laps.stages() {
            total += ms;
            match self.stages.iter_mut().find(|s| s.name == name) {
                Some(stage) => stage.ms.push(ms),
                None => self.stages.push(Stage { name: name.into(), ms: vec![ms] }),
            }
        }
        self.totals.push(total);
        self.points.push(points);
    }

    /// Whether objects are labelled with boxes.
    pub fn has_boxes(&self) -> bool {
        !self.view.is_empty()
    }

    /// Reads the facts of an earlier run.
    pub fn read(path: &Path) -> Result<Facts, Error> {
        let text = fs::read_to_string(path).map_err(Error::reading(path))?;
        let facts: Facts = serde_json::from_str(&text)
            .map_err(|e| Error::input(path, format!("line {}", e.line()), e.to_string()))?;
        if !facts.scores.iter().all(PointScores::are_complete) {
            return Err(Error::input(path, "key `scores`", "is from another version"));
        }
        Ok(facts)
    }

    /// Writes the facts, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let text = serde_json::to_string_pretty(self).expect("plain numbers and text");
        atomic::write(path, |out| out.write_all(text.as_bytes()))
    }
}
