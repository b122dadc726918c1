//! The encoder in floating point, with its gradients.
//!
//! Activations are in units of 1: core's integers count sixteenths of them. Where the network is
//! quantised, weights are whole multiples of their channel's step and activations of 1/16. Every
//! sum is then exact in f32, so that the result is core's bit for bit, whatever the order.

use raywake_core::encoder::layers::*;

/// Numbers of the network: weights of a layer, an output's after another's; and biases.
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

    fn of(&self, layer: usize) -> (&[f32], &[f32]) {
        let ([weights, biases], Layer { inputs, outputs }) = (before(layer), LAYERS[layer]);
        (&self.weights[weights..][..inputs * outputs], &self.biases[biases..][..outputs])
    }

    fn of_mut(&mut self, layer: usize) -> (&mut [f32], &mut [f32]) {
        let ([weights, biases], Layer { inputs, outputs }) = (before(layer), LAYERS[layer]);
        (&mut self.weights[weights..][..inputs * outputs], &mut self.biases[biases..][..outputs])
    }
}

/// What the network sees of a window, padded to whole octets: masks of `side` x `side` columns,
/// and those that it is asked about.
pub struct Input {
    pub side: usize,
    pub masks: Vec<u32>,
    pub asked: Vec<usize>,
}

/// One step of the walk through the network; numbers are of planes.
#[derive(Clone, Copy, Debug)]
enum Op {
    /// The first layer, on every column.
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
    /// What is around the columns asked about, and what they are.
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

/// The walk as it is laid out.
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

    /// Rounded down to sixteenths where it is quantised, and cut.
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

    /// Adds the gradient of the parameters, given that of the scores. Rounding passes gradients on
    /// unchanged, a cut stops them.
    pub fn backward(
        &self,
        p: &Parameters,
        input: &Input,
        tape: &Tape,
        of_scores: Vec<f32>,
        into: &mut Parameters,
    ) {
        let planes = &tape.planes;
        let mut slopes: Vec<Vec<f32>> = planes.iter().map(|x| vec![0.0; x.len()]).collect();
        *slopes.last_mut().expect("there are planes") = of_scores;
        for &op in self.walk.ops.iter().rev() {
            match op {
                Op::Columns { out } => {
                    let slope = passed(&planes[out], &slopes[out], 0.0);
                    let (weights, biases) = into.of_mut(COLUMN);
                    let mut by_bit = transposed::<COLUMN_CHANNELS>(weights);
                    for (&masks, slope) in input.masks.iter().zip(slope.chunks(COLUMN_CHANNELS)) {
                        biases.iter_mut().zip(slope).for_each(|(b, s)| *b += s);
                        for bit in bits(masks) {
                            by_bit[bit].iter_mut().zip(slope).for_each(|(w, s)| *w += s);
                        }
                    }
                    for (bit, of_bit) in by_bit.iter().enumerate() {
                        for (channel, w) in of_bit.iter().enumerate() {
                            weights[channel * BITS + bit] = *w;
                        }
                    }
                }
                Op::Down { layer, from, gathered, out } => {
                    let slope = passed(&planes[out], &slopes[out], 0.0);
                    let mut below = vec![0.0; planes[gathered].len()];
                    dense_slope(p, into, layer, &planes[gathered], &slope, &mut below);
                    scatter(&below, LAYERS[layer].inputs / 4, &mut slopes[from]);
                }
                Op::Depthwise { layer, from, out } => {
                    let slope = passed(&planes[out], &slopes[out], 0.0);
                    depthwise_slope(p, into, layer, &planes[from], &slope, &mut slopes[from]);
                }
                Op::Add { layer, from, to, out } => {
                    let slope = passed(&planes[out], &slopes[out], 0.0);
                    dense_slope(p, into, layer, &planes[from], &slope, &mut slopes[from]);
                    slopes[to].iter_mut().zip(&slope).for_each(|(t, s)| *t += s);
                }
                Op::AddUp { layer, from, to, out } => {
                    let slope = passed(&planes[out], &slopes[out], 0.0);
                    let sums = summed(&slope, LAYERS[layer].outputs);
                    dense_slope(p, into, layer, &planes[from], &sums, &mut slopes[from]);
                    slopes[to].iter_mut().zip(&slope).for_each(|(t, s)| *t += s);
                }
                Op::Dense { layer, from, out } => {
                    let slope = passed(&planes[out], &slopes[out], 0.0);
                    dense_slope(p, into, layer, &planes[from], &slope, &mut slopes[from]);
                }
                Op::Pick { around, columns, out } => {
                    let both = std::mem::take(&mut slopes[out]);
                    for (&c, both) in input.asked.iter().zip(both.chunks(2 * COLUMN_CHANNELS)) {
                        let (a, own) = both.split_at(COLUMN_CHANNELS);
                        let to = &mut slopes[around][parent(c, input.side)..];
                        to.iter_mut().zip(a).for_each(|(t, s)| *t += s);
                        let to = &mut slopes[columns][c * COLUMN_CHANNELS..];
                        to.iter_mut().zip(own).for_each(|(t, s)| *t += s);
                    }
                }
                Op::Score { from, out } => {
                    let least = -(TOP as f32) / ONE as f32;
                    let slope = passed(&planes[out], &slopes[out], least);
                    dense_slope(p, into, SCORE, &planes[from], &slope, &mut slopes[from]);
                }
            }
        }
    }
}

