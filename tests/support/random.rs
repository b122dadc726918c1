//! Random numbers, the same in every run.

use raywake_core::record::Column;
use raywake_sim::Rng;

/// The simulator's generator, as integers; equal seeds give equal sequences.
pub struct Random(Rng);

impl Random {
    /// From a seed.
    pub fn new(seed: u64) -> Random {
        Random(Rng::new(seed))
    }

    /// Any word.
    pub fn word(&mut self) -> u32 {
        (self.0.bits() >> 32) as u32
    }

    /// Below `n`.
    pub fn below(&mut self, n: u32) -> u32 {
        self.word() % n
    }

    /// From `low` to `high`, both included.
    pub fn between(&mut self, low: i32, high: i32) -> i32 {
        low + self.below((high - low + 1) as u32) as i32
    }

    /// `count` words.
    pub fn words(&mut self, count: usize) -> Vec<u32> {
        (0..count).map(|_| self.word()).collect()
    }

    /// Columns as ray tracing produces them: no voxel both free and occupied, solid only where
    /// occupied.
    pub fn columns(&mut self, count: usize, levels: i32) -> Vec<Column> {
        let mask = (1u32 << levels) - 1;
        (0..count)
            .map(|_| {
                let free = self.word() & mask;
                let occupied = self.word() & !free & mask;
                [free | occupied << 16, self.word() & occupied]
            })
            .collect()
    }
}
