//! Chunks, small containers in space and time, and the segments they form.

use super::batch::{Batch, Seen, cell};
use super::{CELL_M, CELLS, FrontEndParams, SEGMENTS_MAX, SIDE};
use raywake_core::groups::Groups;
use raywake_core::params::{COLUMNS_MAX, POINTS_MAX};
use raywake_core::record::NONE;

/// Chunks of a batch; returns that would need more are dropped and counted.
pub(super) const CHUNKS_MAX: usize = 32_768;
/// A return joins a chunk whose first return is so near, m and s.
const JOINS_M: f32 = 0.25;
const JOINS_S: f32 = 0.05;
/// Chunks so near are of one segment, from one's first return to the other's: m along the ground
/// (two cells at most), and up.
const LINKS_M: f32 = 0.7;
const LINKS_UP_M: f32 = 1.0;
/// Velocities of one thing differ by no more than so much, m/s, and this share of the speed.
const ALIKE_MPS: f32 = 0.5;
const ALIKE: f32 = 0.25;

const _: () = assert!(LINKS_M <= 2.0 * CELL_M && JOINS_M <= CELL_M);

/// Sums over returns.
#[derive(Clone, Copy, Debug)]
struct Sums {
    count: u32,
    at: [f64; 3],
    time_s: f64,
    /// Returns with a velocity, and the sum of these.
    known: u32,
    velocity: [f64; 2],
    low: [f32; 3],
    high: [f32; 3],
}

impl Sums {
    const NONE: Sums = Sums {
        count: 0,
        at: [0.0; 3],
        time_s: 0.0,
        known: 0,
        velocity: [0.0; 2],
        low: [f32::INFINITY; 3],
        high: [f32::NEG_INFINITY; 3],
    };

    fn of(seen: &Seen) -> Sums {
        Sums {
            count: 1,
            at: seen.at.map(f64::from),
            time_s: seen.time_s as f64,
            known: seen.velocity.is_some() as u32,
            velocity: seen.velocity.unwrap_or_default().map(f64::from),
            low: seen.at,
            high: seen.at,
        }
    }

    fn add(&mut self, more: &Sums) {
        self.count += more.count;
        self.known += more.known;
        self.time_s += more.time_s;
        for a in 0..3 {
            self.at[a] += more.at[a];
            self.low[a] = self.low[a].min(more.low[a]);
            self.high[a] = self.high[a].max(more.high[a]);
        }
        for a in 0..2 {
            self.velocity[a] += more.velocity[a];
        }
    }
}

struct Chunk {
    first: Seen,
    /// The next chunk of the cell, or [`NONE`].
    next: u32,
    sums: Sums,
}

/// Returns that belong together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// Returns.
    pub count: u32,
    /// m from the batch's corner.
    pub centroid: [f64; 3],
    /// Mean of the returns' times, s after the batch's stamp.
    pub time_s: f64,
    /// Mean velocity of the returns that have one, m/s, where most have.
    pub velocity: Option<[f64; 2]>,
}

/// Segments left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct LeftOut {
    pub returns: u64,
    pub too_small: u32,
    pub too_large: u32,
    pub over_capacity: u32,
}

/// Chunks, found by cell.
struct Store {
    /// First chunk of every cell, or [`NONE`].
    heads: [u32; COLUMNS_MAX],
    all: heapless::Vec<Chunk, CHUNKS_MAX>,
}

impl Store {
    /// The nearest chunk that a return may join; of two as near, the one found first.
    fn nearest(&self, seen: &Seen) -> Option<u32> {
        let mut best = (JOINS_M * JOINS_M, None);
        self.around(seen.at, JOINS_M, |index, chunk| {
            let d = [0, 1, 2].map(|a| chunk.first.at[a] - seen.at[a]);
            let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            let near = (chunk.first.time_s - seen.time_s).abs() < JOINS_S && d2 < best.0;
            if near && alike(chunk.first.velocity, seen.velocity) {
                best = (d2, Some(index));
            }
        });
        best.1
    }

    /// Makes a chunk; [`NONE`] where there is no room.
    fn open(&mut self, seen: &Seen) -> u32 {
        let cell = seen.cell();
        let chunk = Chunk { first: *seen, next: self.heads[cell], sums: Sums::NONE };
        if self.all.push(chunk).is_err() {
            return NONE;
        }
        self.heads[cell] = self.all.len() as u32 - 1;
        self.heads[cell]
    }

    /// Visits the chunks of the cells within `reach` of a place.
    fn around<'a>(&'a self, at: [f32; 3], reach: f32, mut visit: impl FnMut(u32, &'a Chunk)) {
        let low = cell([at[0] - reach, at[1] - reach, 0.0]);
        let high = cell([at[0] + reach, at[1] + reach, 0.0]);
        for i in low[0]..=high[0] {
            for j in low[1]..=high[1] {
                let mut index = self.heads[i * SIDE + j];
                while let Some(chunk) = self.all.get(index as usize) {
                    visit(index, chunk);
                    index = chunk.next;
                }
            }
        }
    }
}

