//! Claims, ranks, winners.

use raywake_core::params::{REACH, ROW_WORKGROUP};
use raywake_core::record::{NONE, Proposal, SweepUniform, pack_flow};
use raywake_core::stages::flow::maximisation::{claim, elect, settle};
use raywake_core::stages::{COUNTERS, FOREGROUND_COUNT};
use raywake_gpu::Kernel;
use raywake_kernels::kernel::{CLAIM, ELECT, SETTLE};
use raywake_tests::bench::Bench;
use raywake_tests::random::Random;

use super::{POISON, around, window};

pub const KERNELS: &[&Kernel] = &[&CLAIM, &ELECT, &SETTLE];

/// Proposals of some columns of a window.
struct Round {
    step: SweepUniform,
    foreground: Vec<u32>,
    proposal: Vec<Proposal>,
}

/// The buffers that a round changes.
#[derive(Clone)]
struct Changed {
    target_energy: Vec<u32>,
    target_index: Vec<u32>,
    state: Vec<u32>,
}

impl Round {
    /// Targets drawn by `aim`, energies below `energies`: a small number causes many ties.
    fn new(
        foreground: Vec<u32>,
        energies: u32,
        random: &mut Random,
        aim: impl Fn(&mut Random) -> [i32; 2],
    ) -> Round {
        let step = window(31, 14);
        let mut propose = |column: &u32| {
            let from = [*column as i32 / 31, *column as i32 % 31];
            let to = aim(random);
            let d = [to[0] - from[0], to[1] - from[1]].map(|d| d.clamp(-REACH, REACH));
            match random.below(9) {
                0 => [0, NONE],
                _ => [pack_flow(d), random.below(energies)],
            }
        };
        Round { step, proposal: foreground.iter().map(&mut propose).collect(), foreground }
    }

    fn bench(&self, start: &Changed) -> Bench {
        let count = self.foreground.len();
        let mut counters = vec![POISON; COUNTERS];
        counters[FOREGROUND_COUNT] = count as u32;
        let [mut foreground, mut proposal] =
            [self.foreground.clone(), bytemuck::cast_slice(&self.proposal).to_vec()];
        // Left over from a round with more columns.
        foreground.extend([0; 2]);
        proposal.extend([pack_flow([0, 0]), 0, pack_flow([1, 1]), 0]);
        Bench::new(Some(&self.step))
            .buffer("counters", counters)
            .buffer("foreground", foreground)
            .buffer("proposal", proposal)
            .buffer("target_energy", start.target_energy.clone())
            .buffer("target_index", start.target_index.clone())
            .buffer("flow", start.state.clone())
    }

    /// Each kernel alone, then all of them in a row.
    fn check(&self, case: &str) {
        let count = self.foreground.len();
        let case = format!("{case}, {count} columns");
        let start = Changed {
            target_energy: vec![NONE; 961],
            target_index: vec![NONE; 961],
            state: vec![POISON; 961],
        };
        let (step, list, proposal) = (&self.step, &self.foreground, &self.proposal);
        let mut after = start.clone();
        for kernel in KERNELS {
            let bench = self.bench(&after).threads(kernel, count + 2);
            match kernel.name {
                "claim" => claim(step, list, proposal, &mut after.target_energy),
                "elect" => {
                    elect(step, list, proposal, &after.target_energy, &mut after.target_index)
                }
                _ => settle(step, list, proposal, &after.target_index, &mut after.state),
            }
            after.check(&format!("{case}, {}", kernel.name), bench);
        }
        let bench = self.bench(&start);
        let bench = KERNELS.iter().fold(bench, |bench, k| bench.threads(k, count + 2));
        after.check(&case, bench);
    }
}

impl Changed {
    fn check(&self, case: &str, bench: Bench) {
        if let Some(outcome) = bench.run() {
            let expected = [
                ("target_energy", &self.target_energy[..]),
                ("target_index", &self.target_index),
                ("flow", &self.state),
            ];
            outcome.check(case, &expected);
        }
    }
}

fn anywhere(random: &mut Random) -> [i32; 2] {
    [random.between(0, 30), random.between(0, 30)]
}

#[test]
fn every_number_of_claimants() {
    let mut random = Random::new(24);
    for count in [around(ROW_WORKGROUP), [2, 300, 900, 960, 961]].concat() {
        let first = random.below(962 - count as u32);
        let columns: Vec<u32> = (first..first + count as u32).collect();
        for energies in [1, 3, 1 << 30] {
            let round = Round::new(columns.clone(), energies, &mut random, anywhere);
            round.check(&format!("any target, {energies} energies"));
            // Only one target is within reach of all: the centre.
            let round = Round::new(columns.clone(), energies, &mut random, |_| [15, 15]);
            round.check(&format!("one target, {energies} energies"));
        }
    }
}

#[test]
fn no_claimants() {
    let foreground: Vec<u32> = (0..961).collect();
    let proposal = vec![[0, NONE]; 961];
    Round { step: window(31, 14), foreground, proposal }.check("no proposals");
}
