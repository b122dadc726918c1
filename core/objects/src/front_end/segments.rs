//! Segments: connected components of chunks (Euclidean clustering: Rusu, 2009; here also in
//! velocity and time).
//!
//! Objects that touch but move differently become two segments if the flow is known. A return whose
//! velocity is unknown, because it lies outside the flow's window or is unmatched, may join either.

use super::batch::Batch;
use super::chunks::{CHUNKS_MAX, Chunk, Chunks, ReturnSums};
use super::{FrontEndParams, SEGMENTS_MAX, TrackingCounts};
use raywake_core::groups::DisjointSets;
use raywake_core::params::POINTS_MAX;
use raywake_core::record::NONE;

/// Returns that belong together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// Number of returns.
    pub count: u32,
    /// m from the batch's corner.
    pub centroid: [f64; 3],
    /// Mean of the returns' times, s after the batch's stamp.
    pub time_s: f64,
    /// Mean velocity of the returns that have one, m/s, if most do.
    pub velocity: Option<[f64; 2]>,
}

impl Segment {
    fn of(sums: &ReturnSums) -> Segment {
        let n = sums.count as f64;
        let velocity = sums.velocity.map(|v| v / sums.with_velocity as f64);
        Segment {
            count: sums.count,
            centroid: sums.position.map(|v| v / n),
            time_s: sums.time_s / n,
            velocity: (2 * sums.with_velocity > sums.count).then_some(velocity),
        }
    }

    /// Its time, s, and position, m, in the world.
    pub fn in_world(&self, batch: &Batch) -> (f64, [f64; 3]) {
        (batch.stamp_s.unwrap_or(0.0) + self.time_s, batch.in_world(self.centroid))
    }
}

/// The segments of a batch.
pub(super) struct Segmentation {
    chunks: Chunks,
    /// Chunk of every return, or [`NONE`].
    of_return: [u32; POINTS_MAX],
    groups: DisjointSets<CHUNKS_MAX>,
    all: heapless::Vec<Segment, SEGMENTS_MAX>,
    /// Segment of every chunk, or [`NONE`].
    of_chunk: [u32; CHUNKS_MAX],
}

impl Segmentation {
    pub const fn new() -> Segmentation {
        Segmentation {
            chunks: Chunks::new(),
            of_return: [0; POINTS_MAX],
            groups: DisjointSets::new(),
            all: heapless::Vec::new(),
            of_chunk: [0; CHUNKS_MAX],
        }
    }

    /// Finds the segments in the returns of objects.
    pub fn find(
        &mut self,
        params: &FrontEndParams,
        batch: &Batch,
        is_object: impl Fn(usize) -> bool,
        counts: &mut TrackingCounts,
    ) {
        self.chunks.clear();
        for (n, one) in batch.returns.iter().enumerate() {
            self.of_return[n] = NONE;
            if is_object(n) {
                self.of_return[n] = self.chunks.add(params, one);
                counts.object_returns += 1;
                counts.unchunked += (self.of_return[n] == NONE) as u64;
            }
        }
        self.connect(params);
        self.list(params, counts);
    }

    pub fn all(&self) -> &[Segment] {
        &self.all
    }

    /// Segment of a return of the batch.
    pub fn of_return(&self, n: usize) -> Option<usize> {
        let segment = *self.of_chunk.get(self.of_return[n] as usize)?;
        (segment != NONE).then_some(segment as usize)
    }

    /// Joins chunks that are near each other.
    fn connect(&mut self, params: &FrontEndParams) {
        let Segmentation { chunks, groups, .. } = self;
        let count = chunks.all().len();
        groups.start(count, |_| true);
        for (n, chunk) in chunks.all().iter().enumerate() {
            chunks.around(chunk.position, params.link_m, |other, near| {
                if (other as usize) < n && is_linked(params, chunk, near) {
                    groups.join(n as u32, other);
                }
            });
        }
        groups.list(count);
    }

    /// Lists the segments that may be objects.
    fn list(&mut self, params: &FrontEndParams, counts: &mut TrackingCounts) {
        self.all.clear();
        for group in 0..self.groups.count() {
            let members = self.groups.members(group);
            let mut sums = ReturnSums::NONE;
            members.iter().for_each(|c| sums.add(self.chunks.sums(*c)));
            let extent = [0, 1].map(|a| sums.high[a] - sums.low[a]);
            let is_large = extent.iter().any(|e| *e > params.extent_max_m);
            let is_small = sums.count < params.returns_min;
            counts.too_large += is_large as u64;
            counts.too_small += is_small as u64;
            let mut index = NONE;
            if !is_large && !is_small {
                match self.all.push(Segment::of(&sums)) {
                    Ok(()) => index = self.all.len() as u32 - 1,
                    Err(_) => counts.unlisted += 1,
                }
            }
            members.iter().for_each(|c| self.of_chunk[*c as usize] = index);
        }
        counts.segments = self.all.len() as u64;
    }
}

