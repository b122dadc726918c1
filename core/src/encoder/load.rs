//! Weights in the form the layers use, and the layers.

use super::layers::*;
use super::rows::{Plane, each_row, gathered};
use super::{ColumnScores, PaddedWindow};
use crate::team::Team;
use crate::weights::{Weights, WeightsError};

/// Sums of a byte of a column's masks: byte, its value, channel.
type ByteTable = [[[i16; COLUMN_CHANNELS]; 256]; 4];

/// The weights of the layers.
#[derive(Clone)]
pub struct EncoderWeights {
    /// In the file's order; depthwise ones with the channels innermost.
    weights: [i16; TOTAL[0]],
    biases: [i32; TOTAL[1]],
    shifts: [u8; TOTAL[1]],
    /// The first layer's.
    bytes: ByteTable,
}

impl Default for EncoderWeights {
    fn default() -> EncoderWeights {
        EncoderWeights::new()
    }
}

impl EncoderWeights {
    /// Before they are loaded, all zeros.
    pub const fn new() -> EncoderWeights {
        EncoderWeights {
            weights: [0; TOTAL[0]],
            biases: [0; TOTAL[1]],
            shifts: [0; TOTAL[1]],
            bytes: [[[0; COLUMN_CHANNELS]; 256]; 4],
        }
    }

    /// Replaces them by those of a file of kind `encoder`; see [`NUMBERS`]. Left as they
    /// were where it fails.
    pub fn load(&mut self, text: &str, levels: usize) -> Result<(), WeightsError> {
        let file = Weights::parse(text, "encoder", &[NUMBERS], 0)?;
        if levels != LEVELS {
            return Err(WeightsError::Shape);
        }
        let mut values = file.values();
        for Layer { inputs, outputs } in LAYERS {
            let values = &mut values;
            let fits = values.take(inputs * outputs).all(|w| w.abs() <= TOP)
                && values.take(outputs).all(|b| b.abs() < BIAS_MAX)
                && values.take(outputs).all(|s| (0..=SHIFT_MAX).contains(&s));
            if !fits {
                return Err(WeightsError::Range);
            }
        }
        let mut values = file.values();
        for (n, layer) in LAYERS.iter().enumerate() {
            let [first, output] = before(n);
            for w in 0..layer.inputs * layer.outputs {
                let to = match layer.inputs {
                    9 => w % 9 * layer.outputs + w / 9,
                    _ => w,
                };
                self.weights[first + to] = values.next().unwrap_or(0) as i16;
            }
            let outputs = output..output + layer.outputs;
            self.biases[outputs.clone()].fill_with(|| values.next().unwrap_or(0));
            self.shifts[outputs].fill_with(|| values.next().unwrap_or(0) as u8);
        }
        self.fill_bytes();
        Ok(())
    }

    fn fill_bytes(&mut self) {
        for (byte, table) in self.bytes.iter_mut().enumerate() {
            for value in 1..256usize {
                // Free voxels are the low half of the masks, occupied ones the high half.
                let bit = byte * 8 + value.trailing_zeros() as usize;
                let (half, level) = (bit / 16, bit % 16);
                let mut sums = table[value & (value - 1)];
                if level < LEVELS {
                    for (channel, sum) in sums.iter_mut().enumerate() {
                        let weight = self.weights[channel * BITS + half * LEVELS + level];
                        *sum += weight * ONE as i16;
                    }
                }
                table[value] = sums;
            }
        }
    }

    /// What a column is.
    #[inline]
    pub(super) fn column(&self, masks: u32) -> [u8; COLUMN_CHANNELS] {
        let bytes = masks.to_le_bytes();
        core::array::from_fn(|channel| {
            let mut sum = 0;
            for (table, byte) in self.bytes.iter().zip(bytes) {
                sum += i32::from(table[byte as usize][channel]);
            }
            activation(sum, self.biases[channel], u32::from(self.shifts[channel]))
        })
    }

    /// The finest level, of 2 x 2 columns a cell.
    pub(super) fn down_from_columns(
        &self,
        team: &impl Team,
        window: &PaddedWindow,
        side: usize,
        to: &mut [u8],
    ) {
        each_row(team, to, side * FINE_CHANNELS, &|row, out| {
            for (at, cell) in out.as_chunks_mut::<FINE_CHANNELS>().0.iter_mut().enumerate() {
                let mut x = [0; 4 * COLUMN_CHANNELS];
                for (n, x) in x.as_chunks_mut::<COLUMN_CHANNELS>().0.iter_mut().enumerate() {
                    let masks = window.masks(2 * row + n / 2, 2 * at + n % 2);
                    *x = self.column(masks).map(i16::from);
                }
                *cell = self.dense::<DOWN_FINE, { 4 * COLUMN_CHANNELS }, FINE_CHANNELS>(&x);
            }
        });
    }

    /// From a level to the next coarser one, `ALL` numbers of 2 x 2 cells to a cell.
    pub(super) fn down<const LAYER: usize, const IN: usize, const ALL: usize, const OUT: usize>(
        &self,
        team: &impl Team,
        from: &Plane<IN>,
        to: &mut [u8],
    ) {
        each_row(team, to, from.side / 2 * OUT, &|row, out| {
            for (at, cell) in out.as_chunks_mut::<OUT>().0.iter_mut().enumerate() {
                *cell = self.dense::<LAYER, ALL, OUT>(&gathered::<IN, ALL>(from, row, at));
            }
        });
    }

