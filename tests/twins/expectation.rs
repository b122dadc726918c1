//! Proposals of the expectation step.

use raywake_core::params::{REACH, ROW, ROW_WORKGROUP};
use raywake_core::record::{MinCost, NONE, Proposal, SweepUniform, pack_flow};
use raywake_core::stages::flow::expectation::expectation;
use raywake_core::stages::occupancy_constancy::COST_MAX;
use raywake_core::stages::window::window as least_of;
use raywake_core::stages::{COUNTERS, FOREGROUND_COUNT};
use raywake_gpu::{Kernel, Options, Validation};
use raywake_kernels::kernel::{EXPECTATION, EXPECTATION_BY_RINGS};
use raywake_tests::bench::Bench;
use raywake_tests::random::Random;
use raywake_tests::vulkan;

use super::{POISON, around, packed, window};

pub const KERNELS: &[&Kernel] = &[&EXPECTATION, &EXPECTATION_BY_RINGS];

/// Inputs of a round of expectation.
struct Round {
    step: SweepUniform,
    foreground: Vec<u32>,
    rank: Vec<u32>,
    costs: Vec<u16>,
    state: Vec<u32>,
    target_energy: Vec<u32>,
    least: Vec<MinCost>,
}

impl Round {
    /// The first round of some columns: no flow yet, no target taken.
    fn first(step: SweepUniform, foreground: Vec<u32>, mut cost: impl FnMut() -> u16) -> Round {
        let columns = (step.side * step.side) as usize;
        let mut rank = vec![NONE; columns];
        foreground.iter().enumerate().for_each(|(n, c)| rank[*c as usize] = n as u32);
        let costs: Vec<u16> = (0..foreground.len() * ROW).map(|_| cost()).collect();
        let mut least = vec![[NONE; 2]; foreground.len()];
        least_of(&step, &foreground, &rank, &costs, &mut least);
        Round {
            rank,
            costs,
            least,
            foreground,
            step,
            state: vec![0; columns],
            target_energy: vec![NONE; columns],
        }
    }

    /// Compares both kernels with the twin. Returns the proposals.
    fn check(&self, case: &str) -> Vec<Proposal> {
        self.check_on(&Options::default(), case)
    }

    /// The same on a given device.
    fn check_on(&self, options: &Options, case: &str) -> Vec<Proposal> {
        let count = self.foreground.len();
        let mut proposal = vec![[POISON; 2]; count];
        let mut counters = vec![POISON; COUNTERS];
        counters[FOREGROUND_COUNT] = count as u32;
        let mut foreground = self.foreground.clone();
        // Left over from a sweep with more of them.
        foreground.extend([0; 3]);
        let poisoned = padded(bytemuck::cast_slice(&proposal));
        let bench = || {
            Bench::new(Some(&self.step))
                .buffer("counters", counters.clone())
                .buffer("foreground", foreground.clone())
                .buffer("foreground_index", self.rank.clone())
                .buffer("pair_cost", packed(&self.costs))
                .buffer("flow", self.state.clone())
                .buffer("target_energy", self.target_energy.clone())
                .buffer("min_cost", padded(self.least.as_flattened()))
                .buffer("proposal", poisoned.clone())
        };
        let runs = [
            (&EXPECTATION, bench().groups(&EXPECTATION, count)),
            (&EXPECTATION_BY_RINGS, bench().threads(&EXPECTATION_BY_RINGS, count + 3)),
        ];
        expectation(
            &self.step,
            &self.foreground,
            &self.rank,
            &self.costs,
            &self.state,
            &self.target_energy,
            &self.least,
            &mut proposal,
        );
        let wanted = padded(bytemuck::cast_slice(&proposal));
        for (kernel, run) in runs {
            let Some(outcome) = run.run_on(options) else { continue };
            let case = format!("{}: {case}, {count} columns, {:?}", kernel.name, self.step);
            outcome.check(&case, &[("proposal", &wanted)]);
        }
        proposal
    }
}

