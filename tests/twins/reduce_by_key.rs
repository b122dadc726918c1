//! Summation of the sparse map's updates by key.

use raywake_core::params::{BAND_UPDATES, TILE, WORKGROUP};
use raywake_core::record::Update;
use raywake_core::stages::map::reduce_by_key::reduce_by_key;
use raywake_core::stages::prefix_sum::prefix_sum;
use raywake_gpu::Kernel;
use raywake_kernels::kernel::{FOLD, MARK_HEADS, REDUCE, SCAN, SPINE};
use raywake_tests::bench::Bench;
use raywake_tests::random::Random;

use super::{POISON, around, roomy, total};

pub const KERNELS: &[&Kernel] = &[&MARK_HEADS, &FOLD];

/// Checks all kernels, alone and one after another.
fn check(case: &str, sorted: &[Update], room: usize) {
    let count = sorted.len();
    let case = format!("{case}, {count} updates, room for {room}");
    let mut voxels = vec![[0; 2]; room];
    let mut run_tiles = [0; TILE + 1];
    reduce_by_key(&total(count), sorted, &mut voxels, &mut run_tiles);
    let found = run_tiles[TILE] as usize;
    let mut heads = vec![0; room];
    for (n, head) in heads[..count].iter_mut().enumerate() {
        *head = (n == 0 || sorted[n - 1][0] != sorted[n][0]) as u32;
    }
    let mut runs = vec![0; room];
    prefix_sum(&heads, &mut run_tiles, &mut runs);
    assert_eq!(run_tiles[TILE] as usize, found);
    let voxels = voxels.as_flattened();
    let bench = |heads: &[u32], runs: &[u32]| {
        Bench::new(None)
            .buffer("count_tiles", total(count))
            // What follows the updates appears to continue the last key.
            .buffer("updates", {
                let mut all = roomy(sorted, room);
                let last = sorted.last().map_or(0, |u| u[0]);
                all[2 * count..].as_chunks_mut::<2>().0.iter_mut().for_each(|u| u[0] = last);
                all
            })
            .buffer("heads", heads.to_vec())
            .buffer("runs", runs.to_vec())
            .buffer("voxels", vec![0; 2 * room])
    };
    let poison = vec![POISON; room];
    let Some(outcome) = bench(&poison, &runs).threads(&MARK_HEADS, room).run() else { return };
    outcome.check(&format!("{case}, heads"), &[("heads", &heads)]);
    if let Some(outcome) = bench(&heads, &runs).threads(&FOLD, room).run() {
        outcome.check(&format!("{case}, fold"), &[("voxels", voxels)]);
    }
    let groups = room.div_ceil(TILE);
    let outcome = bench(&poison, &poison)
        .buffer("tiles", vec![POISON; TILE + 1])
        .threads(&MARK_HEADS, room)
        .bound(&REDUCE, groups, &[("values", "heads"), ("sums", "runs")])
        .bound(&SPINE, 1, &[("values", "heads"), ("sums", "runs")])
        .bound(&SCAN, groups, &[("values", "heads"), ("sums", "runs")])
        .threads(&FOLD, room)
        .run()
        .expect("the same device");
    let mut tiles = outcome.words("tiles").to_vec();
    assert_eq!(tiles[TILE] as usize, found, "{case}");
    tiles.truncate(TILE + 1);
    let expected = [("heads", &heads[..]), ("runs", &runs), ("voxels", voxels), ("tiles", &tiles)];
    outcome.check(&case, &expected);
}

/// Updates with random values whose keys change when `new` says so.
fn list(count: usize, new: &mut dyn FnMut(&mut Random) -> bool) -> Vec<Update> {
    let mut random = Random::new(count as u64);
    let mut key = 0u32;
    let mut one = |_| {
        key += new(&mut random) as u32 * (1 + random.below(200));
        [key, random.word()]
    };
    (0..count).map(&mut one).collect()
}

fn check_lists(count: usize, room: usize) {
    check("runs of one", &list(count, &mut |_| true), room);
    check("runs of any length", &list(count, &mut |r| r.below(6) == 0), room);
    check("long runs", &list(count, &mut |r| r.below(700) == 0), room);
    check("one run", &list(count, &mut |_| false), room);
}

#[test]
fn runs_of_every_length() {
    let sizes = [around(WORKGROUP), around(TILE), [2 * TILE, 2 * TILE + 1, 3000, 5000, 9999]];
    for count in sizes.concat() {
        let room = count.next_multiple_of(WORKGROUP).max(WORKGROUP);
        check_lists(count, room);
        check("room", &list(count, &mut |r| r.below(3) == 0), room + 2 * TILE);
    }
}

#[test]
fn runs_of_a_full_band() {
    check_lists(BAND_UPDATES, BAND_UPDATES);
    check_lists(BAND_UPDATES - WORKGROUP - 1, BAND_UPDATES);
}
