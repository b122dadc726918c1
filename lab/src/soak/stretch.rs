//! One stretch of sweeps through the pipeline.

use super::fault::{Fault, OVER};
use raywake::drive::Drive;
use raywake::error::RunError;
use raywake::laps::milliseconds;
use raywake::latency::Latencies;
use raywake::outputs::{Kinds, Outputs, RunFiles};
use raywake_core::digest::Digest;
use raywake_core::output::PairFlows;
use raywake_core::params::Profile;
use raywake_core::sweep::Point;
use raywake_io::Error;
use raywake_io::source::{Overview, SweepData};
use raywake_sim::Rng;
use std::path::PathBuf;
use std::time::Instant;

/// What all stretches share.
pub struct Stretches {
    /// The profile, checked.
    pub profile: Profile,
    /// The recording's overview.
    pub overview: Overview,
    /// The sweeps of a stretch.
    pub sweeps: Vec<SweepData>,
    /// A folder on a full disk.
    pub full_disk: Option<PathBuf>,
    /// Source of all randomness.
    pub rng: Rng,
    /// The current sweep and the one before; their memory is reused.
    pub sides: [SweepData; 2],
}

/// Outcome of a stretch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StretchEnd {
    /// Digest of all output.
    pub digest: u64,
    /// Sweeps processed.
    pub sweeps: u64,
    /// Whether the device failed during it.
    pub failed_over: bool,
}

/// Memory of both sweeps, as large as any fault needs it, and already touched.
pub fn sides(profile: &Profile) -> [SweepData; 2] {
    let points = vec![Point { sensor: u32::MAX, ..Point::default() }; OVER * profile.returns()];
    [points.clone(), points].map(|points| SweepData { points, ..SweepData::default() })
}

impl Stretches {
    /// Runs one stretch, with a fault in its middle or without one.
    ///
    /// # Errors
    /// Any error of a step; [`Error`] if a disk that should be full accepts all results, or fails
    /// for a reason other than lack of space.
    pub fn run(
        &mut self,
        drive: &mut Drive,
        fault: Option<Fault>,
        times: &mut Latencies,
    ) -> Result<StretchEnd, RunError> {
        let (mut end, mut digest) = (StretchEnd::default(), Digest::START);
        let mut results = self.results(fault)?;
        let on_device = drive.failure().is_none();
        let Stretches { profile, sweeps, rng, sides: [now, last], .. } = self;
        for (index, sweep) in sweeps.iter().enumerate() {
            now.clone_from(sweep);
            let after = index.checked_sub(sweeps.len() / 2);
            let corrupt = |(fault, after): (Fault, usize)| fault.corrupt(after, now, profile, rng);
            if !fault.zip(after).is_none_or(corrupt) {
                continue;
            }
            let began = Instant::now();
            let before = if end.sweeps > 0 { &last.points[..] } else { &[] };
            let stepped = drive.step(&now.sweep(), before)?;
            times.add(milliseconds(began));
            end.sweeps += 1;
            if let Some(flows) = &stepped.output.flows {
                flows.columns.iter().for_each(|column| digest.column(column));
                flows.points.iter().for_each(|point| digest.point(&point));
                results = results.map_or(Ok(None), |results| results.take(last, flows))?;
            }
            drive.tracklets().for_each(|tracklet| digest.tracklet(&tracklet));
            std::mem::swap(now, last);
        }
        if results.is_some() {
            return Err(Error::Usage("--full-disk: there was room for all results".into()).into());
        }
        end.digest = digest.value();
        end.failed_over = on_device && drive.failure().is_some();
        Ok(end)
    }

    /// Where the results go that will not fit.
    fn results(&self, fault: Option<Fault>) -> Result<Option<FullDisk>, Error> {
        let Some(folder) = self.full_disk.as_ref().filter(|_| fault == Some(Fault::FullDisk))
        else {
            return Ok(None);
        };
        let kinds = Kinds { columns: true, points: true, ..Kinds::default() };
        let root = folder.join("results");
        let files = RunFiles { root: Some(root.clone()), kinds, ..RunFiles::default() };
        let outputs = Outputs::create(&files, &self.overview, self.sweeps.len(), &self.profile)?;
        Ok(Some(FullDisk { outputs, root }))
    }
}

/// Results on a full disk.
struct FullDisk {
    outputs: Outputs,
    root: PathBuf,
}

impl FullDisk {
    /// Writes those of a pair. Once the disk is full they are removed, and `None` is returned.
    fn take(mut self, first: &SweepData, flows: &PairFlows) -> Result<Option<FullDisk>, Error> {
        match self.outputs.pair(first, flows, 0.0) {
            Ok(()) => Ok(Some(self)),
            Err(Error::Write { .. }) => {
                std::fs::remove_dir_all(&self.root).map_err(Error::writing(&self.root))?;
                Ok(None)
            }
            Err(e) => Err(e),
        }
    }
}
