//! Counts and times of a run, sweep by sweep.

use std::fmt;

use raywake_core::continuity::Reset;
use raywake_core::digest::Digest;
use raywake_core::dropped::DroppedReturns;
use raywake_core::output::PairFlows;
use raywake_core::output::TrackletState;
use raywake_core::tracklet::TrackletTurnover;
use serde::{Serialize, Serializer};

use crate::drive::Stepped;
use crate::laps::Laps;
use raywake_io::source::SweepData;

/// Age classes of tracklets: name and minimum age.
pub const AGES: [(&str, u32); 5] = [("0", 0), ("1-2", 1), ("3-5", 3), ("6-9", 6), ("10+", 10)];

/// Time budget of a sweep, ms: sweeps come at 10 Hz.
pub const BUDGET_MS: f64 = 100.0;

/// A sweep that had no usable predecessor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ResetAt {
    /// Index of the sweep in the recording.
    pub sweep: usize,
    /// Frame number or timestamp of the sweep.
    pub frame: u64,
    /// `first`, `backwards`, `gap`, `jump` or `spin`.
    pub reason: &'static str,
    /// The reason in words, with its value.
    pub text: String,
}

impl ResetAt {
    fn new(sweep: usize, frame: u64, reset: Reset) -> ResetAt {
        let (reason, text) = describe_reset(reset);
        ResetAt { sweep, frame, reason, text }
    }
}

/// Returns a key for a reset, and its reason in words.
pub fn describe_reset(reset: Reset) -> (&'static str, String) {
    match reset {
        Reset::First => ("first", "first sweep".to_string()),
        Reset::Backwards(dt) => ("backwards", format!("{dt:.3} s after the previous sweep")),
        Reset::Gap(dt) => ("gap", format!("gap of {dt:.3} s")),
        Reset::Jump(mps) => ("jump", format!("poses jump at {mps:.0} m/s")),
        Reset::Spin(radps) => ("spin", format!("poses turn at {radps:.1} rad/s")),
    }
}

/// What was dropped, and why. Counts over all sweeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Returns dropped by preparation.
    pub returns: DroppedReturns,
    /// Rows in the source's files that lack a coordinate.
    pub null_rows: u64,
    /// Sweeps that are missing according to the source's frame numbers.
    pub missing_sweeps: u64,
    /// Solid columns beyond the capacity for foreground.
    pub foreground: u64,
    /// Returns beyond the capacity of the refinement.
    pub unrefined: u64,
}

impl Dropped {
    /// Returns every count with its key and a name for the user.
    pub fn counts(&self) -> impl Iterator<Item = (&'static str, &'static str, u64)> {
        self.returns.counts().into_iter().chain([
            ("null_rows", "null rows", self.null_rows),
            ("missing_sweeps", "missing sweeps", self.missing_sweeps),
            ("foreground", "foreground columns over capacity", self.foreground),
            ("unrefined", "returns over the refinement's capacity", self.unrefined),
        ])
    }
}

impl Serialize for Dropped {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.counts().map(|(key, _, count)| (key, count)))
    }
}

impl fmt::Display for Dropped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let some = self.counts().filter(|c| c.2 > 0).map(|(_, what, n)| format!("{n} {what}"));
        let some = some.collect::<Vec<_>>().join(", ");
        f.write_str(if some.is_empty() { "none" } else { &some })
    }
}

