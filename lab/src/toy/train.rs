//! The encoder, trained either way, and the classifier on top.

use super::digits::{CLASSES, Digits};
use crate::learning::{
    Activation, Adam, Convolution, FeatureMap, FeatureNetwork, cross_entropy, pair_loss,
};
use raywake_sim::Rng;
use std::fmt;

/// Pictures, or pairs of them, per step.
const BATCH: usize = 100;
/// Distance beyond which different digits are far enough apart (4.2).
const D_MAX: f32 = 5.0;
/// Steps of the classifier, each over all digits: more steps change less than one digit in a
/// thousand.
const CLASSIFIER_STEPS: usize = 1000;
/// Its learning rate: encodings range from -10 to 10.
const CLASSIFIER_RATE: f32 = 0.05;

/// How to train.
#[derive(Clone, Debug, clap::Args)]
pub struct Training {
    /// Widths of the hidden layers, each with tanh.
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_value = "150,50")]
    #[arg(value_parser = clap::value_parser!(u16).range(1..=1000))]
    hidden: Vec<u16>,
    /// Steps of Adam, of 100 pictures or 100 pairs.
    #[arg(long, default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..))]
    steps: u32,
    /// Learning rate at the first step; it falls linearly to zero.
    #[arg(long, default_value_t = 1e-3)]
    rate: f32,
    /// Weight of the L2 regularisation.
    #[arg(long, default_value_t = 1e-5)]
    l2: f32,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// What the encoder is trained for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Objective {
    /// To restore the picture (4.1).
    Autoencoder,
    /// Equal digits close, different ones apart (4.2).
    Features,
}

impl fmt::Display for Objective {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Objective::Autoencoder => "autoencoder",
            Objective::Features => "learned features",
        })
    }
}

/// A trained encoder.
pub struct DigitEncoder {
    network: FeatureNetwork,
    numbers: Vec<f32>,
}

impl DigitEncoder {
    /// Returns two numbers for every digit.
    pub fn of(&self, digits: &Digits) -> Vec<[f32; 2]> {
        let input = FeatureMap::row(digits.pixels, digits.values.clone());
        self.network.apply(&self.numbers, &input).values.as_chunks().0.to_vec()
    }
}

/// A trained classifier of two numbers.
pub struct DigitClassifier {
    layer: Convolution,
    numbers: Vec<f32>,
}

impl DigitClassifier {
    /// Returns the digit of each encoding.
    pub fn classify(&self, encodings: &[[f32; 2]]) -> Vec<u8> {
        let input = FeatureMap::row(2, encodings.as_flattened().to_vec());
        let scores = self.layer.forward(&self.numbers, &input);
        let best = |cell: &[f32]| (0..CLASSES).max_by(|a, b| cell[*a].total_cmp(&cell[*b]));
        scores.cells().map(|cell| best(cell).unwrap_or_default() as u8).collect()
    }
}

impl Training {
    /// Description for a report.
    pub fn text(&self) -> String {
        let widths = self.hidden.iter().map(u16::to_string).collect::<Vec<_>>().join(", ");
        format!(
            "hidden layers of {widths}, {} steps of {BATCH}, rate {}, L2 {}, seed {}",
            self.steps, self.rate, self.l2, self.seed
        )
    }

    /// Trains an encoder.
    pub fn encoder(&self, objective: Objective, digits: &Digits) -> DigitEncoder {
        let widths: Vec<usize> = [digits.pixels]
            .into_iter()
            .chain(self.hidden.iter().map(|w| usize::from(*w)))
            .chain([2])
            .collect();
        let encoder = dense(&widths, Activation::Linear);
        let own = encoder.numbers();
        let mut rng = Rng::split(self.seed, 2);
        let (mut network, mut numbers) = (encoder.clone(), encoder.drawn(&mut rng));
        if objective == Objective::Autoencoder {
            let back: Vec<usize> = widths.into_iter().rev().collect();
            let decoder = dense(&back, Activation::Sigmoid);
            numbers.extend(decoder.drawn(&mut rng));
            network.layers.extend(decoder.layers);
        }
        let mut by_class = digits.by_class().to_vec();
        by_class.retain(|indices| !indices.is_empty());
        let mut state = Adam::new(numbers.len());
        for step in 0..self.steps {
            let mut slope = match objective {
                Objective::Autoencoder => restored(&network, &numbers, digits, &mut rng),
                Objective::Features => {
                    pair_gradient(&network, &numbers, digits, &by_class, &mut rng)
                }
            };
            slope.iter_mut().zip(&numbers).for_each(|(s, n)| *s += 2.0 * self.l2 * n);
            let left = 1.0 - step as f32 / self.steps as f32;
            state.advance(&mut numbers, &slope, self.rate * left);
        }
        numbers.truncate(own);
        DigitEncoder { network: encoder, numbers }
    }

