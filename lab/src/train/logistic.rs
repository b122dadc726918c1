//! Logistic regression by Newton's method: a convex problem with few unknowns, solved exactly.

use super::solve::cholesky;
use serde::Serialize;

/// Labelled rows of small counts.
pub struct Data {
    /// Numbers of a row.
    pub width: usize,
    /// The rows, one after another.
    pub rows: Vec<u8>,
    pub labels: Vec<bool>,
    /// Weight of every row; they should sum to about 1.
    pub weights: Vec<f32>,
    /// Half of this times the squared norm of the weights, excluding the bias, is added to the
    /// loss.
    pub ridge: f64,
}

/// Losses after a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Progress {
    /// The minimised loss, including the penalty on squared weights.
    pub training: f64,
    /// Loss on held-out data, without the penalty.
    pub held_out: f64,
}

/// Loss, its gradient and, if requested, the lower triangle of its second derivatives.
#[derive(Clone)]
struct Slope {
    loss: f64,
    gradient: Vec<f64>,
    hessian: Vec<f64>,
}

/// Maximum number of Newton steps; about ten are needed.
const STEPS_MAX: usize = 40;
/// Decrease of the loss below which the fit has converged.
const LOSS_TOLERANCE: f64 = 1e-9;

impl Data {
    /// Weights of rows, in proportion to `weights` within a class, such that both classes count the
    /// same and all weights sum to 1.
    pub fn balanced(labels: &[bool], weights: impl Iterator<Item = f64>) -> Vec<f32> {
        let mut sums = [0.0; 2];
        let weights: Vec<f64> = weights.collect();
        labels.iter().zip(&weights).for_each(|(l, w)| sums[*l as usize] += w);
        labels.iter().zip(&weights).map(|(l, w)| (0.5 * w / sums[*l as usize]) as f32).collect()
    }
}

impl Data {
    /// Score of a row: `weights` has the bias last.
    pub fn score(weights: &[f64], row: &[u8]) -> f64 {
        let sum: f64 = row.iter().zip(weights).map(|(x, w)| f64::from(*x) * w).sum();
        sum + weights[row.len()]
    }

    pub fn loss(&self, weights: &[f64]) -> f64 {
        self.slope(weights, false).loss
    }

    /// The weights that minimise the loss, bias last. `report` is called with weights and loss
    /// after every step.
    pub fn fit(&self, report: &mut dyn FnMut(&[f64], f64)) -> Vec<f64> {
        let mut weights = vec![0.0; self.width + 1];
        let mut here = self.slope(&weights, true);
        for _ in 0..STEPS_MAX {
            let Some(step) = cholesky(here.hessian.clone(), here.gradient.clone()) else {
                break;
            };
            let before = here.loss;
            // The step is halved until the loss decreases: far from the minimum the full step may
            // overshoot.
            let moved = (0..20).map(|n| 0.5f64.powi(n)).find_map(|share| {
                let to: Vec<f64> = weights.iter().zip(&step).map(|(w, s)| w - share * s).collect();
                (self.slope(&to, false).loss <= before).then_some(to)
            });
            let Some(moved) = moved else {
                break;
            };
            weights = moved;
            here = self.slope(&weights, true);
            report(&weights, here.loss);
            if before - here.loss < LOSS_TOLERANCE {
                break;
            }
        }
        weights
    }

    /// Two threads, each with half of the rows, on any machine, so that the sums do not depend on
    /// it.
    fn slope(&self, weights: &[f64], second: bool) -> Slope {
        let middle = self.labels.len() / 2;
        let [mut sum, other] = std::thread::scope(|scope| {
            let other = scope.spawn(|| self.slope_of(0..middle, weights, second));
            let rest = self.slope_of(middle..self.labels.len(), weights, second);
            [rest, other.join().expect("a summing thread panicked")]
        });
        sum.loss += other.loss;
        let add = |a: &mut Vec<f64>, b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        add(&mut sum.gradient, &other.gradient);
        add(&mut sum.hessian, &other.hessian);
        for (n, w) in weights[..self.width].iter().enumerate() {
            sum.loss += 0.5 * self.ridge * w * w;
            sum.gradient[n] += self.ridge * w;
            if second {
                sum.hessian[n * (self.width + 2)] += self.ridge;
            }
        }
        sum
    }

