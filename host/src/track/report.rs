//! The figures of a tracking run.

use std::fmt::Write;
use std::time::Instant;

use raywake_core::digest::Digest;
use raywake_core::encoder::ColumnClass;
use raywake_objects::ObjectState;
use raywake_objects::front_end::TrackingCounts;
use serde::{Serialize, Serializer};

use super::tracker::{Ended, Tracker, moved_m};
use super::write::Files;
use crate::args::FrontEndKind;
use crate::error::RunError;
use crate::order_statistics::Spread;
use crate::statistics::Dropped;
use raywake_io::Error;
use raywake_io::source::SweepData;

const LISTED: usize = 20;

fn by_name<S: Serializer>(counts: &TrackingCounts, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(counts.named())
}

/// A track at its end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Line {
    pub track: u32,
    /// Time of its first centroid, s.
    pub from_s: f64,
    /// Time from the first to the last one, s.
    pub for_s: f64,
    /// Centroids observed.
    pub updates: u32,
    pub returns: u64,
    /// The class the encoder assigns to most of its returns; null if unknown.
    pub class: Option<&'static str>,
    /// Length, width and height of its box, m.
    pub size_m: [f32; 3],
    /// Mean P(moves) of its returns over its life; null without the flow.
    pub p_moves: Option<f32>,
    /// Distance from the first position of the estimate to the last, m.
    pub moved_m: f64,
    /// Speed of the estimate at the end, m/s.
    pub speed_mps: f64,
    /// Mean distance of a return from the model, m.
    pub residual_m: f64,
    pub iterations: usize,
}

/// Counts of a run in progress.
#[derive(Default)]
pub struct Report {
    pub counts: TrackingCounts,
    /// Tracks that a signal left without an estimate.
    unestimated: u64,
    dropped: Dropped,
    sweeps: u64,
    steps: Vec<f64>,
    estimates: Vec<f64>,
    lines: Vec<Line>,
    digest: Digest,
}

impl Report {
    /// Counts a step of the front end that began at `clock`.
    pub fn step(&mut self, counts: &TrackingCounts, clock: Instant) {
        self.steps.push(clock.elapsed().as_secs_f64() * 1e3);
        self.counts += *counts;
        self.dropped.returns += counts.dropped;
    }

    /// Time of the last step, ms.
    pub fn last_ms(&self) -> f64 {
        self.steps.last().copied().unwrap_or_default()
    }

    /// Counts a sweep that was read.
    pub fn read(&mut self, sweep: &SweepData) {
        self.dropped.null_rows += u64::from(sweep.dropped.null_rows);
        if self.sweeps > 0 {
            self.dropped.missing_sweeps += sweep.dropped.sweeps_before;
        }
        self.sweeps += 1;
    }

    /// Counts the tracks that ended in the last step, and writes their files; `tell` is called for
    /// each.
    pub fn ended(
        &mut self,
        tracker: &mut Tracker,
        files: &mut Files,
        mut tell: impl FnMut(),
    ) -> Result<(), RunError> {
        let left = tracker.ended(|ended| {
            tell();
            self.track(ended, files)
        })?;
        self.unestimated += left;
        Ok(())
    }

    /// Counts an ended track, and writes its files. The digest covers its number, anchor and start,
    /// then each state of its history with the estimate at that time, then the estimates of every
    /// sweep.
    fn track(&mut self, ended: &Ended, files: &mut Files) -> Result<(), Error> {
        let Ended { track, estimator, shape, report, lag, milliseconds } = *ended;
        self.estimates.push(milliseconds);
        self.digest.word(track.id);
        track.anchor.iter().for_each(|v| self.digest.double(*v));
        self.digest.double(track.start_s);
        for filter in track.history() {
            self.state(filter);
            self.state(&estimator.state(filter.time_s));
        }
        lag.into_iter().flatten().for_each(|state| self.state(state));
        let for_s = track.last_s() - track.start_s;
        self.lines.push(Line {
            track: track.id,
            from_s: track.start_s,
            for_s,
            updates: track.observations,
            returns: track.returns_seen(),
            class: track.class().map(ColumnClass::name),
            size_m: shape.size,
            p_moves: mean_known(track.p_moves()),
            moved_m: moved_m(track, estimator),
            speed_mps: estimator.state(for_s).speed,
            residual_m: report.costs.last().map_or(0.0, |c| c.residual_m),
            iterations: report.iterations,
        });
        files.track(ended)
    }

    fn state(&mut self, s: &ObjectState) {
        let [x, y, z] = s.position;
        let numbers = [s.time_s, x, y, z, s.heading, s.speed, s.climb, s.turn_rate];
        numbers.into_iter().for_each(|v| self.digest.double(v));
    }

