//! Where what is found goes: datagrams, a recording, a digest.

use std::time::{Duration, Instant};

use raywake_core::digest::Digest;
use raywake_core::output::{ColumnFlow, PairFlows};
use raywake_io::source::capture::assembly::LiveSweep;
use raywake_objects::tracked::TrackedObject;

use super::handover::Handover;
use super::recorder::RecordedPair;
use super::stream::{FlowStream, SentSweep};

/// Where what is found goes.
pub struct Outlets<'a> {
    pub stream: Option<FlowStream>,
    /// Where pairs go that are recorded, and the next one.
    pub recording: Option<(&'a Handover<RecordedPair>, RecordedPair)>,
    /// Of all results but objects, where it is wanted.
    pub digest: Option<Digest>,
}

/// What became of a pair's flow.
#[derive(Clone, Copy, Debug, Default)]
pub struct FlowGone {
    /// Columns that move.
    pub moving: usize,
    /// How long was spent on what nobody waits for.
    pub aside: Duration,
}

impl Outlets<'_> {
    /// The flow of a pair with its first sweep.
    pub fn flow(&mut self, first: &LiveSweep, flows: &PairFlows) -> FlowGone {
        let moves = |column: &&ColumnFlow| column.velocity_world_mps != [0.0; 2];
        let columns = flows.columns.iter().filter(moves);
        let moving = columns.clone().count();
        if let Some(stream) = &mut self.stream {
            stream.columns(&sent_sweep(first), columns);
        }
        // Now, as the next borrow of the drive ends the flow.
        let clock = Instant::now();
        if let Some((_, kept)) = &mut self.recording {
            kept.keep(flows);
        }
        if let Some(digest) = &mut self.digest {
            flows.columns.iter().for_each(|c| digest.column(c));
            flows.points.iter().for_each(|p| digest.point(&p));
        }
        FlowGone { moving, aside: clock.elapsed() }
    }

    /// The objects in a pair's first sweep.
    pub fn objects(&mut self, first: &LiveSweep, seen: &[TrackedObject]) {
        if let Some(stream) = &mut self.stream {
            stream.objects(&sent_sweep(first), first.data.stamp_s, seen.iter());
        }
        if let Some((_, kept)) = &mut self.recording {
            kept.keep_objects(seen);
        }
    }

    /// Hands on a pair whose flow is kept, for another sweep of no meaning in place of its first.
    pub fn record(&mut self, first: &mut LiveSweep) {
        let Some((pairs, kept)) = &mut self.recording else { return };
        kept.take_first(first);
        pairs.put(kept);
    }

    /// Datagrams that the system did not take.
    pub fn unsent(&self) -> u64 {
        self.stream.as_ref().map_or(0, FlowStream::unsent)
    }

    /// Pairs that were replaced before they were recorded.
    pub fn unrecorded(&self) -> u64 {
        self.recording.as_ref().map_or(0, |(pairs, _)| pairs.replaced())
    }
}

pub fn sent_sweep(sweep: &LiveSweep) -> SentSweep {
    let LiveSweep { data, stamp_ns, .. } = sweep;
    SentSweep { number: data.frame, stamp_ns: *stamp_ns, pose: data.world_from_vehicle }
}
