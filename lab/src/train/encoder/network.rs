//! The encoder in floating point, with its gradients.
//!
//! Activations are in units of 1: core's integers count sixteenths. If the network is quantised,
//! weights are integer multiples of their channel's step and activations are multiples of 1/16.
//! Every sum is then exact in f32, so the result matches core's bit for bit, whatever the order.

use super::parameters::Parameters;
use super::planes::*;
use raywake_core::encoder::layers::*;

/// The network's input for a window, padded to whole octets: masks of `side` x `side` columns, and
/// the columns asked about.
pub struct Input {
    pub side: usize,
    pub masks: Vec<u32>,
    pub asked: Vec<usize>,
}

/// One operation of the walk through the network; its fields are indices of planes.
#[derive(Clone, Copy, Debug)]
enum Op {
    /// The first layer, applied to every column.
    Columns {
        out: usize,
    },
    /// 2 x 2 cells side by side, then a dense layer.
    Down {
        layer: usize,
        from: usize,
        gathered: usize,
        out: usize,
    },
    Depthwise {
        layer: usize,
        from: usize,
        out: usize,
    },
    /// A dense layer added to a plane.
    Add {
        layer: usize,
        from: usize,
        to: usize,
        out: usize,
    },
    /// A dense layer, its result added to the 2 x 2 cells below.
    AddUp {
        layer: usize,
        from: usize,
        to: usize,
        out: usize,
    },
    Dense {
        layer: usize,
        from: usize,
        out: usize,
    },
    /// The surroundings of the columns asked about, and the columns themselves.
    Pick {
        around: usize,
        columns: usize,
        out: usize,
    },
    /// The scores.
    Score {
        from: usize,
        out: usize,
    },
}

/// The sequence of operations.
#[derive(Default)]
struct Walk {
    ops: Vec<Op>,
    planes: usize,
}

impl Walk {
    fn through() -> Walk {
        let mut walk = Walk::default();
        let columns = walk.plane();
        walk.ops.push(Op::Columns { out: columns });
        let fine = walk.down(DOWN_FINE, columns);
        let fine = walk.blocks(&BLOCKS_FINE, fine);
        let middle = walk.down(DOWN_MIDDLE, fine);
        let middle = walk.blocks(&BLOCKS_MIDDLE, middle);
        let coarse = walk.down(DOWN_COARSE, middle);
        let coarse = walk.blocks(&BLOCKS_COARSE, coarse);
        let middle = walk.up(UP_MIDDLE, coarse, middle);
        let fine = walk.up(UP_FINE, middle, fine);
        let fine = walk.blocks(&[BLOCK_AFTER], fine);
        let [around, picked, hidden, scores] = [(); 4].map(|()| walk.plane());
        walk.ops.extend([
            Op::Dense { layer: UP_COLUMN, from: fine, out: around },
            Op::Pick { around, columns, out: picked },
            Op::Dense { layer: HEAD, from: picked, out: hidden },
            Op::Score { from: hidden, out: scores },
        ]);
        walk
    }

    fn plane(&mut self) -> usize {
        self.planes += 1;
        self.planes - 1
    }

    fn down(&mut self, layer: usize, from: usize) -> usize {
        let [gathered, out] = [self.plane(), self.plane()];
        self.ops.push(Op::Down { layer, from, gathered, out });
        out
    }

    fn blocks(&mut self, firsts: &[usize], mut from: usize) -> usize {
        for &layer in firsts {
            let [beside, out] = [self.plane(), self.plane()];
            self.ops.push(Op::Depthwise { layer, from, out: beside });
            self.ops.push(Op::Add { layer: layer + 1, from: beside, to: from, out });
            from = out;
        }
        from
    }

    fn up(&mut self, layer: usize, from: usize, to: usize) -> usize {
        let out = self.plane();
        self.ops.push(Op::AddUp { layer, from, to, out });
        out
    }
}

/// The network, and whether its numbers are rounded as core's are.
pub struct Network {
    walk: Walk,
    quantised: bool,
}

/// The activations of one input.
pub struct Tape {
    planes: Vec<Vec<f32>>,
}

impl Tape {
    /// Scores of the columns asked about.
    pub fn scores(&self) -> &[[f32; SCORES]] {
        self.planes.last().expect("there are planes").as_chunks().0
    }
}

impl Network {
    pub fn new(quantised: bool) -> Network {
        Network { walk: Walk::through(), quantised }
    }

    /// Clamps, after rounding down to sixteenths if the network is quantised.
    fn cut(&self, x: f32, least: f32) -> f32 {
        let one = ONE as f32;
        let x = if self.quantised { (x * one).floor() / one } else { x };
        x.clamp(least, TOP as f32 / one)
    }

