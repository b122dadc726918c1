//! The statistics of a live run, and their summary.

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

/// Statistics updated sweep by sweep, without allocation.
pub struct LiveStatistics {
    pub counts: SweepCounts,
    pub dropped: DroppedReturns,
    pub latencies: Latencies,
}

/// Counts of sweeps by outcome.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SweepCounts {
    /// Sweeps whose flow was computed, or that had no usable predecessor.
    pub done: u64,
    /// Of these, sweeps that completed a pair.
    pub pairs: u64,
    /// Sweeps dropped, as a newer one arrived before they were begun.
    pub left_out: u64,
    /// Sweeps whose flow was later than the deadline, after the first pair.
    pub late: u64,
    /// Sweeps dropped before everything was allocated.
    pub before_start: u64,
    /// Sweeps that lack packets.
    pub incomplete: u64,
    /// Revolutions missing between others.
    pub missing: u64,
    /// Sweeps without a usable predecessor, except the first.
    pub resets: u64,
    /// Columns reported as moving.
    pub moving_columns: u64,
    /// Objects reported as moving.
    pub moving_objects: u64,
    /// Number of times that no sweep arrived for a second.
    pub pauses: u64,
    /// Sweeps in which memory was allocated, which is a bug.
    pub allocating: u64,
    /// Pairs recorded.
    pub recorded: u64,
    /// Pairs not recorded, as the disk or a viewer was too slow.
    pub unrecorded: u64,
    /// Datagrams that the system did not send.
    pub unsent_datagrams: u64,
}

impl LiveStatistics {
    /// Creates empty statistics.
    pub fn new() -> LiveStatistics {
        LiveStatistics {
            counts: SweepCounts::default(),
            dropped: DroppedReturns::default(),
            latencies: Latencies::default(),
        }
    }

    /// Counts a processed sweep.
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

    /// Counts the latency of a sweep, given its deadline.
    pub fn latency(&mut self, ms: f64, deadline_ms: f64) {
        self.latencies.add(ms);
        self.counts.late += u64::from(ms > deadline_ms);
    }
}

/// The facts and results of a live run.
#[derive(Debug, Serialize)]
pub struct LiveSummary {
    /// Version of this program.
    pub version: &'static str,
    /// Model of the sensor, and its address if it sent anything.
    pub sensor: String,
    pub sender: Option<String>,
    pub profile: String,
    pub backend: &'static str,
    pub device: String,
    pub threads: usize,
    pub simd: &'static str,
    /// Duration of a revolution, and maximum latency of a sweep's flow, ms.
    pub turn_ms: f64,
    pub deadline_ms: f64,
    /// Duration of the run, s.
    pub seconds: f64,
    pub packets: PacketCounts,
    /// Datagrams that the system dropped because they were not fetched in time; null if unknown.
    pub overflowed: Option<u64>,
    /// Size of the system's receive buffer, bytes.
    pub held_bytes: usize,
    pub sweeps: SweepCounts,
    /// Numbers of the first and the last sweep processed.
    pub frames: Option<[u64; 2]>,
    /// Returns dropped.
    #[serde(serialize_with = "by_name")]
    pub dropped_returns: DroppedReturns,
    /// Counts of object tracking, if asked for.
    #[serde(serialize_with = "tracking_by_name")]
    pub tracking: Option<TrackingCounts>,
    pub located: LocatedCounts,
    /// Counts of received poses, if poses are received.
    pub poses: Option<PoseCounts>,
    /// Time from the arrival of a sweep's last packet until its flow is computed and sent, ms;
    /// after the first pair.
    pub latency_ms: Option<LatencyFigures>,
    /// How the device failed, if it did and the scalar backend took over.
    pub device_failure: Option<String>,
    /// Why recording ended early.
    pub recording_failure: Option<String>,
    /// Digest of all results of a replay.
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
    /// Formats the summary for the user.
    pub fn text(&self) -> String {
        let SweepCounts { done, pairs, left_out, late, incomplete, resets, .. } = self.sweeps;
        let PacketCounts { packets, missing, duplicates, reordered, foreign, .. } = self.packets;
        let overflowed = self.overflowed.map_or("unknown".into(), |n| n.to_string());
        let latency = self.latency_ms.map_or("none".into(), |latency| latency.line());
        let located = self.located.registration.map_or(String::new(), |located| located.text());
        let digest = self.digest.as_ref().map_or(String::new(), |d| format!("digest {d}\n"));
        format!(
            "{:.1} s: {done} sweeps, {pairs} pairs; {left_out} dropped, {late} later than \
             {:.0} ms, {incomplete} incomplete, {resets} resets\n\
             packets: {packets}, missing {missing} (dropped by this system: {overflowed}), \
             duplicate {duplicates}, out of order {reordered}; foreign datagrams {foreign}\n\
             {located}latency from the last packet to flow: {latency}\n{digest}",
            self.seconds, self.deadline_ms
        )
    }
}
