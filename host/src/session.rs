//! The run loop of `run`, `track`, `map` and `odometry`: the sweeps of a recording, one by one,
//! until the last one or a signal. If the recording has no poses, or poor ones, each sweep is
//! located by registration.

use std::ops::Range;
use std::time::Instant;

use raywake_io::source::{Source, SweepData};

use crate::console::{interrupted, listen, say};
use crate::error::RunError;
use crate::laps::milliseconds;
use crate::locate::{LocatedSweeps, Locator};
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
    /// Whether a signal came before the last sweep.
    pub interrupted: bool,
    /// The last sweep visited.
    pub last: SweepData,
    /// How sweeps were located, unless the source's poses are trusted.
    pub located: Option<LocatedSweeps>,
}

/// Reads the sweeps in order and passes each to `visit`. After a signal the current sweep is
/// finished and no further one is read.
///
/// # Errors
/// The first error of the source or `visit`; [`RunError::Allocation`] and [`RunError::NoMemory`]
/// from registration.
pub fn for_each_sweep<S: Source + ?Sized>(
    source: &mut S,
    sweeps: Range<usize>,
    quiet: bool,
    mut visit: impl FnMut(&S, &Visit) -> Result<(), RunError>,
) -> Result<SessionEnd, RunError> {
    listen();
    let (mut now, mut last) = (SweepData::default(), SweepData::default());
    let mut locator = Locator::of(source.is_located(), source.overview().trusted)?;
    let mut progress = Progress::new("sweep", sweeps.len(), quiet);
    let mut stopped = false;
    for (done, index) in sweeps.enumerate() {
        stopped = interrupted();
        if stopped {
            break;
        }
        let clock = Instant::now();
        source.read(index, &mut now)?;
        let read_ms = milliseconds(clock);
        if let Some(locator) = &mut locator {
            locator.locate(source.rig(), &mut now)?;
        }
        visit(source, &Visit { index, now: &now, before: (done > 0).then_some(&last), read_ms })?;
        std::mem::swap(&mut now, &mut last);
        progress.update(done + 1);
    }
    progress.finish();
    let located = locator.map(|locator| locator.located());
    if let Some(located) = &located {
        say(quiet, &located.text())?;
    }
    Ok(SessionEnd { interrupted: stopped, last, located })
}
