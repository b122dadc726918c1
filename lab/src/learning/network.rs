//! A sequence of layers.

use super::convolution::{Convolution, FeatureMap};
use raywake_sim::Rng;

/// Layers, each applied to the output of the one before it.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureNetwork {
    /// In order.
    pub layers: Vec<Convolution>,
    /// Share of the numbers that training sets to zero, in the input of the first layer and the
    /// output of every layer. In steps of 1/256.
    pub dropout: f64,
}

/// Record of a pass through a network.
#[derive(Clone, Debug, Default)]
pub struct FeatureTape {
    /// The input of each layer and, last, the output, all after dropout.
    maps: Vec<FeatureMap>,
    /// Dropout factors of each map; empty if nothing was dropped.
    kept: Vec<Vec<f32>>,
}

impl FeatureTape {
    /// The output.
    pub fn output(&self) -> &FeatureMap {
        self.maps.last().expect("an input at least")
    }
}

impl FeatureNetwork {
    /// How many numbers it has.
    pub fn numbers(&self) -> usize {
        self.layers.iter().map(Convolution::numbers).sum()
    }

    /// Initial numbers: weights as in Glorot and Bengio (2010), biases of zero.
    pub fn drawn(&self, rng: &mut Rng) -> Vec<f32> {
        let mut numbers = Vec::with_capacity(self.numbers());
        for layer in &self.layers {
            let fan_out = layer.kernel * layer.kernel * layer.outputs;
            let most = (6.0 / (layer.fan_in() + fan_out) as f64).sqrt();
            let weights = layer.fan_in() * layer.outputs;
            numbers.extend((0..weights).map(|_| rng.range(-most, most) as f32));
            numbers.extend(std::iter::repeat_n(0.0, layer.outputs));
        }
        numbers
    }

    /// The output, with nothing dropped.
    pub fn apply(&self, numbers: &[f32], input: &FeatureMap) -> FeatureMap {
        let mut at = 0;
        let mut map = None;
        for layer in &self.layers {
            let own = &numbers[at..][..layer.numbers()];
            map = Some(layer.forward(own, map.as_ref().unwrap_or(input)));
            at += layer.numbers();
        }
        map.unwrap_or_else(|| input.clone())
    }

    /// The same for training, with dropout drawn from `rng`.
    pub fn forward(&self, numbers: &[f32], input: FeatureMap, rng: &mut Rng) -> FeatureTape {
        let mut tape = FeatureTape::default();
        let mut at = 0;
        let mut map = input;
        for layer in &self.layers {
            self.keep(&mut tape, map, rng);
            map = layer.forward(&numbers[at..][..layer.numbers()], tape.output());
            at += layer.numbers();
        }
        self.keep(&mut tape, map, rng);
        tape
    }

    /// Puts a map on the tape with dropout applied; the rest is scaled up so that sums stay the
    /// same.
    fn keep(&self, tape: &mut FeatureTape, mut map: FeatureMap, rng: &mut Rng) {
        let limit = (256.0 * self.dropout) as u8;
        let mut kept = Vec::new();
        if limit > 0 {
            let factor = 256.0 / (256.0 - f32::from(limit));
            kept.reserve(map.values.len() + 8);
            while kept.len() < map.values.len() {
                let drawn = rng.bits().to_le_bytes();
                kept.extend(drawn.map(|byte| if byte < limit { 0.0 } else { factor }));
            }
            map.values.iter_mut().zip(&kept).for_each(|(v, k)| *v *= k);
        }
        tape.maps.push(map);
        tape.kept.push(kept);
    }

    /// Adds the gradient of the network's numbers to `into`, given that of the output, and returns
    /// that of the input if `below` is set.
    pub fn backward(
        &self,
        numbers: &[f32],
        tape: &FeatureTape,
        slope: Vec<f32>,
        into: &mut [f32],
        below: bool,
    ) -> Option<Vec<f32>> {
        let mut slope = dropped(slope, tape.kept.last()?);
        let mut end = self.numbers();
        for (n, layer) in self.layers.iter().enumerate().rev() {
            let own = end - layer.numbers()..end;
            end = own.start;
            let (x, out) = (&tape.maps[n], self.raw_output(tape, n + 1));
            let mut under =
                (n > 0 || below).then(|| FeatureMap::zeros(x.rows, x.columns, x.channels));
            let numbers = &numbers[own.clone()];
            layer.backward(numbers, (x, &out), &slope, &mut into[own], under.as_mut());
            slope = dropped(under?.values, &tape.kept[n]);
        }
        Some(slope)
    }

    /// A map of the tape as its layer output it; dropped numbers stay zero, as do their slopes.
    fn raw_output<'a>(&self, tape: &'a FeatureTape, n: usize) -> std::borrow::Cow<'a, FeatureMap> {
        let map = &tape.maps[n];
        let Some(factor) = tape.kept[n].iter().copied().find(|k| *k > 0.0) else {
            return std::borrow::Cow::Borrowed(map);
        };
        let values = map.values.iter().map(|v| v / factor).collect();
        std::borrow::Cow::Owned(FeatureMap { values, ..*map })
    }
}

/// The slope before dropout, from the one after it.
fn dropped(mut slope: Vec<f32>, kept: &[f32]) -> Vec<f32> {
    slope.iter_mut().zip(kept).for_each(|(s, k)| *s *= k);
    slope
}
