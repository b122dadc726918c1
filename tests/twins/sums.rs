//! Prefix sums and compaction.

use raywake_core::params::{COLUMNS_MAX, FOREGROUND_MAX, TILE, WORKGROUP};
use raywake_core::stages::compact::compact;
use raywake_core::stages::prefix_sum::prefix_sum;
use raywake_core::stages::{COUNTERS, FOREGROUND_COUNT, FOREGROUND_MARKED};
use raywake_gpu::Kernel;
use raywake_kernels::kernel::{COMPACT, REDUCE, SCAN, SPINE};
use raywake_tests::bench::Bench;
use raywake_tests::random::Random;

use super::{POISON, around};

pub const KERNELS: &[&Kernel] = &[&REDUCE, &SPINE, &SCAN, &COMPACT];

/// Checks all three kernels of the sum, each also separately.
fn check_sum(case: &str, values: &[u32]) {
    let count = values.len();
    let groups = count.div_ceil(TILE);
    // Behind the tiles, the spine stores the total.
    let mut totals = vec![POISON; TILE + 1];
    for (total, tile) in totals.iter_mut().zip(values.chunks(TILE)) {
        *total = tile.iter().sum();
    }
    let mut offsets = totals.clone();
    let mut sums = vec![0; count];
    prefix_sum(values, &mut offsets, &mut sums);
    prefix_sum(&totals[..groups], &mut [0; TILE + 1], &mut offsets[..groups]);

    let bench = |tiles: &[u32]| {
        Bench::new(None)
            .buffer("values", values.to_vec())
            .buffer("tiles", tiles.to_vec())
            .buffer("sums", vec![POISON; count])
    };
    let poisoned = [POISON; TILE + 1];
    let all = bench(&poisoned).groups(&REDUCE, groups).groups(&SPINE, 1).groups(&SCAN, groups);
    let Some(outcome) = all.run() else { return };
    outcome.check(case, &[("tiles", &offsets), ("sums", &sums)]);
    for (kernel, groups, tiles, expected) in [
        (&REDUCE, groups, &poisoned[..], ("tiles", &totals)),
        (&SPINE, 1, &totals[..], ("tiles", &offsets)),
        (&SCAN, groups, &offsets[..], ("sums", &sums)),
    ] {
        if let Some(outcome) = bench(tiles).groups(kernel, groups).run() {
            outcome.check(&format!("{case}, {}", kernel.name), &[(expected.0, expected.1)]);
        }
    }
}

#[test]
fn sums_of_every_length() {
    let mut random = Random::new(2);
    let tiles = [around(WORKGROUP), around(TILE), around(2 * TILE), around(COLUMNS_MAX)];
    let mut sizes: Vec<usize> = tiles.into_iter().flatten().filter(|n| *n > 0).collect();
    sizes.extend([TILE * TILE - 1, TILE * TILE]);
    sizes.sort();
    sizes.dedup();
    for size in sizes {
        // Just small enough for the longest sum to fit into a word.
        let values: Vec<u32> = (0..size).map(|_| random.below(4096)).collect();
        check_sum(&format!("{size} values"), &values);
    }
}

#[test]
fn sums_of_every_kind() {
    let size = 3 * TILE + 77;
    let ascending: Vec<u32> = (0..size as u32).collect();
    let mut last = vec![0; size];
    last[size - 1] = u32::MAX;
    check_sum("zeros", &vec![0; size]);
    check_sum("ones", &vec![1; size]);
    check_sum("sorted", &ascending);
    check_sum("reversed", &ascending.iter().rev().copied().collect::<Vec<_>>());
    check_sum("all of it at the end", &last);
    last.rotate_right(1);
    last.swap(0, TILE);
    check_sum("all of it in the middle", &last);
}

fn check_compact(case: &str, marks: &[u32], capacity: usize) {
    let count = marks.len();
    let mut index = vec![0; count];
    prefix_sum(marks, &mut [0; TILE + 1], &mut index);
    let mut list = vec![POISON; capacity];
    let mut counters = vec![POISON; COUNTERS];
    let bench = Bench::new(None)
        .buffer("foreground_marks", marks.to_vec())
        .buffer("foreground_index", index.clone())
        .buffer("foreground", list.clone())
        .buffer("counters", counters.clone())
        .threads(&COMPACT, count);
    compact(marks, &mut index, &mut list, &mut counters);
    if let Some(outcome) = bench.run() {
        let expected =
            [("foreground_index", &index[..]), ("foreground", &list), ("counters", &counters)];
        outcome.check(&format!("{case}, {count} marks, room for {capacity}"), &expected);
    }
}

#[test]
fn lists_of_every_length() {
    let mut random = Random::new(3);
    for count in [1, WORKGROUP - 1, WORKGROUP, WORKGROUP + 1, 167 * 167, COLUMNS_MAX] {
        let marks: Vec<u32> = (0..count).map(|_| (random.below(5) == 0) as u32).collect();
        let marked = marks.iter().sum::<u32>() as usize;
        for capacity in [marked.max(2) - 1, marked + 1, FOREGROUND_MAX] {
            check_compact("random", &marks, capacity);
        }
        check_compact("none", &vec![0; count], FOREGROUND_MAX);
        check_compact("all", &vec![1; count], FOREGROUND_MAX);
        check_compact("all", &vec![1; count], count);
    }
}

#[test]
fn the_prefix_sum_feeds_the_list() {
    let mut random = Random::new(4);
    let marks: Vec<u32> = (0..COLUMNS_MAX).map(|_| random.below(2)).collect();
    let mut index = vec![POISON; marks.len()];
    let mut list = vec![POISON; FOREGROUND_MAX];
    // To the prefix sum the marks are `values` and the indices are `sums`.
    let bench = Bench::new(None)
        .buffer("values", marks.clone())
        .buffer("tiles", vec![POISON; TILE + 1])
        .buffer("sums", index.clone())
        .groups(&REDUCE, COLUMNS_MAX / TILE)
        .groups(&SPINE, 1)
        .groups(&SCAN, COLUMNS_MAX / TILE);
    let Some(outcome) = bench.run() else { return };
    let summed = outcome.words("sums").to_vec();
    let bench = Bench::new(None)
        .buffer("foreground_marks", marks.clone())
        .buffer("foreground_index", summed)
        .buffer("foreground", list.clone())
        .buffer("counters", vec![0; COUNTERS])
        .threads(&COMPACT, COLUMNS_MAX);
    let mut counters = vec![0; COUNTERS];
    prefix_sum(&marks, &mut [0; TILE + 1], &mut index);
    compact(&marks, &mut index, &mut list, &mut counters);
    assert!(counters[FOREGROUND_MARKED] > counters[FOREGROUND_COUNT], "more marks than room");
    let outcome = bench.run().expect("the same device");
    let expected =
        [("foreground_index", &index[..]), ("foreground", &list), ("counters", &counters)];
    outcome.check("chain", &expected);
}