    pub fn forward(&self, p: &Parameters, input: &Input) -> Tape {
        let mut planes: Vec<Vec<f32>> = vec![Vec::new(); self.walk.planes];
        for &op in &self.walk.ops {
            match op {
                Op::Columns { out } => planes[out] = self.columns(p, &input.masks),
                Op::Down { layer, from, gathered, out } => {
                    planes[gathered] = gather(&planes[from], LAYERS[layer].inputs / 4);
                    let sums = dense(p.of(layer), &planes[gathered]);
                    planes[out] = sums.into_iter().map(|x| self.cut(x, 0.0)).collect();
                }
                Op::Depthwise { layer, from, out } => {
                    let sums = depthwise(p.of(layer), &planes[from]);
                    planes[out] = sums.into_iter().map(|x| self.cut(x, 0.0)).collect();
                }
                Op::Add { layer, from, to, out } => {
                    let sums = dense(p.of(layer), &planes[from]);
                    planes[out] =
                        sums.iter().zip(&planes[to]).map(|(s, x)| self.cut(x + s, 0.0)).collect();
                }
                Op::AddUp { layer, from, to, out } => {
                    let sums = dense(p.of(layer), &planes[from]);
                    let sums = spread(&sums, LAYERS[layer].outputs);
                    planes[out] =
                        sums.iter().zip(&planes[to]).map(|(s, x)| self.cut(x + s, 0.0)).collect();
                }
                Op::Dense { layer, from, out } => {
                    let sums = dense(p.of(layer), &planes[from]);
                    planes[out] = sums.into_iter().map(|x| self.cut(x, 0.0)).collect();
                }
                Op::Pick { around, columns, out } => {
                    planes[out] = input
                        .asked
                        .iter()
                        .flat_map(|&c| {
                            [
                                &planes[around][parent(c, input.side)..][..COLUMN_CHANNELS],
                                &planes[columns][c * COLUMN_CHANNELS..][..COLUMN_CHANNELS],
                            ]
                        })
                        .flatten()
                        .copied()
                        .collect();
                }
                Op::Score { from, out } => {
                    let least = -(TOP as f32) / ONE as f32;
                    let sums = dense(p.of(SCORE), &planes[from]);
                    planes[out] = sums.into_iter().map(|x| self.cut(x, least)).collect();
                }
            }
        }
        Tape { planes }
    }

    fn columns(&self, p: &Parameters, masks: &[u32]) -> Vec<f32> {
        let (weights, biases) = p.of(COLUMN);
        let by_bit = transposed::<COLUMN_CHANNELS>(weights);
        let mut out = Vec::with_capacity(masks.len() * COLUMN_CHANNELS);
        for &masks in masks {
            let mut sums: [f32; COLUMN_CHANNELS] = biases.try_into().expect("a bias a channel");
            for bit in bits(masks) {
                sums.iter_mut().zip(&by_bit[bit]).for_each(|(s, w)| *s += w);
            }
            out.extend(sums.map(|x| self.cut(x, 0.0)));
        }
        out
    }

    /// Adds the gradient of the parameters to `into`, given that of the scores. Rounding passes
    /// gradients on unchanged; clamping stops them.
    pub fn backward(
        &self,
        p: &Parameters,
        input: &Input,
        tape: &Tape,
        of_scores: Vec<f32>,
        into: &mut Parameters,
    ) {
        let mut gradients = Gradients { of: p, into };
        let planes = &tape.planes;
        let mut slopes: Vec<Vec<f32>> = planes.iter().map(|x| vec![0.0; x.len()]).collect();
        *slopes.last_mut().expect("there are planes") = of_scores;
        for &op in self.walk.ops.iter().rev() {
            match op {
                Op::Columns { out } => {
                    let slope = passed(&planes[out], &slopes[out], 0.0);
                    gradients.columns(&input.masks, &slope);
                }
                Op::Down { layer, from, gathered, out } => {
                    let slope = passed(&planes[out], &slopes[out], 0.0);
                    let mut below = vec![0.0; planes[gathered].len()];
                    gradients.dense(layer, &planes[gathered], &slope, &mut below);
                    scatter(&below, LAYERS[layer].inputs / 4, &mut slopes[from]);
                }
                Op::Depthwise { layer, from, out } => {
                    let slope = passed(&planes[out], &slopes[out], 0.0);
                    gradients.depthwise(layer, &planes[from], &slope, &mut slopes[from]);
                }
                Op::Add { layer, from, to, out } => {
                    let slope = passed(&planes[out], &slopes[out], 0.0);
                    gradients.dense(layer, &planes[from], &slope, &mut slopes[from]);
                    add_slices(&mut slopes[to], &slope);
                }
                Op::AddUp { layer, from, to, out } => {
                    let slope = passed(&planes[out], &slopes[out], 0.0);
                    let sums = summed(&slope, LAYERS[layer].outputs);
                    gradients.dense(layer, &planes[from], &sums, &mut slopes[from]);
                    add_slices(&mut slopes[to], &slope);
                }
                Op::Dense { layer, from, out } => {
                    let slope = passed(&planes[out], &slopes[out], 0.0);
                    gradients.dense(layer, &planes[from], &slope, &mut slopes[from]);
                }
                Op::Pick { around, columns, out } => {
                    let both = std::mem::take(&mut slopes[out]);
                    for (&c, both) in input.asked.iter().zip(both.chunks(2 * COLUMN_CHANNELS)) {
                        let (a, own) = both.split_at(COLUMN_CHANNELS);
                        add_slices(&mut slopes[around][parent(c, input.side)..], a);
                        add_slices(&mut slopes[columns][c * COLUMN_CHANNELS..], own);
                    }
                }
                Op::Score { from, out } => {
                    let least = -(TOP as f32) / ONE as f32;
                    let slope = passed(&planes[out], &slopes[out], least);
                    gradients.dense(SCORE, &planes[from], &slope, &mut slopes[from]);
                }
            }
        }
    }
}
