//! Gradient boosting of symmetric trees for two classes: the numbers of a
//! [`MovesForest`](raywake_core::refinement::forest::MovesForest).
//!
//! Every tree follows the slope of the loss, as Newton's method would (Friedman, "Greedy function
//! approximation", 2001). All its nodes of a level ask the same question: the one that lowers the
//! loss most over all of them.

use super::logistic::Progress;
use raywake_core::refinement::forest::{LEAVES, QUESTIONS};
use std::ops::Range;

/// Steps per unit of a value and per nat.
pub const SCALE: f64 = 1000.0;
/// Share of Newton's step that a tree takes. With 0.15 to 0.4, and 20 to 400 for [`RIDGE`], the
/// loss of 100 trees on held-out drives is 0.0685 to 0.0714 nat (56 drives, the first seven of
/// `lab/README.md`).
const RATE: f64 = 0.25;
/// Added to the second derivatives of a leaf, each at most a quarter: leaves of a few samples say
/// little.
const RIDGE: f64 = 20.0;
/// Maximum number of values that a cue is compared with.
const BORDERS_MAX: usize = 63;

/// Labelled rows of values.
pub struct Samples {
    /// Values of a row.
    pub width: usize,
    /// The rows, one after another.
    pub rows: Vec<f32>,
    pub labels: Vec<bool>,
}

/// Sums over the samples of a bin: first and second derivatives of their losses.
type Slope = [f64; 2];

/// One tree, in steps.
struct Tree {
    /// Which value each question is about, and what it must exceed.
    questions: [(usize, i32); QUESTIONS],
    leaves: [i32; LEAVES],
}

impl Tree {
    /// Logit of a row, nats.
    fn logit(&self, row: &[f32]) -> f64 {
        let asked = self.questions.iter().enumerate();
        let answer = asked.fold(0, |answer, (n, &(value, border))| {
            answer | usize::from(row[value] > border as f32 / SCALE as f32) << n
        });
        f64::from(self.leaves[answer]) / SCALE
    }
}

impl Samples {
    fn len(&self) -> usize {
        self.labels.len()
    }

    fn row(&self, n: usize) -> &[f32] {
        &self.rows[n * self.width..][..self.width]
    }

    /// What each value may be compared with, ascending: quantiles, leaving out zeros, which stand
    /// for no value, and zero from either side.
    fn borders(&self) -> Vec<Vec<i32>> {
        let of_value = |value: usize| {
            let values = self.rows.iter().skip(value).step_by(self.width);
            let mut values: Vec<f32> = values.copied().filter(|v| *v != 0.0).collect();
            values.sort_by(f32::total_cmp);
            let quantile = |n: usize| values.get(values.len() * n / (BORDERS_MAX - 1));
            let quantiles = (0..BORDERS_MAX - 2).filter_map(quantile);
            let steps = quantiles.map(|v| (f64::from(*v) * SCALE).floor() as i32);
            let mut borders: Vec<i32> = steps.chain([-1, 0]).collect();
            borders.sort_unstable();
            borders.dedup();
            borders
        };
        (0..self.width).map(of_value).collect()
    }

    /// Number of borders that each value of each row exceeds.
    fn bins(&self, borders: &[Vec<i32>]) -> Vec<u8> {
        let exceeded = |(n, v): (usize, &f32)| {
            let exceeds = |border: &i32| *v > *border as f32 / SCALE as f32;
            borders[n % self.width].partition_point(exceeds) as u8
        };
        self.rows.iter().enumerate().map(exceeded).collect()
    }

    /// Mean loss of these logits.
    fn loss(&self, logits: &[f64]) -> f64 {
        let loss = |(logit, label): (&f64, &bool)| {
            let signed = if *label { -logit } else { *logit };
            signed.max(0.0) + (-signed.abs()).exp().ln_1p()
        };
        logits.iter().zip(&self.labels).map(loss).sum::<f64>() / self.len().max(1) as f64
    }

    /// Half of the rows for each of two threads, on any machine, so that sums do not depend on it.
    fn halves(&self) -> [Range<usize>; 2] {
        let middle = self.len() / 2;
        [0..middle, middle..self.len()]
    }
}

/// Samples while a tree grows.
struct Growth<'a> {
    samples: &'a Samples,
    bins: &'a [u8],
    slopes: Vec<Slope>,
    /// The answers so far of each row.
    answers: Vec<u8>,
}