/// Whether two chunks belong to one segment.
fn is_linked(params: &FrontEndParams, a: &Chunk, b: &Chunk) -> bool {
    let d = [0, 1, 2].map(|n| a.position[n] - b.position[n]);
    d[0] * d[0] + d[1] * d[1] <= params.link_m * params.link_m
        && d[2].abs() <= params.link_up_m
        && params.is_similar(a.velocity, b.velocity)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::front_end::batch::{BatchReturn, cell};
    use crate::random::Random;
    use std::boxed::Box;
    use std::vec;
    use std::vec::Vec;

    const PARAMS: FrontEndParams = FrontEndParams::DEFAULT;

    /// Clusters of returns, some of which touch, with and without velocities.
    fn batch(seed: u64) -> Box<Batch> {
        let mut random = Random(seed);
        let mut batch = raywake_alloc_guard::boxed!(Batch, Batch::new());
        for _ in 0..60 {
            let middle = [0; 2].map(|_| random.between(1.0, 25.0));
            let speed = random.below(4) as f32 * 2.0;
            let velocity = (speed < 6.0).then_some([speed, 0.0]);
            for _ in 0..random.below(80) {
                let [x, y] = middle.map(|m| m + random.between(-0.9, 0.9));
                let one = BatchReturn {
                    cell: cell([x, y, 0.0]),
                    position: [x, y, random.between(0.0, 2.0)],
                    time_s: random.between(0.0, 0.1),
                    velocity,
                    ..BatchReturn::default()
                };
                batch.returns.push(one).unwrap();
            }
        }
        batch
    }

    /// Labels every chunk with the first one that it is connected to.
    fn flood(firsts: &[Chunk]) -> Vec<usize> {
        let mut label = vec![usize::MAX; firsts.len()];
        for n in 0..firsts.len() {
            let mut open = vec![n];
            while let Some(at) = open.pop() {
                if label[at] == usize::MAX {
                    label[at] = n;
                    open.extend(
                        (0..firsts.len()).filter(|m| is_linked(&PARAMS, &firsts[at], &firsts[*m])),
                    );
                }
            }
        }
        label
    }

    #[test]
    fn components_equal_a_flood_fill() {
        let mut segments = raywake_alloc_guard::boxed!(Segmentation, Segmentation::new());
        let params = FrontEndParams { returns_min: 1, ..PARAMS };
        let mut several = 0;
        for seed in 0..20 {
            let batch = batch(seed);
            let mut counts = TrackingCounts::default();
            segments.find(&params, &batch, |n| n % 7 != 0, &mut counts);
            let firsts = segments.chunks.all();
            let label = flood(firsts);
            let mut of_label = vec![None; firsts.len()];
            for (label, segment) in label.iter().zip(segments.of_chunk) {
                let known = of_label[*label].get_or_insert(segment);
                assert_eq!(*known, segment);
            }
            let groups = of_label.iter().flatten().count();
            assert_eq!(groups, segments.all().len() + counts.too_large as usize);
            several += (groups > 10 && groups < firsts.len() / 2) as u32;
        }
        assert!(several > 15, "{several}");
    }

    #[test]
    fn returns_join_the_nearest_chunk_and_segments_sum_them() {
        let mut segments = raywake_alloc_guard::boxed!(Segmentation, Segmentation::new());
        for seed in 0..10 {
            let batch = batch(seed);
            segments.find(&PARAMS, &batch, |n| n % 7 != 0, &mut TrackingCounts::default());
            let all = segments.chunks.all();
            let mut opened = 0;
            for (n, one) in batch.returns.iter().enumerate() {
                let chunk = segments.of_return[n];
                if n % 7 == 0 {
                    assert_eq!(chunk, NONE);
                    continue;
                }
                // Of the chunks so far, the nearest it may join; otherwise its own.
                let joins = |c: &Chunk| {
                    let d2: f32 = (0..3).map(|a| (c.position[a] - one.position[a]).powi(2)).sum();
                    let near = d2 < PARAMS.chunk_radius_m * PARAMS.chunk_radius_m
                        && (c.time_s - one.time_s).abs() < PARAMS.chunk_span_s
                        && PARAMS.is_similar(c.velocity, one.velocity);
                    near.then_some(d2)
                };
                let least = all[..opened].iter().filter_map(joins).min_by(f32::total_cmp);
                match least {
                    Some(d2) => assert_eq!(joins(&all[chunk as usize]), Some(d2)),
                    None => {
                        assert_eq!((chunk as usize, all[opened].position), (opened, one.position));
                        opened += 1;
                    }
                }
            }
            for (index, segment) in segments.all().iter().enumerate() {
                let of = |n: &usize| segments.of_return(*n) == Some(index);
                let members: Vec<usize> = (0..batch.returns.len()).filter(of).collect();
                assert_eq!(members.len(), segment.count as usize);
                assert!(segment.count >= PARAMS.returns_min);
                for a in 0..3 {
                    let sum: f64 =
                        members.iter().map(|n| batch.returns[*n].position[a] as f64).sum();
                    assert!((sum / members.len() as f64 - segment.centroid[a]).abs() < 1e-9);
                }
            }
        }
    }
}
