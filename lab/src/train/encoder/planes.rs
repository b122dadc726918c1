//! Layers on planes of numbers, and how they pass gradients back.

use super::parameters::Parameters;
use raywake_core::encoder::layers::*;

/// Set bits of a column's masks, numbered as in the first layer.
pub fn bits(masks: u32) -> impl Iterator<Item = usize> {
    (0..BITS).filter(move |bit| masks >> (bit / LEVELS * 16 + bit % LEVELS) & 1 == 1)
}

/// Side of a square level.
fn side_of(plane: &[f32], channels: usize) -> usize {
    (plane.len() / channels).isqrt()
}

/// Index of the first channel, in the finest level, of the cell above a column.
pub fn parent(column: usize, side: usize) -> usize {
    (column / side / 2 * (side / 2) + column % side / 2) * COLUMN_CHANNELS
}

/// The slope that passes through a clamp.
pub fn passed(values: &[f32], slope: &[f32], least: f32) -> Vec<f32> {
    let top = TOP as f32 / ONE as f32;
    let inside = |v: f32| v > least && v < top;
    values.iter().zip(slope).map(|(v, s)| if inside(*v) { *s } else { 0.0 }).collect()
}

pub fn transposed<const OUT: usize>(weights: &[f32]) -> Vec<[f32; OUT]> {
    let inputs = weights.len() / OUT;
    (0..inputs).map(|i| std::array::from_fn(|o| weights[o * inputs + i])).collect()
}

/// Calls a function instantiated for the sizes of a dense layer: loops of known length vectorise
/// fully.
macro_rules! of_size {
    ($of:ident $args:tt of $size:expr; $($inputs:literal $outputs:literal),*) => {
        match $size {
            $(($inputs, $outputs) => $of::<$inputs, $outputs> $args,)*
            other => unreachable!("no layer has {other:?}"),
        }
    };
    ($of:ident $args:tt of $size:expr) => {
        of_size!(
            $of $args of $size; 64 24, 24 24, 96 32, 32 32, 128 48, 48 48, 48 32, 32 24, 24 16, 32 9
        )
    };
}

pub fn dense((weights, biases): (&[f32], &[f32]), x: &[f32]) -> Vec<f32> {
    of_size!(dense_sized(weights, biases, x) of (weights.len() / biases.len(), biases.len()))
}

fn dense_sized<const IN: usize, const OUT: usize>(
    weights: &[f32],
    biases: &[f32],
    x: &[f32],
) -> Vec<f32> {
    let by_input = transposed::<OUT>(weights);
    let biases: [f32; OUT] = biases.try_into().expect("a bias a channel");
    let mut out = Vec::with_capacity(x.len() / IN * OUT);
    for x in x.as_chunks::<IN>().0 {
        let mut sums = biases;
        for (x, weights) in x.iter().zip(&by_input) {
            if *x != 0.0 {
                add(&mut sums, *x, weights);
            }
        }
        out.extend(sums);
    }
    out
}

#[inline]
fn add<const N: usize>(to: &mut [f32; N], by: f32, values: &[f32; N]) {
    for n in 0..N {
        to[n] += by * values[n];
    }
}

/// Adds numbers element by element.
pub fn add_slices(to: &mut [f32], values: &[f32]) {
    to.iter_mut().zip(values).for_each(|(t, v)| *t += v);
}

/// Gradients with respect to parameters, added to those already there.
pub struct Gradients<'a> {
    pub of: &'a Parameters,
    pub into: &'a mut Parameters,
}

impl Gradients<'_> {
    /// Of the first layer.
    pub fn columns(&mut self, masks: &[u32], slope: &[f32]) {
        let (weights, biases) = self.into.of_mut(COLUMN);
        let mut by_bit = transposed::<COLUMN_CHANNELS>(weights);
        for (&masks, slope) in masks.iter().zip(slope.chunks(COLUMN_CHANNELS)) {
            add_slices(biases, slope);
            for bit in bits(masks) {
                add_slices(&mut by_bit[bit], slope);
            }
        }
        for (bit, of_bit) in by_bit.iter().enumerate() {
            for (channel, w) in of_bit.iter().enumerate() {
                weights[channel * BITS + bit] = *w;
            }
        }
    }

    /// Of a dense layer; the gradient of its input `x` is added to `below`.
    pub fn dense(&mut self, layer: usize, x: &[f32], slope: &[f32], below: &mut [f32]) {
        let Layer { inputs, outputs } = LAYERS[layer];
        let (weights, into) = (self.of.of(layer).0, self.into.of_mut(layer));
        of_size!(dense_slope_sized(weights, into, x, slope, below) of (inputs, outputs));
    }

    /// Of a depthwise layer; otherwise as for a dense one.
    pub fn depthwise(&mut self, layer: usize, x: &[f32], slope: &[f32], below: &mut [f32]) {
        let channels = LAYERS[layer].outputs;
        let by_tap = by_tap(self.of.of(layer).0, channels);
        let mut of_taps = vec![vec![0.0; channels]; TAPS];
        each_tap(side_of(x, channels), |cell, other, tap| {
            let slope = &slope[cell * channels..][..channels];
            let below = &mut below[other * channels..][..channels];
            add_products(below, slope, &by_tap[tap]);
            add_products(&mut of_taps[tap], slope, &x[other * channels..][..channels]);
        });
        let (weights, biases) = self.into.of_mut(layer);
        slope.chunks(channels).for_each(|slope| add_slices(biases, slope));
        for (tap, of_tap) in of_taps.iter().enumerate() {
            of_tap.iter().enumerate().for_each(|(c, s)| weights[c * TAPS + tap] += s);
        }
    }
}

