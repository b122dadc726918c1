//! One sweep through figure 3.1 on the chosen backend. A step allocates nothing, except when a
//! device fails and the CPU takes over.

use raywake_alloc_guard::Sealed;
use raywake_core::output::{ColumnFlow, Output, ReturnFlow, SweepOutput, TrackletState};
use raywake_core::params::{Profile, SOLID_MAX};
use raywake_core::perceive::{StageTimer, StepContext};
use raywake_core::pipeline::Pipeline;
use raywake_core::prepare::{Preparation, Setup};
use raywake_core::sweep::{Point, Rig, Sweep};
use raywake_core::team::Team;
use raywake_gpu::GpuError;
use raywake_simd::Simd;

use crate::backend::{Backend, Tables};
use crate::console::warn;
use crate::error::RunError;
use crate::laps::Laps;
use crate::team::ThreadTeam;

/// The pipeline with its backend and the storage of its results. Once created, it allocates nothing
/// unless a device fails.
pub struct Drive {
    parts: Sealed<Parts>,
    spare: Option<Spare>,
    failover: Option<Failover>,
}

/// What is needed to create the scalar backend should the device fail.
struct Spare {
    profile: Profile,
    rig: Rig,
    tables: Tables,
    team: ThreadTeam,
}

/// The replacement of a device that failed. The device itself is kept, as waiting for it to finish
/// may take long.
struct Failover {
    failure: GpuError,
    parts: Sealed<Parts>,
}

struct Parts {
    setup: Setup,
    pipeline: Box<Pipeline>,
    backend: Backend,
    team: ThreadTeam,
    columns: Vec<ColumnFlow>,
    points: Vec<ReturnFlow>,
}

/// Capacity for output columns.
fn solid(profile: &Profile) -> usize {
    profile.columns().min(SOLID_MAX)
}

/// The output of one sweep, and its timing.
pub struct Stepped<'a> {
    /// The output.
    pub output: SweepOutput<'a>,
    /// Time of each stage.
    pub laps: Laps,
}

impl Drive {
    /// Allocates for a checked profile. `simd` is as in [`ThreadTeam::new`].
    pub fn new(
        profile: &Profile,
        rig: &Rig,
        tables: &Tables,
        backend: Backend,
        simd: Option<Simd>,
    ) -> Drive {
        let parts = Parts::new(profile, rig, tables, backend, ThreadTeam::new(simd));
        Drive { parts, spare: None, failover: None }
    }

    /// The same, with the scalar backend to fall back on if the device fails.
    pub fn with_spare(self, tables: Tables) -> Drive {
        let Setup { profile, rig, .. } = &self.parts.setup;
        let (profile, rig) = (profile.clone(), rig.clone());
        let spare = Spare { profile, rig, tables, team: self.parts.team };
        let on_device = matches!(self.parts.backend, Backend::Device(_));
        Drive { spare: on_device.then_some(spare), ..self }
    }

    /// Bytes of host memory held for a profile, excluding the backend's.
    pub fn bytes(profile: &Profile) -> usize {
        size_of::<Pipeline>()
            + solid(profile) * size_of::<ColumnFlow>()
            + profile.returns() * size_of::<ReturnFlow>()
    }

    /// The original backend, even if its device has failed.
    pub fn backend(&self) -> &Backend {
        &self.parts.backend
    }

    /// How the device failed, if the scalar backend has taken over.
    pub fn failure(&self) -> Option<&GpuError> {
        self.failover.as_ref().map(|failover| &failover.failure)
    }

    /// Processes one sweep. `before` holds the points of the sweep before, whose flow is returned.
    ///
    /// If the device fails and there is a spare, the user is warned and the sweep is processed
    /// again by the scalar backend, as the first one.
    ///
    /// # Errors
    /// [`RunError::Device`] without a spare, after which every later step fails;
    /// [`RunError::Allocation`], after which the next sweep may be passed in.
    pub fn step<'a>(
        &'a mut self,
        sweep: &Sweep,
        before: &'a [Point],
    ) -> Result<Stepped<'a>, RunError> {
        let mut laps = Laps::start();
        let output = self.step_timed(sweep, before, &mut laps)?;
        Ok(Stepped { output, laps })
    }

    /// As [`Drive::step`], with the stages timed by the caller's timer.
    ///
    /// # Errors
    /// As for [`Drive::step`].
    pub fn step_timed<'a>(
        &'a mut self,
        sweep: &Sweep,
        before: &'a [Point],
        timer: &mut (impl StageTimer + Send),
    ) -> Result<SweepOutput<'a>, RunError> {
        let Drive { parts, spare, failover } = self;
        if let Some(failover) = failover {
            return step(&mut failover.parts, sweep, before, timer);
        }
        match (step(parts, sweep, before, timer), spare) {
            (Err(RunError::Device(failure)), Some(spare)) => {
                warn(&format!("device: {failure}: continuing on the scalar backend"));
                let failover = failover.insert(Failover { failure, parts: spare.parts() });
                step(&mut failover.parts, sweep, &[], timer)
            }
            (stepped, _) => stepped,
        }
    }

    /// The parts in use.
    fn active(&self) -> &Parts {
        self.failover.as_ref().map_or(&self.parts, |failover| &failover.parts)
    }

    /// The instruction set used by the CPU's part of a step.
    pub fn simd(&self) -> Simd {
        self.parts.team.simd()
    }

    /// Whether columns and returns are classified.
    pub fn has_classes(&self) -> bool {
        self.active().pipeline.encoder.has_weights()
    }

    /// Tracklets after the last step.
    pub fn tracklets(&self) -> impl Iterator<Item = TrackletState> + Clone {
        let parts = self.active();
        parts.pipeline.tracklets(&parts.setup.profile)
    }
}

impl Spare {
    fn parts(&self) -> Sealed<Parts> {
        let Spare { profile, rig, tables, team } = self;
        Parts::new(profile, rig, tables, Backend::scalar(profile, tables), *team)
    }
}

impl Parts {
    fn new(
        profile: &Profile,
        rig: &Rig,
        tables: &Tables,
        backend: Backend,
        team: ThreadTeam,
    ) -> Sealed<Parts> {
        // A constant is written in place; via the stack it would need 30 MiB of it.
        let mut pipeline = raywake_alloc_guard::boxed!(Pipeline, Pipeline::new());
        pipeline.encoder.set_weights(tables.encoder.as_deref());
        let parts = Parts {
            setup: Setup {
                profile: profile.clone(),
                rig: rig.clone(),
                scores: tables.scores,
                moves: tables.moves,
                unfiltered: tables.unfiltered,
                preparation: Preparation::new(),
            },
            pipeline,
            backend,
            team,
            columns: vec![ColumnFlow::default(); solid(profile)],
            points: vec![ReturnFlow::default(); profile.returns()],
        };
        Sealed::new("sweep", parts)
    }
}

/// Processes one sweep with the given parts.
fn step<'a>(
    parts: &'a mut Sealed<Parts>,
    sweep: &Sweep,
    before: &'a [Point],
    timer: &mut (impl StageTimer + Send),
) -> Result<SweepOutput<'a>, RunError> {
    parts.step(|Parts { setup, pipeline, backend, team, columns, points }| {
        let context = StepContext { backend, team, timer };
        Ok(pipeline.step(setup, context, sweep, before, Output { columns, points })?)
    })
}