/// Everything counted and timed. Times cover only sweeps that complete a pair; a sweep after a
/// reset, and the first one, yields no flow and is not timed.
#[derive(Debug, Default)]
pub struct Statistics {
    /// Sweeps processed.
    pub sweeps: u64,
    /// Sweeps that completed a pair.
    pub pairs: u64,
    /// Returns of all sweeps.
    pub points: u64,
    /// Distinct rays of all sweeps.
    pub rays: u64,
    /// Solid columns of all pairs.
    pub solid: u64,
    /// Foreground columns of all pairs.
    pub foreground: u64,
    /// Valid flows of all pairs.
    pub valid: u64,
    /// Times by stage, in the order of the first pair: name, and ms for every pair.
    pub stages: Vec<(&'static str, Vec<f64>)>,
    /// Sums of the stages of each pair, ms.
    pub totals: Vec<f64>,
    /// Time to read sweeps, ms.
    pub read_ms: f64,
    /// Time to write results, ms.
    pub write_ms: f64,
    /// What was dropped.
    pub dropped: Dropped,
    /// Tracklets born and ended.
    pub turnover: TrackletTurnover,
    /// Tracklets after the last sweep, by class of [`AGES`].
    pub ages_at_end: [u64; AGES.len()],
    /// Tracklets after every sweep that completed a pair.
    pub ages_sum: [u64; AGES.len()],
    /// Resets.
    pub resets: Vec<ResetAt>,
    /// Digest of all results, see [`Statistics::tracklets`].
    pub digest: Digest,
}

impl Statistics {
    /// Counts a sweep, and adds its columns and returns to the digest.
    pub fn sweep(&mut self, index: usize, data: &SweepData, stepped: &Stepped) {
        self.dropped.returns += stepped.output.dropped;
        self.dropped.unrefined += stepped.output.unrefined as u64;
        self.dropped.null_rows += u64::from(data.dropped.null_rows);
        if self.sweeps > 0 {
            self.dropped.missing_sweeps += data.dropped.sweeps_before;
        }
        self.sweeps += 1;
        self.points += data.points.len() as u64;
        self.rays += stepped.output.rays as u64;
        if let Some(reset) = stepped.output.reset {
            self.resets.push(ResetAt::new(index, data.frame, reset));
        }
        if let Some(flows) = &stepped.output.flows {
            self.pair(flows, stepped.output.foreground);
            self.times(&stepped.laps);
        }
    }

    fn pair(&mut self, flows: &PairFlows, foreground: usize) {
        self.pairs += 1;
        self.solid += flows.columns.len() as u64;
        self.foreground += foreground as u64;
        self.valid += flows.valid as u64;
        self.dropped.foreground += flows.foreground_dropped as u64;
        self.turnover += flows.turnover;
        flows.columns.iter().for_each(|c| self.digest.column(c));
        flows.points.iter().for_each(|p| self.digest.point(&p));
    }

    fn times(&mut self, laps: &Laps) {
        let mut total = 0.0;
        for (name, ms) in laps.stages() {
            total += ms;
            match self.stages.iter_mut().find(|s| s.0 == name) {
                Some((_, times)) => times.push(ms),
                None => self.stages.push((name, vec![ms])),
            }
        }
        self.totals.push(total);
    }

    /// Counts the tracklets after a sweep.
    ///
    /// The digest covers every column of a pair in the order of the output, every return in the
    /// order of the sweep, then every tracklet after the pair in the order of the output, pair by
    /// pair.
    pub fn tracklets(&mut self, tracklets: &[TrackletState], paired: bool) {
        self.ages_at_end = [0; AGES.len()];
        for tracklet in tracklets {
            let class = AGES.iter().rposition(|(_, least)| tracklet.age >= *least);
            self.ages_at_end[class.unwrap_or(0)] += 1;
            self.digest.tracklet(tracklet);
        }
        if paired {
            let sums = self.ages_sum.iter_mut().zip(self.ages_at_end);
            sums.for_each(|(sum, n)| *sum += n);
        }
    }

    /// Returns the share of pairs within [`BUDGET_MS`]; `None` without pairs.
    pub fn share_within_budget(&self) -> Option<f64> {
        let within = self.totals.iter().filter(|ms| **ms < BUDGET_MS).count();
        (!self.totals.is_empty()).then(|| within as f64 / self.totals.len() as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ages() {
        let mut s = Statistics::default();
        let aged = |age| TrackletState { age, ..TrackletState::default() };
        let all: Vec<_> = [0, 1, 2, 3, 5, 6, 9, 10, 99].map(aged).into();
        s.tracklets(&all, true);
        s.tracklets(&all[..1], true);
        s.tracklets(&[], false);
        assert_eq!((s.ages_sum, s.ages_at_end), ([2, 2, 2, 2, 2], [0; 5]));
    }
}
