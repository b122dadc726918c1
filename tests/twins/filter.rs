//! The background filter.

use raywake_core::params::{ROW_WORKGROUP, TILE};
use raywake_core::record::{Column, SweepUniform};
use raywake_core::stages::background_filter::{TABLE_WORDS, background_filter, load};
use raywake_gpu::Kernel;
use raywake_kernels::kernel::BACKGROUND_FILTER;
use raywake_tests::bench::Bench;
use raywake_tests::random::Random;
use raywake_tests::weights;

use super::{POISON, window, words};

pub const KERNELS: &[&Kernel] = &[&BACKGROUND_FILTER];

/// Largest weight with which no sum over 25 columns exceeds 32 bits.
const WEIGHT_MAX: i32 = 5_000_000;

fn table(text: &str, levels: i32) -> Vec<i32> {
    let mut table = vec![0; TABLE_WORDS];
    load(text, levels as usize, &mut table).expect("a weights file");
    table
}

fn check(case: &str, step: &SweepUniform, table: &[i32], before: &[Column]) -> usize {
    let mut marks = vec![POISON; before.len()];
    let bench = Bench::new(Some(step))
        .buffer("filter_table", bytemuck::cast_slice(table).to_vec())
        .buffer("columns_before", words(before))
        .buffer("foreground_marks", marks.clone())
        .groups(&BACKGROUND_FILTER, before.len().div_ceil(TILE));
    background_filter(step, table, before, &mut marks);
    if let Some(outcome) = bench.run() {
        outcome.check(&format!("{case}, {step:?}"), &[("foreground_marks", &marks)]);
    }
    marks.iter().sum::<u32>() as usize
}

#[test]
fn filters_of_every_kind() {
    let sides = [1, 3, 7, 8, 9, 31, 167, 337];
    assert!(sides.contains(&8) && ROW_WORKGROUP == 8 * 8);
    let mut random = Random::new(5);
    for levels in [14, 16] {
        let mild = table(&weights::filter(6, levels as usize, 1000, 3), levels);
        let strong = table(&weights::filter(7, levels as usize, WEIGHT_MAX, -1), levels);
        for side in sides {
            let step = window(side, levels);
            let count = (side * side) as usize;
            let columns = random.columns(count, levels);
            let kept = check("mild", &step, &mild, &columns);
            assert!(side < 31 || kept > count / 10 && kept < count * 9 / 10, "{kept} of {count}");
            check("strong", &step, &strong, &columns);
            let all = check("open", &SweepUniform { unfiltered: 1, ..step }, &mild, &columns);
            assert_eq!(all, columns.iter().filter(|c| c[1] != 0).count());
        }
    }
}

#[test]
fn columns_of_every_kind() {
    let step = window(31, 16);
    let filter = table(&weights::filter(8, 16, WEIGHT_MAX, 0), 16);
    for (case, column) in [
        ("unknown", [0, 0]),
        ("free", [0xffff, 0]),
        ("occupied", [0xffff << 16, 0xffff]),
        ("mixed", [0x5555 | 0xaaaa << 16, 0xaaaa]),
    ] {
        check(case, &step, &filter, &[column; 961]);
    }
    let closed = table(&weights::closed_filter(16), 16);
    assert_eq!(check("closed", &step, &closed, &[[0xffff << 16, 1]; 961]), 0);
}
