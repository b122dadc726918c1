//! A sweep through the front end, and through the flow before it where that is wanted; a track
//! through the estimate at its end. Nothing in here allocates once made.

use std::time::Instant;

use raywake_core::objects::estimate::{EstimateParams, Estimator, Report};
use raywake_core::objects::front_end::{
    FrontEnd, FrontEndParams, Life, TRACKS_MAX, Track, Turnover,
};
use raywake_core::output::PointFlow;
use raywake_core::sweep::Rig;
use raywake_gpu::GpuError;
use raywake_gpu::guard::guarded;

use crate::drive::Drive;
use crate::error::Error;
use crate::source::SweepData;

/// The front end with its tracks, and the estimate.
pub struct Tracker {
    rig: Rig,
    params: FrontEndParams,
    drive: Option<Drive>,
    front_end: Box<FrontEnd>,
    tracks: Vec<Track>,
    estimator: Box<Estimator>,
}

impl Tracker {
    /// Tracks of a rig's sweeps, with the flow where there is a drive to find it. Call it on a thread
    /// with 64 MiB of stack, as [`Drive::new`].
    pub fn new(rig: &Rig, drive: Option<Drive>) -> Tracker {
        Tracker {
            rig: rig.clone(),
            params: FrontEndParams::street(),
            drive,
            front_end: Box::new(FrontEnd::new()),
            tracks: vec![Track::new(); TRACKS_MAX],
            estimator: Box::new(Estimator::new()),
        }
    }

    /// Bytes of host memory held, those of the flow apart.
    pub fn bytes() -> usize {
        size_of::<FrontEnd>() + TRACKS_MAX * size_of::<Track>() + size_of::<Estimator>()
    }

    /// A sweep, and the one before it if there is one. With the flow it is that one whose tracks come
    /// next, as its flow is then known; nothing comes back where there is none.
    pub fn sweep(
        &mut self,
        now: &SweepData,
        before: Option<&SweepData>,
    ) -> Result<Option<Turnover>, GpuError> {
        let Tracker { rig, params, drive, front_end, tracks, .. } = self;
        let mut step = |sweep: &SweepData, flows: Option<&[PointFlow]>| {
            guarded(|| {
                front_end.take(rig, &sweep.sweep(), flows);
                front_end.step(params, None, tracks)
            })
        };
        let Some(drive) = drive else { return Ok(Some(step(now, None))) };
        let points = before.map_or(&[][..], |b| &b.points);
        let flows = drive.step(&now.sweep(), points)?.flows;
        Ok(before.map(|before| step(before, flows.map(|f| f.points))))
    }

    /// The last sweep, where it still waits for its flow, which will not come.
    pub fn last(&mut self, sweep: &SweepData) -> Option<Turnover> {
        self.drive.take()?;
        self.sweep(sweep, None).ok()?
    }

    /// Ends all tracks. Returns how many there were.
    pub fn finish(&mut self) -> u32 {
        self.front_end.finish(&mut self.tracks)
    }

    /// The tracks that ended in the last step, in the order of their room.
    pub fn ended_tracks(&self) -> impl Iterator<Item = &Track> {
        self.tracks.iter().filter(|t| t.life == Life::Ended)
    }

    /// Shows the tracks that ended in the last step, in the order of their room, each with the
    /// estimate of its trajectory and shape.
    pub fn ended(
        &mut self,
        mut show: impl FnMut(&Ended) -> Result<(), Error>,
    ) -> Result<(), Error> {
        for track in self.tracks.iter().filter(|t| t.life == Life::Ended) {
            let clock = Instant::now();
            let (returns, history) = (track.returns(), track.history());
            let report =
                guarded(|| self.estimator.solve(&EstimateParams::default(), returns, history));
            let milliseconds = clock.elapsed().as_secs_f64() * 1e3;
            show(&Ended { track, estimator: &self.estimator, report: &report, milliseconds })?;
        }
        Ok(())
    }
}

/// A track at its end.
pub struct Ended<'a> {
    /// The track.
    pub track: &'a Track,
    /// With its trajectory and shape.
    pub estimator: &'a Estimator,
    /// How these were found.
    pub report: &'a Report,
    /// How long that took, ms.
    pub milliseconds: f64,
}
