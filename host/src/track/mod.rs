//! `raywake track`: objects of a recorded drive.

mod ground;
mod report;
mod tracker;
mod write;

use std::time::Instant;

use crate::args;
use crate::choose;
use crate::config::{self, Weights};
use crate::drive::Drive;
use crate::engine::{interrupted, listen, say};
use crate::error::RunError;
use crate::progress::Progress;
use crate::report::bytes;
use crate::summary::make_room;
use raywake_io::source::{self, SweepData};

use raywake_objects::estimate::FixedLag;

pub use ground::Ground;
pub use report::Summary;
pub use tracker::{Ended, Tracker};

/// Follows the objects of a recording. Returns whether it got to the end: a signal ends it after the
/// sweep in hand, and all tracks with it.
pub fn track(args: &args::Track) -> Result<bool, RunError> {
    listen();
    let mut profile = config::profile(&args.profile)?;
    profile.deskew |= args.recording.deskew == Some(true);
    let mut source = source::open(&args.data, &args.recording.options())?;
    let sweeps = args.part.range(source.len())?;
    let summary = args.summary.clone().or(args.out.as_ref().map(|out| out.join("summary.json")));
    let ground = args.ground_map.as_deref().map(Ground::read).transpose()?;
    make_room(&summary)?;
    let mut files = write::Files::create(args.out.as_deref())?;
    say(args.quiet, &format!("{}\n", source.describe()))?;
    for note in source.notes() {
        say(args.quiet, &format!("note: {note}\n"))?;
    }
    let drive = match args.front_end {
        args::FrontEndKind::Variance => None,
        args::FrontEndKind::Flow => {
            let weights = Weights::read(&args.learned, &profile)?;
            let tables = weights.tables(&profile)?;
            let chosen = choose::backend(&args.backend, &profile, weights.tables(&profile)?)?;
            if let Some(note) = &chosen.note {
                say(args.quiet, &format!("note: {note}\n"))?;
            }
            Some(Drive::new(&profile, source.rig(), &tables, chosen.backend))
        }
    };
    let mut tracker = Tracker::new(source.rig(), &profile, drive, ground, args.fixed_lag);
    let parts = Tracker::parts().map(|(name, _, size)| format!("{name} {}", bytes(size as u64)));
    say(args.quiet, &format!("memory budget: {}\n", parts.join(", ")))?;
    if args.fixed_lag {
        let (iterations, returns) = (FixedLag::ITERATIONS_MAX, FixedLag::RETURNS_MAX);
        let most = format!("{iterations} iterations over {returns} returns");
        say(args.quiet, &format!("fixed lag: {most} at most a track and sweep\n"))?;
    }

    let mut report = report::Report::default();
    let (mut now, mut before) = (SweepData::default(), SweepData::default());
    let mut progress = Progress::new(sweeps.len(), args.quiet);
    let mut whole = true;
    for (done, index) in sweeps.clone().enumerate() {
        if interrupted() {
            whole = false;
            break;
        }
        source.read(index, &mut now)?;
        report.read(&now);
        let clock = Instant::now();
        let earlier = (done > 0).then_some(&before);
        if let Some(turnover) = tracker.sweep(&now, earlier)? {
            report.step(&turnover, clock);
            tracker.ended(|ended| report.track(ended, &mut files))?;
        }
        std::mem::swap(&mut now, &mut before);
        progress.update(done + 1);
    }
    progress.finish();
    let clock = Instant::now();
    if let Some(turnover) = tracker.last(&before)? {
        report.step(&turnover, clock);
        tracker.ended(|ended| report.track(ended, &mut files))?;
    }
    report.tally.ended += u64::from(tracker.finish()?);
    tracker.ended(|ended| report.track(ended, &mut files))?;
    files.finish()?;
    let figures = report.summary(source.name(), args.front_end, !whole);
    say(args.quiet, &figures.text())?;
    if let Some(path) = &summary {
        figures.write(path)?;
    }
    Ok(whole)
}
