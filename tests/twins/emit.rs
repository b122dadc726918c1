//! Updates of the sparse map, counted and written band by band.

use raywake_core::params::{EXTENT_VOXELS, MERGE_SLOTS, POINTS_MAX, ROW_WORKGROUP, TILE};
use raywake_core::record::Update;
use raywake_core::record::{Ray, SweepUniform, ray};
use raywake_core::stages::map::emit::{count, emit};
use raywake_core::stages::prefix_sum::prefix_sum;
use raywake_core::stages::{COUNTERS, DISTINCT_COUNT};
use raywake_gpu::Kernel;
use raywake_kernels::kernel::{COUNT, EMIT};
use raywake_tests::bench::Bench;
use raywake_tests::random::Random;

use super::{POISON, around, extremes, roomy, window};

pub const KERNELS: &[&Kernel] = &[&COUNT, &EMIT];

/// Rays, the contents of the table that merged them, and entries of either kind.
struct Distinct {
    rays: Vec<Ray>,
    slots: Vec<[u32; 2]>,
    entries: Vec<u32>,
}

impl Distinct {
    /// Every third ray found no slot in the table; the others are stored in it in reverse order.
    fn of(rays: Vec<Ray>, mut weight: impl FnMut() -> u32) -> Distinct {
        let count = rays.len() as u32;
        let slots = (0..count).rev().map(|n| [n + 1, weight()]).collect();
        let entry = |n| if n % 3 == 1 { MERGE_SLOTS as u32 + n } else { n };
        Distinct { rays, slots, entries: (0..count).map(entry).collect() }
    }

    /// Rays around `centre`: some ends nearby, some at the limit of what a ray can represent.
    fn any(random: &mut Random, count: usize, centre: [i32; 3], origins: usize) -> Distinct {
        let mut one = || {
            let reach = [0, 2, 40, 400, EXTENT_VOXELS][random.below(5) as usize];
            let end = centre.map(|c| c + random.between(-reach, reach));
            let end = end.map(|v| v.clamp(-EXTENT_VOXELS, EXTENT_VOXELS));
            ray(end, random.below(origins as u32), random.below(4) == 0)
        };
        let rays = (0..count).map(|_| one()).collect();
        Distinct::of(rays, || {
            let heavy = random.below(9) == 0;
            1 + random.below(if heavy { 99_999 } else { 5 })
        })
    }
}

/// Checks both kernels over a band. Returns the number of updates.
fn check(case: &str, step: &SweepUniform, origins: &[[i32; 4]], d: &Distinct) -> usize {
    let used = d.entries.len();
    let room = (used + 70).next_multiple_of(ROW_WORKGROUP);
    let (mut counts, mut offsets) = (vec![0; room], vec![0; room]);
    count(step, origins, &d.rays, &d.slots, &d.entries, &mut counts);
    let mut tiles = [0; TILE + 1];
    prefix_sum(&counts, &mut tiles, &mut offsets);
    let total = tiles[TILE] as usize;
    let mut updates: Vec<Update> = vec![[POISON; 2]; total];
    emit(step, origins, &d.rays, &d.slots, &d.entries, &offsets[..used], &mut updates);
    let mut counters = vec![POISON; COUNTERS];
    counters[DISTINCT_COUNT] = used as u32;
    let mut entries = d.entries.clone();
    entries.extend([POISON; 9]);
    let bench = Bench::new(Some(step))
        .buffer("origins", bytemuck::cast_slice(origins).to_vec())
        .buffer("rays", d.rays.as_flattened().to_vec())
        .buffer("slots", d.slots.as_flattened().to_vec())
        .buffer("distinct", entries)
        .buffer("counters", counters)
        .buffer("counts", vec![POISON; room])
        .buffer("offsets", offsets)
        .buffer("updates", vec![POISON; 2 * total + 9])
        .threads(&COUNT, room)
        .threads(&EMIT, room);
    if let Some(outcome) = bench.run() {
        let mut written = roomy(&updates, total + 5);
        written.truncate(2 * total + 9);
        let case = format!("{case}, {used} rays, {total} updates, {step:?}");
        outcome.check(&case, &[("counts", &counts), ("updates", &written)]);
    }
    total
}