    /// Sums of a layer with their biases, before the shift.
    #[inline]
    fn sums<const LAYER: usize, const IN: usize, const OUT: usize>(
        &self,
        x: &[i16; IN],
    ) -> [i32; OUT] {
        const { assert!(LAYERS[LAYER].inputs == IN && LAYERS[LAYER].outputs == OUT) };
        let [first, output] = const { before(LAYER) };
        let weights = self.weights[first..][..IN * OUT].as_chunks::<IN>().0;
        core::array::from_fn(|n| dot(x, &weights[n]) + self.biases[output + n])
    }

    /// A dense layer.
    #[inline]
    pub(super) fn dense<const LAYER: usize, const IN: usize, const OUT: usize>(
        &self,
        x: &[i16; IN],
    ) -> [u8; OUT] {
        let output = const { before(LAYER)[1] };
        let sums = self.sums::<LAYER, IN, OUT>(x);
        core::array::from_fn(|n| activation(sums[n], 0, u32::from(self.shifts[output + n])))
    }

    /// A block on a level: depthwise into `beside`, then dense, added to the level.
    pub(super) fn block<const CHANNELS: usize>(
        &self,
        team: &impl Team,
        first: usize,
        side: usize,
        level: &mut [u8],
        beside: &mut [u8],
    ) {
        let [from, output] = before(first);
        let weights = self.weights[from..][..9 * CHANNELS].as_chunks::<CHANNELS>().0;
        let plane = Plane::<CHANNELS> { side, cells: level };
        each_row(team, beside, side * CHANNELS, &|row, out| {
            for (at, cell) in out.as_chunks_mut::<CHANNELS>().0.iter_mut().enumerate() {
                let mut sums: [i32; CHANNELS] = core::array::from_fn(|n| self.biases[output + n]);
                for (tap, weights) in weights.iter().enumerate() {
                    // Wraps below zero, and is then not within the level.
                    let [i, j] = [row + tap / 3, at + tap % 3].map(|n| n.wrapping_sub(1));
                    if i < side && j < side {
                        add_products(&mut sums, plane.at(i, j), weights);
                    }
                }
                *cell = core::array::from_fn(|n| {
                    activation(sums[n], 0, u32::from(self.shifts[output + n]))
                });
            }
        });
        let [from, output] = before(first + 1);
        let weights = self.weights[from..][..CHANNELS * CHANNELS].as_chunks::<CHANNELS>().0;
        let beside = Plane::<CHANNELS> { side, cells: beside };
        each_row(team, level, side * CHANNELS, &|row, out| {
            for (at, cell) in out.as_chunks_mut::<CHANNELS>().0.iter_mut().enumerate() {
                let x = beside.at(row, at).map(i16::from);
                for (n, value) in cell.iter_mut().enumerate() {
                    let sum = dot(&x, &weights[n]) + self.biases[output + n];
                    *value = added(*value, sum, self.shifts[output + n]);
                }
            }
        });
    }

    /// From a level to the one before it, to whose cells the result is added.
    pub(super) fn up<const LAYER: usize, const IN: usize, const OUT: usize>(
        &self,
        team: &impl Team,
        from: &Plane<IN>,
        to: &mut [u8],
    ) {
        let output = const { before(LAYER)[1] };
        let length = 2 * from.side * OUT;
        each_row(team, to, 2 * length, &|row, out| {
            let (upper, lower) = out.split_at_mut(length);
            for at in 0..from.side {
                let sums = self.sums::<LAYER, IN, OUT>(&from.at(row, at).map(i16::from));
                for line in [&mut *upper, &mut *lower] {
                    for cell in line[2 * at * OUT..][..2 * OUT].as_chunks_mut::<OUT>().0 {
                        for (n, value) in cell.iter_mut().enumerate() {
                            *value = added(*value, sums[n], self.shifts[output + n]);
                        }
                    }
                }
            }
        });
    }

    /// The scores of a column, from what is around it and what it is.
    #[inline]
    pub(super) fn head(
        &self,
        around: &[u8; COLUMN_CHANNELS],
        own: &[u8; COLUMN_CHANNELS],
    ) -> ColumnScores {
        let mut x = [0; 2 * COLUMN_CHANNELS];
        for (x, from) in x.as_chunks_mut::<COLUMN_CHANNELS>().0.iter_mut().zip([around, own]) {
            *x = from.map(i16::from);
        }
        let hidden = self.dense::<HEAD, { 2 * COLUMN_CHANNELS }, HEAD_CHANNELS>(&x);
        let sums = self.sums::<SCORE, HEAD_CHANNELS, SCORES>(&hidden.map(i16::from));
        let output = const { before(SCORE)[1] };
        core::array::from_fn(|n| (sums[n] >> self.shifts[output + n]).clamp(-TOP, TOP) as i8)
    }
}

/// An activation with a sum added to it.
#[inline]
fn added(value: u8, sum: i32, shift: u8) -> u8 {
    (i32::from(value) + (sum >> shift)).clamp(0, TOP) as u8
}

#[inline]
fn dot<const N: usize>(x: &[i16; N], weights: &[i16; N]) -> i32 {
    let mut sum = 0;
    for n in 0..N {
        sum += i32::from(x[n]) * i32::from(weights[n]);
    }
    sum
}

#[inline]
fn add_products<const N: usize>(sums: &mut [i32; N], x: &[u8; N], weights: &[i16; N]) {
    for n in 0..N {
        sums[n] += i32::from(x[n]) * i32::from(weights[n]);
    }
}
