//! Merging and tracing of rays.

use raywake_core::params::{EXTENT_VOXELS, MERGE_PROBES, MERGE_SLOTS, POINTS_MAX, WORKGROUP};
use raywake_core::record::{Ray, SweepUniform, ray};
use raywake_core::stages::grid::ray_merge::{merged, ray_merge};
use raywake_core::stages::grid::ray_trace::ray_trace;
use raywake_core::stages::{COUNTERS, DISTINCT_COUNT};
use raywake_gpu::Kernel;
use raywake_kernels::kernel::{RAY_MERGE, RAY_TRACE};
use raywake_tests::bench::Bench;
use raywake_tests::difference;
use raywake_tests::random::Random;

use super::{POISON, around, extremes, window};

pub const KERNELS: &[&Kernel] = &[&RAY_MERGE, &RAY_TRACE];

/// Rays with the table that merges them.
struct Merged {
    rays: Vec<Ray>,
    slots: Vec<[u32; 2]>,
    distinct: Vec<u32>,
}

impl Merged {
    fn by_twin(rays: &[Ray]) -> Merged {
        let mut slots = vec![[0; 2]; MERGE_SLOTS];
        let mut distinct = vec![0; rays.len()];
        let sweep = SweepUniform { rays: rays.len() as i32, ..SweepUniform::default() };
        let mut counters = [0; COUNTERS];
        ray_merge(&sweep, rays, &mut slots, &mut distinct, &mut counters);
        distinct.truncate(counters[DISTINCT_COUNT] as usize);
        Merged { rays: rays.to_vec(), slots, distinct }
    }

    /// `None` if there is no device.
    fn by_kernel(rays: &[Ray]) -> Option<Merged> {
        let step = SweepUniform { rays: rays.len() as i32, ..SweepUniform::default() };
        // Rays after the last one, as left over from an earlier sweep, must not count.
        let mut more = rays.to_vec();
        more.extend([ray([1, 2, 3], 4, false); 3]);
        let outcome = Bench::new(Some(&step))
            .buffer("rays", bytemuck::cast_slice(&more).to_vec())
            .buffer("slots", vec![0; 2 * MERGE_SLOTS])
            .buffer("distinct", vec![POISON; more.len()])
            .buffer("counters", vec![0; COUNTERS])
            .threads(&RAY_MERGE, more.len() + WORKGROUP)
            .run()?;
        let used = outcome.words("counters")[DISTINCT_COUNT] as usize;
        let (listed, rest) = outcome.words("distinct").split_at(used);
        assert!(rest.iter().all(|w| *w == POISON), "nothing behind the last entry");
        Some(Merged {
            rays: rays.to_vec(),
            slots: bytemuck::cast_slice(outcome.words("slots")).to_vec(),
            distinct: listed.to_vec(),
        })
    }

    /// Every entry with its weight, in an order independent of which came first.
    fn entries(&self) -> Vec<(Ray, i32)> {
        let entry = |e: &u32| merged(*e, &self.rays, &self.slots);
        let mut all: Vec<_> = self.distinct.iter().map(entry).collect();
        all.sort();
        all
    }

    /// Number of entries without a slot in the table.
    fn without_slot(&self) -> usize {
        self.distinct.iter().filter(|e| **e >= MERGE_SLOTS as u32).count()
    }
}

fn check_merge(case: &str, rays: &[Ray]) {
    let twin = Merged::by_twin(rays);
    let Some(kernel) = Merged::by_kernel(rays) else { return };
    if let Some(what) = difference(&kernel.entries(), &twin.entries()) {
        panic!("{case}: {what}");
    }
}

fn any_ray(random: &mut Random, reach: i32) -> Ray {
    let end = [0; 3].map(|_| random.between(-reach, reach));
    ray(end, random.below(512), random.below(10) == 0)
}

#[test]
fn merged_rays_and_their_weights() {
    let mut random = Random::new(15);
    let few: Vec<Ray> = (0..50).map(|_| any_ray(&mut random, 9)).collect();
    for count in [around(WORKGROUP), [1000, 20_000, 70_001, POINTS_MAX - 1, POINTS_MAX]].concat() {
        let one = vec![ray([-4095, 4095, -1], 511, true); count];
        let of_few: Vec<Ray> = (0..count).map(|n| few[n * 31 % few.len()]).collect();
        let similar: Vec<Ray> = (0..count).map(|_| any_ray(&mut random, 20)).collect();
        check_merge(&format!("{count} equal rays"), &one);
        check_merge(&format!("{count} rays of few kinds"), &of_few);
        check_merge(&format!("{count} rays, some equal"), &similar);
    }
    let distinct: Vec<Ray> =
        (0..POINTS_MAX as i32).map(|n| ray([n & 0xfff, n >> 12, n % 7 - 3], 0, false)).collect();
    check_merge("all distinct", &distinct);
}