/// Appends words that must stay unchanged.
fn padded(words: &[u32]) -> Vec<u32> {
    [words, &[POISON; 3]].concat()
}

fn any_flow(random: &mut Random) -> u32 {
    pack_flow([random.between(-REACH, REACH), random.between(-REACH, REACH)])
}

/// Settings from zero to the upper limits of a profile.
const SETTINGS: [[i32; 3]; 5] =
    [[1000, 1, 693], [1000, 1, 17_289], [0, 0, 0], [10_000, 1000, 100_000], [100, 0, 693]];

fn with(side: i32, [smoothing, displacement_cost, outside_cost]: [i32; 3]) -> SweepUniform {
    SweepUniform { smoothing, displacement_cost, outside_cost, ..window(side, 14) }
}

/// A first round, then later ones over states and targets of every kind.
fn check_rounds(case: &str, mut round: Round, seed: u64) {
    let mut random = Random::new(seed);
    round.check(&format!("{case}, first round"));
    for (filled, share) in [("a sixth", 6), ("half", 2), ("all", 1)] {
        for flow in &mut round.state {
            *flow = if random.below(share) == 0 { any_flow(&mut random) } else { 0 };
        }
        round.target_energy.fill(NONE);
        round.check(&format!("{case}, {filled} with flow"));
        for energy in &mut round.target_energy {
            *energy = if random.below(3) == 0 { NONE } else { random.below(30_000) };
        }
        round.check(&format!("{case}, {filled} with flow, targets taken"));
        // Only the column's own flow is feasible.
        round.target_energy.fill(0);
        round.check(&format!("{case}, {filled} with flow, no target left"));
    }
}

#[test]
fn rounds_of_every_size() {
    let mut random = Random::new(18);
    for (count, settings) in around(ROW_WORKGROUP).into_iter().zip(SETTINGS) {
        let foreground = (0..count as u32).map(|n| n * 14 + n % 3).collect();
        let cost = || random.below(COST_MAX + 1) as u16;
        check_rounds("some", Round::first(with(31, settings), foreground, cost), count as u64);
    }
}

#[test]
fn rounds_of_every_setting() {
    let mut random = Random::new(19);
    for settings in SETTINGS {
        for side in [31, 33] {
            let all = (0..(side * side) as u32).collect();
            let few_values = || 700 * random.below(4) as u16;
            check_rounds("ties", Round::first(with(side, settings), all, few_values), 20);
        }
        let all: Vec<u32> = (0..961).collect();
        check_rounds("free", Round::first(with(31, settings), all.clone(), || 0), 21);
        check_rounds("dear", Round::first(with(31, settings), all, || COST_MAX as u16), 22);
    }
}

#[test]
fn flows_that_agree() {
    let mut random = Random::new(23);
    for settings in SETTINGS {
        let all = (0..961).collect();
        let mut round = Round::first(with(31, settings), all, || random.below(COST_MAX + 1) as u16);
        round.check("agreement, first round");
        for d in [[0, 0], [REACH, REACH], [-REACH, REACH], [3, -7]] {
            round.state.fill(pack_flow(d));
            round.check(&format!("all by {d:?}"));
        }
    }
}

#[test]
fn nothing_is_feasible_if_every_target_is_taken() {
    let mut round = Round::first(with(31, SETTINGS[0]), (0..961).collect(), || 9);
    round.target_energy.fill(0);
    let proposal = round.check("taken");
    assert!(proposal.iter().all(|p| *p == [0, NONE]));
}

/// In the whole pipeline, which `validation.rs` covers, a device runs one of the two; here both.
#[test]
fn no_access_out_of_bounds_is_found() {
    let Some(options) = vulkan::under(Validation::GpuAssisted) else { return };
    let mut random = Random::new(24);
    let all = (0..961).collect();
    let mut round = Round::first(with(31, SETTINGS[0]), all, || random.below(COST_MAX + 1) as u16);
    round.check_on(&options, "first round");
    round.state.fill_with(|| any_flow(&mut random));
    round.target_energy.fill(0);
    round.check_on(&options, "no target left");
}
