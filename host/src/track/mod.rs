//! `raywake track`: objects of a recorded drive.

mod ground;
mod report;
mod tracker;
mod write;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::args;
use crate::batch::{RecordingCommand, shared_args};
use crate::choose;
use crate::config::{self, Settings};
use crate::console::{bytes, note, say};
use crate::drive::Drive;
use crate::error::RunError;
use crate::figures::FiguresFile;
use crate::progress::Progress;
use crate::session::for_each_sweep;
use crate::settings_file::ResultSettings;
use crate::weight_files::WeightFiles;
use raywake_core::digest::Digest;
use raywake_core::params::Profile;
use raywake_core::sweep::Rig;
use raywake_io::source;
use raywake_objects::estimate::FixedLag;
use raywake_objects::params::TrackingParams;

pub use ground::Ground;
pub use report::TrackSummary;
pub use tracker::{Ended, Tracker};

/// Tracks the objects of a recording. Returns whether it ran to completion: a signal ends it after
/// the current sweep; tracks without an estimate by then are left out.
fn track(args: &args::TrackArgs) -> Result<bool, RunError> {
    let settings = settings(args)?;
    let mut source = source::open(args.recordings.path(), &args.recording.options())?;
    let sweeps = args.part.range(source.len())?;
    let ground = args.ground_map.as_deref().map(Ground::read).transpose()?;
    say(args.quiet, &format!("{}\n", source.describe()))?;
    note(args.quiet, source.notes())?;
    let drive = match args.front_end {
        args::FrontEndKind::Variance => None,
        args::FrontEndKind::Flow => Some(flow(args, &settings.profile, source.rig())?),
    };
    let made = ResultSettings {
        command: "track",
        recording: source.overview(),
        first: sweeps.start,
        profile: &settings.profile,
        objects: Some(&settings.objects),
        weights: &WeightFiles::read(&args.flow.learned, &settings.profile)?.digest(),
        others: &others(args, &sweeps, ground.as_ref()),
    };
    let _claim = made.claim(args.out.as_deref())?;
    let figures = FiguresFile::create(args.summary.as_deref(), args.out.as_deref())?;
    say(args.quiet, &budget(args.fixed_lag))?;
    let mut files = write::Files::create(args, source.overview(), sweeps.len())?;
    let mut tracker = Tracker::new(source.rig(), &settings, drive, ground, args.fixed_lag)?;
    tracker.all |= args.all;
    let mut report = report::Report::default();
    let end = for_each_sweep(source.as_mut(), sweeps, args.quiet, |_, visit| {
        report.read(visit.now);
        let clock = Instant::now();
        if let Some(counts) = tracker.sweep(visit.now, visit.before)? {
            report.step(&counts, clock);
            // The flow of a sweep is known with the next one.
            let stepped = visit.before.filter(|_| tracker.lags()).unwrap_or(visit.now);
            files.sweep(stepped, &tracker, report.last_ms())?;
            report.ended(&mut tracker, &mut files, || ())?;
        }
        Ok(())
    })?;
    let clock = Instant::now();
    if let Some(counts) = tracker.last(&end.last)? {
        report.step(&counts, clock);
        files.sweep(&end.last, &tracker, report.last_ms())?;
        report.ended(&mut tracker, &mut files, || ())?;
    }
    report.counts.ended += tracker.finish()?;
    let mut progress = Progress::new("track", tracker.ended_objects(), args.quiet);
    let mut done = 0;
    report.ended(&mut tracker, &mut files, || {
        done += 1;
        progress.update(done);
    })?;
    progress.finish();
    let summary = report.summary(source.name(), args.front_end, end.interrupted);
    files.finish(&summary.text())?;
    say(args.quiet, &summary.text())?;
    figures.write(&summary)?;
    Ok(!summary.interrupted)
}

/// Parameters of flow and tracking.
fn settings(args: &args::TrackArgs) -> Result<Settings, RunError> {
    let objects = TrackingParams { estimate: args.estimate.params(), ..TrackingParams::DEFAULT };
    let mut settings = config::settings_over(&args.flow.profile, objects)?;
    args.recording.kind.adapt(&mut settings.profile);
    Ok(settings)
}

/// The flow, for the front end that takes it.
fn flow(args: &args::TrackArgs, profile: &Profile, rig: &Rig) -> Result<Drive, RunError> {
    let weights = WeightFiles::read(&args.flow.learned, profile)?;
    let chosen = choose::drive(&args.flow.backend, &weights, profile, rig)?;
    note(args.quiet, &chosen.note)?;
    Ok(chosen.drive)
}

/// The memory of the run, and the bounds of its work.
fn budget(fixed_lag: bool) -> String {
    let parts = Tracker::parts().map(|(name, _, size)| format!("{name} {}", bytes(size as u64)));
    let mut text = format!("memory budget: {}\n", parts.join(", "));
    if fixed_lag {
        let (iterations, returns) = (FixedLag::ITERATIONS_MAX, FixedLag::RETURNS_MAX);
        text += &format!(
            "fixed lag: at most {iterations} iterations, {returns} returns per track and sweep\n"
        );
    }
    text
}

/// What tracks depend on besides recording, parameters and weights.
fn others(args: &args::TrackArgs, sweeps: &Range<usize>, ground: Option<&Ground>) -> String {
    let args::TrackArgs { front_end, estimate, fixed_lag, all, .. } = args;
    let ground = Digest::of(format!("{ground:?}").as_bytes());
    format!(
        "sweeps {sweeps:?}, front end {front_end:?}, estimate {estimate:?}, \
         fixed lag {fixed_lag}, all {all}, ground {ground:016x}"
    )
}

impl RecordingCommand for args::TrackArgs {
    const NAME: &'static str = "track";

    shared_args!();

    fn out(&self) -> Option<&Path> {
        self.out.as_deref()
    }

    fn set_output(&mut self, out: PathBuf) {
        self.out = Some(out);
    }

    fn single_file(&self) -> Option<&'static str> {
        let streams = self.streams.single_file().or(self.views.single_file());
        streams.or(self.summary.is_some().then_some("summary"))
    }

    fn other_input(&self) -> Option<&Path> {
        self.ground_map.as_deref()
    }

    fn execute(&self) -> Result<bool, RunError> {
        track(self)
    }
}
