//! One sweep through figure 3.1: the statements of `raywake_core::pipeline`, the heavy ones on the
//! chosen backend. Nothing in here allocates.

use raywake_core::output::{ColumnFlow, PointFlow, TrackletState};
use raywake_core::params::{POINTS_MAX, Profile};
use raywake_core::pipeline::{Flows, Output, Pipeline, Prepared};
use raywake_core::sweep::{Point, Rig, Sweep};
use raywake_gpu::GpuError;
use raywake_gpu::guard::guarded;

use crate::backend::{Backend, Tables};
use crate::laps::Laps;
use crate::team::Team;

/// The pipeline with its backend and the storage of its results.
pub struct Drive {
    pipeline: Box<Pipeline>,
    backend: Backend,
    columns: Vec<ColumnFlow>,
    points: Vec<PointFlow>,
}

/// What one sweep yields.
pub struct Stepped<'a> {
    /// Sizes, dropped returns, reset.
    pub prepared: Prepared,
    /// Flow of the pair that this sweep completes; none after a reset.
    pub flows: Option<Flows<'a>>,
    /// Returns beyond the capacity of the refinement: it does not see them.
    pub unrefined: usize,
    /// Foreground columns.
    pub foreground: usize,
    /// Distinct rays.
    pub rays: usize,
    /// Time of every stage.
    pub laps: Laps,
}

impl Drive {
    /// Allocates for a checked profile. The pipeline is made on the stack before it moves to the
    /// heap: call it on a thread with 64 MiB of stack.
    pub fn new(profile: &Profile, rig: &Rig, tables: &Tables, backend: Backend) -> Drive {
        Drive {
            pipeline: Box::new(Pipeline::new(
                profile.clone(),
                rig.clone(),
                tables.scores,
                tables.unfiltered,
            )),
            backend,
            columns: vec![ColumnFlow::default(); profile.columns()],
            points: vec![PointFlow::default(); POINTS_MAX],
        }
    }

    /// Bytes of host memory held for a profile, the backend's apart.
    pub fn bytes(profile: &Profile) -> usize {
        size_of::<Pipeline>()
            + profile.columns() * size_of::<ColumnFlow>()
            + POINTS_MAX * size_of::<PointFlow>()
    }

    /// The backend.
    pub fn backend(&self) -> &Backend {
        &self.backend
    }

    /// One sweep. `before` holds the points of the sweep before, whose flow comes back.
    pub fn step(&mut self, sweep: &Sweep, before: &[Point]) -> Result<Stepped<'_>, GpuError> {
        guarded(|| {
            let mut laps = Laps::start();
            let (rays, origins) = self.backend.input();
            let prepared = self.pipeline.prepare(&Team, sweep, rays, origins);
            laps.lap("prepare");
            let rounds = self.pipeline.profile().em_rounds;
            let mut unrefined = 0;
            let meanwhile = || unrefined = self.pipeline.take(sweep);
            let perceived = self.backend.perceive(&prepared.step, rounds, &mut laps, meanwhile)?;
            let output = Output { columns: &mut self.columns, points: &mut self.points };
            let lap = &mut |name| laps.lap(name);
            let flows =
                self.pipeline.follow(&Team, &prepared.step, &perceived, before, output, lap);
            laps.lap("follow");
            let (foreground, rays) = (perceived.foreground.len(), perceived.rays);
            Ok(Stepped { prepared, flows, unrefined, foreground, rays, laps })
        })
    }

    /// Tracklets after the last step.
    pub fn tracklets(&self) -> impl Iterator<Item = TrackletState> {
        self.pipeline.tracklets()
    }
}
