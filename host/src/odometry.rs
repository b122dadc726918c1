//! `raywake odometry`: the poses of a recording, from its sweeps alone.

use std::io::Write;

use raywake_io::sink::atomic::Partial;
use raywake_io::source::{self, Unlocated, pose_rows};

use crate::args;
use crate::console::{note, say};
use crate::error::RunError;
use crate::session::for_each_sweep;

/// Locates all sweeps and writes their poses. Returns whether it ran to completion: a signal ends
/// it after the current sweep, and the poses so far are written.
pub fn odometry(args: &args::OdometryArgs) -> Result<bool, RunError> {
    let options = source::OpenOptions { unlocated: Unlocated::Always, ..args.kind.options() };
    let mut source = source::open(&args.data, &options)?;
    let sweeps = args.part.range(source.len())?;
    say(args.quiet, &format!("{}\n", source.describe()))?;
    note(args.quiet, source.notes())?;
    // Whether it can be written is better known before than after.
    let (file, mut to) = Partial::create(&args.out)?;
    let (first, mut poses) = (sweeps.start, Vec::with_capacity(sweeps.len()));
    let end = for_each_sweep(source.as_mut(), sweeps, args.quiet, |_, visit| {
        poses.push(visit.now.world_from_vehicle);
        Ok(())
    })?;
    let written = to.write_all(pose_rows(first, &poses).as_bytes());
    written.and_then(|()| to.flush()).map_err(|e| file.error(e))?;
    file.keep()?;
    Ok(!end.interrupted)
}
