//! Chunks: small containers of returns in space and time, found by cell.

use super::batch::{BatchReturn, cell_along};
use super::{CELLS, FrontEndParams, SIDE};
use raywake_core::record::NONE;

/// Maximum number of chunks of a batch; returns that would need more are dropped and counted.
pub(super) const CHUNKS_MAX: usize = 32_768;

/// Sums over returns.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReturnSums {
    pub count: u32,
    pub position: [f64; 3],
    pub time_s: f64,
    /// Number of returns with a velocity, and the sum of their velocities.
    pub with_velocity: u32,
    pub velocity: [f64; 2],
    pub low: [f32; 3],
    pub high: [f32; 3],
}

impl ReturnSums {
    pub const NONE: ReturnSums = ReturnSums {
        count: 0,
        position: [0.0; 3],
        time_s: 0.0,
        with_velocity: 0,
        velocity: [0.0; 2],
        low: [f32::INFINITY; 3],
        high: [f32::NEG_INFINITY; 3],
    };

    fn of(one: &BatchReturn) -> ReturnSums {
        ReturnSums {
            count: 1,
            position: one.position.map(f64::from),
            time_s: one.time_s as f64,
            with_velocity: one.velocity.is_some() as u32,
            velocity: one.velocity.unwrap_or_default().map(f64::from),
            low: one.position,
            high: one.position,
        }
    }

    pub fn add(&mut self, more: &ReturnSums) {
        self.count += more.count;
        self.with_velocity += more.with_velocity;
        self.time_s += more.time_s;
        for a in 0..3 {
            self.position[a] += more.position[a];
            self.low[a] = self.low[a].min(more.low[a]);
            self.high[a] = self.high[a].max(more.high[a]);
        }
        for a in 0..2 {
            self.velocity[a] += more.velocity[a];
        }
    }
}

/// What is inspected of a chunk that may be near: the return that opened it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Chunk {
    /// m from the batch's corner.
    pub position: [f32; 3],
    /// s after the batch's stamp.
    pub time_s: f32,
    /// m/s, if known.
    pub velocity: Option<[f32; 2]>,
    /// The next chunk of the cell, or [`NONE`].
    next: u32,
}

/// The chunks of a batch.
pub(super) struct Chunks {
    /// First chunk of every cell, or [`NONE`].
    heads: [u32; CELLS],
    all: heapless::Vec<Chunk, CHUNKS_MAX>,
    /// Sums over the returns of each chunk.
    sums: heapless::Vec<ReturnSums, CHUNKS_MAX>,
}

impl Chunks {
    pub const fn new() -> Chunks {
        Chunks { heads: [0; CELLS], all: heapless::Vec::new(), sums: heapless::Vec::new() }
    }

    pub fn clear(&mut self) {
        self.heads.fill(NONE);
        self.all.clear();
        self.sums.clear();
    }

    pub fn all(&self) -> &[Chunk] {
        &self.all
    }

    /// Sums over the returns of a chunk.
    pub fn sums(&self, chunk: u32) -> &ReturnSums {
        &self.sums[chunk as usize]
    }

    /// Adds a return to the nearest chunk that it may join, or to a new one. Returns the chunk, or
    /// [`NONE`] if there is no room.
    pub fn add(&mut self, params: &FrontEndParams, one: &BatchReturn) -> u32 {
        let index = self.nearest(params, one).unwrap_or_else(|| self.open(one));
        if let Some(sums) = self.sums.get_mut(index as usize) {
            sums.add(&ReturnSums::of(one));
        }
        index
    }

    /// The nearest chunk that a return may join; of two equally near ones, the one found first.
    fn nearest(&self, params: &FrontEndParams, one: &BatchReturn) -> Option<u32> {
        let radius = params.chunk_radius_m;
        let mut best = (radius * radius, None);
        self.around(one.position, radius, |index, chunk| {
            let d = [0, 1, 2].map(|a| chunk.position[a] - one.position[a]);
            let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            let apart_s = (chunk.time_s - one.time_s).abs();
            let near = apart_s < params.chunk_span_s && d2 < best.0;
            if near && params.is_similar(chunk.velocity, one.velocity) {
                best = (d2, Some(index));
            }
        });
        best.1
    }

    fn open(&mut self, one: &BatchReturn) -> u32 {
        let cell = one.cell as usize;
        let &BatchReturn { position, time_s, velocity, .. } = one;
        let chunk = Chunk { position, time_s, velocity, next: self.heads[cell] };
        if self.all.push(chunk).is_err() || self.sums.push(ReturnSums::NONE).is_err() {
            return NONE;
        }
        self.heads[cell] = self.all.len() as u32 - 1;
        self.heads[cell]
    }

    /// Visits the chunks of the cells within `reach` (m) of a point.
    pub fn around<'a>(&'a self, at: [f32; 3], reach: f32, mut visit: impl FnMut(u32, &'a Chunk)) {
        let low = cell_along([at[0] - reach, at[1] - reach, 0.0]);
        let high = cell_along([at[0] + reach, at[1] + reach, 0.0]);
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
