//! From rays to flow: the part of a sweep's work that a device may do.

use crate::params::{FOREGROUND_MAX, Profile};
use crate::record::{Column, Flow, Proposal, Ray, SweepUniform, is_flow};
use crate::stages::background_filter;
use crate::stages::occupancy_constancy::{self, Scores};
use crate::stages::{
    DISTINCT_COUNT, FLOW, FLOW_PROGRAMS, FOREGROUND_COUNT, FOREGROUND_MARKED, GRID, Storage, run,
};
use crate::team::Team;
use crate::weights::WeightsError;

/// The results of perception for a pair of sweeps.
#[derive(Clone, Copy, Debug)]
pub struct Perceived<'a> {
    /// Columns of the previous sweep, in the new window.
    pub columns_before: &'a [Column],
    /// Columns of the new sweep.
    pub columns_now: &'a [Column],
    /// Foreground columns, ascending.
    pub foreground: &'a [u32],
    /// Foreground columns found, including those beyond the capacity.
    pub marked: usize,
    /// Number of distinct rays traced.
    pub rays: usize,
    /// Flow of every column.
    pub flow: &'a [Flow],
    /// Last proposal of every foreground column: the energy of its flow.
    pub proposal: &'a [Proposal],
}

/// Buffers as perception leaves them, wherever they are held.
pub struct PerceptionBuffers<'a> {
    /// `counters`.
    pub counters: &'a [u32],
    /// `columns_before`.
    pub columns_before: &'a [Column],
    /// `columns_now`.
    pub columns_now: &'a [Column],
    /// `foreground`.
    pub foreground: &'a [u32],
    /// `flow`.
    pub flow: &'a [Flow],
    /// `proposal`.
    pub proposal: &'a [Proposal],
}

impl PerceptionBuffers<'_> {
    /// Checks that the contents are possible: a failing device may leave anything behind. The error
    /// names what is not.
    pub fn check(&self, sweep: &SweepUniform) -> Result<(), &'static str> {
        let counter = |n: usize| self.counters[n] as usize;
        let (count, marked) = (counter(FOREGROUND_COUNT), counter(FOREGROUND_MARKED));
        let columns = self.flow.len();
        if count > FOREGROUND_MAX || marked < count || marked > columns {
            return Err("the number of foreground columns");
        }
        if counter(DISTINCT_COUNT) > sweep.rays as usize {
            return Err("the number of distinct rays");
        }
        let foreground = &self.foreground[..count];
        let in_window = foreground.last().is_none_or(|&last| (last as usize) < columns);
        if !in_window || foreground.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err("the list of foreground columns");
        }
        if !self.flow.iter().all(|&flow| is_flow(flow)) {
            return Err("the flow of a column");
        }
        let levels = u32::MAX >> (32 - sweep.levels);
        let beyond = [!(levels | levels << 16), !levels];
        let fits = |column: &Column| (0..2).all(|n| column[n] & beyond[n] == 0);
        match self.columns_before.iter().chain(self.columns_now).all(fits) {
            true => Ok(()),
            false => Err("the voxels of a column"),
        }
    }
}

impl<'a> From<PerceptionBuffers<'a>> for Perceived<'a> {
    fn from(o: PerceptionBuffers<'a>) -> Perceived<'a> {
        let count = o.counters[FOREGROUND_COUNT] as usize;
        Perceived {
            columns_before: o.columns_before,
            columns_now: o.columns_now,
            foreground: &o.foreground[..count],
            marked: o.counters[FOREGROUND_MARKED] as usize,
            rays: o.counters[DISTINCT_COUNT] as usize,
            flow: o.flow,
            proposal: &o.proposal[..count],
        }
    }
}

/// The entry for the time a sweep takes beyond the stages of perception: concurrent work on the
/// CPU, as far as it outlasts them, and, for a device, submission and waiting.
pub const MEANWHILE: &str = "meanwhile";

