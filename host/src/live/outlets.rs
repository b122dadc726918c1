//! Where results go: datagrams, a recording, a digest.

use std::time::{Duration, Instant};

use raywake_core::digest::Digest;
use raywake_core::output::{ColumnFlow, PairFlows};
use raywake_io::source::capture::assembly::LiveSweep;
use raywake_objects::tracked::TrackedObject;

use super::handover::Handover;
use super::recorder::RecordedPair;
use super::stream::{FlowStream, SentSweep};

/// Where results go.
pub struct Outlets<'a> {
    pub stream: Option<FlowStream>,
    /// The queue of pairs to record, and the next one.
    pub recording: Option<(&'a Handover<RecordedPair>, RecordedPair)>,
    /// Digest of all results except objects, if wanted.
    pub digest: Option<Digest>,
}

/// Facts about a pair's flow that was passed on.
#[derive(Clone, Copy, Debug, Default)]
pub struct SentFlow {
    /// Columns that move.
    pub moving: usize,
    /// Time spent on output that nobody waits for.
    pub aside: Duration,
}

impl Outlets<'_> {
    /// Passes on the flow of a pair with its first sweep.
    pub fn flow(&mut self, first: &LiveSweep, flows: &PairFlows) -> SentFlow {
        let moves = |column: &&ColumnFlow| column.velocity_world_mps != [0.0; 2];
        let columns = flows.columns.iter().filter(moves);
        let moving = columns.clone().count();
        if let Some(stream) = &mut self.stream {
            stream.columns(&sent_sweep(first), columns);
        }
        // Now, as the next borrow of the drive ends the flow's.
        let clock = Instant::now();
        if let Some((_, kept)) = &mut self.recording {
            kept.keep(flows);
        }
        if let Some(digest) = &mut self.digest {
            flows.columns.iter().for_each(|c| digest.column(c));
            flows.points.iter().for_each(|p| digest.point(&p));
        }
        SentFlow { moving, aside: clock.elapsed() }
    }

    /// Passes on the objects in a pair's first sweep.
    pub fn objects(&mut self, first: &LiveSweep, seen: &[TrackedObject]) {
        if let Some(stream) = &mut self.stream {
            stream.objects(&sent_sweep(first), first.data.stamp_s, seen.iter());
        }
        if let Some((_, kept)) = &mut self.recording {
            kept.keep_objects(seen);
        }
    }

    /// Passes on a pair whose flow is kept; its first sweep is exchanged for a spare.
    pub fn record(&mut self, first: &mut LiveSweep) {
        let Some((pairs, kept)) = &mut self.recording else { return };
        kept.take_first(first);
        pairs.put(kept);
    }

    /// Number of datagrams that the system did not accept.
    pub fn unsent(&self) -> u64 {
        self.stream.as_ref().map_or(0, FlowStream::unsent)
    }

    /// Number of pairs replaced before they were recorded.
    pub fn unrecorded(&self) -> u64 {
        self.recording.as_ref().map_or(0, |(pairs, _)| pairs.replaced())
    }
}

pub fn sent_sweep(sweep: &LiveSweep) -> SentSweep {
    let LiveSweep { data, stamp_ns, .. } = sweep;
    SentSweep { number: data.frame, stamp_ns: *stamp_ns, pose: data.world_from_vehicle }
}
