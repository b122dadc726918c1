//! The run loop of `run`, `track` and `map`: the sweeps of a recording, one by one, until the last
//! one or a signal.

use std::ops::Range;
use std::time::Instant;

use raywake_io::source::{Source, SweepData};

use crate::console::{interrupted, listen};
use crate::error::RunError;
use crate::laps::milliseconds;
use crate::progress::Progress;

/// A sweep that has just been read.
pub struct Visit<'a> {
    /// Its index in the recording.
    pub index: usize,
    /// The sweep.
    pub now: &'a SweepData,
    /// The sweep visited before it, if any.
    pub before: Option<&'a SweepData>,
    /// How long reading it took, ms.
    pub read_ms: f64,
}

/// How a session ended.
pub struct End {
    /// A signal came before the last sweep.
    pub interrupted: bool,
    /// The last sweep visited, as it was read.
    pub last: SweepData,
}

/// Reads the sweeps in order and hands each to `visit`. After a signal the sweep in hand is
/// finished and no further one is read.
///
/// # Errors
/// What the source or `visit` returns, at once.
pub fn each_sweep<S: Source + ?Sized>(
    source: &mut S,
    sweeps: Range<usize>,
    quiet: bool,
    mut visit: impl FnMut(&S, &Visit) -> Result<(), RunError>,
) -> Result<End, RunError> {
    listen();
    let (mut now, mut last) = (SweepData::default(), SweepData::default());
    let mut progress = Progress::new(sweeps.len(), quiet);
    for (done, index) in sweeps.enumerate() {
        if interrupted() {
            progress.finish();
            return Ok(End { interrupted: true, last });
        }
        let clock = Instant::now();
        source.read(index, &mut now)?;
        let read_ms = milliseconds(clock);
        visit(source, &Visit { index, now: &now, before: (done > 0).then_some(&last), read_ms })?;
        std::mem::swap(&mut now, &mut last);
        progress.update(done + 1);
    }
    progress.finish();
    Ok(End { interrupted: false, last })
}