/// Bits of a column's masks as the first layer counts them.
fn bits(masks: u32) -> impl Iterator<Item = usize> {
    (0..BITS).filter(move |bit| masks >> (bit / LEVELS * 16 + bit % LEVELS) & 1 == 1)
}

/// Side of a square level.
fn side_of(plane: &[f32], channels: usize) -> usize {
    (plane.len() / channels).isqrt()
}

/// First channel, in the finest level, of the cell above a column.
fn parent(column: usize, side: usize) -> usize {
    (column / side / 2 * (side / 2) + column % side / 2) * COLUMN_CHANNELS
}

/// What a cut lets through of a slope.
fn passed(values: &[f32], slope: &[f32], least: f32) -> Vec<f32> {
    let top = TOP as f32 / ONE as f32;
    let inside = |v: f32| v > least && v < top;
    values.iter().zip(slope).map(|(v, s)| if inside(*v) { *s } else { 0.0 }).collect()
}

fn transposed<const OUT: usize>(weights: &[f32]) -> Vec<[f32; OUT]> {
    let inputs = weights.len() / OUT;
    (0..inputs).map(|i| std::array::from_fn(|o| weights[o * inputs + i])).collect()
}

/// Calls a function of the sizes of a dense layer: loops of known length are whole vectors.
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

