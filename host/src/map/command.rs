//! The `map` command: sources in, feather files out.

use std::time::Instant;

use raywake_core::digest::Digest;
use raywake_core::params::Profile;

use super::{MapBackend, Mapper, device::DeviceMap, scalar::ScalarMap};
use crate::args;
use crate::choose;
use crate::console::{bytes, note, say};
use crate::error::RunError;
use crate::laps::milliseconds;
use crate::memory;
use crate::order_statistics::Spread;
use crate::picture::{PictureFiles, Pictures, Subject, SweepFigures};
use crate::session::for_each_sweep;
use crate::settings_file::ResultSettings;
use crate::statistics::Dropped;
use raywake_io::sink::feather::{self, Voxel};
use raywake_io::source::{self, SweepData};

/// Maps every sweep of a recording. Returns whether it ran to completion: a signal ends it after
/// the current sweep.
pub fn map(args: &args::MapArgs) -> Result<bool, RunError> {
    let profile = Profile::map();
    let mut source = source::open(&args.data, &args.recording.options())?;
    let sweeps = args.part.range(source.len())?;
    let wanted = choose::wanted(&args.backend)?;
    let backend = match &wanted.device {
        Some(options) => MapBackend::Device(Box::new(DeviceMap::new(&profile, options)?)),
        None => {
            memory::probe_memory(Mapper::bytes(&profile) as u64)?;
            MapBackend::Scalar(Box::new(ScalarMap::new(&profile)))
        }
    };
    let made = ResultSettings {
        command: "map",
        recording: source.overview(),
        first: sweeps.start,
        profile: &profile,
        objects: None,
        weights: "none",
        others: &format!("sweeps {sweeps:?}, clipped at {}", args.clip),
    };
    let _claim = made.claim(Some(&args.out))?;
    say(args.quiet, &format!("{}\n", source.describe()))?;
    note(args.quiet, source.notes().iter().chain(&wanted.note))?;
    let most = bytes(Mapper::bytes(&profile) as u64);
    say(args.quiet, &format!("{}; memory budget: up to {most} of buffers\n", backend.name()))?;

    let mut mapper = Mapper::new(profile.clone(), source.rig().clone(), backend);
    let files = PictureFiles::of(&args.views, args.png.then(|| args.out.clone()));
    let mut pictures = Pictures::create(&files, source.name(), sweeps.len())?;
    let mut tally = MapTally::default();
    let end = for_each_sweep(source.as_mut(), sweeps, args.quiet, |_, visit| {
        let (voxels, origin_m) = tally.sweep(&mut mapper, &profile, visit.now)?;
        let path = args.out.join(format!("{:010}.feather", visit.now.frame));
        let subject = Subject::Map { voxels: &voxels, origin_m, voxel_m: profile.voxel_m };
        pictures.write(visit.now, &subject, &tally.last(&voxels))?;
        let meta =
            [("frame", visit.now.frame.to_string()), ("stamp_s", visit.now.stamp_s.to_string())];
        Ok(feather::write_map(&path, &voxels, origin_m, profile.voxel_m, args.clip, &meta)?)
    })?;
    pictures.finish(&tally.text())?;
    if !end.interrupted {
        say(args.quiet, &tally.text())?;
    }
    Ok(!end.interrupted)
}

#[derive(Default)]
struct MapTally {
    digest: Digest,
    milliseconds: Vec<f64>,
    voxels: usize,
    dropped: Dropped,
}

impl MapTally {
    /// Maps a sweep. Returns its voxels, and the corner of the voxel (0, 0, 0) in the world, m.
    fn sweep(
        &mut self,
        mapper: &mut Mapper,
        profile: &Profile,
        sweep: &SweepData,
    ) -> Result<(Vec<Voxel>, [f64; 3]), RunError> {
        let clock = Instant::now();
        let mut found = Vec::new();
        let mapped = mapper.map(&sweep.sweep(), &mut |band| found.extend_from_slice(band))?;
        self.milliseconds.push(milliseconds(clock));
        self.dropped.returns += mapped.dropped;
        self.dropped.null_rows += u64::from(sweep.dropped.null_rows);
        found.iter().flatten().for_each(|word| self.digest.word(*word));
        self.voxels += found.len();
        let voxel = |&[key, log_odds]: &[u32; 2]| Voxel {
            index: mapper.cell(&mapped, key),
            log_odds_tenths: log_odds as i32,
        };
        // The lattice's origin is the centre of its voxel (0, 0, 0).
        let half = 0.5 * profile.voxel_m;
        let origin_m = mapped.window.lattice_origin.to_array().map(|c| c - half);
        Ok((found.iter().map(voxel).collect(), origin_m))
    }

    /// Figures of the sweep mapped last.
    fn last(&self, voxels: &[Voxel]) -> SweepFigures {
        let ms = self.milliseconds.last().copied().unwrap_or_default();
        [("voxels", voxels.len() as f64), ("ms per sweep", ms)]
    }

    fn text(&self) -> String {
        let Some(t) = Spread::of(&self.milliseconds) else { return String::new() };
        let count = self.milliseconds.len();
        format!(
            "{count} sweeps, {} voxels per sweep\n\
             map        {}\n\
             dropped    {}\n\
             digest     {:016x}\n",
            self.voxels / count,
            t.line(1),
            self.dropped,
            self.digest.value()
        )
    }
}
