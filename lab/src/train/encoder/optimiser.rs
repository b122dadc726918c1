//! Adam (Kingma and Ba, 2015), the rounding of weights, and checkpoints.

use super::parameters::Parameters;
use crate::learning::checkpoint;
use raywake_core::encoder::layers::*;
use raywake_io::Error;
use raywake_sim::Rng;
use std::io::{self, Write};
use std::path::Path;

/// Decay of the mean gradient, and of its square.
const DECAY: [f32; 2] = [0.9, 0.99];
/// The highest learning rate, reached after [`WARM_UP`] of the steps.
const RATE: f64 = 3e-3;
const WARM_UP: f64 = 0.1;
/// Headroom for weights to grow after their shifts are chosen.
const ROOM: f32 = 1.25;

/// The learning rate over the steps, and when rounding begins.
pub struct Schedule {
    pub steps: usize,
    /// The first step with rounded numbers.
    pub rounded: usize,
}

impl Schedule {
    /// Linearly up, then down to zero along a parabola, which needs no transcendental function.
    pub fn rate(&self, step: usize) -> f32 {
        let at = (step as f64 + 0.5) / self.steps as f64;
        let part = if at < WARM_UP { at / WARM_UP } else { (1.0 - at) / (1.0 - WARM_UP) };
        (RATE * if at < WARM_UP { part } else { part * (2.0 - part) }) as f32
    }
}

/// State of the training.
pub struct Optimiser {
    pub parameters: Parameters,
    means: Parameters,
    squares: Parameters,
    /// Shift of every output, once chosen; all zero before that.
    shifts: Vec<u8>,
    pub step: usize,
}

impl Optimiser {
    /// Weights drawn by the seed, as in He et al. (2015) for clamped activations; layers whose
    /// result is added to a plane, and the scores, begin at 0.3 times their deviation.
    pub fn new(seed: u64) -> Optimiser {
        let mut rng = Rng::split(seed, 3 << 32);
        let mut parameters = Parameters::zeros();
        let mut weights = parameters.weights.iter_mut();
        for (n, layer) in LAYERS.iter().enumerate() {
            let blocks = BLOCKS_FINE.iter().chain(&BLOCKS_MIDDLE).chain(&BLOCKS_COARSE);
            let added = blocks.chain([&BLOCK_AFTER]).any(|first| first + 1 == n);
            let part = if added || n == SCORE { 0.3 } else { 1.0 };
            let scale = part * (2.0 / layer.inputs as f64).sqrt();
            let all = weights.by_ref().take(layer.inputs * layer.outputs);
            all.for_each(|w| *w = (scale * rng.bell()) as f32);
        }
        let [means, squares] = [Parameters::zeros(), Parameters::zeros()];
        Optimiser { parameters, means, squares, shifts: vec![0; TOTAL[1]], step: 0 }
    }

    /// Makes a step down the gradient.
    pub fn advance(&mut self, slope: &Parameters, rate: f32) {
        self.step += 1;
        let unbiased = DECAY.map(|d| 1.0 - f64::from(d).powi(self.step as i32) as f32);
        let moments = self.means.each_mut().zip(self.squares.each_mut());
        for ((p, s), (mean, square)) in self.parameters.each_mut().zip(slope.each()).zip(moments) {
            *mean = DECAY[0] * *mean + (1.0 - DECAY[0]) * s;
            *square = DECAY[1] * *square + (1.0 - DECAY[1]) * s * s;
            *p -= rate * (*mean / unbiased[0]) / ((*square / unbiased[1]).sqrt() + 1e-8);
        }
    }

    /// Fixes the step of every output's weights according to the largest of them.
    pub fn choose_shifts(&mut self) {
        let mut weights = self.parameters.weights.iter();
        let mut shifts = self.shifts.iter_mut();
        for layer in LAYERS {
            for shift in shifts.by_ref().take(layer.outputs) {
                let own = weights.by_ref().take(layer.inputs);
                let largest = own.fold(0.0f32, |a, w| a.max(w.abs())) * ROOM;
                let fits = |s: &u8| largest * (1u32 << s) as f32 <= TOP as f32;
                *shift = (0..=SHIFT_MAX as u8).rev().find(fits).unwrap_or(0);
            }
        }
    }

