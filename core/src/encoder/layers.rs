//! The layers, declared once for the network, its weights file and its training.

/// Voxel levels that the encoder is trained for.
pub const LEVELS: usize = 14;
/// Bits for the free and occupied voxels of a column.
pub const BITS: usize = 2 * LEVELS;
/// Columns along an axis of the coarsest cell.
pub const OCTET: usize = 8;
/// The activation that represents 1.
pub const ONE: i32 = 16;
/// Largest activation.
pub const TOP: i32 = 127;
/// Largest shift.
pub const SHIFT_MAX: i32 = 14;
/// Exclusive bound on biases: with the widest layer's products, 127 x 127 x 128, they fit in 32
/// bits.
pub const BIAS_MAX: i32 = 1 << 22;

/// Channels of columns, and of pairs, quads and octets of them. Multiples of 8, to fill vectors.
pub const COLUMN_CHANNELS: usize = 16;
/// See [`COLUMN_CHANNELS`].
pub const FINE_CHANNELS: usize = 24;
/// See [`COLUMN_CHANNELS`].
pub const MIDDLE_CHANNELS: usize = 32;
/// See [`COLUMN_CHANNELS`].
pub const COARSE_CHANNELS: usize = 48;
/// Channels between the two layers of the head.
pub const HEAD_CHANNELS: usize = 32;
/// Scores of a column.
pub const SCORES: usize = 9;

/// A layer: a channel times its 3 x 3 neighbourhood (depthwise), or all channels times all (dense).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layer {
    /// Inputs per output: [`TAPS`] in a depthwise layer, otherwise an even number.
    pub inputs: usize,
    /// Output channels.
    pub outputs: usize,
}

/// Inputs per output of a depthwise layer: the 3 x 3 cells around it.
pub const TAPS: usize = 9;

impl Layer {
    /// The index of the weight from an input to an output within the layer: outputs are contiguous,
    /// so that a processor handles several at once, and a dense layer's inputs come in pairs.
    pub const fn place(self, output: usize, input: usize) -> usize {
        match self.inputs {
            TAPS => input * self.outputs + output,
            _ => (input / 2 * self.outputs + output) * 2 + input % 2,
        }
    }
}

/// Index of a layer in [`LAYERS`].
pub const COLUMN: usize = 0;
/// See [`COLUMN`]: from 2 x 2 cells of a level to one of the next, and so on.
pub const DOWN_FINE: usize = 1;
/// Where each block of two layers begins: depthwise, then dense, added to the block's input.
pub const BLOCKS_FINE: [usize; 2] = [2, 4];
/// See [`COLUMN`].
pub const DOWN_MIDDLE: usize = 6;
/// See [`BLOCKS_FINE`].
pub const BLOCKS_MIDDLE: [usize; 3] = [7, 9, 11];
/// See [`COLUMN`].
pub const DOWN_COARSE: usize = 13;
/// See [`BLOCKS_FINE`].
pub const BLOCKS_COARSE: [usize; 2] = [14, 16];
/// From a cell to the 2 x 2 cells of the next finer level, added to their values.
pub const UP_MIDDLE: usize = 18;
/// See [`UP_MIDDLE`].
pub const UP_FINE: usize = 19;
/// See [`BLOCKS_FINE`].
pub const BLOCK_AFTER: usize = 20;
/// From a pair's cell to its columns.
pub const UP_COLUMN: usize = 22;
/// The head's first layer: from the features around a column and its own.
pub const HEAD: usize = 23;
/// The head's second layer: the scores.
pub const SCORE: usize = 24;

const fn layer(inputs: usize, outputs: usize) -> Layer {
    Layer { inputs, outputs }
}

/// Layers in the order of the weights file.
pub const LAYERS: [Layer; 25] = {
    let mut all = [layer(TAPS, 0); 25];
    all[COLUMN] = layer(BITS, COLUMN_CHANNELS);
    all[DOWN_FINE] = layer(4 * COLUMN_CHANNELS, FINE_CHANNELS);
    all = with_blocks(all, &BLOCKS_FINE, FINE_CHANNELS);
    all[DOWN_MIDDLE] = layer(4 * FINE_CHANNELS, MIDDLE_CHANNELS);
    all = with_blocks(all, &BLOCKS_MIDDLE, MIDDLE_CHANNELS);
    all[DOWN_COARSE] = layer(4 * MIDDLE_CHANNELS, COARSE_CHANNELS);
    all = with_blocks(all, &BLOCKS_COARSE, COARSE_CHANNELS);
    all[UP_MIDDLE] = layer(COARSE_CHANNELS, MIDDLE_CHANNELS);
    all[UP_FINE] = layer(MIDDLE_CHANNELS, FINE_CHANNELS);
    all = with_blocks(all, &[BLOCK_AFTER], FINE_CHANNELS);
    all[UP_COLUMN] = layer(FINE_CHANNELS, COLUMN_CHANNELS);
    all[HEAD] = layer(2 * COLUMN_CHANNELS, HEAD_CHANNELS);
    all[SCORE] = layer(HEAD_CHANNELS, SCORES);
    all
};

const fn with_blocks(mut all: [Layer; 25], firsts: &[usize], channels: usize) -> [Layer; 25] {
    let mut n = 0;
    while n < firsts.len() {
        all[firsts[n]] = layer(TAPS, channels);
        all[firsts[n] + 1] = layer(channels, channels);
        n += 1;
    }
    all
}

/// Number of weights and of outputs in the layers before `layer`.
pub const fn before(layer: usize) -> [usize; 2] {
    let mut sums = [0; 2];
    let mut n = 0;
    while n < layer {
        sums = [sums[0] + LAYERS[n].inputs * LAYERS[n].outputs, sums[1] + LAYERS[n].outputs];
        n += 1;
    }
    sums
}

/// Number of weights and of outputs in all layers.
pub const TOTAL: [usize; 2] = before(LAYERS.len());

/// Count of numbers in a weights file: for each layer its weights, output by output, then a bias
/// per output, then a shift per output.
pub const NUMBERS: usize = TOTAL[0] + 2 * TOTAL[1];

/// The activation of a sum, its bias included, and its shift.
#[inline(always)]
pub fn activation(sum: i32, shift: u8) -> u8 {
    (sum >> shift).clamp(0, TOP) as u8
}
