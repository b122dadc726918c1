//! The thread that writes messages: a slow disk or viewer holds up nothing else.

use std::time::Duration;

use raywake_core::output::{ColumnFlow, KeptPoints, PairFlows, ReturnFlow};
use raywake_core::params::{Profile, SOLID_MAX};
use raywake_core::tracklet::TrackletTurnover;
use raywake_io::Error;
use raywake_io::sink::bag::BagSink;
use raywake_io::source::capture::assembly::LiveSweep;
use raywake_io::source::capture::live::LiveSensor;
use raywake_objects::front_end::TRACKS_MAX;
use raywake_objects::tracked::TrackedObject;

use super::handover::{Fetched, Handover};
use crate::console::warn;

/// Maximum time to wait for something to write.
const POLL: Duration = Duration::from_secs(1);

/// A pair of sweeps, kept for writing.
pub struct RecordedPair {
    first: LiveSweep,
    columns: Vec<ColumnFlow>,
    returns: Vec<ReturnFlow>,
    /// `None` if objects are not tracked.
    objects: Option<heapless::Vec<TrackedObject, TRACKS_MAX>>,
    /// The remaining fields; `None` before the first pair.
    rest: Option<Rest>,
}

struct Rest {
    points: KeptPoints,
    solid: usize,
    dt_s: f64,
    turnover: TrackletTurnover,
    valid: usize,
    foreground_dropped: usize,
}

impl RecordedPair {
    /// Allocates room for a pair.
    pub fn of(sensor: &LiveSensor, profile: &Profile) -> RecordedPair {
        RecordedPair {
            first: LiveSweep::of(sensor),
            columns: Vec::with_capacity(profile.columns().min(SOLID_MAX)),
            returns: Vec::with_capacity(profile.returns()),
            objects: None,
            rest: None,
        }
    }

    /// Copies a pair's flow.
    pub fn keep(&mut self, flows: &PairFlows) {
        let (columns, returns) = flows.points.slices();
        self.columns.clear();
        self.columns.extend_from_slice(columns);
        self.returns.clear();
        self.returns.extend_from_slice(returns);
        let &PairFlows { dt_s, turnover, valid, foreground_dropped, .. } = flows;
        let (points, solid) = (flows.points.keep(), flows.columns.len());
        self.rest = Some(Rest { points, solid, dt_s, turnover, valid, foreground_dropped });
    }

    /// Copies the objects in the pair's first sweep.
    pub fn keep_objects(&mut self, seen: &[TrackedObject]) {
        let kept = self.objects.get_or_insert_default();
        kept.clear();
        // The capacity is the maximum number of tracks.
        let _ = kept.extend_from_slice(seen);
    }

    /// Takes the pair's first sweep, in exchange for a spare.
    pub fn take_first(&mut self, sweep: &mut LiveSweep) {
        std::mem::swap(&mut self.first, sweep);
    }

    /// Writes the pair, if there is one.
    fn write(&self, to: &mut BagSink) -> Option<Result<(), Error>> {
        let Rest { points, solid, dt_s, turnover, valid, foreground_dropped } =
            *self.rest.as_ref()?;
        let first = &self.first.data;
        let flows = PairFlows {
            columns: self.columns.get(..solid)?,
            points: points.over(&self.columns, &self.returns, &first.points),
            dt_s,
            turnover,
            valid,
            foreground_dropped,
        };
        let written = to.pair(first, &flows);
        Some(written.and_then(|()| match &self.objects {
            Some(seen) => to.boxes(first, seen),
            None => Ok(()),
        }))
    }
}

/// The outcome of recording.
#[derive(Debug, Default)]
pub struct RecordingOutcome {
    /// Number of pairs written.
    pub pairs: u64,
    /// Why recording ended early.
    pub failure: Option<Error>,
}

/// Writes pairs until no more come. A failure, such as a full disk, ends only the recording.
pub fn record(
    sink: BagSink,
    pairs: &Handover<RecordedPair>,
    mut spare: RecordedPair,
) -> RecordingOutcome {
    let (mut recorded, mut sink) = (RecordingOutcome::default(), Some(sink));
    loop {
        match pairs.fetch(&mut spare, POLL) {
            Fetched::Value => {
                let Some(open) = &mut sink else { continue };
                match spare.write(open) {
                    Some(Err(e)) => {
                        fail(&mut recorded, e);
                        sink.take().into_iter().for_each(keep);
                    }
                    _ => recorded.pairs += 1,
                }
            }
            Fetched::Nothing => {}
            Fetched::Closed => break,
        }
    }
    if let Some(Err(e)) = sink.map(BagSink::finish) {
        fail(&mut recorded, e);
    }
    recorded
}

/// A sensor's data cannot be had again: what was recorded is kept.
fn keep(sink: BagSink) {
    match sink.keep_incomplete() {
        Some(Ok(path)) => warn(&format!("what was recorded before is in {}", path.display())),
        Some(Err(e)) => warn(&e.to_string()),
        None => {}
    }
}

fn fail(recorded: &mut RecordingOutcome, error: Error) {
    warn(&format!("{error}: recording stopped"));
    recorded.failure = Some(error);
}