    /// Assembles the figures.
    pub fn summary(self, source: &str, kind: FrontEndKind, stopped: bool) -> TrackSummary {
        TrackSummary {
            version: env!("CARGO_PKG_VERSION"),
            source: source.to_string(),
            front_end: match kind {
                FrontEndKind::Variance => "variance",
                FrontEndKind::Flow => "flow",
            },
            interrupted: stopped || self.unestimated > 0,
            sweeps: self.sweeps,
            digest: format!("{:016x}", self.digest.value()),
            step_ms: Spread::of(&self.steps),
            estimate_ms: Spread::of(&self.estimates),
            tally: self.counts,
            unestimated: self.unestimated,
            dropped: self.dropped,
            tracks: self.lines,
        }
    }
}

/// Mean of the known values.
fn mean_known(p_moves: &[f32]) -> Option<f32> {
    let known = || p_moves.iter().filter(|p| !p.is_nan());
    let count = known().count();
    (count > 0).then(|| known().sum::<f32>() / count as f32)
}

/// The facts and results of a tracking run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrackSummary {
    /// Version of this program.
    pub version: &'static str,
    /// Name of the recording.
    pub source: String,
    /// `variance` or `flow`.
    pub front_end: &'static str,
    /// Whether a signal ended the run.
    pub interrupted: bool,
    /// Sweeps processed.
    pub sweeps: u64,
    /// Digest of all tracks and their estimates, 16 hexadecimal digits.
    pub digest: String,
    /// Time per sweep, ms: flow, front end and fixed lag, as far as they are asked for. Null
    /// without a sweep.
    pub step_ms: Option<Spread>,
    /// Time to estimate a track at its end, ms; null without a track.
    pub estimate_ms: Option<Spread>,
    /// Counts over all sweeps, except those of dropped returns.
    #[serde(serialize_with = "by_name")]
    pub tally: TrackingCounts,
    /// Tracks left out because a signal came before their estimate.
    pub unestimated: u64,
    /// What was dropped.
    pub dropped: Dropped,
    /// Every track that was seen often enough, in the order in which they ended.
    pub tracks: Vec<Line>,
}

impl TrackSummary {
    /// Formats the summary for the user.
    pub fn text(&self) -> String {
        let mut out = String::new();
        // Writing to a string cannot fail.
        let _ = self.print(&mut out);
        out
    }

    fn print(&self, out: &mut String) -> std::fmt::Result {
        let end = match (self.interrupted, self.unestimated) {
            (false, 0) => String::new(),
            (true, 0) => ", INTERRUPTED".into(),
            (_, left) => format!(", INTERRUPTED before {left} estimates"),
        };
        let listed = self.tracks.len() as u64 + self.unestimated;
        let brief = self.tally.ended.saturating_sub(listed);
        writeln!(
            out,
            "\n{} sweeps, {} tracks ({brief} omitted as too short or not objects: see --all){end}",
            self.sweeps,
            self.tracks.len()
        )?;
        self.longest(out)?;
        for (what, spread) in [("sweep", &self.step_ms), ("estimate", &self.estimate_ms)] {
            if let Some(t) = spread {
                writeln!(out, "{what:10} {}", t.line(2))?;
            }
        }
        let t = &self.tally;
        writeln!(
            out,
            "segments   {} candidates, {} too small, {} too large",
            t.segments, t.too_small, t.too_large
        )?;
        writeln!(
            out,
            "tracks     {} born, {} updated, {} coasting, {} ended because time went backwards",
            t.born, t.updated, t.waiting, t.reset
        )?;
        writeln!(
            out,
            "dropped    {}; over capacity: {} object returns, {} segments, {} tracks",
            self.dropped, t.unchunked, t.unlisted, t.unborn
        )?;
        writeln!(out, "digest     {}", self.digest)
    }

    /// Lists the tracks observed most often.
    fn longest(&self, out: &mut String) -> std::fmt::Result {
        let mut lines: Vec<&Line> = self.tracks.iter().collect();
        lines.sort_by_key(|l| (u32::MAX - l.updates, l.track));
        let head = ["track", "start s", "s", "updates", "returns", "dist m", "m/s", "resid m"];
        let head = head.map(|h| format!("{h:>8}")).join("");
        writeln!(out, "\n{head}  {:16}class", "l x w x h, m")?;
        for l in lines.iter().take(LISTED) {
            write!(out, "{:8}{:8.2}{:8.2}{:8}", l.track, l.from_s, l.for_s, l.updates)?;
            let (moved, speed, residual) = (l.moved_m, l.speed_mps, l.residual_m);
            write!(out, "{:8}{moved:8.2}{speed:8.2}{residual:8.3}", l.returns)?;
            let size = l.size_m.map(|v| format!("{v:.1}")).join(" x ");
            writeln!(out, "  {size:16}{}", l.class.unwrap_or("-"))?;
        }
        let rest = lines.len().saturating_sub(LISTED);
        if rest > 0 { writeln!(out, "and {rest} more\n") } else { writeln!(out) }
    }
}