    /// Trains a classifier of digits by their encodings.
    pub fn classifier(&self, encodings: &[[f32; 2]], labels: &[u8]) -> DigitClassifier {
        let layer =
            Convolution { kernel: 1, inputs: 2, outputs: CLASSES, activation: Activation::Linear };
        let network = FeatureNetwork { layers: vec![layer], dropout: 0.0 };
        let mut rng = Rng::split(self.seed, 3);
        let mut numbers = network.drawn(&mut rng);
        let mut state = Adam::new(numbers.len());
        let input = FeatureMap::row(2, encodings.as_flattened().to_vec());
        let weight = 1.0 / labels.len() as f32;
        for _ in 0..CLASSIFIER_STEPS {
            let tape = network.forward(&numbers, input.clone(), &mut rng);
            let mut slopes = vec![0.0; labels.len() * CLASSES];
            let rows = tape.output().cells().zip(slopes.chunks_exact_mut(CLASSES));
            for ((scores, slope), label) in rows.zip(labels) {
                cross_entropy(scores, usize::from(*label), weight, slope);
            }
            let mut total = vec![0.0; numbers.len()];
            network.backward(&numbers, &tape, slopes, &mut total, false);
            state.advance(&mut numbers, &total, CLASSIFIER_RATE);
        }
        DigitClassifier { layer, numbers }
    }
}

/// Dense layers of these widths, with tanh except for the last.
fn dense(widths: &[usize], last: Activation) -> FeatureNetwork {
    let hidden = widths.len() - 2;
    let layer = |(n, ends): (usize, &[usize])| Convolution {
        kernel: 1,
        inputs: ends[0],
        outputs: ends[1],
        activation: if n < hidden { Activation::Tanh } else { last },
    };
    FeatureNetwork { layers: widths.windows(2).enumerate().map(layer).collect(), dropout: 0.0 }
}

/// Gradient of (4.1) over a batch: mean squared error of the restored pictures.
fn restored(network: &FeatureNetwork, numbers: &[f32], digits: &Digits, rng: &mut Rng) -> Vec<f32> {
    let batch = (0..BATCH).map(|_| rng.bits() as usize % digits.count());
    let pictures: Vec<f32> = batch.flat_map(|n| digits.picture(n)).copied().collect();
    let tape = network.forward(numbers, FeatureMap::row(digits.pixels, pictures.clone()), rng);
    let weight = 2.0 / pictures.len() as f32;
    let pairs = tape.output().values.iter().zip(&pictures);
    let slope = pairs.map(|(restored, picture)| weight * (restored - picture)).collect();
    let mut total = vec![0.0; numbers.len()];
    network.backward(numbers, &tape, slope, &mut total, false);
    total
}

/// Gradient of (4.2) over a batch of pairs, half of them of equal digits.
fn pair_gradient(
    network: &FeatureNetwork,
    numbers: &[f32],
    digits: &Digits,
    by_class: &[Vec<usize>],
    rng: &mut Rng,
) -> Vec<f32> {
    let pairs: Vec<[usize; 2]> = (0..BATCH).map(|n| pair(n % 2 == 0, by_class, rng)).collect();
    let pictures = pairs.iter().flatten().flat_map(|n| digits.picture(*n)).copied().collect();
    let tape = network.forward(numbers, FeatureMap::row(digits.pixels, pictures), rng);
    let mut slope = Vec::with_capacity(4 * BATCH);
    let (features, _) = tape.output().values.as_chunks::<4>();
    for (f, [a, b]) in features.iter().zip(&pairs) {
        let same = digits.labels[*a] == digits.labels[*b];
        let (_, factor) = pair_loss(&f[..2], &f[2..], same, D_MAX);
        let by = [f[0] - f[2], f[1] - f[3]].map(|d| factor / BATCH as f32 * d);
        slope.extend([by[0], by[1], -by[0], -by[1]]);
    }
    let mut total = vec![0.0; numbers.len()];
    network.backward(numbers, &tape, slope, &mut total, false);
    total
}

/// Draws two digits, uniformly among the classes: of the same class or of two.
fn pair(same: bool, by_class: &[Vec<usize>], rng: &mut Rng) -> [usize; 2] {
    let classes = by_class.len();
    let first = rng.bits() as usize % classes;
    let step = if same { 0 } else { 1 + rng.bits() as usize % (classes - 1).max(1) };
    [first, (first + step) % classes].map(|class| {
        let of_class = &by_class[class];
        of_class[rng.bits() as usize % of_class.len()]
    })
}