/// First slot of a ray: where crowds form depends on it, results do not.
fn first_slot(ray: Ray) -> u32 {
    let mixed = ray[0].wrapping_mul(0x9e37_79b1) ^ ray[1].wrapping_mul(0x85eb_ca77);
    let mixed = (mixed ^ mixed >> 15).wrapping_mul(0x2c1b_3c6d);
    (mixed ^ mixed >> 13) & (MERGE_SLOTS as u32 - 1)
}

/// More rays with the same first slot than there are probes; it is the last slot, so that they
/// wrap.
fn crowd() -> Vec<Ray> {
    let ends = (0..60).flat_map(|i| (0..60).flat_map(move |j| (-9..45).map(move |k| [i, j, k])));
    let rays = ends.flat_map(|end| (0..512).map(move |origin| ray(end, origin, false)));
    let crowd: Vec<Ray> =
        rays.filter(|r| first_slot(*r) == MERGE_SLOTS as u32 - 1).take(150).collect();
    assert_eq!(crowd.len(), 150);
    crowd
}

#[test]
fn a_crowd_beyond_the_probes_changes_no_sum() {
    let crowd = crowd();
    let rays: Vec<Ray> = (0..4 * crowd.len()).map(|n| crowd[n * 7 % crowd.len()]).collect();
    let step = SweepUniform { range_steps: 100, ..window(61, 16) };
    let mut random = Random::new(16);
    let origins: Vec<[i32; 4]> =
        (0..512).map(|_| [random.between(20, 40), random.between(20, 40), 7, 0]).collect();
    let trace = |m: &Merged| {
        let mut sums = vec![0; 61 * 61 * 16];
        ray_trace(&step, &origins, &m.rays, &m.slots, &m.distinct, &mut sums);
        sums
    };
    let twin = Merged::by_twin(&rays);
    let alone = 4 * (crowd.len() - MERGE_PROBES as usize);
    assert_eq!(twin.without_slot(), alone);
    let Some(kernel) = Merged::by_kernel(&rays) else { return };
    assert_eq!(kernel.without_slot(), alone);
    assert!(difference(&trace(&kernel), &trace(&twin)).is_none());
    check_trace("crowd", &step, &origins, &twin);
    check_trace("crowd, as the kernel merged it", &step, &origins, &kernel);
}

fn check_trace(case: &str, step: &SweepUniform, origins: &[[i32; 4]], merged: &Merged) {
    let used = merged.distinct.len();
    let mut counters = vec![POISON; COUNTERS];
    counters[DISTINCT_COUNT] = used as u32;
    // Values already in the grid are added to.
    let mut log_odds: Vec<i32> = (0..step.side * step.side * step.levels).collect();
    let mut distinct = merged.distinct.clone();
    distinct.extend([POISON; 9]);
    let bench = Bench::new(Some(step))
        .buffer("origins", bytemuck::cast_slice(origins).to_vec())
        .buffer("rays", bytemuck::cast_slice(&merged.rays).to_vec())
        .buffer("slots", bytemuck::cast_slice(&merged.slots).to_vec())
        .buffer("distinct", distinct)
        .buffer("counters", counters)
        .buffer("log_odds", bytemuck::cast_slice(&log_odds).to_vec())
        .threads(&RAY_TRACE, used + 70);
    ray_trace(step, origins, &merged.rays, &merged.slots, &merged.distinct, &mut log_odds);
    if let Some(outcome) = bench.run() {
        outcome.check(case, &[("log_odds", bytemuck::cast_slice(&log_odds))]);
    }
}

#[test]
fn traces_of_every_kind() {
    let mut random = Random::new(17);
    let inside = vec![[15, 15, 4, 0], [0, 0, 0, 0], [30, 30, 7, 0], [16, 15, 4, 0]];
    let outside = vec![[-3, 15, 4, 0], [15, 40, 4, 0], [15, 15, -9, 0], [900, -900, 30, 0]];
    for (case, origins) in [("inside", inside), ("outside", outside)] {
        for (levels, range_steps) in [(8, 1), (14, 20), (16, 334), (8, 2000)] {
            let step = SweepUniform { range_steps, ..window(31, levels) };
            for count in [0, 1, 63, 64, 65, 3000] {
                for reach in [2, 40, EXTENT_VOXELS] {
                    let mut one = || {
                        let end = [15, 15, 4].map(|c| c + random.between(-reach, reach));
                        let end = end.map(|v| v.clamp(-EXTENT_VOXELS, EXTENT_VOXELS));
                        ray(end, random.below(4), random.below(8) == 0)
                    };
                    let rays: Vec<Ray> = (0..count).map(|_| one()).collect();
                    let case = format!("{case}, {count} rays, reach {reach}, {step:?}");
                    check_trace(&case, &step, &origins, &Merged::by_twin(&rays));
                }
            }
        }
    }
}

#[test]
fn extreme_traces() {
    let (step, origins, ends) = extremes();
    for (case, end, origin) in ends {
        // The weight of all returns of a sweep in one ray: a 16-bit sum would overflow.
        for no_end in [false, true] {
            let rays = vec![ray(end, origin, no_end); POINTS_MAX];
            check_trace(case, &step, &origins, &Merged::by_twin(&rays));
        }
    }
}
