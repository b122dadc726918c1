//! Costs of pairs of columns, and their sums over the 3x3 window.

use raywake_core::params::{FOREGROUND_MAX, ROW, ROW_WORDS};
use raywake_core::record::{Column, NONE, SweepUniform};
use raywake_core::stages::occupancy_constancy::{
    COST_MAX, SCORES_MAX, SHIPPED, WEIGHT_WORDS, load, occupancy_constancy_by_lines,
};
use raywake_gpu::Kernel;
use raywake_kernels::kernel::{OCCUPANCY_CONSTANCY, WINDOW};
use raywake_tests::bench::Bench;
use raywake_tests::random::Random;
use raywake_tests::weights;

use super::{POISON, packed, window, words};

pub const KERNELS: &[&Kernel] = &[&OCCUPANCY_CONSTANCY, &WINDOW];

/// A classifier in its loaded form.
struct Classifier {
    weights: Vec<i32>,
    costs: Vec<u32>,
    score_min: i32,
}

impl Classifier {
    fn load(text: &str, levels: i32) -> Classifier {
        let (mut weights, mut costs) = (vec![0; WEIGHT_WORDS], vec![0; SCORES_MAX]);
        let scores = load(text, levels as usize, &mut weights, &mut costs).expect("weights");
        Classifier { weights, costs, score_min: scores.min }
    }
}

fn check_constancy(
    case: &str,
    step: &SweepUniform,
    with: &Classifier,
    foreground: &[u32],
    [before, now]: [&[Column]; 2],
) {
    let step = SweepUniform { score_min: with.score_min, ..*step };
    let mut cost = vec![POISON; foreground.len().max(1) * ROW_WORDS];
    let bench = Bench::new(Some(&step))
        .buffer("constancy_weights", bytemuck::cast_slice(&with.weights).to_vec())
        .buffer("constancy_costs", with.costs.clone())
        .buffer("foreground", foreground.to_vec())
        .buffer("columns_before", words(before))
        .buffer("columns_now", words(now))
        .buffer("pair_cost", cost.clone())
        .groups(&OCCUPANCY_CONSTANCY, foreground.len());
    let halves: &mut [u16] = bytemuck::cast_slice_mut(&mut cost);
    raywake_core::stages::occupancy_constancy::occupancy_constancy(
        &step,
        &with.weights,
        &with.costs,
        foreground,
        before,
        now,
        halves,
    );
    // What the scalar backend runs instead, for the list and the list reversed.
    let mut sources = foreground.to_vec();
    let mut wanted: Vec<&[u16]> = halves.chunks(ROW).take(sources.len()).collect();
    for order in ["ascending", "descending"] {
        let (weights, costs) = (&with.weights, &with.costs);
        let mut found = vec![0; sources.len() * ROW];
        occupancy_constancy_by_lines(&step, weights, costs, &sources, before, now, &mut found);
        assert!(found.chunks(ROW).eq(wanted.iter().copied()), "{case}, {order}");
        sources.reverse();
        wanted.reverse();
    }
    if let Some(outcome) = bench.run() {
        outcome.check(&format!("{case}, {} rows", foreground.len()), &[("pair_cost", &cost)]);
    }
}

/// Corners, edges, centre.
fn places(side: u32) -> Vec<u32> {
    let last = side * side - 1;
    vec![0, 1, side - 1, side, last / 2, last - side + 1, last - 1, last]
}

#[test]
fn costs_at_every_place() {
    let mut random = Random::new(9);
    for (case, text, levels) in [
        ("shipped", SHIPPED.to_string(), 14),
        ("random", weights::constancy(10, 14, 80), 14),
        ("high", weights::constancy(11, 16, 200), 16),
        ("flat", weights::constancy(12, 2, 100), 2),
    ] {
        let with = Classifier::load(&text, levels);
        for side in [31u32, 33, 167] {
            let step = window(side as i32, levels);
            let count = (side * side) as usize;
            let [before, now] = [0, 1].map(|_| random.columns(count, levels));
            check_constancy(case, &step, &with, &places(side), [&before, &now]);
            check_constancy(case, &step, &with, &[], [&before, &now]);
            check_constancy(case, &step, &with, &[5], [&now, &before]);
        }
    }
}

#[test]
fn costs_of_every_column() {
    let with = Classifier::load(&weights::constancy(13, 16, 200), 16);
    let step = window(31, 16);
    let all: Vec<u32> = (0..961).collect();
    let masks = [[0, 0], [0xffff, 0], [0xffff << 16, 0xffff], [0x00ff | 0xff00 << 16, 0x100]];
    for source in masks {
        for target in masks {
            let case = format!("{source:x?} to {target:x?}");
            check_constancy(&case, &step, &with, &all, [&[source; 961], &[target; 961]]);
        }
    }
}

/// Checks `window` over these columns and costs.
fn check_window(case: &str, side: u32, foreground: &[u32], cost: &[u16]) {
    let step = SweepUniform { displacement_cost: 3, outside_cost: 99, ..window(side as i32, 14) };
    let mut rank = vec![NONE; (side * side) as usize];
    foreground.iter().enumerate().for_each(|(n, c)| rank[*c as usize] = n as u32);
    let mut least = vec![[POISON; 2]; foreground.len().max(1)];
    let bench = Bench::new(Some(&step))
        .buffer("foreground", foreground.to_vec())
        .buffer("foreground_index", rank.clone())
        .buffer("pair_cost", packed(cost))
        .buffer("min_cost", least.as_flattened().to_vec())
        .groups(&WINDOW, foreground.len());
    raywake_core::stages::window::window(&step, foreground, &rank, cost, &mut least);
    if let Some(outcome) = bench.run() {
        let case = format!("{case}, {} rows", foreground.len());
        outcome.check(&case, &[("min_cost", least.as_flattened())]);
    }
}

#[test]
fn windows_of_every_kind() {
    let mut random = Random::new(14);
    let mut costs = |rows: usize| -> Vec<u16> {
        (0..rows * ROW).map(|_| random.below(COST_MAX + 1) as u16).collect()
    };
    check_window("nothing", 31, &[], &[]);
    check_window("alone", 31, &[480], &costs(1));
    check_window("places", 31, &places(31), &costs(8));
    let all: Vec<u32> = (0..961).collect();
    check_window("everything", 31, &all, &costs(961));
    check_window("the dearest", 31, &all, &vec![COST_MAX as u16; 961 * ROW]);
    let some: Vec<u32> = (0..167 * 167).filter(|n| n % 7 < 2 || n % 167 < 3).collect();
    check_window("some", 167, &some, &costs(some.len()));
    let most: Vec<u32> = (0..337 * 337).filter(|n| n % 5 != 0).take(FOREGROUND_MAX).collect();
    check_window("capacity", 337, &most, &costs(FOREGROUND_MAX));
}
