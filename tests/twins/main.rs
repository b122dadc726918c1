//! Every kernel against its scalar twin, bit for bit.

#![forbid(unsafe_code)]

mod constancy;
mod emit;
mod expectation;
mod filter;
mod maximisation;
mod plan;
mod radix_sort;
mod rays;
mod reduce_by_key;
mod sums;
mod voxels;

use raywake_core::params::{EXTENT_VOXELS, TILE};
use raywake_core::record::{Column, SweepUniform};
use raywake_core::stages::COUNTERS;
use raywake_gpu::Kernel;
use raywake_tests::bench::Bench;
use std::collections::BTreeSet;

/// Content of buffers that a kernel must not touch or has to overwrite.
const POISON: u32 = 0xdead_beef;

/// The kernels that these tests run.
const COVERED: [&[&Kernel]; 11] = [
    constancy::KERNELS,
    emit::KERNELS,
    expectation::KERNELS,
    filter::KERNELS,
    maximisation::KERNELS,
    plan::KERNELS,
    radix_sort::KERNELS,
    rays::KERNELS,
    reduce_by_key::KERNELS,
    sums::KERNELS,
    voxels::KERNELS,
];

/// Counts around the boundaries of a workgroup or tile.
fn around(size: usize) -> [usize; 5] {
    [0, 1, size - 1, size, size + 1]
}

/// A window, ray origins, and ends of rays that are hard to walk: a description, the end, and the
/// index of the origin.
#[allow(clippy::type_complexity)]
fn extremes() -> (SweepUniform, [[i32; 4]; 2], [(&'static str, [i32; 3], u32); 7]) {
    let step = SweepUniform { range_steps: 2000, ..window(337, 16) };
    let e = EXTENT_VOXELS;
    let ends = [
        ("onto itself", [127, 127, 8], 0),
        ("one step", [127, 128, 8], 0),
        ("to a corner", [0, 0, 0], 0),
        ("far", [e, -e, e], 0),
        ("through everything", [e, -e, 15], 1),
        ("too far by one", [127 + 2001, 127, 8], 0),
        ("just in range", [127, 127 - 2000, 8], 0),
    ];
    (step, [[127, 127, 8, 0], [-e, e, 0, 0]], ends)
}

/// Columns in the layout of a buffer.
fn words(columns: &[Column]) -> Vec<u32> {
    columns.as_flattened().to_vec()
}

/// 16-bit costs in the layout of a buffer: two per word, the first in the low half.
fn packed(costs: &[u16]) -> Vec<u32> {
    costs.chunks_exact(2).map(|c| c[0] as u32 | (c[1] as u32) << 16).collect()
}

/// A list of pairs in the layout of a buffer, with spare room at the end.
fn roomy(pairs: &[[u32; 2]], room: usize) -> Vec<u32> {
    let mut words = pairs.as_flattened().to_vec();
    words.resize(2 * room, POISON);
    words
}

/// Tiles of a prefix sum of which the sparse map's kernels read only the total.
fn total(count: usize) -> Vec<u32> {
    let mut tiles = vec![POISON; TILE + 1];
    tiles[TILE] = count as u32;
    tiles
}

/// A square window.
fn window(side: i32, levels: i32) -> SweepUniform {
    SweepUniform { side, levels, ..SweepUniform::default() }
}

/// Names of the functions following `@compute`.
fn entry_points(source: &str) -> impl Iterator<Item = &str> {
    source.split("@compute").skip(1).filter_map(|rest| {
        let (_, rest) = rest.split_once("fn ")?;
        rest.split('(').next()
    })
}

#[test]
fn a_wrong_word_is_detected() {
    let bench =
        |kernel| Bench::new(None).buffer("counters", vec![7; COUNTERS]).groups(kernel, 1).run();
    let Some(outcome) = bench(&raywake_kernels::kernel::PLAN) else { return };
    let failed = |expected: &[(&str, &[u32])]| {
        std::panic::catch_unwind(|| outcome.check("on purpose", expected)).is_err()
    };
    let right = outcome.words("counters").to_vec();
    let mut wrong = right.clone();
    wrong[COUNTERS - 1] ^= 1;
    assert!(failed(&[]) && failed(&[("counters", &wrong)]) && !failed(&[("counters", &right)]));
}

#[test]
fn no_kernel_is_left_out() {
    let sources = raywake_tests::files(&raywake_tests::root().join("kernels/wgsl"), ".wgsl");
    let sources: Vec<String> = sources.iter().map(|f| raywake_tests::read(f)).collect();
    let wanted: BTreeSet<&str> = sources.iter().flat_map(|s| entry_points(s)).collect();
    let found: BTreeSet<&str> = COVERED.iter().copied().flatten().map(|k| k.name).collect();
    assert_eq!(found, wanted);
}
