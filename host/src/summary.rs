//! The figures of a run: what `--summary` writes as JSON and what the report prints.

use raywake_core::tracklet::TrackletTurnover;
use serde::{Serialize, Serializer};

use crate::locate::LocatedSweeps;
use crate::order_statistics::Spread;
use crate::statistics::{AGES, Dropped, ResetAt, Statistics};

/// Entries of a JSON object in the order given.
#[derive(Clone, Debug, PartialEq)]
pub struct Ordered<T>(pub Vec<(&'static str, T)>);

impl<T: Serialize> Serialize for Ordered<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

fn by_name<S: Serializer>(counts: &TrackletTurnover, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(counts.counts())
}

/// Tracklets of one age class.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Aged {
    /// After the last sweep.
    pub end: u64,
    /// Mean after a pair of sweeps.
    pub mean: f64,
}

/// The facts and results of a run. Means are per sweep for points and rays, per pair of sweeps for
/// the rest; times are of sweeps that complete a pair, excluding file I/O.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunSummary {
    /// What was run.
    #[serde(flatten)]
    pub facts: Facts,
    /// Sweeps processed.
    pub sweeps: u64,
    /// Of these, sweeps that completed a pair.
    pub pairs: u64,
    /// Digest of all results, 16 hexadecimal digits; see [`Statistics::tracklets`].
    pub digest: String,
    /// Valid flows of all pairs.
    pub valid_flows: u64,
    /// Mean valid flows.
    pub valid_flows_per_sweep: f64,
    /// Mean foreground columns.
    pub foreground_columns: f64,
    /// Mean solid columns.
    pub solid_columns: f64,
    /// Mean returns.
    pub points: f64,
    /// Mean distinct rays.
    pub distinct_rays: f64,
    /// Time of each stage, ms.
    pub stage_ms: Ordered<Spread>,
    /// Time of all stages, ms; null without a pair.
    pub total_ms: Option<Spread>,
    /// Share (0..1) of pairs processed within 100 ms; null without a pair.
    pub share_under_100_ms: Option<f64>,
    /// Mean time to read a sweep, ms.
    pub read_ms: f64,
    /// Mean time to write a sweep's results, ms.
    pub write_ms: f64,
    /// What was dropped.
    pub dropped: Dropped,
    /// Tracklets born and ended.
    #[serde(serialize_with = "by_name")]
    pub tracklet_turnover: TrackletTurnover,
    /// Tracklets by observations after birth.
    pub tracklets_by_age: Ordered<Aged>,
    /// Sweeps without a usable predecessor.
    pub resets: Vec<ResetAt>,
}

/// What was run, and on what.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Facts {
    /// Version of this program.
    pub version: &'static str,
    /// Name of the recording.
    pub source: String,
    /// Name of the profile.
    pub profile: String,
    /// `scalar` or `vulkan`.
    pub backend: &'static str,
    /// Name of the device.
    pub device: String,
    /// Threads that share the CPU's part of a sweep.
    pub threads: usize,
    /// Instruction set used on the CPU.
    pub simd: &'static str,
    /// Where the background filter comes from.
    pub filter: String,
    /// Whether a signal ended the run.
    pub interrupted: bool,
    /// How sweeps were located, and how poses were checked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub registration: Option<LocatedSweeps>,
    /// Bytes allocated on the device, all heaps; 0 for the scalar backend.
    pub device_bytes: u64,
    /// Bytes of host memory held: throughout, or since a device failed.
    pub host_bytes: u64,
    /// Calls of vkAllocateMemory.
    pub vulkan_allocations: u64,
    /// How the device failed, if it did and the scalar backend took over.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub device_failure: Option<String>,
    /// Messages of the validation layer, if enabled.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub validation_messages: Option<Vec<String>>,
}

impl RunSummary {
    /// Assembles the figures.
    pub fn new(facts: Facts, s: &Statistics) -> RunSummary {
        let per = |sum: u64, count: u64| sum as f64 / count.max(1) as f64;
        let spreads = s.stages.iter().filter_map(|(name, ms)| Some((*name, Spread::of(ms)?)));
        let ages = AGES.iter().zip(s.ages_at_end.iter().zip(s.ages_sum));
        let ages =
            ages.map(|((name, _), (&end, sum))| (*name, Aged { end, mean: per(sum, s.pairs) }));
        RunSummary {
            facts,
            sweeps: s.sweeps,
            pairs: s.pairs,
            digest: format!("{:016x}", s.digest.value()),
            valid_flows: s.valid,
            valid_flows_per_sweep: per(s.valid, s.pairs),
            foreground_columns: per(s.foreground, s.pairs),
            solid_columns: per(s.solid, s.pairs),
            points: per(s.points, s.sweeps),
            distinct_rays: per(s.rays, s.sweeps),
            stage_ms: Ordered(spreads.collect()),
            total_ms: Spread::of(&s.totals),
            share_under_100_ms: s.share_within_budget(),
            read_ms: s.read_ms / s.sweeps.max(1) as f64,
            write_ms: s.write_ms / s.sweeps.max(1) as f64,
            dropped: s.dropped,
            tracklet_turnover: s.turnover,
            tracklets_by_age: Ordered(ages.collect()),
            resets: s.resets.clone(),
        }
    }
}