fn dense_slope_sized<const IN: usize, const OUT: usize>(
    weights: &[f32],
    (of_weights, of_biases): (&mut [f32], &mut [f32]),
    x: &[f32],
    slope: &[f32],
    below: &mut [f32],
) {
    let weights = weights.as_chunks::<IN>().0;
    let of_weights = of_weights.as_chunks_mut::<IN>().0;
    let all = x.as_chunks::<IN>().0.iter().zip(slope.as_chunks::<OUT>().0);
    for ((x, slope), below) in all.zip(below.as_chunks_mut::<IN>().0) {
        for (n, s) in slope.iter().enumerate() {
            if *s != 0.0 {
                add(below, *s, &weights[n]);
                add(&mut of_weights[n], *s, x);
                of_biases[n] += s;
            }
        }
    }
}

/// Adds products of numbers element by element.
fn add_products(to: &mut [f32], a: &[f32], b: &[f32]) {
    to.iter_mut().zip(a).zip(b).for_each(|((t, a), b)| *t += a * b);
}

/// Number of cells in the window of a depthwise layer: a cell and its neighbours.
const TAPS: usize = 9;

/// Weights of a depthwise layer with the channels innermost.
fn by_tap(weights: &[f32], channels: usize) -> Vec<Vec<f32>> {
    (0..TAPS).map(|tap| (0..channels).map(|c| weights[c * TAPS + tap]).collect()).collect()
}

/// Calls `each` with a cell, a neighbour and the tap between them, on a square level.
fn each_tap(side: usize, mut each: impl FnMut(usize, usize, usize)) {
    for row in 0..side {
        for at in 0..side {
            for tap in 0..TAPS {
                // Wraps below zero, and is then outside the level.
                let [i, j] = [row + tap / 3, at + tap % 3].map(|n| n.wrapping_sub(1));
                if i < side && j < side {
                    each(row * side + at, i * side + j, tap);
                }
            }
        }
    }
}

pub fn depthwise((weights, biases): (&[f32], &[f32]), x: &[f32]) -> Vec<f32> {
    let channels = biases.len();
    let by_tap = by_tap(weights, channels);
    let mut out = biases.repeat(x.len() / channels);
    each_tap(side_of(x, channels), |cell, other, tap| {
        let sums = &mut out[cell * channels..][..channels];
        add_products(sums, &x[other * channels..][..channels], &by_tap[tap]);
    });
    out
}

/// Puts the 2 x 2 cells below each cell side by side.
pub fn gather(x: &[f32], channels: usize) -> Vec<f32> {
    let half = side_of(x, channels) / 2;
    let cell = move |n: usize| (0..4).map(move |k| below(n, k, half));
    (0..half * half).flat_map(cell).flat_map(|c| &x[c * channels..][..channels]).copied().collect()
}

/// Adds what [`gather`] put side by side back to where it came from.
pub fn scatter(x: &[f32], channels: usize, into: &mut [f32]) {
    let half = side_of(into, channels) / 2;
    for (n, x) in x.chunks(channels).enumerate() {
        add_slices(&mut into[below(n / 4, n % 4, half) * channels..], x);
    }
}

/// The `k`-th of the 2 x 2 cells below cell `n` of a level of `side`.
fn below(n: usize, k: usize, side: usize) -> usize {
    (n / side * 2 + k / 2) * 2 * side + n % side * 2 + k % 2
}

/// Copies every cell's values to the 2 x 2 cells below it.
pub fn spread(x: &[f32], channels: usize) -> Vec<f32> {
    let side = side_of(x, channels);
    let mut out = vec![0.0; 4 * x.len()];
    for (n, x) in x.chunks(channels).enumerate() {
        (0..4).for_each(|k| out[below(n, k, side) * channels..][..channels].copy_from_slice(x));
    }
    out
}

/// Sums over the 2 x 2 cells below each cell.
pub fn summed(x: &[f32], channels: usize) -> Vec<f32> {
    let side = side_of(x, channels) / 2;
    let mut out = vec![0.0; x.len() / 4];
    for (n, sums) in out.chunks_mut(channels).enumerate() {
        for k in 0..4 {
            add_slices(sums, &x[below(n, k, side) * channels..]);
        }
    }
    out
}