    /// Every number in core's form: weights, biases and shifts by layer.
    pub fn numbers(&self) -> Vec<i32> {
        let mut numbers = Vec::with_capacity(NUMBERS);
        for (n, layer) in LAYERS.iter().enumerate() {
            let [weights, outputs] = before(n);
            let shifts = &self.shifts[outputs..][..layer.outputs];
            let all = &self.parameters.weights[weights..][..layer.inputs * layer.outputs];
            for (of_output, shift) in all.chunks(layer.inputs).zip(shifts) {
                numbers.extend(of_output.iter().map(|w| whole(*w, *shift, TOP)));
            }
            let biases = &self.parameters.biases[outputs..][..layer.outputs];
            let bias = |(b, shift): (&f32, &u8)| whole(b * ONE as f32, *shift, BIAS_MAX - 1);
            numbers.extend(biases.iter().zip(shifts).map(bias));
            numbers.extend(shifts.iter().map(|s| i32::from(*s)));
        }
        numbers
    }

    /// The parameters after rounding.
    pub fn rounded(&self) -> Parameters {
        let mut parameters = self.parameters.clone();
        for (n, layer) in LAYERS.iter().enumerate() {
            let [weights, outputs] = before(n);
            for output in 0..layer.outputs {
                let shift = self.shifts[outputs + output];
                let unit = (1u32 << shift) as f32;
                let own = &mut parameters.weights[weights + output * layer.inputs..];
                let own = &mut own[..layer.inputs];
                own.iter_mut().for_each(|w| *w = whole(*w, shift, TOP) as f32 / unit);
                let bias = &mut parameters.biases[outputs + output];
                let one = ONE as f32;
                *bias = whole(*bias * one, shift, BIAS_MAX - 1) as f32 / unit / one;
            }
        }
        parameters
    }

    /// Writes a checkpoint of the training identified by `of`.
    pub fn write(&self, to: &mut impl Write, of: u64) -> io::Result<()> {
        let mut body = (self.step as u64).to_le_bytes().to_vec();
        body.extend(&self.shifts);
        for part in [&self.parameters, &self.means, &self.squares] {
            part.each().for_each(|x| body.extend(x.to_le_bytes()));
        }
        checkpoint::write(to, MAGIC, of, &body)
    }

    /// Reads a checkpoint; fails if it is damaged or belongs to another training than `of`.
    pub fn read(file: &Path, of: u64) -> Result<Optimiser, Error> {
        let parameters: usize = TOTAL.iter().sum();
        let length = 8 + TOTAL[1] + 3 * 4 * parameters;
        let body = checkpoint::read(file, MAGIC, of, length..=length)?;
        let (step, rest) = body.split_at(8);
        let mut state = Optimiser::new(0);
        state.step = u64::from_le_bytes(step.try_into().expect("8 bytes")) as usize;
        let (shifts, numbers) = rest.split_at(TOTAL[1]);
        state.shifts.copy_from_slice(shifts);
        let parts = [&mut state.parameters, &mut state.means, &mut state.squares];
        let all = parts.into_iter().flat_map(Parameters::each_mut);
        for (x, bytes) in all.zip(numbers.as_chunks::<4>().0) {
            *x = f32::from_le_bytes(*bytes);
        }
        Ok(state)
    }
}

/// Magic of a checkpoint.
const MAGIC: &[u8] = b"raywake-encoder-training 1\n";

/// A number as a multiple of its step, clamped to `most` either way.
fn whole(x: f32, shift: u8, most: i32) -> i32 {
    ((x * (1u32 << shift) as f32).round() as i32).clamp(-most, most)
}
