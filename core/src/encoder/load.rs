//! Weights in the form the layers use.

use super::layers::*;
use crate::weights::{Weights, WeightsError};

/// Sums for each byte of a column's masks, indexed by byte, its value, and channel.
type ByteTable = [[[i16; COLUMN_CHANNELS]; 256]; 4];

/// The weights of the layers.
#[derive(Clone)]
pub struct EncoderWeights {
    /// Layer by layer, each in the order of [`Layer::place`].
    pub(super) weights: [i16; TOTAL[0]],
    pub(super) biases: [i32; TOTAL[1]],
    pub(super) shifts: [u8; TOTAL[1]],
    /// Table of the first layer's sums.
    pub(super) bytes: ByteTable,
}

impl Default for EncoderWeights {
    fn default() -> EncoderWeights {
        EncoderWeights::new()
    }
}

impl EncoderWeights {
    /// Weights before they are loaded: all zeros.
    pub const fn new() -> EncoderWeights {
        EncoderWeights {
            weights: [0; TOTAL[0]],
            biases: [0; TOTAL[1]],
            shifts: [0; TOTAL[1]],
            bytes: [[[0; COLUMN_CHANNELS]; 256]; 4],
        }
    }

    /// Replaces the weights with those of a file of kind `encoder`; see [`NUMBERS`]. On failure
    /// they stay as they were.
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
                let to = layer.place(w / layer.inputs, w % layer.inputs);
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
                        let place = LAYERS[COLUMN].place(channel, half * LEVELS + level);
                        let weight = self.weights[before(COLUMN)[0] + place];
                        *sum += weight * ONE as i16;
                    }
                }
                table[value] = sums;
            }
        }
    }
}
