//! Group counts. No twin: the scalar backend loops over slices.

use raywake_core::params::{FOREGROUND_MAX, POINTS_MAX, ROW_WORKGROUP};
use raywake_core::stages::{
    COUNTERS, DISTINCT_COUNT, FOREGROUND_COUNT, GROUPS_DISTINCT, GROUPS_FOREGROUND, GROUPS_ROWS,
};
use raywake_gpu::Kernel;
use raywake_kernels::kernel::PLAN;
use raywake_tests::bench::Bench;

use super::{POISON, around};

pub const KERNELS: &[&Kernel] = &[&PLAN];

fn check(rays: usize, columns: usize) {
    let mut counters = vec![POISON; COUNTERS];
    (counters[DISTINCT_COUNT], counters[FOREGROUND_COUNT]) = (rays as u32, columns as u32);
    let bench = Bench::new(None).buffer("counters", counters.clone()).groups(&PLAN, 1);
    let (rays, columns) = (rays.min(POINTS_MAX), columns.min(FOREGROUND_MAX));
    for (at, groups) in [
        (GROUPS_DISTINCT, rays.div_ceil(ROW_WORKGROUP)),
        (GROUPS_FOREGROUND, columns.div_ceil(ROW_WORKGROUP)),
        (GROUPS_ROWS, columns),
    ] {
        counters[at..at + 3].copy_from_slice(&[groups as u32, 1, 1]);
    }
    if let Some(outcome) = bench.run() {
        outcome.check(&format!("{rays} rays, {columns} columns"), &[("counters", &counters)]);
    }
}

#[test]
fn group_counts_are_rounded_up_and_clamped() {
    for n in around(ROW_WORKGROUP) {
        check(n, 2 * n);
    }
    check(POINTS_MAX, FOREGROUND_MAX);
    check(POINTS_MAX + 1, FOREGROUND_MAX + 1);
    check(u32::MAX as usize, u32::MAX as usize);
}
