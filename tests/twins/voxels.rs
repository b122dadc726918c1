//! Columns from log-odds, and columns shifted into the next window.

use raywake_core::record::SweepUniform;
use raywake_core::stages::grid::{columns::columns, shift::shift};
use raywake_gpu::Kernel;
use raywake_kernels::kernel::{COLUMNS, SHIFT};
use raywake_tests::bench::Bench;
use raywake_tests::random::Random;

use super::{POISON, window, words};

pub const KERNELS: &[&Kernel] = &[&COLUMNS, &SHIFT];

/// Sides whose squares lie around a workgroup's size, and the largest one.
const SIDES: [i32; 5] = [1, 15, 16, 17, 337];

fn check_columns(step: &SweepUniform, log_odds: Vec<i32>) {
    let count = (step.side * step.side) as usize;
    let mut now = vec![[POISON; 2]; count];
    let bench = Bench::new(Some(step))
        .buffer("log_odds", bytemuck::cast_slice(&log_odds).to_vec())
        .buffer("columns_now", words(&now))
        .threads(&COLUMNS, count);
    columns(step, &log_odds, &mut now);
    if let Some(outcome) = bench.run() {
        outcome.check(&format!("{step:?}"), &[("columns_now", &words(&now))]);
    }
}

#[test]
fn columns_of_every_height() {
    let mut random = Random::new(1);
    let extremes = [i32::MIN, i32::MAX, -1, 0, 1, 4, 5, 6, -30, 30, 1_310_720];
    for (side, levels) in SIDES.into_iter().zip([2, 3, 14, 16, 15]) {
        let step = window(side, levels);
        let count = (side * side * levels) as usize;
        let pick = |_| extremes[random.below(extremes.len() as u32) as usize];
        check_columns(&step, (0..count).map(pick).collect());
        check_columns(&step, (0..count).map(|_| random.between(-12, 12)).collect());
        check_columns(&step, vec![0; count]);
        check_columns(&step, vec![5; count]);
    }
}

fn check_shift(step: &SweepUniform, seed: u64) {
    let count = (step.side * step.side) as usize;
    let now = Random::new(seed).columns(count, step.levels);
    let mut before = vec![[POISON; 2]; count];
    let bench = Bench::new(Some(step))
        .buffer("columns_now", words(&now))
        .buffer("columns_before", words(&before))
        .threads(&SHIFT, count);
    shift(step, &now, &mut before);
    if let Some(outcome) = bench.run() {
        outcome.check(&format!("{step:?}"), &[("columns_before", &words(&before))]);
    }
}

#[test]
fn shifts_of_every_size() {
    for (n, side) in SIDES.into_iter().enumerate() {
        for levels in [2, 14, 16] {
            let still = window(side, levels);
            let edge = side - 1;
            for (x, y, z) in [
                (0, 0, 0),
                (1, -2, 1),
                (-edge, edge, 1 - levels),
                (edge, -edge, levels - 1),
                (side, 0, 0),
                (0, -side, levels),
                (0, 0, -side.max(levels)),
            ] {
                let step = SweepUniform { shift_x: x, shift_y: y, shift_z: z, ..still };
                check_shift(&step, n as u64);
            }
        }
    }
}