/// All of a window's keys, some of them, none; cut at slabs of equal x and next to these cuts.
fn bands(step: &SweepUniform) -> [[i32; 2]; 10] {
    let (slab, keys) = (step.side * step.levels, step.side * step.side * step.levels);
    let middle = step.side / 2;
    let [from, to] = [(middle - 2) * slab, (middle + 3) * slab];
    let centre = middle * slab + middle * step.levels + step.levels / 2;
    [
        [0, keys],
        [0, from],
        [to, keys],
        [from, to],
        [from - 1, to + 1],
        [from + 1, to - 1],
        [centre, centre + 1],
        [keys - 1, keys],
        [from, from],
        [keys, keys],
    ]
}

fn banded(step: &SweepUniform, [band_from, band_to]: [i32; 2]) -> SweepUniform {
    SweepUniform { band_from, band_to, ..*step }
}

#[test]
fn bands_of_every_kind() {
    let mut random = Random::new(60);
    let inside = vec![[15, 15, 4, 0], [0, 0, 0, 0], [30, 30, 7, 0], [16, 15, 4, 0]];
    let outside = vec![[-3, 15, 4, 0], [15, 40, 4, 0], [15, 15, -9, 0], [900, -900, 30, 0]];
    for (case, origins) in [("inside", inside), ("outside", outside)] {
        let mut most = 0;
        for (levels, range_steps) in [(8, 1), (13, 20), (16, 334), (8, 2000)] {
            let step = SweepUniform { range_steps, ..window(31, levels) };
            let rays = Distinct::any(&mut random, 500, [15, 15, 4], origins.len());
            let bands = bands(&step);
            let of = |band: [i32; 2]| check(case, &banded(&step, band), &origins, &rays);
            let counts = bands.map(of);
            // The second, fourth and third band together are the first; the last two are empty.
            assert_eq!(counts[0], counts[1] + counts[3] + counts[2], "{case}, {step:?}");
            assert!(counts[8..] == [0, 0], "{case}, {step:?}: {counts:?}");
            most = most.max(counts[3]);
        }
        assert!(most > 1000, "{case}: {most} updates in a part of the window");
    }
}

#[test]
fn rays_of_every_number() {
    let mut random = Random::new(61);
    let step = SweepUniform { range_steps: 100, ..window(61, 16) };
    for count in [&around(ROW_WORKGROUP)[..], &[3000]].concat() {
        let rays = Distinct::any(&mut random, count, [30, 30, 8], 1);
        for band in bands(&step) {
            check("number", &banded(&step, band), &[[30, 30, 8, 0]], &rays);
        }
    }
}

#[test]
fn the_window_of_the_map() {
    // Keys up to 3e8, rays longer than the range of 334 voxels.
    let mut random = Random::new(62);
    let step = SweepUniform { range_steps: 334, ..window(669, 669) };
    let rays = Distinct::any(&mut random, 300, [334; 3], 2);
    let origins = [[334, 334, 334, 0], [335, 334, 334, 0]];
    let counts = bands(&step).map(|band| check("map", &banded(&step, band), &origins, &rays));
    assert!(counts[0] > 10_000 && counts[1] > 1000 && counts[2] > 1000, "{counts:?}");
}

#[test]
fn extreme_rays() {
    let (step, origins, ends) = extremes();
    for (case, end, origin) in ends {
        for no_end in [false, true] {
            // The weight of all returns of a sweep in one ray.
            let ray = Distinct::of(vec![ray(end, origin, no_end)], || POINTS_MAX as u32);
            for band in bands(&step) {
                check(case, &banded(&step, band), &origins, &ray);
            }
        }
    }
}
