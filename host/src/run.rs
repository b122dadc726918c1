//! `raywake run`.

use std::path::{Path, PathBuf};

use crate::args;
use crate::batch::{RecordingCommand, shared_args};
use crate::config;
use crate::console::note;
use crate::engine::{self, RunPlan};
use crate::error::RunError;
use crate::outputs::RunFiles;
use crate::summary::RunSummary;
use crate::weight_files::WeightFiles;
use raywake_io::source;

/// Estimates the flow of a recorded drive.
fn run(args: &args::RunArgs) -> Result<RunSummary, RunError> {
    let mut profile = config::profile(&args.flow.profile)?;
    args.recording.kind.adapt(&mut profile);
    let weights = WeightFiles::read(&args.flow.learned, &profile)?;
    let mut source = source::open(args.recordings.path(), &args.recording.options())?;
    let plan = RunPlan {
        sweeps: args.part.range(source.len())?,
        profile,
        weights,
        backend: &args.flow.backend,
        files: RunFiles::of(&args.results),
        summary: args.results.summary.clone(),
        quiet: args.quiet,
    };
    if plan.files.is_empty() && plan.summary.is_none() {
        let what = "no output, only timings: to write, use --out, --mcap, --film or --page";
        note(plan.quiet, [&what.to_owned()])?;
    }
    engine::execute(&plan, source.as_mut(), &mut |_, _| ())
}

impl RecordingCommand for args::RunArgs {
    const NAME: &'static str = "run";

    shared_args!();

    fn out(&self) -> Option<&Path> {
        self.results.out.as_deref()
    }

    fn set_output(&mut self, out: PathBuf) {
        self.results.out = Some(out);
    }

    fn single_file(&self) -> Option<&'static str> {
        self.results.single_file()
    }

    fn execute(&self) -> Result<bool, RunError> {
        Ok(!run(self)?.facts.interrupted)
    }
}