/// Keeps the times of the stages.
pub trait StageTimer {
    /// Attributes the time since the last stage ended to `stage`.
    fn lap(&mut self, stage: &'static str);
    /// Adds times measured elsewhere, and attributes any other time since the last stage ended to
    /// `rest`.
    fn measured(
        &mut self,
        stages: &mut dyn Iterator<Item = (&'static str, f64)>,
        rest: &'static str,
    );
}

/// Keeps no times.
impl StageTimer for () {
    fn lap(&mut self, _: &'static str) {}
    fn measured(&mut self, _: &mut dyn Iterator<Item = (&'static str, f64)>, _: &'static str) {}
}

/// Destination of rays and of the voxels of their origins.
pub type RayInput<'a> = (&'a mut [Ray], &'a mut [[i32; 4]]);

/// A backend of perception: the twins on the CPU, or the kernels on a device.
pub trait Perceive {
    /// Why it may fail.
    type Error;

    /// The destination of rays and of the voxels of their origins:
    /// [`crate::params::Profile::returns`] and [`crate::params::ORIGINS_MAX`] elements, possibly
    /// device memory that is slow to read.
    ///
    /// Fails if the backend has failed before.
    fn input(&mut self) -> Result<RayInput<'_>, Self::Error>;

    /// Runs from rays to flow. `meanwhile` runs while a device works, or on another thread of the
    /// team.
    fn perceive(
        &mut self,
        sweep: &SweepUniform,
        team: &impl Team,
        timer: &mut (impl StageTimer + Send),
        meanwhile: impl FnOnce() + Send,
    ) -> Result<Perceived<'_>, Self::Error>;
}

/// What does the work of a step, and what keeps its times.
pub struct StepContext<'a, P, T, C> {
    /// From rays to flow.
    pub backend: &'a mut P,
    /// CPU threads; their number makes no difference to the results.
    pub team: &'a T,
    /// Times of the stages.
    pub timer: &'a mut C,
}

/// The learned numbers in the form the kernels and their twins use: slices owned by the caller.
#[derive(Clone, Copy, Debug)]
pub struct LearnedTables<'a> {
    /// See [`crate::stages::background_filter::load`]; all zero if there is no filter.
    pub filter_table: &'a [i32],
    /// See [`crate::stages::occupancy_constancy::load`].
    pub constancy_weights: &'a [i32],
    /// The costs that belong to them.
    pub constancy_costs: &'a [u32],
}

/// The scalar backend: the stages of [`crate::stages`] over memory that the caller provides.
pub struct ScalarBackend<M> {
    memory: M,
    profile: Profile,
}

impl<M: AsMut<[u32]> + Send> ScalarBackend<M> {
    /// Words of memory needed for a profile.
    pub fn words(profile: &Profile) -> usize {
        Storage::words(FLOW_PROGRAMS, profile)
    }

    /// A backend over zeroed memory of [`ScalarBackend::words`] words.
    pub fn new(memory: M, profile: &Profile, tables: &LearnedTables) -> ScalarBackend<M> {
        let mut scalar = ScalarBackend { memory, profile: profile.clone() };
        let storage = scalar.storage();
        storage.filter_table.copy_from_slice(tables.filter_table);
        storage.constancy_weights.copy_from_slice(tables.constancy_weights);
        storage.constancy_costs.copy_from_slice(tables.constancy_costs);
        scalar
    }

    /// The same with the shipped weights, read in place; and the range of their scores.
    ///
    /// # Errors
    /// The weights have a different shape than the profile needs.
    pub fn shipped(
        memory: M,
        profile: &Profile,
    ) -> Result<(ScalarBackend<M>, Scores), WeightsError> {
        let mut scalar = ScalarBackend { memory, profile: profile.clone() };
        let Storage { filter_table, constancy_weights, constancy_costs, .. } = scalar.storage();
        let levels = profile.levels as usize;
        background_filter::load(background_filter::shipped(profile.frame), levels, filter_table)?;
        let constancy = occupancy_constancy::shipped(profile.frame);
        let scores =
            occupancy_constancy::load(constancy, levels, constancy_weights, constancy_costs)?;
        Ok((scalar, scores))
    }

    /// The buffers as the last sweep left them.
    pub fn storage(&mut self) -> Storage<'_> {
        Storage::over(self.memory.as_mut(), FLOW_PROGRAMS, &self.profile)
    }
}

impl<M: AsMut<[u32]> + Send> Perceive for ScalarBackend<M> {
    type Error = core::convert::Infallible;

    fn input(&mut self) -> Result<RayInput<'_>, Self::Error> {
        let storage = self.storage();
        Ok((storage.rays, storage.origins))
    }

    fn perceive(
        &mut self,
        sweep: &SweepUniform,
        team: &impl Team,
        timer: &mut (impl StageTimer + Send),
        meanwhile: impl FnOnce() + Send,
    ) -> Result<Perceived<'_>, Self::Error> {
        let rounds = self.profile.em_rounds;
        let mut s = self.storage();
        s.sweep = *sweep;
        let lap = &mut |stage| timer.lap(stage);
        let stages = || [GRID, FLOW].iter().for_each(|ops| run(ops, &mut s, rounds, team, lap));
        team.join(stages, meanwhile);
        timer.lap(MEANWHILE);
        let left = PerceptionBuffers {
            counters: s.counters,
            columns_before: s.columns_before,
            columns_now: s.columns_now,
            foreground: s.foreground,
            flow: s.flow,
            proposal: s.proposal,
        };
        // What would be tolerated as a device failure is a bug here.
        assert_eq!(left.check(sweep), Ok(()));
        Ok(left.into())
    }
}