pub(super) struct Chunks {
    chunks: Store,
    /// Chunk of every return, or [`NONE`].
    of_return: [u32; POINTS_MAX],
    groups: Groups<CHUNKS_MAX>,
    segments: heapless::Vec<Segment, SEGMENTS_MAX>,
    /// Segment of every chunk, or [`NONE`].
    of_chunk: [u32; CHUNKS_MAX],
}

impl Chunks {
    pub const fn new() -> Chunks {
        Chunks {
            chunks: Store { heads: [0; COLUMNS_MAX], all: heapless::Vec::new() },
            of_return: [0; POINTS_MAX],
            groups: Groups::new(),
            segments: heapless::Vec::new(),
            of_chunk: [0; CHUNKS_MAX],
        }
    }

    /// From the returns of objects to segments.
    pub fn segment(
        &mut self,
        params: &FrontEndParams,
        batch: &Batch,
        is_object: impl Fn(usize) -> bool,
    ) -> LeftOut {
        let mut left = LeftOut { returns: self.gather(batch, is_object), ..LeftOut::default() };
        self.connect();
        self.list(params, &mut left);
        left
    }

    /// The segments.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Segment of a return of the batch.
    pub fn segment_of(&self, n: usize) -> Option<usize> {
        let segment = *self.of_chunk.get(self.of_return[n] as usize)?;
        (segment != NONE).then_some(segment as usize)
    }

    /// Puts returns into chunks. Returns how many had no room.
    fn gather(&mut self, batch: &Batch, is_object: impl Fn(usize) -> bool) -> u64 {
        self.chunks.heads[..CELLS].fill(NONE);
        self.chunks.all.clear();
        let mut dropped = 0;
        for (n, seen) in batch.returns.iter().enumerate() {
            self.of_return[n] = NONE;
            if !is_object(n) {
                continue;
            }
            let chunk = self.chunks.nearest(seen).unwrap_or_else(|| self.chunks.open(seen));
            match self.chunks.all.get_mut(chunk as usize) {
                Some(chunk) => chunk.sums.add(&Sums::of(seen)),
                None => dropped += 1,
            }
            self.of_return[n] = chunk;
        }
        dropped
    }

    /// Joins chunks that are near each other.
    fn connect(&mut self) {
        let Chunks { chunks, groups, .. } = self;
        groups.start(chunks.all.len(), |_| true);
        for (n, chunk) in chunks.all.iter().enumerate() {
            chunks.around(chunk.first.at, LINKS_M, |other, near| {
                if (other as usize) < n && linked(&chunk.first, &near.first) {
                    groups.join(n as u32, other);
                }
            });
        }
        groups.list(chunks.all.len());
    }

    /// Lists the segments that may be objects.
    fn list(&mut self, params: &FrontEndParams, left: &mut LeftOut) {
        self.segments.clear();
        for group in 0..self.groups.count() {
            let members = self.groups.members(group);
            let mut sums = Sums::NONE;
            members.iter().for_each(|c| sums.add(&self.chunks.all[*c as usize].sums));
            let extent = [0, 1].map(|a| sums.high[a] - sums.low[a]);
            let is_large = extent.iter().any(|e| *e > params.extent_max_m);
            let is_small = sums.count < params.returns_min;
            left.too_large += is_large as u32;
            left.too_small += is_small as u32;
            let mut index = NONE;
            if !is_large && !is_small {
                let n = sums.count as f64;
                let segment = Segment {
                    count: sums.count,
                    centroid: sums.at.map(|v| v / n),
                    time_s: sums.time_s / n,
                    velocity: (2 * sums.known > sums.count)
                        .then(|| sums.velocity.map(|v| v / sums.known as f64)),
                };
                match self.segments.push(segment) {
                    Ok(()) => index = self.segments.len() as u32 - 1,
                    Err(_) => left.over_capacity += 1,
                }
            }
            members.iter().for_each(|c| self.of_chunk[*c as usize] = index);
        }
    }
}

/// Whether two chunks are of one segment.
fn linked(a: &Seen, b: &Seen) -> bool {
    let d = [0, 1, 2].map(|n| a.at[n] - b.at[n]);
    d[0] * d[0] + d[1] * d[1] <= LINKS_M * LINKS_M
        && d[2].abs() <= LINKS_UP_M
        && alike(a.velocity, b.velocity)
}

