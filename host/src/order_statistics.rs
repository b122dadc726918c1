//! Order statistics of samples: quantiles, the median, and the spread.

use serde::Serialize;

fn ascending(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// Returns, for each share from 0 to 1, the smallest value that at least this share of the values
/// does not exceed (nearest rank); NaN without values.
pub fn quantiles<const N: usize>(
    values: impl IntoIterator<Item = f64>,
    shares: [f64; N],
) -> [f64; N] {
    let sorted = ascending(values);
    shares.map(|share| nearest_rank(&sorted, share))
}

fn nearest_rank(sorted: &[f64], share: f64) -> f64 {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

/// Returns the middle value, or the mean of the middle two; NaN without values.
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let sorted = ascending(values);
    match sorted.len() {
        0 => f64::NAN,
        n => 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]),
    }
}

/// How a quantity is distributed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Sum over count.
    pub mean: f64,
    /// The middle value, or the mean of the middle two.
    pub median: f64,
    /// Standard deviation.
    pub sd: f64,
    /// 99 % of the values lie at or below this.
    pub p99: f64,
    /// The maximum.
    pub max: f64,
}

impl Spread {
    /// Returns the spread of some values; `None` without any.
    pub fn of(values: &[f64]) -> Option<Spread> {
        let sorted = ascending(values.iter().copied());
        let (n, max) = (sorted.len(), *sorted.last()?);
        let mean = sorted.iter().sum::<f64>() / n as f64;
        let variance = sorted.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n as f64;
        Some(Spread {
            mean,
            median: median(sorted.iter().copied()),
            sd: variance.sqrt(),
            p99: nearest_rank(&sorted, 0.99),
            max,
        })
    }

    /// Formats the spread of times in ms for the user, with the given number of decimals.
    pub fn line(&self, decimals: usize) -> String {
        let shown = [self.median, self.sd, self.p99, self.max].map(|v| format!("{v:.decimals$}"));
        let [median, sd, p99, max] = shown;
        format!("{median} ms median, {sd} sd, {p99} p99, {max} max")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads() {
        assert_eq!(Spread::of(&[]), None);
        let one = Spread::of(&[3.0]).unwrap();
        assert_eq!(one, Spread { mean: 3.0, median: 3.0, sd: 0.0, p99: 3.0, max: 3.0 });
        let values: Vec<f64> = (1..=200).rev().map(f64::from).collect();
        let s = Spread::of(&values).unwrap();
        assert_eq!((s.median, s.p99, s.max), (100.5, 198.0, 200.0));
        assert!((s.sd - 57.734).abs() < 1e-3);
    }

    #[test]
    fn quantiles_are_values_of_the_sample() {
        let descending = (1..=100).rev().map(f64::from);
        assert_eq!(quantiles(descending, [0.0, 0.5, 0.95, 1.0]), [1.0, 50.0, 95.0, 100.0]);
        assert_eq!(median([4.0, 1.0, 3.0, 2.0]), 2.5);
        assert!(median([]).is_nan() && quantiles([], [0.5])[0].is_nan());
    }
}
