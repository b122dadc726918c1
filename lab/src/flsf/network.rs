//! The network (Fig. 4.4, sizes from the author's program) and its losses (4.6)-(4.8).

use crate::learning::{
    Activation, Convolution, FeatureMap, FeatureNetwork, cross_entropy, pair_loss,
};
use raywake_sim::Rng;

/// Levels of the input occupancy: those of [`raywake_core`]; the author's program has 13.
pub const LEVELS: usize = 14;
/// Dimension of an encoding (N_f).
pub const FEATURES: usize = 10;
/// Scores of a cell: background and foreground.
pub const SCORES: usize = 2;
/// Kernels and outputs of the encoder's layers, then of the classifier, which reads only the
/// encoding.
const LAYERS: [[usize; 2]; 6] = [[9, 200], [7, 100], [5, 50], [3, 25], [3, FEATURES], [3, SCORES]];
/// Cells seen by an encoding on each side of its own.
pub const SEEN: usize = 11;
/// Slope below zero, in every layer.
const LEAK: f32 = 0.2;
/// Share of the input and of every layer's outputs that training sets to zero (4.4.3.2).
const DROPOUT: f64 = 0.2;
/// Distance from which on encodings are far enough apart (4.4.2).
pub const D_MAX: f32 = 10.0;

/// Layers of the encoder and of the classifier.
#[derive(Clone, Debug, PartialEq)]
pub struct Flsf {
    /// From occupancy to encodings.
    pub encoder: FeatureNetwork,
    /// From encodings to scores.
    pub classifier: FeatureNetwork,
}

/// A pair of cells from two maps of encodings, and whether the first went to the second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellPair {
    /// Index in the first map.
    pub first: usize,
    /// Index in the second.
    pub second: usize,
    /// Whether it is the cell the first went to.
    pub matching: bool,
}

/// A training sample: a place and what the network is to learn there.
#[derive(Clone, Debug)]
pub struct TrainingSample {
    /// Occupancy of the same square of both sweeps.
    pub maps: [FeatureMap; 2],
    /// Pairs of their encodings.
    pub pairs: Vec<CellPair>,
    /// Class for every score of the first map: foreground, background, or unknown.
    pub classes: Vec<Option<bool>>,
}

impl Flsf {
    /// The network, with dropout or, for evaluation, without.
    pub fn new(dropout: bool) -> Flsf {
        let mut inputs = LEVELS;
        let mut layers: Vec<Convolution> = Vec::new();
        for [kernel, outputs] in LAYERS {
            let activation = Activation::LeakyRelu(LEAK);
            layers.push(Convolution { kernel, inputs, outputs, activation });
            inputs = outputs;
        }
        let last = layers.pop().into_iter().collect();
        let dropout = if dropout { DROPOUT } else { 0.0 };
        Flsf {
            encoder: FeatureNetwork { layers, dropout },
            classifier: FeatureNetwork { layers: last, dropout: 0.0 },
        }
    }

    /// Number of parameters, those of the encoder first.
    pub fn numbers(&self) -> usize {
        self.encoder.numbers() + self.classifier.numbers()
    }

    /// Random initial parameters.
    pub fn drawn(&self, rng: &mut Rng) -> Vec<f32> {
        let mut numbers = self.encoder.drawn(rng);
        numbers.extend(self.classifier.drawn(rng));
        numbers
    }

    /// Mean losses of a sample, for the pairs (4.6) and for the classes (4.7); adds the gradient of
    /// their sum (4.8) to `into`. `weights` are those of background and foreground.
    pub fn learn(
        &self,
        numbers: &[f32],
        sample: &TrainingSample,
        weights: [f32; SCORES],
        rng: &mut Rng,
        into: &mut [f32],
    ) -> [f32; 2] {
        let (of_encoder, of_classifier) = numbers.split_at(self.encoder.numbers());
        let (into_encoder, into_classifier) = into.split_at_mut(of_encoder.len());
        let tapes =
            sample.maps.each_ref().map(|map| self.encoder.forward(of_encoder, map.clone(), rng));
        let (matching, [mut first, second]) =
            of_pairs(tapes.each_ref().map(|t| t.output()), &sample.pairs);
        let classified = self.classifier.forward(of_classifier, tapes[0].output().clone(), rng);
        let (classes, slope) = of_classes(classified.output(), &sample.classes, weights);
        let passed =
            self.classifier.backward(of_classifier, &classified, slope, into_classifier, true);
        first.iter_mut().zip(passed.unwrap_or_default()).for_each(|(s, p)| *s += p);
        for (tape, slope) in tapes.iter().zip([first, second]) {
            self.encoder.backward(of_encoder, tape, slope, into_encoder, false);
        }
        [matching, classes]
    }
}

/// Mean loss of the pairs, and its gradient with respect to both maps.
fn of_pairs(maps: [&FeatureMap; 2], pairs: &[CellPair]) -> (f32, [Vec<f32>; 2]) {
    let mut slopes = maps.map(|map| vec![0.0; map.values.len()]);
    let share = 1.0 / pairs.len().max(1) as f32;
    let mut sum = 0.0;
    for pair in pairs {
        let at = [pair.first, pair.second].map(|n| n * FEATURES..(n + 1) * FEATURES);
        let [a, b] = [&maps[0].values[at[0].clone()], &maps[1].values[at[1].clone()]];
        let (loss, factor) = pair_loss(a, b, pair.matching, D_MAX);
        sum += share * loss;
        for (n, (a, b)) in a.iter().zip(b).enumerate() {
            let by = share * factor * (a - b);
            slopes[0][at[0].start + n] += by;
            slopes[1][at[1].start + n] -= by;
        }
    }
    (sum, slopes)
}

/// Mean loss of the cells whose class is known, and its gradient with respect to the scores.
fn of_classes(
    scores: &FeatureMap,
    classes: &[Option<bool>],
    weights: [f32; SCORES],
) -> (f32, Vec<f32>) {
    let mut slope = vec![0.0; scores.values.len()];
    let known = classes.iter().flatten().count().max(1) as f32;
    let mut sum = 0.0;
    let cells = scores.cells().zip(slope.chunks_exact_mut(SCORES)).zip(classes);
    for ((scores, slope), class) in cells {
        if let Some(class) = class.map(usize::from) {
            sum += cross_entropy(scores, class, weights[class] / known, slope);
        }
    }
    (sum, slope)
}
