//! Convolution without padding, with its activation, by matrix products.

use ndarray::linalg::general_mat_mul;
use ndarray::{ArrayView2, ArrayViewMut2, ShapeBuilder};

/// `rows` x `columns` cells of `channels` numbers each, channels innermost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FeatureMap {
    /// Cells along the first axis.
    pub rows: usize,
    /// Cells along the second.
    pub columns: usize,
    /// Numbers per cell.
    pub channels: usize,
    /// The numbers of all cells.
    pub values: Vec<f32>,
}

impl FeatureMap {
    /// A map of zeros.
    pub fn zeros(rows: usize, columns: usize, channels: usize) -> FeatureMap {
        FeatureMap { rows, columns, channels, values: vec![0.0; rows * columns * channels] }
    }

    /// Vectors side by side, as a dense layer processes them.
    pub fn row(channels: usize, values: Vec<f32>) -> FeatureMap {
        FeatureMap { rows: 1, columns: values.len() / channels, channels, values }
    }

    /// The numbers of a cell.
    pub fn cell(&self, row: usize, column: usize) -> &[f32] {
        &self.values[(row * self.columns + column) * self.channels..][..self.channels]
    }

    /// All cells, in order.
    pub fn cells(&self) -> impl Iterator<Item = &[f32]> {
        self.values.chunks_exact(self.channels)
    }

    /// For each of the first `count` cells of a row, the numbers of `width` cells from there:
    /// overlapping lines that need no copy.
    fn windows(&self, row: usize, count: usize, width: usize) -> ArrayView2<'_, f32> {
        let from = row * self.columns * self.channels;
        let shape = (count, width * self.channels).strides((self.channels, 1));
        ArrayView2::from_shape(shape, &self.values[from..]).expect("windows lie within their row")
    }
}

/// Function applied to a sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Activation {
    /// The sum itself.
    Linear,
    /// Its hyperbolic tangent.
    Tanh,
    /// 1 / (1 + exp(-sum)).
    Sigmoid,
    /// The given fraction of it if below zero.
    LeakyRelu(f32),
}

impl Activation {
    fn of(self, sum: f32) -> f32 {
        match self {
            Activation::Linear => sum,
            Activation::Tanh => libm::tanhf(sum),
            Activation::Sigmoid => 1.0 / (1.0 + libm::expf(-sum)),
            Activation::LeakyRelu(part) => sum.max(part * sum),
        }
    }

    /// Its derivative where the output is `value`.
    fn slope(self, value: f32) -> f32 {
        match self {
            Activation::Linear => 1.0,
            Activation::Tanh => 1.0 - value * value,
            Activation::Sigmoid => value * (1.0 - value),
            Activation::LeakyRelu(part) => {
                if value > 0.0 {
                    1.0
                } else {
                    part
                }
            }
        }
    }
}

/// A layer: a weighted sum over `kernel` x `kernel` cells with their channels, plus a bias. Its
/// numbers are the weights by row, column and channel of the kernel, outputs innermost, then the
/// biases. A dense layer has a kernel of 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Convolution {
    /// Side of the kernel, cells.
    pub kernel: usize,
    /// Input channels.
    pub inputs: usize,
    /// Output channels.
    pub outputs: usize,
    /// Function applied to the sums.
    pub activation: Activation,
}

impl Convolution {
    /// How many numbers it has.
    pub fn numbers(&self) -> usize {
        (self.fan_in() + 1) * self.outputs
    }

    /// Count of numbers that enter a sum.
    pub fn fan_in(&self) -> usize {
        self.kernel * self.kernel * self.inputs
    }

    /// Range of the numbers of row `n` of the kernel.
    fn of_row(&self, n: usize) -> std::ops::Range<usize> {
        let row = self.kernel * self.inputs * self.outputs;
        n * row..(n + 1) * row
    }

    /// The layer's output map, smaller by `kernel` - 1 cells along each axis.
    pub fn forward(&self, numbers: &[f32], x: &FeatureMap) -> FeatureMap {
        let [rows, columns] = [x.rows, x.columns].map(|n| n + 1 - self.kernel);
        let (weights, biases) = numbers.split_at(self.fan_in() * self.outputs);
        let mut values = biases.repeat(rows * columns);
        let lines = (columns, self.outputs);
        let wide = (self.kernel * self.inputs, self.outputs);
        for (row, sums) in values.chunks_exact_mut(columns * self.outputs).enumerate() {
            let mut sums = ArrayViewMut2::from_shape(lines, sums).expect("a row of sums");
            for n in 0..self.kernel {
                let weights = ArrayView2::from_shape(wide, &weights[self.of_row(n)]);
                let weights = weights.expect("a row of the kernel");
                let x = x.windows(row + n, columns, self.kernel);
                general_mat_mul(1.0, &x, &weights, 1.0, &mut sums);
            }
        }
        values.iter_mut().for_each(|v| *v = self.activation.of(*v));
        FeatureMap { rows, columns, channels: self.outputs, values }
    }

    /// Given the gradient of the output, adds that of its numbers to `into` and, if `below` is
    /// given, that of the input to `below`.
    pub fn backward(
        &self,
        numbers: &[f32],
        (x, out): (&FeatureMap, &FeatureMap),
        slope: &[f32],
        into: &mut [f32],
        mut below: Option<&mut FeatureMap>,
    ) {
        let slope: Vec<f32> =
            out.values.iter().zip(slope).map(|(v, s)| s * self.activation.slope(*v)).collect();
        let (of_weights, of_biases) = into.split_at_mut(self.fan_in() * self.outputs);
        for slope in slope.chunks_exact(self.outputs) {
            of_biases.iter_mut().zip(slope).for_each(|(b, s)| *b += s);
        }
        let lines = (out.columns, self.outputs);
        let wide = (self.kernel * self.inputs, self.outputs);
        for (row, slope) in slope.chunks_exact(out.columns * self.outputs).enumerate() {
            let slope = ArrayView2::from_shape(lines, slope).expect("a row of slopes");
            for n in 0..self.kernel {
                let x = x.windows(row + n, out.columns, self.kernel);
                let of_row = &mut of_weights[self.of_row(n)];
                let mut of_row = ArrayViewMut2::from_shape(wide, of_row).expect("a row of it");
                general_mat_mul(1.0, &x.t(), &slope, 1.0, &mut of_row);
                if let Some(below) = &mut below {
                    self.descend(&numbers[self.of_row(n)], slope, below, row + n);
                }
            }
        }
    }

    /// Adds to a row of the map below what a row of the kernel passes back from a row of slopes.
    fn descend(
        &self,
        weights: &[f32],
        slope: ArrayView2<'_, f32>,
        below: &mut FeatureMap,
        row: usize,
    ) {
        let from = row * below.columns * self.inputs;
        let one = (self.inputs, self.outputs);
        for (n, weights) in weights.chunks_exact(self.inputs * self.outputs).enumerate() {
            let weights = ArrayView2::from_shape(one, weights).expect("a cell of the kernel");
            let lines = (slope.nrows(), self.inputs);
            let cells = &mut below.values[from + n * self.inputs..][..lines.0 * lines.1];
            let mut cells = ArrayViewMut2::from_shape(lines, cells).expect("a row below");
            general_mat_mul(1.0, &slope, &weights.t(), 1.0, &mut cells);
        }
    }
}
