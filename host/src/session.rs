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
    pub index: usize,
    pub now: &'a SweepData,
    /// The sweep visited before it, if any.
    pub before: Option<&'a SweepData>,
    pub read_ms: f64,
}

pub struct SessionEnd {
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
) -> Result<SessionEnd, RunError> {
    listen();
    let (mut now, mut last) = (SweepData::default(), SweepData::default());
    let mut progress = Progress::new(sweeps.len(), quiet);
    for (done, index) in sweeps.enumerate() {
        if interrupted() {
            progress.finish();
            return Ok(SessionEnd { interrupted: true, last });
        }
        let clock = Instant::now();
        source.read(index, &mut now)?;
        let read_ms = milliseconds(clock);
        visit(source, &Visit { index, now: &now, before: (done > 0).then_some(&last), read_ms })?;
        std::mem::swap(&mut now, &mut last);
        progress.update(done + 1);
    }
    progress.finish();
    Ok(SessionEnd { interrupted: false, last })
}