impl Growth<'_> {
    /// Sums by answers, value and bin.
    fn sums(&self, level: usize) -> Vec<Slope> {
        let width = self.samples.width;
        let of = |rows: Range<usize>| {
            let mut sums = vec![[0.0; 2]; (width * (BORDERS_MAX + 1)) << level];
            for n in rows {
                let (slope, first) = (self.slopes[n], usize::from(self.answers[n]) * width);
                for (value, bin) in self.bins[n * width..][..width].iter().enumerate() {
                    let sum = &mut sums[(first + value) * (BORDERS_MAX + 1) + usize::from(*bin)];
                    *sum = [sum[0] + slope[0], sum[1] + slope[1]];
                }
            }
            sums
        };
        let [first, second] = self.samples.halves();
        let [mut sums, other] = std::thread::scope(|scope| {
            let other = scope.spawn(|| of(second));
            [of(first), other.join().expect("a summing thread panicked")]
        });
        sums.iter_mut().zip(other).for_each(|(a, b)| *a = [a[0] + b[0], a[1] + b[1]]);
        sums
    }

    /// The question that lowers the loss most: which value, and which of its borders.
    fn best_question(&self, level: usize, borders: &[Vec<i32>]) -> (usize, usize) {
        let (width, sums) = (self.samples.width, self.sums(level));
        let gain = |[g, h]: Slope| g * g / (h + RIDGE);
        let mut best = (f64::NEG_INFINITY, (0, 0));
        for (value, borders) in borders.iter().enumerate() {
            let mut gains = vec![0.0; borders.len()];
            for answers in 0..1 << level {
                let bins = &sums[(answers * width + value) * (BORDERS_MAX + 1)..];
                let bins = &bins[..=borders.len()];
                let all = bins.iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
                let mut below = [0.0; 2];
                for (sum, bin) in gains.iter_mut().zip(bins) {
                    below = [below[0] + bin[0], below[1] + bin[1]];
                    *sum += gain(below) + gain([all[0] - below[0], all[1] - below[1]]);
                }
            }
            for (border, gain) in gains.into_iter().enumerate() {
                if gain > best.0 {
                    best = (gain, (value, border));
                }
            }
        }
        best.1
    }

    fn grow(&mut self, borders: &[Vec<i32>]) -> Tree {
        let width = self.samples.width;
        let mut questions = [(0, 0); QUESTIONS];
        for (level, question) in questions.iter_mut().enumerate() {
            let (value, border) = self.best_question(level, borders);
            *question = (value, borders[value][border]);
            let values = self.bins.iter().skip(value).step_by(width);
            for (answers, bin) in self.answers.iter_mut().zip(values) {
                *answers |= u8::from(usize::from(*bin) > border) << level;
            }
        }
        let mut sums = [[0.0; 2]; LEAVES];
        for (answers, slope) in self.answers.iter().zip(&self.slopes) {
            let sum = &mut sums[usize::from(*answers)];
            *sum = [sum[0] + slope[0], sum[1] + slope[1]];
        }
        let leaf = |[g, h]: Slope| (-RATE * g / (h + RIDGE) * SCALE).round() as i32;
        Tree { questions, leaves: sums.map(leaf) }
    }
}

/// Trees that tell the labels apart.
pub struct Boosted {
    /// The numbers of one after another, in steps.
    pub trees: Vec<i32>,
    /// Logit without any of them, steps.
    pub bias: i32,
    /// Losses after each.
    pub progress: Vec<Progress>,
}

/// Fits this many trees.
pub fn fit(count: usize, training: &Samples, held_out: &Samples) -> Boosted {
    let borders = training.borders();
    let bins = training.bins(&borders);
    let share = training.labels.iter().filter(|l| **l).count() as f64 / training.len() as f64;
    let bias = ((share / (1.0 - share)).ln() * SCALE).round() as i32;
    let mut logits = [training, held_out].map(|of| vec![f64::from(bias) / SCALE; of.len()]);
    let (mut trees, mut progress) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let slope = |(logit, label): (&f64, &bool)| {
            let p = 1.0 / (1.0 + (-logit).exp());
            [p - f64::from(u8::from(*label)), p * (1.0 - p)]
        };
        let slopes = logits[0].iter().zip(&training.labels).map(slope).collect();
        let answers = vec![0; training.len()];
        let tree = Growth { samples: training, bins: &bins, slopes, answers }.grow(&borders);
        for (logits, of) in logits.iter_mut().zip([training, held_out]) {
            logits.iter_mut().enumerate().for_each(|(n, logit)| *logit += tree.logit(of.row(n)));
        }
        let losses = [training.loss(&logits[0]), held_out.loss(&logits[1])];
        progress.push(Progress { training: losses[0], held_out: losses[1] });
        trees.extend(tree.questions.into_iter().flat_map(|(value, b)| [value as i32, b]));
        trees.extend(tree.leaves);
    }
    Boosted { trees, bias, progress }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of three values; whether the first two are both above 0.5 or both not decides.
    fn alike(count: usize) -> Samples {
        let mut rng = raywake_sim::Rng::new(7);
        let rows: Vec<f32> = (0..3 * count).map(|_| rng.range(0.0, 1.0) as f32).collect();
        let labels = rows.chunks(3).map(|r| (r[0] > 0.5) == (r[1] > 0.5)).collect();
        Samples { width: 3, rows, labels }
    }

    #[test]
    fn what_no_sum_of_weights_can_tell_apart_is_learned() {
        let Boosted { trees, progress, .. } = fit(40, &alike(4000), &alike(500));
        assert_eq!(trees.len(), 40 * (2 * QUESTIONS + LEAVES));
        let last = progress.last().unwrap();
        assert!(last.training < 0.05 && last.held_out < 0.05, "{last:?}");
        assert!(progress.windows(2).all(|p| p[1].training <= p[0].training));
    }

    #[test]
    fn borders_leave_out_what_stands_for_no_value() {
        let rows = [0.0, 0.0, 0.0, 0.25, 0.0, 0.5].into_iter().flat_map(|v| [v, 1.0]).collect();
        let samples = Samples { width: 2, rows, labels: vec![true; 6] };
        assert_eq!(samples.borders(), [vec![-1, 0, 250, 500], vec![-1, 0, 1000]]);
        let bins = samples.bins(&samples.borders());
        assert_eq!(bins.chunks(2).map(|b| b[0]).collect::<Vec<_>>(), [1, 1, 1, 2, 1, 3]);
    }
}
