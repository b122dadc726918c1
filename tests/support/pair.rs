//! Two backends side by side.

use raywake::backend::{Backend, Tables};
use raywake_core::output::{ColumnFlow, Output, PointFlow, ReturnFlow, TrackletState};
use raywake_core::params::POINTS_MAX;
use raywake_core::perceive::{Perceive, Perceived, RayInput, StageTimer, StepContext};
use raywake_core::pipeline::Pipeline;
use raywake_core::prepare::{Preparation, Setup};
use raywake_core::record::SweepUniform;
use raywake_core::team::{SingleThread, Team};
use raywake_gpu::GpuError;
use raywake_sim::SimSweep;
use std::ops::DerefMut;

use crate::difference;
use crate::drives::{self, sweep};

/// A backend with its pipeline, inspected stage by stage.
pub struct Side<P = Box<Pipeline>> {
    setup: Setup,
    pipeline: P,
    backend: Backend,
}

/// A backend that records its inputs and outputs.
struct Witness<'a> {
    backend: &'a mut Backend,
    stages: Stages,
}

impl Perceive for Witness<'_> {
    type Error = GpuError;

    fn input(&mut self) -> Result<RayInput<'_>, GpuError> {
        self.backend.input()
    }

    fn perceive(
        &mut self,
        sweep: &SweepUniform,
        team: &impl Team,
        timer: &mut (impl StageTimer + Send),
        meanwhile: impl FnOnce() + Send,
    ) -> Result<Perceived<'_>, GpuError> {
        let (rays, origins) = self.backend.input()?;
        let rays = rays[..sweep.rays as usize].as_flattened().to_vec();
        let origins = bytemuck::cast_slice(origins.as_flattened()).to_vec();
        self.stages.words.extend([("rays", rays), ("origins", origins)]);
        self.stages.step = *sweep;
        let perceived = self.backend.perceive(sweep, team, timer, meanwhile)?;
        self.stages.perceived(&perceived);
        Ok(perceived)
    }
}

/// Output of each stage of one sweep, in the order of figure 3.1.
#[derive(Default)]
pub struct Stages {
    /// Name and words of the stages up to the flow of columns.
    words: Vec<(&'static str, Vec<u32>)>,
    /// Flow of columns; empty after a reset.
    pub columns: Vec<ColumnFlow>,
    /// Flow of points.
    pub points: Vec<PointFlow>,
    /// Tracklets after the sweep.
    pub tracklets: Vec<TrackletState>,
    /// Sizes and shift of the sweep.
    pub step: SweepUniform,
}

impl Side {
    /// Before the first sweep.
    pub fn new(setup: &drives::Setup, backend: Backend) -> Side {
        Side::with(setup, &setup.tables(), backend)
    }

    /// Before the first sweep, with the given tables.
    pub fn with(setup: &drives::Setup, tables: &Tables, backend: Backend) -> Side {
        let pipeline = raywake_alloc_guard::boxed!(Pipeline, Pipeline::new());
        Side::on(pipeline, setup, tables, backend)
    }
}

impl<P: DerefMut<Target = Pipeline>> Side<P> {
    /// On a pipeline before its first sweep, wherever it is stored.
    pub fn on(
        mut pipeline: P,
        setup: &drives::Setup,
        tables: &Tables,
        backend: Backend,
    ) -> Side<P> {
        let setup = Setup {
            profile: setup.profile.clone(),
            rig: setup.rig.clone(),
            scores: tables.scores,
            moves: tables.moves,
            unfiltered: tables.unfiltered,
            preparation: Preparation::new(),
        };
        pipeline.encoder.set_weights(tables.encoder.as_deref());
        Side { setup, pipeline, backend }
    }

    /// Runs one sweep; `before` is the one before it.
    pub fn step(&mut self, now: &SimSweep, before: Option<&SimSweep>) -> Stages {
        let mut columns = vec![ColumnFlow::default(); self.setup.profile.columns()];
        let mut points = vec![ReturnFlow::default(); POINTS_MAX];
        let out = Output { columns: &mut columns, points: &mut points };
        let seen = before.map_or(&[][..], |b| &b.points);
        let mut witness = Witness { backend: &mut self.backend, stages: Stages::default() };
        let context = StepContext { backend: &mut witness, team: &SingleThread, timer: &mut () };
        let stepped = self.pipeline.step(&self.setup, context, &sweep(now), seen, out);
        let flows = stepped.unwrap_or_else(|e| panic!("{e}")).flows;
        let mut stages = witness.stages;
        if let Some(flows) = flows {
            (stages.columns, stages.points) =
                (flows.columns.to_vec(), flows.points.iter().collect());
        }
        stages.tracklets = self.pipeline.tracklets(&self.setup.profile).collect();
        stages
    }
}

impl Stages {
    fn perceived(&mut self, p: &Perceived) {
        self.words.extend([
            ("ray_merge", vec![p.rays as u32]),
            ("shift", p.columns_before.as_flattened().to_vec()),
            ("background_filter", vec![p.marked as u32]),
            ("compact", p.foreground.to_vec()),
            ("flow", p.flow.to_vec()),
            ("energy", p.proposal.as_flattened().to_vec()),
        ]);
    }

    /// Output of a stage.
    pub fn words(&self, stage: &str) -> &[u32] {
        let found = self.words.iter().find(|w| w.0 == stage);
        &found.unwrap_or_else(|| panic!("no stage `{stage}`")).1
    }

    /// The first stage whose output differs, and where.
    pub fn difference(&self, wanted: &Stages) -> Option<String> {
        let words = self.words.iter().zip(&wanted.words);
        let stages = words.map(|((name, f), (_, w))| (*name, difference(f, w)));
        let ends = [
            ("columns", difference(&self.columns, &wanted.columns)),
            ("points", difference(&self.points, &wanted.points)),
            ("tracklets", difference(&self.tracklets, &wanted.tracklets)),
        ];
        let mut all = stages.chain(ends);
        all.find_map(|(name, d)| Some(format!("`{name}` differs first: {}", d?)))
    }
}
