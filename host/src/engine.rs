//! `raywake run` and similar commands: a source through the pipeline, its results to files.

use std::ops::Range;
use std::path::PathBuf;
use std::time::Instant;

use raywake_core::output::PairFlows;
use raywake_core::output::TrackletState;
use raywake_core::params::Profile;

use crate::args::BackendChoice;
use crate::backend::Backend;
use crate::budget;
use crate::choose;

use crate::console::{note, say};
use crate::drive::Drive;
use crate::error::RunError;
use crate::figures::FiguresFile;
use crate::laps::{Laps, milliseconds};
use crate::locate::Locator;
use crate::outputs::{Outputs, RunFiles};
use crate::report;
use crate::session::{Visit, for_each_sweep};
use crate::settings_file::ResultSettings;
use crate::statistics::Statistics;
use crate::summary::{Facts, RunSummary};
use crate::team;
use crate::weight_files::WeightFiles;
use raywake_gpu::GpuError;
use raywake_io::source::{Source, SweepData};

/// What to do with a source.
pub struct RunPlan<'a> {
    /// The profile, checked.
    pub profile: Profile,
    /// The weights, read and checked.
    pub weights: WeightFiles,
    /// Where the heavy half runs.
    pub backend: &'a BackendChoice,
    /// Sweeps of the source.
    pub sweeps: Range<usize>,
    /// Where results go.
    pub files: RunFiles,
    /// File for the figures; by default in the output folder.
    pub summary: Option<PathBuf>,
    /// Print errors only.
    pub quiet: bool,
}

/// Two sweeps and the flow between them.
pub struct Pair<'a> {
    /// Index of the first sweep in the source.
    pub index: usize,
    /// The first sweep, which the flow belongs to.
    pub first: &'a SweepData,
    /// The second sweep.
    pub second: &'a SweepData,
    /// Flow of the first sweep.
    pub flows: &'a PairFlows<'a>,
    /// Time of each stage.
    pub laps: &'a Laps,
}

/// Called with every pair.
pub type Observer<'a, S> = &'a mut dyn FnMut(&S, &Pair);

/// Runs to the end, or to a signal: then the current sweep is finished and the summary says so.
/// After an error the files already written remain.
pub fn execute<S: Source + ?Sized>(
    plan: &RunPlan,
    source: &mut S,
    observe: Observer<S>,
) -> Result<RunSummary, RunError> {
    let (profile, say) = (&plan.profile, |text: &str| say(plan.quiet, text));
    let root = plan.files.root.as_deref();
    let chosen = choose::drive(plan.backend, &plan.weights, profile, source.rig())?;
    let made = ResultSettings {
        command: "run",
        recording: source.overview(),
        first: plan.sweeps.start,
        profile,
        objects: None,
        weights: &plan.weights.digest(),
        others: "no pair depends on what comes after it",
    };
    // After all checks, and before anything there is replaced.
    let _claim = made.claim(root)?;
    let outputs = Outputs::create(&plan.files, source.overview(), plan.sweeps.len(), profile)?;
    let figures = FiguresFile::create(plan.summary.as_deref(), root)?;
    say(&format!("{}\n", source.describe()))?;
    note(plan.quiet, source.notes().iter().chain(&chosen.note))?;
    say(&budget::paragraph(profile, &chosen.drive, &chosen.filter))?;
    outputs.await_viewer(plan.quiet)?;
    let mut run = Running {
        drive: chosen.drive,
        outputs,
        statistics: Statistics::default(),
        tracklets: Vec::new(),
    };
    let end = for_each_sweep(source, plan.sweeps.clone(), plan.quiet, |source, visit| {
        run.sweep(source, visit, observe)
    })?;
    let backend = run.drive.backend();
    let census = backend.census().unwrap_or_default();
    let facts = Facts {
        version: env!("CARGO_PKG_VERSION"),
        source: source.name().to_string(),
        profile: profile.name.to_string(),
        backend: backend.name(),
        device: backend.device().to_string(),
        threads: team::threads(),
        simd: run.drive.simd().name(),
        filter: chosen.filter,
        interrupted: end.interrupted,
        registration: end.located,
        device_bytes: census.upload_bytes + census.device_bytes + census.readback_bytes,
        host_bytes: host_bytes(&run.drive, profile) + end.located.map_or(0, |_| Locator::BYTES),
        vulkan_allocations: census.memory_allocations,
        device_failure: run.drive.failure().map(GpuError::to_string),
        validation_messages: plan.backend.validation.map(|_| backend.messages()),
    };
    let summary = RunSummary::new(facts, &run.statistics);
    let text = report::text(&summary);
    run.outputs.finish(&text)?;
    say(&text)?;
    figures.write(&summary)?;
    Ok(summary)
}

/// Bytes of host memory held for a pipeline; if its device failed, for both backends.
fn host_bytes(drive: &Drive, profile: &Profile) -> u64 {
    budget::host_bytes(profile, matches!(drive.backend(), Backend::Scalar(_)))
        + drive.failure().map_or(0, |_| budget::host_bytes(profile, true))
}

/// A run in progress.
struct Running {
    drive: Drive,
    outputs: Outputs,
    statistics: Statistics,
    tracklets: Vec<TrackletState>,
}

impl Running {
    fn sweep<S: Source + ?Sized>(
        &mut self,
        source: &S,
        &Visit { index, now, before, read_ms }: &Visit,
        observe: Observer<S>,
    ) -> Result<(), RunError> {
        self.statistics.read_ms += read_ms;
        let stepped = self.drive.step(&now.sweep(), before.map_or(&[], |b| &b.points))?;
        self.statistics.sweep(index, now, &stepped);
        let clock = Instant::now();
        let dt_s = stepped.output.flows.map(|f| f.dt_s);
        if let (Some(flows), Some(before)) = (&stepped.output.flows, before) {
            let laps = &stepped.laps;
            self.outputs.pair(before, flows, laps.stages().map(|(_, ms)| ms).sum())?;
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
