//! What is counted while sweeps come, and what is told of it.

use raywake_core::continuity::Reset;
use raywake_core::dropped::DroppedReturns;
use raywake_core::output::SweepOutput;
use raywake_io::source::capture::assembly::PacketCounts;
use raywake_objects::front_end::TrackingCounts;
use raywake_objects::tracked::TrackedObject;
use serde::{Serialize, Serializer};

use super::locating::LocatedCounts;
use super::poses::PoseCounts;
use crate::latency::{Latencies, LatencyFigures};

/// Counted sweep by sweep. Nothing is allocated for it.
pub struct LiveStatistics {
    pub counts: SweepCounts,
    pub dropped: DroppedReturns,
    pub latencies: Latencies,
}

/// What became of sweeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SweepCounts {
    /// Sweeps whose flow was computed, or that had no usable predecessor.
    pub done: u64,
    /// Of these, sweeps that completed a pair.
    pub pairs: u64,
    /// Left out, as a newer one came before they were begun.
    pub left_out: u64,
    /// Whose flow came later than the deadline, after the first pair.
    pub late: u64,
    /// Left out before all was allocated.
    pub before_start: u64,
    /// That lack packets.
    pub incomplete: u64,
    /// Turns that are missing between others.
    pub missing: u64,
    /// Without a usable predecessor, the first apart.
    pub resets: u64,
    /// Columns that were put out as moving.
    pub moving_columns: u64,
    /// Objects that were put out as moving.
    pub moving_objects: u64,
    /// Times that no sweep came for a second.
    pub pauses: u64,
    /// Sweeps in which memory was allocated: a defect of this program.
    pub allocating: u64,
    /// Pairs that were recorded.
    pub recorded: u64,
    /// Pairs that were not, as the disk or a viewer was slower.
    pub unrecorded: u64,
    /// Datagrams that the system did not send.
    pub unsent_datagrams: u64,
}

impl LiveStatistics {
    /// Nothing so far.
    pub fn new() -> LiveStatistics {
        LiveStatistics {
            counts: SweepCounts::default(),
            dropped: DroppedReturns::default(),
            latencies: Latencies::default(),
        }
    }

    /// Counts a sweep that was done.
    pub fn sweep(&mut self, output: &SweepOutput) {
        let counts = &mut self.counts;
        self.dropped += output.dropped;
        counts.done += 1;
        counts.pairs += u64::from(output.flows.is_some());
        let reset = output.reset.is_some_and(|reset| reset != Reset::First);
        counts.resets += u64::from(reset);
    }

    /// Counts the objects of a sweep.
    pub fn objects(&mut self, seen: &[TrackedObject]) {
        let moving = seen.iter().filter(|object| object.velocity.is_some());
        self.counts.moving_objects += moving.count() as u64;
    }

    /// Counts the latency of a sweep that may take so long.
    pub fn latency(&mut self, ms: f64, deadline_ms: f64) {
        self.latencies.add(ms);
        self.counts.late += u64::from(ms > deadline_ms);
    }
}

/// What a run was and what came of it.
#[derive(Debug, Serialize)]
pub struct LiveSummary {
    /// Version of this program.
    pub version: &'static str,
    /// Model of the sensor, and its address, where one sent.
    pub sensor: String,
    pub sender: Option<String>,
    pub profile: String,
    pub backend: &'static str,
    pub device: String,
    pub threads: usize,
    pub simd: &'static str,
    /// Time that a sweep takes, and may take until its flow is there, ms.
    pub turn_ms: f64,
    pub deadline_ms: f64,
    /// How long it ran, s.
    pub seconds: f64,
    pub packets: PacketCounts,
    /// Datagrams that the system threw away as they were not fetched in time; null where it does
    /// not tell.
    pub overflowed: Option<u64>,
    /// Bytes of packets that it holds.
    pub held_bytes: usize,
    pub sweeps: SweepCounts,
    /// Number of the first sweep done, and of the last.
    pub frames: Option<[u64; 2]>,
    /// Returns left out.
    #[serde(serialize_with = "by_name")]
    pub dropped_returns: DroppedReturns,
    /// What following objects did, where it was asked for.
    #[serde(serialize_with = "tracking_by_name")]
    pub tracking: Option<TrackingCounts>,
    pub located: LocatedCounts,
    /// Where poses come.
    pub poses: Option<PoseCounts>,
    /// From the arrival of a sweep's last packet until its flow is there and sent, ms; after the
    /// first pair.
    pub latency_ms: Option<LatencyFigures>,
    /// How the device failed, where it did, and the scalar backend took its place.
    pub device_failure: Option<String>,
    /// Why recording ended early.
    pub recording_failure: Option<String>,
    /// Digest of all results, of a replay.
    pub digest: Option<String>,
}

fn by_name<S: Serializer>(counts: &DroppedReturns, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(counts.counts().iter().map(|(key, _, count)| (key, count)))
}

fn tracking_by_name<S: Serializer>(
    counts: &Option<TrackingCounts>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(counts.iter().flat_map(TrackingCounts::named))
}

impl LiveSummary {
    /// For people.
    pub fn text(&self) -> String {
        let SweepCounts { done, pairs, left_out, late, incomplete, resets, .. } = self.sweeps;
        let PacketCounts { packets, missing, duplicates, reordered, foreign, .. } = self.packets;
        let overflowed = self.overflowed.map_or("unknown".into(), |n| n.to_string());
        let latency = self.latency_ms.map_or("none".into(), |latency| latency.line());
        let digest = self.digest.as_ref().map_or(String::new(), |d| format!("digest {d}\n"));
        format!(
            "{:.1} s: {done} sweeps, {pairs} pairs; {left_out} left out, {late} later than \
             {:.0} ms, {incomplete} incomplete, {resets} resets\n\
             packets: {packets}, missing {missing} (thrown away here: {overflowed}), again \
             {duplicates}, out of order {reordered}; foreign datagrams {foreign}\n\
             latency from the last packet to flow: {latency}\n{digest}",
            self.seconds, self.deadline_ms
        )
    }
}
