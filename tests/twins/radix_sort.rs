//! Sorting of the sparse map's updates by key: each pass alone, and all eight.

use raywake_core::params::{BAND_UPDATES, RADIX, TILE};
use raywake_core::record::Update;
use raywake_core::stages::map::radix_sort::radix_sort;
use raywake_core::stages::prefix_sum::prefix_sum;
use raywake_core::stages::{COUNTERS, DIGIT_SHIFT};
use raywake_gpu::Kernel;
use raywake_kernels::kernel::{FIRST_DIGIT, HISTOGRAM, NEXT_DIGIT, REDUCE, SCAN, SCATTER, SPINE};
use raywake_tests::bench::Bench;
use raywake_tests::difference;
use raywake_tests::random::Random;

use super::{POISON, around, roomy, total};

pub const KERNELS: &[&Kernel] = &[&FIRST_DIGIT, &HISTOGRAM, &SCATTER, &NEXT_DIGIT];

/// Sizes around a tile, and of several tiles.
fn sizes() -> Vec<usize> {
    [&around(TILE)[..], &[2 * TILE - 1, 5 * TILE + 77]].concat()
}

/// Updates by the kind of their keys. Values are positions: they show whether a sort is stable.
fn lists(count: usize) -> Vec<(&'static str, Vec<Update>)> {
    let mut random = Random::new(count as u64);
    let list = |key: &mut dyn FnMut(u32) -> u32| (0..count as u32).map(|n| [key(n), n]).collect();
    let scale = (u32::MAX / count.max(1) as u32).max(1);
    vec![
        ("equal", list(&mut |_| 0x1234_5678)),
        ("sorted", list(&mut |n| n * scale)),
        ("reversed", list(&mut |n| u32::MAX - n * scale)),
        ("random", list(&mut |_| random.word())),
        ("few", list(&mut |n| 0x0f00_0000 + (n * 7 % 3) * 0x11)),
    ]
}

/// The histograms of a pass at `shift`: a count for every digit and tile.
fn counted(list: &[Update], shift: u32, tiles: usize) -> Vec<u32> {
    let mut histograms = vec![0; RADIX * tiles];
    for (tile, updates) in list.chunks(TILE).enumerate() {
        for [key, _] in updates {
            histograms[(key >> shift) as usize % RADIX * tiles + tile] += 1;
        }
    }
    histograms
}

/// Checks the kernels of one pass, each separately.
fn check_pass(case: &str, list: &[Update], shift: u32) {
    // One tile more than needed, as in a band that is not full.
    let tiles = list.len().div_ceil(TILE) + 1;
    let histograms = counted(list, shift, tiles);
    let mut offsets = vec![0; histograms.len()];
    prefix_sum(&histograms, &mut [0; TILE + 1], &mut offsets);
    let mut passed = list.to_vec();
    passed.sort_by_key(|u| u[0] >> shift & (RADIX as u32 - 1));
    let mut counters = vec![POISON; COUNTERS];
    counters[DIGIT_SHIFT] = shift;
    let room = tiles * TILE;
    let bench = Bench::new(None)
        .buffer("count_tiles", total(list.len()))
        .buffer("counters", counters.clone())
        .buffer("unsorted", roomy(list, room))
        .buffer("sorted", roomy(&[], room))
        .buffer("histograms", vec![POISON; RADIX * tiles])
        .buffer("digit_offsets", offsets)
        .groups(&HISTOGRAM, tiles)
        .groups(&SCATTER, tiles)
        .groups(&NEXT_DIGIT, 1);
    counters[DIGIT_SHIFT] += 4;
    if let Some(outcome) = bench.run() {
        let case = format!("{case}, {} updates, shift {shift}", list.len());
        outcome.check(
            &case,
            &[
                ("histograms", &histograms),
                ("sorted", &roomy(&passed, room)),
                ("counters", &counters),
            ],
        );
    }
}

#[test]
fn passes_of_every_digit() {
    for (case, list) in sizes().into_iter().flat_map(lists) {
        for shift in (0..32).step_by(4) {
            check_pass(case, &list, shift);
        }
    }
}

/// Checks all passes, in the order of the map's schedule.
fn check_sort(case: &str, list: &[Update], tiles: usize) {
    let room = tiles * TILE;
    let mut bench = Bench::new(None)
        .buffer("count_tiles", total(list.len()))
        .buffer("counters", vec![POISON; COUNTERS])
        .buffer("unsorted", roomy(list, room))
        .buffer("sorted", roomy(&[], room))
        .buffer("histograms", vec![POISON; RADIX * tiles])
        .buffer("digit_offsets", vec![POISON; RADIX * tiles])
        .buffer("tiles", vec![POISON; TILE + 1])
        .groups(&FIRST_DIGIT, 1);
    for pass in 0..8 {
        let groups = (RADIX * tiles).div_ceil(TILE);
        bench = match pass % 2 {
            0 => bench.groups(&HISTOGRAM, tiles),
            _ => bench.bound(&HISTOGRAM, tiles, &[("unsorted", "sorted"), ("sorted", "unsorted")]),
        };
        bench = bench
            .bound(&REDUCE, groups, &[("values", "histograms"), ("sums", "digit_offsets")])
            .bound(&SPINE, 1, &[("values", "histograms"), ("sums", "digit_offsets")])
            .bound(&SCAN, groups, &[("values", "histograms"), ("sums", "digit_offsets")]);
        bench = match pass % 2 {
            0 => bench.groups(&SCATTER, tiles),
            _ => bench.bound(&SCATTER, tiles, &[("unsorted", "sorted"), ("sorted", "unsorted")]),
        };
        bench = bench.groups(&NEXT_DIGIT, 1);
    }
    let mut sorted = list.to_vec();
    radix_sort(&total(list.len()), &mut sorted, &mut vec![[0; 2]; list.len()]);
    // Before the last pass the keys were sorted by all digits but the highest.
    let mut but_one = list.to_vec();
    but_one.sort_by_key(|u| u[0] << 4);
    let Some(outcome) = bench.run() else { return };
    for (name, wanted) in [("unsorted", &sorted), ("sorted", &but_one)] {
        if let Some(what) = difference(outcome.words(name), &roomy(wanted, room)) {
            panic!("{case}, {} updates, `{name}`: {what}", list.len());
        }
    }
    assert_eq!(outcome.words("counters")[DIGIT_SHIFT], 32);
    assert_eq!(outcome.words("count_tiles"), total(list.len()));
}

#[test]
fn sorts_of_every_size() {
    for (case, list) in sizes().into_iter().flat_map(lists) {
        let tiles = list.len().div_ceil(TILE);
        check_sort(case, &list, tiles.max(1));
        check_sort(case, &list, tiles + 2);
    }
}

#[test]
fn sorts_of_a_full_band() {
    for (case, list) in lists(BAND_UPDATES) {
        check_sort(case, &list, BAND_UPDATES / TILE);
    }
    let (case, list) = lists(BAND_UPDATES - TILE - 1).swap_remove(3);
    check_sort(case, &list, BAND_UPDATES / TILE);
}