/// Whether two velocities may be those of one thing; an unknown one may be any.
fn alike(a: Option<[f32; 2]>, b: Option<[f32; 2]>) -> bool {
    let (Some(a), Some(b)) = (a, b) else { return true };
    let square = |v: [f32; 2]| v[0] * v[0] + v[1] * v[1];
    let apart = square([a[0] - b[0], a[1] - b[1]]);
    let allowed = ALIKE_MPS + ALIKE * libm::sqrtf(square(a).max(square(b)));
    apart <= allowed * allowed
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::random::Random;
    use std::boxed::Box;
    use std::vec;
    use std::vec::Vec;

    const PARAMS: FrontEndParams = FrontEndParams::street();

    /// Clusters of returns, some of which touch, with and without velocities.
    fn batch(seed: u64) -> Box<Batch> {
        let mut random = Random(seed);
        let mut batch = Box::new(Batch::new());
        for _ in 0..60 {
            let middle = [0; 2].map(|_| random.between(1.0, 25.0));
            let speed = random.below(4) as f32 * 2.0;
            let velocity = (speed < 6.0).then_some([speed, 0.0]);
            for _ in 0..random.below(80) {
                let [x, y] = middle.map(|m| m + random.between(-0.9, 0.9));
                let seen = Seen {
                    at: [x, y, random.between(0.0, 2.0)],
                    time_s: random.between(0.0, 0.1),
                    velocity,
                    ..Seen::default()
                };
                batch.returns.push(seen).unwrap();
            }
        }
        batch
    }

    /// Every chunk with all that can be reached from it.
    fn flood(firsts: &[Seen]) -> Vec<usize> {
        let mut label = vec![usize::MAX; firsts.len()];
        for n in 0..firsts.len() {
            let mut open = vec![n];
            while let Some(at) = open.pop() {
                if label[at] == usize::MAX {
                    label[at] = n;
                    open.extend((0..firsts.len()).filter(|m| linked(&firsts[at], &firsts[*m])));
                }
            }
        }
        label
    }

    #[test]
    fn components_equal_a_flood_fill() {
        let mut chunks = Box::new(Chunks::new());
        let params = FrontEndParams { returns_min: 1, ..PARAMS };
        let mut several = 0;
        for seed in 0..20 {
            let batch = batch(seed);
            let left = chunks.segment(&params, &batch, |n| n % 7 != 0);
            let firsts: Vec<Seen> = chunks.chunks.all.iter().map(|c| c.first).collect();
            let label = flood(&firsts);
            let mut of_label = vec![None; firsts.len()];
            for (label, segment) in label.iter().zip(chunks.of_chunk) {
                let known = of_label[*label].get_or_insert(segment);
                assert_eq!(*known, segment);
            }
            let groups = of_label.iter().flatten().count();
            assert_eq!(groups, chunks.segments().len() + left.too_large as usize);
            several += (groups > 10 && groups < firsts.len() / 2) as u32;
        }
        assert!(several > 15, "{several}");
    }

    #[test]
    fn returns_join_the_nearest_chunk_and_segments_sum_them() {
        let mut chunks = Box::new(Chunks::new());
        for seed in 0..10 {
            let batch = batch(seed);
            chunks.segment(&PARAMS, &batch, |n| n % 7 != 0);
            let all = &chunks.chunks.all;
            let mut opened = 0;
            for (n, seen) in batch.returns.iter().enumerate() {
                let chunk = chunks.of_return[n];
                if n % 7 == 0 {
                    assert_eq!(chunk, NONE);
                    continue;
                }
                // Of the chunks there were, the nearest it may join; else its own.
                let joins = |c: &Chunk| {
                    let d2: f32 = (0..3)
                        .map(|a| (c.first.at[a] - seen.at[a]) * (c.first.at[a] - seen.at[a]))
                        .sum();
                    let near = d2 < JOINS_M * JOINS_M
                        && (c.first.time_s - seen.time_s).abs() < JOINS_S
                        && alike(c.first.velocity, seen.velocity);
                    near.then_some(d2)
                };
                let least = all[..opened].iter().filter_map(joins).min_by(f32::total_cmp);
                match least {
                    Some(d2) => assert_eq!(joins(&all[chunk as usize]), Some(d2)),
                    None => {
                        assert_eq!((chunk as usize, all[opened].first), (opened, *seen));
                        opened += 1;
                    }
                }
            }
            for (index, segment) in chunks.segments().iter().enumerate() {
                let of = |n: &usize| chunks.segment_of(*n) == Some(index);
                let members: Vec<usize> = (0..batch.returns.len()).filter(of).collect();
                assert_eq!(members.len(), segment.count as usize);
                assert!(segment.count >= PARAMS.returns_min);
                for a in 0..3 {
                    let sum: f64 = members.iter().map(|n| batch.returns[*n].at[a] as f64).sum();
                    assert!((sum / members.len() as f64 - segment.centroid[a]).abs() < 1e-9);
                }
            }
        }
    }
}