fn dense((weights, biases): (&[f32], &[f32]), x: &[f32]) -> Vec<f32> {
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

/// Adds the gradients of a dense layer, and to `below` that of what entered it.
fn dense_slope(
    p: &Parameters,
    into: &mut Parameters,
    layer: usize,
    x: &[f32],
    slope: &[f32],
    below: &mut [f32],
) {
    let Layer { inputs, outputs } = LAYERS[layer];
    let (weights, into) = (p.of(layer).0, into.of_mut(layer));
    of_size!(dense_slope_sized(weights, into, x, slope, below) of (inputs, outputs));
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

/// Calls `each` with a cell, a neighbour and the tap between them, on a square level.
fn each_tap(side: usize, mut each: impl FnMut(usize, usize, usize)) {
    for row in 0..side {
        for at in 0..side {
            for tap in 0..9 {
                // Wraps below zero, and is then not within the level.
                let [i, j] = [row + tap / 3, at + tap % 3].map(|n| n.wrapping_sub(1));
                if i < side && j < side {
                    each(row * side + at, i * side + j, tap);
                }
            }
        }
    }
}

fn depthwise((weights, biases): (&[f32], &[f32]), x: &[f32]) -> Vec<f32> {
    let channels = biases.len();
    let by_tap: Vec<Vec<f32>> =
        (0..9).map(|tap| (0..channels).map(|c| weights[c * 9 + tap]).collect()).collect();
    let mut out = biases.repeat(x.len() / channels);
    each_tap(side_of(x, channels), |cell, other, tap| {
        let sums = &mut out[cell * channels..][..channels];
        let x = &x[other * channels..][..channels];
        sums.iter_mut().zip(x).zip(&by_tap[tap]).for_each(|((s, x), w)| *s += x * w);
    });
    out
}

fn depthwise_slope(
    p: &Parameters,
    into: &mut Parameters,
    layer: usize,
    x: &[f32],
    slope: &[f32],
    below: &mut [f32],
) {
    let (weights, channels) = (p.of(layer).0, LAYERS[layer].outputs);
    let (of_weights, of_biases) = into.of_mut(layer);
    let by_tap: Vec<Vec<f32>> =
        (0..9).map(|tap| (0..channels).map(|c| weights[c * 9 + tap]).collect()).collect();
    let mut of_taps = vec![vec![0.0; channels]; 9];
    each_tap(side_of(x, channels), |cell, other, tap| {
        let slope = &slope[cell * channels..][..channels];
        let below = &mut below[other * channels..][..channels];
        below.iter_mut().zip(slope).zip(&by_tap[tap]).for_each(|((b, s), w)| *b += s * w);
        let x = &x[other * channels..][..channels];
        of_taps[tap].iter_mut().zip(slope).zip(x).for_each(|((t, s), x)| *t += s * x);
    });
    for slope in slope.chunks(channels) {
        of_biases.iter_mut().zip(slope).for_each(|(b, s)| *b += s);
    }
    for (tap, of_tap) in of_taps.iter().enumerate() {
        of_tap.iter().enumerate().for_each(|(c, s)| of_weights[c * 9 + tap] += s);
    }
}

/// 2 x 2 cells of a level side by side.
fn gather(x: &[f32], channels: usize) -> Vec<f32> {
    let half = side_of(x, channels) / 2;
    let cell = move |n: usize| (0..4).map(move |k| below(n, k, half));
    (0..half * half).flat_map(cell).flat_map(|c| &x[c * channels..][..channels]).copied().collect()
}

/// Adds what [`gather`] put side by side to where it came from.
fn scatter(x: &[f32], channels: usize, into: &mut [f32]) {
    let half = side_of(into, channels) / 2;
    for (n, x) in x.chunks(channels).enumerate() {
        let to = &mut into[below(n / 4, n % 4, half) * channels..];
        to.iter_mut().zip(x).for_each(|(t, x)| *t += x);
    }
}

/// The `k`-th of the 2 x 2 cells below cell `n` of a level of `side`.
fn below(n: usize, k: usize, side: usize) -> usize {
    (n / side * 2 + k / 2) * 2 * side + n % side * 2 + k % 2
}

/// Every cell's values to the 2 x 2 below it.
fn spread(x: &[f32], channels: usize) -> Vec<f32> {
    let side = side_of(x, channels);
    let mut out = vec![0.0; 4 * x.len()];
    for (n, x) in x.chunks(channels).enumerate() {
        (0..4).for_each(|k| out[below(n, k, side) * channels..][..channels].copy_from_slice(x));
    }
    out
}

/// The sums over the 2 x 2 cells below each.
fn summed(x: &[f32], channels: usize) -> Vec<f32> {
    let side = side_of(x, channels) / 2;
    let mut out = vec![0.0; x.len() / 4];
    for (n, sums) in out.chunks_mut(channels).enumerate() {
        for k in 0..4 {
            let from = &x[below(n, k, side) * channels..];
            sums.iter_mut().zip(from).for_each(|(s, x)| *s += x);
        }
    }
    out
}
