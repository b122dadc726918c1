//! One sweep through figure 3.1 on the chosen backend. Nothing in here allocates.

use raywake_alloc_guard::Sealed;
use raywake_core::output::{self, ColumnFlow, Output, ReturnFlow, TrackletState};
use raywake_core::params::{Profile, SOLID_MAX};
use raywake_core::perceive::Machine;
use raywake_core::pipeline::Pipeline;
use raywake_core::prepare::{Preparation, Setup};
use raywake_core::sweep::{Point, Rig, Sweep};

use crate::backend::{Backend, Tables};
use crate::error::RunError;
use crate::laps::Laps;
use crate::team::ThreadTeam;

/// The pipeline with its backend and the storage of its results. Nothing is allocated once it is
/// made.
pub struct Drive {
    parts: Sealed<Parts>,
}

struct Parts {
    setup: Setup,
    pipeline: Box<Pipeline>,
    backend: Backend,
    columns: Vec<ColumnFlow>,
    points: Vec<ReturnFlow>,
}

/// Room for columns that are put out.
fn solid(profile: &Profile) -> usize {
    profile.columns().min(SOLID_MAX)
}

/// What one sweep yields, and how long it took.
pub struct Stepped<'a> {
    /// What comes out.
    pub output: output::SweepOutput<'a>,
    /// Time of every stage.
    pub laps: Laps,
}

impl Drive {
    /// Allocates for a checked profile.
    pub fn new(profile: &Profile, rig: &Rig, tables: &Tables, backend: Backend) -> Drive {
        // A constant is written to its place: by way of the stack it would need 30 MiB of it.
        let mut pipeline = raywake_alloc_guard::boxed!(Pipeline, Pipeline::new());
        pipeline.encoder.set_weights(tables.encoder.as_deref());
        let parts = Parts {
            setup: Setup {
                profile: profile.clone(),
                rig: rig.clone(),
                scores: tables.scores,
                unfiltered: tables.unfiltered,
                preparation: Preparation::new(),
            },
            pipeline,
            backend,
            columns: vec![ColumnFlow::default(); solid(profile)],
            points: vec![ReturnFlow::default(); profile.returns()],
        };
        Drive { parts: Sealed::new("sweep", parts) }
    }

    /// Bytes of host memory held for a profile, the backend's apart.
    pub fn bytes(profile: &Profile) -> usize {
        size_of::<Pipeline>()
            + solid(profile) * size_of::<ColumnFlow>()
            + profile.returns() * size_of::<ReturnFlow>()
    }

    /// The backend.
    pub fn backend(&self) -> &Backend {
        &self.parts.backend
    }

    /// One sweep. `before` holds the points of the sweep before, whose flow comes back.
    ///
    /// # Errors
    /// [`RunError::Device`], after which every later step fails; [`RunError::Allocation`], after
    /// which the next sweep may be given.
    pub fn step<'a>(
        &'a mut self,
        sweep: &Sweep,
        before: &'a [Point],
    ) -> Result<Stepped<'a>, RunError> {
        self.parts.step(|Parts { setup, pipeline, backend, columns, points }| {
            let mut laps = Laps::start();
            let machine = Machine { backend, team: &ThreadTeam, timer: &mut laps };
            let output =
                pipeline.step(setup, machine, sweep, before, Output { columns, points })?;
            Ok(Stepped { output, laps })
        })
    }

    /// Whether columns and returns come with a class.
    pub fn tells_classes(&self) -> bool {
        self.parts.pipeline.encoder.is_on()
    }

    /// Tracklets after the last step.
    pub fn tracklets(&self) -> impl Iterator<Item = TrackletState> {
        self.parts.pipeline.tracklets(&self.parts.setup.profile)
    }
}
