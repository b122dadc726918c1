//! The trainable numbers of the network.

use raywake_core::encoder::layers::*;

/// Numbers of the network: weights, layer by layer and output by output; and biases.
#[derive(Clone)]
pub struct Parameters {
    pub weights: Vec<f32>,
    pub biases: Vec<f32>,
}

impl Parameters {
    pub fn zeros() -> Parameters {
        let [weights, biases] = TOTAL;
        Parameters { weights: vec![0.0; weights], biases: vec![0.0; biases] }
    }

    pub fn each_mut(&mut self) -> impl Iterator<Item = &mut f32> {
        self.weights.iter_mut().chain(&mut self.biases)
    }

    pub fn each(&self) -> impl Iterator<Item = &f32> {
        self.weights.iter().chain(&self.biases)
    }

    pub fn of(&self, layer: usize) -> (&[f32], &[f32]) {
        let ([weights, biases], Layer { inputs, outputs }) = (before(layer), LAYERS[layer]);
        (&self.weights[weights..][..inputs * outputs], &self.biases[biases..][..outputs])
    }

    pub fn of_mut(&mut self, layer: usize) -> (&mut [f32], &mut [f32]) {
        let ([weights, biases], Layer { inputs, outputs }) = (before(layer), LAYERS[layer]);
        (&mut self.weights[weights..][..inputs * outputs], &mut self.biases[biases..][..outputs])
    }
}
