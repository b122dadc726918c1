//! From rays to flow: the part of a sweep that a device may do.

use crate::params::{FOREGROUND_MAX, Profile};
use crate::record::{Column, Flow, Proposal, Ray, SweepUniform, is_flow};
use crate::stages::background_filter;
use crate::stages::occupancy_constancy::{self, Scores};
use crate::stages::{
    DISTINCT_COUNT, FLOW, FLOW_PROGRAMS, FOREGROUND_COUNT, FOREGROUND_MARKED, GRID, Storage, run,
};
use crate::team::Team;
use crate::weights::WeightsError;

/// What perception finds in a pair of sweeps.
#[derive(Clone, Copy, Debug)]
pub struct Perceived<'a> {
    /// Columns of the sweep before, in the new window.
    pub columns_before: &'a [Column],
    /// Columns of the new sweep.
    pub columns_now: &'a [Column],
    /// Foreground columns, ascending.
    pub foreground: &'a [u32],
    /// Foreground columns found, those beyond the capacity included.
    pub marked: usize,
    /// Distinct rays traced.
    pub rays: usize,
    /// Flow of every column.
    pub flow: &'a [Flow],
    /// Last proposal of every foreground column: the energy of its flow.
    pub proposal: &'a [Proposal],
}

/// Buffers as perception leaves them, whoever holds them.
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
    /// Whether what they hold can be: a device that fails may leave anything behind. `Err` with
    /// what cannot be.
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

/// What is booked for what a sweep takes beyond the stages of perception: what the CPU does
/// meanwhile as far as they are done before, and, of a device, submission and waiting.
pub const MEANWHILE: &str = "meanwhile";

/// Who keeps the times of the stages.
pub trait StageTimer {
    /// Books the time since the last stage ended to `stage`.
    fn lap(&mut self, stage: &'static str);
    /// Books time measured elsewhere, and to `rest` what else has passed since the last stage
    /// ended.
    fn measured(
        &mut self,
        stages: &mut dyn Iterator<Item = (&'static str, f64)>,
        rest: &'static str,
    );
}

/// Nobody does.
impl StageTimer for () {
    fn lap(&mut self, _: &'static str) {}
    fn measured(&mut self, _: &mut dyn Iterator<Item = (&'static str, f64)>, _: &'static str) {}
}

/// Where rays and the voxels of their origins go.
pub type RayInput<'a> = (&'a mut [Ray], &'a mut [[i32; 4]]);

/// A backend of perception: the twins on the CPU, or the kernels on a device.
pub trait Perceive {
    /// Why it may fail.
    type Error;

    /// Where the rays and the voxels of their origins go: [`crate::params::Profile::returns`] and
    /// [`crate::params::ORIGINS_MAX`] elements, perhaps memory of a device that is slow to read.
    ///
    /// Fails where the backend has failed before.
    fn input(&mut self) -> Result<RayInput<'_>, Self::Error>;

    /// From rays to flow. `meanwhile` is done while a device works, or by another thread of the
    /// team.
    fn perceive(
        &mut self,
        sweep: &SweepUniform,
        team: &impl Team,
        timer: &mut (impl StageTimer + Send),
        meanwhile: impl FnOnce() + Send,
    ) -> Result<Perceived<'_>, Self::Error>;
}

/// Who does the work of a step, and who keeps its time.
pub struct Machine<'a, P, T, C> {
    /// From rays to flow.
    pub backend: &'a mut P,
    /// Threads of the CPU; how many makes no difference to what comes out.
    pub team: &'a T,
    /// Times of the stages.
    pub timer: &'a mut C,
}

/// The learned numbers in the form the kernels and their twins use: slices of the caller's.
#[derive(Clone, Copy, Debug)]
pub struct LearnedTables<'a> {
    /// See [`crate::stages::background_filter::load`]; all zero where there is no filter.
    pub filter_table: &'a [i32],
    /// See [`crate::stages::occupancy_constancy::load`].
    pub constancy_weights: &'a [i32],
    /// Its costs.
    pub constancy_costs: &'a [u32],
}

/// The scalar backend: the stages of [`crate::stages`] over memory that the caller provides.
pub struct ScalarBackend<M> {
    memory: M,
    profile: Profile,
}

impl<M: AsMut<[u32]> + Send> ScalarBackend<M> {
    /// Words of memory it needs for a profile.
    pub fn words(profile: &Profile) -> usize {
        Storage::words(FLOW_PROGRAMS, profile)
    }

    /// Over zeroed memory of [`ScalarBackend::words`].
    pub fn new(memory: M, profile: &Profile, tables: &LearnedTables) -> ScalarBackend<M> {
        let mut scalar = ScalarBackend { memory, profile: profile.clone() };
        let storage = scalar.storage();
        storage.filter_table.copy_from_slice(tables.filter_table);
        storage.constancy_weights.copy_from_slice(tables.constancy_weights);
        storage.constancy_costs.copy_from_slice(tables.constancy_costs);
        scalar
    }

    /// The same with the shipped weights, read into their place; and the range of their scores.
    ///
    /// # Errors
    /// They are of another shape than the profile needs.
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
        // What is not put up with from a device is a defect here.
        assert_eq!(left.check(sweep), Ok(()));
        Ok(left.into())
    }
}
