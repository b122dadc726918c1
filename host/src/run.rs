//! `raywake run`.

use crate::args;
use crate::config;
use crate::console::note;
use crate::engine::{self, RunPlan};
use crate::error::RunError;
use crate::outputs::RunFiles;
use crate::summary::RunSummary;
use crate::weight_files::WeightFiles;
use raywake_io::source;

/// Estimates the flow of a recorded drive.
pub fn run(args: &args::RunArgs) -> Result<RunSummary, RunError> {
    let mut profile = config::profile(&args.flow.profile)?;
    // Asked for by name, it is wanted under every profile.
    profile.deskew |= args.recording.kind.deskew == Some(true);
    let weights = WeightFiles::read(&args.flow.learned, &profile)?;
    let mut source = source::open(&args.data, &args.recording.options())?;
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
        let what = "nothing will be written, only measured: --out, --mcap, --film or --page do";
        note(plan.quiet, [&what.to_owned()])?;
    }
    engine::execute(&plan, source.as_mut(), &mut |_, _| ())
}
