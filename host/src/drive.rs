//! One sweep through figure 3.1: the statements of `raywake_core::pipeline`, the heavy ones on the
//! chosen backend. Nothing in here allocates.

use raywake_alloc_guard::Sealed;
use raywake_core::output::{ColumnFlow, PointFlow, TrackletState};
use raywake_core::params::{POINTS_MAX, Profile};
use raywake_core::pipeline::{Flows, Output, Pipeline, Prepared};
use raywake_core::sweep::{Point, Rig, Sweep};

use crate::backend::{Backend, Tables};
use crate::error::RunError;
use crate::laps::Laps;
use crate::team::Team;

/// The pipeline with its backend and the storage of its results. Nothing is allocated once it is
/// made.
pub struct Drive {
    parts: Sealed<Parts>,
}

struct Parts {
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
        let parts = Parts {
            pipeline: Box::new(Pipeline::new(
                profile.clone(),
                rig.clone(),
                tables.scores,
                tables.unfiltered,
            )),
            backend,
            columns: vec![ColumnFlow::default(); profile.columns()],
            points: vec![PointFlow::default(); POINTS_MAX],
        };
        Drive { parts: Sealed::new("sweep", parts) }
    }

    /// Bytes of host memory held for a profile, the backend's apart.
    pub fn bytes(profile: &Profile) -> usize {
        size_of::<Pipeline>()
            + profile.columns() * size_of::<ColumnFlow>()
            + POINTS_MAX * size_of::<PointFlow>()
    }

    /// The backend.
    pub fn backend(&self) -> &Backend {
        &self.parts.backend
    }

    /// One sweep. `before` holds the points of the sweep before, whose flow comes back.
    ///
    /// # Errors
    /// [`RunError::Device`], after which every later step fails; [`RunError::Allocation`], after which the
    /// next sweep may be given.
    pub fn step(&mut self, sweep: &Sweep, before: &[Point]) -> Result<Stepped<'_>, RunError> {
        self.parts.step(|Parts { pipeline, backend, columns, points }| {
            let mut laps = Laps::start();
            let (rays, origins) = backend.input();
            let prepared = pipeline.prepare(&Team, sweep, rays, origins);
            laps.lap("prepare");
            let rounds = pipeline.profile().em_rounds;
            let mut unrefined = 0;
            let meanwhile = || unrefined = pipeline.take(sweep);
            let perceived = backend.perceive(&prepared.step, rounds, &mut laps, meanwhile)?;
            let output = Output { columns, points };
            let lap = &mut |name| laps.lap(name);
            let flows = pipeline.follow(&Team, &prepared.step, &perceived, before, output, lap);
            laps.lap("follow");
            let (foreground, rays) = (perceived.foreground.len(), perceived.rays);
            Ok(Stepped { prepared, flows, unrefined, foreground, rays, laps })
        })
    }

    /// Tracklets after the last step.
    pub fn tracklets(&self) -> impl Iterator<Item = TrackletState> {
        self.parts.pipeline.tracklets()
    }
}
