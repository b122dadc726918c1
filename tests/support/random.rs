//! Numbers without a pattern, the same in every run.

use raywake_core::record::Column;

/// A generator; equal seeds give equal numbers.
pub struct Random(u64);

impl Random {
    /// From a seed.
    pub fn new(seed: u64) -> Random {
        Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d)
    }

    /// Any word (SplitMix64, upper half).
    pub fn word(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 32) as u32
    }

    /// Below `n`.
    pub fn below(&mut self, n: u32) -> u32 {
        self.word() % n
    }

    /// From `low` to `high`, both included.
    pub fn between(&mut self, low: i32, high: i32) -> i32 {
        low + self.below((high - low + 1) as u32) as i32
    }

    /// So many words.
    pub fn words(&mut self, count: usize) -> Vec<u32> {
        (0..count).map(|_| self.word()).collect()
    }

    /// Columns as ray tracing makes them: no voxel both free and occupied, solid only where
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
