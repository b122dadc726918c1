//! Two backends side by side.

use raywake::backend::{Backend, Tables};
use raywake::laps::Laps;
use raywake_core::output::{ColumnFlow, PointFlow, TrackletState};
use raywake_core::params::{POINTS_MAX, Profile};
use raywake_core::pipeline::{Output, Perceived, Pipeline};
use raywake_core::team::Alone;
use raywake_sim::SimSweep;

use crate::difference;
use crate::drives::{Setup, sweep};

/// A backend with its pipeline, looked at stage by stage.
pub struct Side {
    pipeline: Box<Pipeline>,
    backend: Backend,
}

/// What each stage of one sweep left behind, in the order of figure 3.1.
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
    pub step: raywake_core::record::Step,
}

impl Side {
    /// At rest.
    pub fn new(setup: &Setup, backend: Backend) -> Side {
        Side::with(setup, &setup.tables(), backend)
    }

    /// At rest, with tables of one's own.
    pub fn with(setup: &Setup, tables: &Tables, backend: Backend) -> Side {
        let profile = setup.profile.clone();
        let pipeline = Pipeline::new(profile, setup.rig.clone(), tables.scores, tables.unfiltered);
        Side { pipeline: Box::new(pipeline), backend }
    }

    /// One sweep; `before` is the sweep before it.
    pub fn step(&mut self, now: &SimSweep, before: Option<&SimSweep>) -> Stages {
        let (rays, origins) = self.backend.input();
        let prepared = self.pipeline.prepare(&Alone, &sweep(now), rays, origins);
        let rays = rays[..prepared.step.rays as usize].as_flattened().to_vec();
        let origins = bytemuck::cast_slice(origins.as_flattened()).to_vec();
        let mut laps = Laps::start();
        let profile: &Profile = self.pipeline.profile();
        let (rounds, columns) = (profile.em_rounds, profile.columns());
        let (pipeline, sweep) = (&mut self.pipeline, sweep(now));
        let meanwhile = || _ = pipeline.take(&sweep);
        let perceived = self.backend.perceive(&prepared.step, rounds, &mut laps, meanwhile);
        let perceived = perceived.unwrap_or_else(|e| panic!("{e}"));
        let mut stages = Stages { step: prepared.step, ..Stages::default() };
        stages.words.extend([("rays", rays), ("origins", origins)]);
        stages.perceived(&perceived);
        let mut columns = vec![ColumnFlow::default(); columns];
        let mut points = vec![PointFlow::default(); POINTS_MAX];
        let output = Output { columns: &mut columns, points: &mut points };
        let seen = before.map_or(&[][..], |b| &b.points);
        if let Some(flows) =
            self.pipeline.follow(&Alone, &prepared.step, &perceived, seen, output, &mut |_| ())
        {
            (stages.columns, stages.points) = (flows.columns.to_vec(), flows.points.to_vec());
        }
        stages.tracklets = self.pipeline.tracklets().collect();
        stages
    }
}

impl Stages {
    fn perceived(&mut self, p: &Perceived) {
        self.words.extend([
            ("ray_merge", vec![p.rays as u32]),
            ("shift", p.before.as_flattened().to_vec()),
            ("background_filter", vec![p.marked as u32]),
            ("compact", p.foreground.to_vec()),
            ("flow", p.state.to_vec()),
            ("energy", p.proposal.as_flattened().to_vec()),
        ]);
    }

    /// What a stage left behind.
    pub fn words(&self, stage: &str) -> &[u32] {
        let found = self.words.iter().find(|w| w.0 == stage);
        &found.unwrap_or_else(|| panic!("no stage `{stage}`")).1
    }

    /// The first stage that left something else behind, and where.
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
