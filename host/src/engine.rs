//! Drives a source through the pipeline, sweep by sweep.

use std::io::{self, Write};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use raywake_core::output::TrackletState;
use raywake_core::params::Profile;
use raywake_core::pipeline::Flows;

use crate::args::BackendChoice;
use crate::backend::Backend;
use crate::budget;
use crate::choose;
use crate::config::Weights;
use crate::drive::Drive;
use crate::error::RunError;
use crate::laps::Laps;
use crate::outputs::{Kinds, Outputs};
use crate::progress::Progress;
use crate::report;
use crate::statistics::Statistics;
use crate::summary::{self, Facts, Summary};
use raywake_io::Error;
use raywake_io::source::{Source, SweepData};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// What is to be done with a source.
pub struct Plan<'a> {
    /// Checked.
    pub profile: Profile,
    /// Read and checked.
    pub weights: Weights,
    /// Where the heavy half runs.
    pub backend: &'a BackendChoice,
    /// Sweeps of the source.
    pub sweeps: Range<usize>,
    /// Folder for results.
    pub out: Option<PathBuf>,
    /// Which.
    pub kinds: Kinds,
    /// File for the figures; in `out` where none is named.
    pub summary: Option<PathBuf>,
    /// Errors only.
    pub quiet: bool,
}

/// Two sweeps and the flow between them.
pub struct Pair<'a> {
    /// Index of the first sweep in the source.
    pub index: usize,
    /// The first sweep, whose flow it is.
    pub first: &'a SweepData,
    /// The second sweep.
    pub second: &'a SweepData,
    /// Flow of the first sweep.
    pub flows: &'a Flows<'a>,
    /// Time of every stage.
    pub laps: &'a Laps,
}

/// Sees every pair.
pub type Observer<'a, S> = &'a mut dyn FnMut(&S, &Pair);

/// Runs to the end, or to a signal: then the sweep in hand is finished and the summary says so.
/// After an error the files already written stay.
pub fn execute<S: Source + ?Sized>(
    plan: &Plan,
    source: &mut S,
    observe: Observer<S>,
) -> Result<Summary, RunError> {
    listen();
    let (profile, say) = (&plan.profile, |text: &str| say(plan.quiet, text));
    let summary_path =
        plan.summary.clone().or(plan.out.as_ref().map(|out| out.join("summary.json")));
    summary::make_room(&summary_path)?;
    let outputs = Outputs::create(plan.out.as_deref(), plan.kinds, source.name(), profile)?;
    let tables = plan.weights.tables(profile)?;
    let chosen = choose::backend(plan.backend, profile, plan.weights.tables(profile)?)?;
    let backend = chosen.backend;
    say(&format!("{}\n", source.describe()))?;
    for note in source.notes().iter().chain(&chosen.note) {
        say(&format!("note: {note}\n"))?;
    }
    say(&budget::paragraph(profile, &backend, &tables.provenance))?;
    let mut run = Running {
        drive: Drive::new(profile, source.rig(), &tables, backend),
        outputs,
        statistics: Statistics::default(),
        tracklets: Vec::new(),
    };
    let interrupted = run.all(plan, source, observe)?;
    let facts = Facts {
        source: source.name(),
        profile,
        backend: run.drive.backend(),
        filter: &tables.provenance,
        interrupted,
        validating: plan.backend.validation.is_some(),
        host_bytes: budget::host_bytes(profile, matches!(run.drive.backend(), Backend::Scalar(_))),
    };
    let summary = Summary::new(&facts, &run.statistics);
    say(&report::text(&summary))?;
    if let Some(path) = &summary_path {
        summary.write(path)?;
    }
    Ok(summary)
}

/// A run under way.
struct Running {
    drive: Drive,
    outputs: Outputs,
    statistics: Statistics,
    tracklets: Vec<TrackletState>,
}

impl Running {
    /// All sweeps. Returns whether a signal ended the run before the last one.
    fn all<S: Source + ?Sized>(
        &mut self,
        plan: &Plan,
        source: &mut S,
        observe: Observer<S>,
    ) -> Result<bool, RunError> {
        let (mut now, mut before) = (SweepData::default(), SweepData::default());
        let mut progress = Progress::new(plan.sweeps.len(), plan.quiet);
        for (done, index) in plan.sweeps.clone().enumerate() {
            if interrupted() {
                progress.finish();
                return Ok(true);
            }
            let clock = Instant::now();
            source.read(index, &mut now)?;
            self.statistics.read_ms += milliseconds(clock);
            self.sweep(index, source, &now, &before, observe)?;
            std::mem::swap(&mut now, &mut before);
            progress.update(done + 1);
        }
        progress.finish();
        Ok(false)
    }

    /// One sweep and its files.
    fn sweep<S: Source + ?Sized>(
        &mut self,
        index: usize,
        source: &S,
        now: &SweepData,
        before: &SweepData,
        observe: Observer<S>,
    ) -> Result<(), RunError> {
        let stepped = self.drive.step(&now.sweep(), &before.points)?;
        self.statistics.sweep(index, now, &stepped);
        let clock = Instant::now();
        let dt_s = stepped.flows.map(|f| f.dt_s);
        if let Some(flows) = &stepped.flows {
            self.outputs.pair(before, flows)?;
            let laps = &stepped.laps;
            observe(source, &Pair { index: index - 1, first: before, second: now, flows, laps });
        }
        self.tracklets.clear();
        self.tracklets.extend(self.drive.tracklets());
        self.statistics.tracklets(&self.tracklets, dt_s.is_some());
        if let Some(dt_s) = dt_s {
            self.outputs.tracklets(now, &self.tracklets, dt_s)?;
        }
        self.statistics.write_ms += milliseconds(clock);
        Ok(())
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// Whether a signal came.
pub fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// From now on SIGINT and SIGTERM end a run after the sweep in hand.
pub fn listen() {
    // Fails where a handler is there already: another run's, which sets the same flag.
    let _ = ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed));
}

/// Prints to standard output unless quiet. A reader that has had enough is no error.
pub fn say(quiet: bool, text: &str) -> Result<(), Error> {
    if quiet {
        return Ok(());
    }
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::Write { path: "standard output".into(), source: e })
        }
        _ => Ok(()),
    }
}
