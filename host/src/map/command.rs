//! The command: sources in, feather files out.

use std::time::Instant;

use raywake_core::digest::Digest;
use raywake_core::params::Profile;

use super::{MapBackend, Mapped, Mapper, device::DeviceMap, scalar::ScalarMap};
use crate::args;
use crate::choose;
use crate::engine::{interrupted, listen, say};
use crate::error::RunError;
use crate::order_statistics::Spread;
use crate::progress::Progress;
use crate::report::bytes;
use crate::statistics::Dropped;
use raywake_io::sink::{atomic, feather};
use raywake_io::source::{self, SweepData};

/// Voxels of one sweep, in columns as the file has them.
#[derive(Default)]
struct Voxels {
    index: [Vec<i32>; 3],
    log_odds: Vec<i32>,
}

/// Maps every sweep of a recording. Returns whether it got to the end: a signal ends it after the
/// sweep in hand.
pub fn map(args: &args::Map) -> Result<bool, RunError> {
    listen();
    let profile = Profile::map();
    let mut source = source::open(&args.data, &args.recording.options())?;
    let sweeps = args.part.range(source.len())?;
    atomic::create_folder(&args.out)?;
    let wanted = choose::wanted(&args.backend)?;
    let backend = match &wanted.device {
        Some(options) => MapBackend::Device(Box::new(DeviceMap::new(&profile, options)?)),
        None => MapBackend::Scalar(Box::new(ScalarMap::new(&profile))),
    };
    say(args.quiet, &format!("{}\n", source.describe()))?;
    for note in source.notes().iter().chain(&wanted.note) {
        say(args.quiet, &format!("note: {note}\n"))?;
    }
    let budget = bytes(Mapper::bytes(&profile) as u64);
    say(args.quiet, &format!("{}; memory budget: at most {budget} of buffers\n", backend.name()))?;

    let mut mapper = Mapper::new(profile.clone(), source.rig().clone(), backend);
    let (mut sweep, mut voxels) = (SweepData::default(), Voxels::default());
    let (mut digest, mut times, mut count) = (Digest::default(), Vec::new(), 0);
    let mut left_out = Dropped::default();
    let mut progress = Progress::new(sweeps.len(), args.quiet);
    for (done, index) in sweeps.clone().enumerate() {
        if interrupted() {
            progress.finish();
            return Ok(false);
        }
        source.read(index, &mut sweep)?;
        let clock = Instant::now();
        let mut found = Vec::new();
        let mapped = mapper.map(&sweep.sweep(), &mut |band| found.extend_from_slice(band))?;
        left_out.returns += mapped.dropped;
        left_out.null_rows += u64::from(sweep.dropped.null_rows);
        times.push(clock.elapsed().as_secs_f64() * 1e3);
        found.iter().flatten().for_each(|word| digest.word(*word));
        voxels.set(&mapper, &mapped, &found);
        count += found.len();
        let path = args.out.join(format!("{:010}.feather", sweep.frame));
        // The lattice's origin is the centre of its voxel (0, 0, 0), the file's a corner.
        let half = 0.5 * profile.voxel_m;
        let origin = mapped.window.lattice_origin.to_array().map(|c| c - half);
        let meta = [("frame", sweep.frame.to_string()), ("stamp_s", sweep.stamp_s.to_string())];
        let [i, j, k] = &voxels.index;
        feather::write_map(&path, i, j, k, &voxels.log_odds, origin, profile.voxel_m, &meta)?;
        progress.update(done + 1);
    }
    progress.finish();
    if let Some(t) = Spread::of(&times) {
        let mean = count / times.len();
        let text = format!(
            "{} sweeps, {mean} voxels a sweep; {:.1} ms median, {:.1} sd, {:.1} p99, {:.1} max a map\n\
             left out   {left_out}\n\
             digest     {:016x}\n",
            times.len(),
            t.median,
            t.sd,
            t.p99,
            t.max,
            digest.value()
        );
        say(args.quiet, &text)?;
    }
    Ok(true)
}

impl Voxels {
    fn set(&mut self, mapper: &Mapper, mapped: &Mapped, found: &[[u32; 2]]) {
        self.index.iter_mut().for_each(Vec::clear);
        self.log_odds.clear();
        for &[key, log_odds] in found {
            for (column, value) in self.index.iter_mut().zip(mapper.cell(mapped, key)) {
                column.push(value);
            }
            self.log_odds.push(log_odds as i32);
        }
    }
}