    fn slope_of(&self, rows: std::ops::Range<usize>, weights: &[f64], second: bool) -> Slope {
        let n = self.width + 1;
        let hessian = vec![0.0; if second { n * n } else { 0 }];
        let mut sum = Slope { loss: 0.0, gradient: vec![0.0; n], hessian };
        let mut x = vec![1.0; n];
        for r in rows {
            let row = &self.rows[r * self.width..][..self.width];
            let (label, score) = (self.labels[r], Data::score(weights, row));
            let weight = f64::from(self.weights[r]);
            let signed = if label { -score } else { score };
            sum.loss += weight * (signed.max(0.0) + (-signed.abs()).exp().ln_1p());
            if !second {
                continue;
            }
            let p = 1.0 / (1.0 + (-score).exp());
            let (slope, bend) = (weight * (p - label as u8 as f64), weight * p * (1.0 - p));
            x.iter_mut().zip(row).for_each(|(x, c)| *x = f64::from(*c));
            for (i, &xi) in x.iter().enumerate().filter(|(_, x)| **x != 0.0) {
                sum.gradient[i] += slope * xi;
                let line = &mut sum.hessian[i * n..][..=i];
                line.iter_mut().zip(&x).for_each(|(h, xj)| *h += bend * xi * xj);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise() -> Data {
        let mut rng = raywake_sim::Rng::new(5);
        let labels: Vec<bool> = (0..200).map(|_| rng.chance(0.3)).collect();
        let rows = (0..200 * 4).map(|_| rng.range(0.0, 4.0) as u8).collect();
        let weights = (0..200).map(|_| rng.range(0.0, 0.01) as f32).collect();
        Data { width: 4, rows, labels, weights, ridge: 0.01 }
    }

    #[test]
    fn derivatives_are_central_differences() {
        let data = noise();
        let at = [0.3, -0.2, 0.5, 0.1, -0.4];
        let here = data.slope(&at, true);
        let step = 1e-5;
        for i in 0..5 {
            let beside = |by: f64| {
                let mut to = at;
                to[i] += by;
                data.slope(&to, true)
            };
            let (up, down) = (beside(step), beside(-step));
            assert!(((up.loss - down.loss) / (2.0 * step) - here.gradient[i]).abs() < 1e-8);
            for j in i..5 {
                let bend = (up.gradient[j] - down.gradient[j]) / (2.0 * step);
                assert!((bend - here.hessian[j * 5 + i]).abs() < 1e-8);
            }
        }
        let best = data.fit(&mut |_, _| ());
        assert!(data.slope(&best, true).gradient.iter().all(|g| g.abs() < 1e-6));
    }

    #[test]
    fn classes_are_balanced() {
        let weights = Data::balanced(&[true, false, true, true], [1.0, 9.0, 2.0, 1.0].into_iter());
        assert_eq!(weights, [0.125, 0.5, 0.25, 0.125]);
    }

    #[test]
    fn toy_problem_has_the_known_optimum() {
        // Three of four rows with the count are foreground, and one of four without.
        let data = Data {
            width: 1,
            rows: vec![1, 1, 1, 1, 0, 0, 0, 0],
            labels: vec![true, true, true, false, true, false, false, false],
            weights: vec![0.125; 8],
            ridge: 0.0,
        };
        let w = data.fit(&mut |_, _| ());
        assert!((w[0] - 2.0 * 3f64.ln()).abs() < 1e-6 && (w[1] + 3f64.ln()).abs() < 1e-6);
    }

    #[test]
    fn a_separable_toy_is_separated() {
        let data = Data {
            width: 2,
            rows: vec![2, 0, 3, 1, 0, 2, 1, 3],
            labels: vec![true, true, false, false],
            weights: vec![0.25; 4],
            ridge: 1e-3,
        };
        let w = data.fit(&mut |_, _| ());
        for (row, label) in data.rows.chunks(2).zip(&data.labels) {
            assert_eq!(Data::score(&w, row) > 0.0, *label);
        }
        // The optimum is as symmetric as the data: opposite weights, no bias.
        assert!((w[0] + w[1]).abs() < 1e-6 && w[2].abs() < 1e-6);
    }
}
