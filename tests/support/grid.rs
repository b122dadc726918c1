//! The dense window of a sweep, independent of the pipeline.

use raywake_core::frame::Window;
use raywake_core::params::{MERGE_SLOTS, ORIGINS_MAX, POINTS_MAX, Profile};
use raywake_core::prepare::{Placement, Preparation, RayBuffers, uniform_of};
use raywake_core::record::{Ray, SweepUniform};
use raywake_core::stages::grid::ray_merge::ray_merge;
use raywake_core::stages::grid::ray_trace::ray_trace;
use raywake_core::stages::{COUNTERS, DISTINCT_COUNT};
use raywake_core::sweep::{Rig, Sweep};
use raywake_core::team::SingleThread;

/// A sweep as rays in a window.
pub struct Rays {
    /// Sizes.
    pub step: SweepUniform,
    /// Rays.
    pub rays: Vec<Ray>,
    /// Origins of the rays.
    pub origins: Vec<[i32; 4]>,
}

impl Rays {
    /// Prepares a sweep.
    pub fn new(profile: &Profile, rig: &Rig, window: &Window, sweep: &Sweep) -> Rays {
        let (mut rays, mut columns) = (vec![[0; 2]; POINTS_MAX], vec![0; POINTS_MAX]);
        let mut origins = vec![[0; 4]; ORIGINS_MAX];
        let preparation = Preparation::new();
        let (count, _) = preparation.prepare(
            &SingleThread,
            &Placement { profile, rig, window, sweep },
            RayBuffers {
                rays: &mut rays,
                origins: &mut origins,
                columns: &mut columns,
                placed: &mut [],
            },
        );
        rays.truncate(count);
        Rays { step: uniform_of(profile, count), rays, origins }
    }
}

/// Storage for merging and tracing.
pub struct Tracer {
    slots: Vec<[u32; 2]>,
    distinct: Vec<u32>,
    used: usize,
}

impl Default for Tracer {
    fn default() -> Tracer {
        Tracer { slots: vec![[0; 2]; MERGE_SLOTS], distinct: vec![0; POINTS_MAX], used: 0 }
    }
}

impl Tracer {
    /// Merges equal rays; returns the number left.
    pub fn merge(&mut self, rays: &Rays) -> usize {
        self.slots.fill([0; 2]);
        let mut counters = [0; COUNTERS];
        let (slots, distinct) = (&mut self.slots, &mut self.distinct);
        ray_merge(&rays.step, &rays.rays, slots, distinct, &mut counters);
        self.used = counters[DISTINCT_COUNT] as usize;
        self.used
    }

    /// Traces the merged rays.
    pub fn trace(&self, rays: &Rays, log_odds: &mut [i32]) {
        log_odds.fill(0);
        let distinct = &self.distinct[..self.used];
        ray_trace(&rays.step, &rays.origins, &rays.rays, &self.slots, distinct, log_odds);
    }
}
