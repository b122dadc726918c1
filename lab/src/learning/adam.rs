//! Adam (Kingma and Ba, 2015).

/// Decay of the mean gradient, and of its square, as in the paper.
const DECAY: [f32; 2] = [0.9, 0.999];

/// Moments of the gradient so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Adam {
    /// Decayed mean of the gradient of every number.
    pub means: Vec<f32>,
    /// Decayed mean of its square.
    pub squares: Vec<f32>,
    /// Steps made.
    pub step: u32,
}

impl Adam {
    /// State before the first step, for the given count of numbers.
    pub fn new(numbers: usize) -> Adam {
        Adam { means: vec![0.0; numbers], squares: vec![0.0; numbers], step: 0 }
    }

    /// Moves `numbers` one step down their gradient.
    pub fn advance(&mut self, numbers: &mut [f32], slope: &[f32], rate: f32) {
        self.step += 1;
        let unbiased = DECAY.map(|d| 1.0 - f64::from(d).powi(self.step as i32) as f32);
        let moments = self.means.iter_mut().zip(&mut self.squares);
        for ((number, slope), (mean, square)) in numbers.iter_mut().zip(slope).zip(moments) {
            *mean = DECAY[0] * *mean + (1.0 - DECAY[0]) * slope;
            *square = DECAY[1] * *square + (1.0 - DECAY[1]) * slope * slope;
            *number -= rate * (*mean / unbiased[0]) / ((*square / unbiased[1]).sqrt() + 1e-8);
        }
    }
}
