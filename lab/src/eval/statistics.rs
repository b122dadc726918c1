//! Errors of columns: counts, quantiles, shares.

/// How much an error counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// Every column counts once.
    Column,
    /// Every column counts as often as it has occupied voxels: the dissertation's tables.
    Voxel,
}

/// Errors, each with the occupied voxels of its column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Errors {
    values: Vec<(f32, u8)>,
}

impl Errors {
    /// Adds one. NaN counts as infinite: failing must not improve the result.
    pub fn push(&mut self, error: f32, voxels: u8) {
        self.values.push((if error.is_nan() { f32::INFINITY } else { error }, voxels));
    }

    /// Adds all errors of `others`.
    pub fn extend(&mut self, others: &Errors) {
        self.values.extend_from_slice(&others.values);
    }

    /// The errors in ascending order.
    pub fn sorted(mut self, weight: Weight) -> Sorted {
        self.values.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut sum = 0;
        let values = self.values.iter().map(|&(e, voxels)| {
            sum += if weight == Weight::Column { 1 } else { u64::from(voxels) };
            (e, sum)
        });
        Sorted { values: values.collect() }
    }
}

/// Errors in ascending order with the sum of the weights up to each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sorted {
    values: Vec<(f32, u64)>,
}

impl Sorted {
    /// Sum of the weights.
    pub fn count(&self) -> u64 {
        self.values.last().map_or(0, |v| v.1)
    }

    /// The smallest error that at least a share `q` of the weight does not exceed; for an even
    /// number of equal weights the median is the mean of the middle two, as usual.
    pub fn quantile(&self, q: f64) -> f64 {
        let Some(&(last, count)) = self.values.last() else {
            return f64::NAN;
        };
        let rank = q * count as f64;
        let at = self.values.partition_point(|v| (v.1 as f64) < rank);
        let here = self.values.get(at).map_or(last, |v| v.0);
        match self.values.get(at + 1) {
            Some(next) if self.values[at].1 as f64 == rank => 0.5 * f64::from(here + next.0),
            _ => f64::from(here),
        }
    }

    /// Share of the weight strictly below `limit`.
    pub fn share_below(&self, limit: f64) -> f64 {
        let at = self.values.partition_point(|v| f64::from(v.0) < limit);
        let below = if at == 0 { 0 } else { self.values[at - 1].1 };
        if self.values.is_empty() { f64::NAN } else { below as f64 / self.count() as f64 }
    }

    /// Weighted mean.
    pub fn mean(&self) -> f64 {
        let mut before = 0;
        let sum: f64 = self
            .values
            .iter()
            .map(|&(e, sum)| {
                let weight = sum - before;
                before = sum;
                f64::from(e) * weight as f64
            })
            .sum();
        if self.values.is_empty() { f64::NAN } else { sum / self.count() as f64 }
    }

    /// Weight in bins of `width` from 0, the last one open.
    pub fn histogram(&self, width: f64, bins: usize) -> Vec<u64> {
        let mut counts = vec![0; bins];
        let mut before = 0;
        for &(error, sum) in &self.values {
            let bin = (f64::from(error) / width).min(bins as f64 - 1.0) as usize;
            counts[bin] += sum - before;
            before = sum;
        }
        counts
    }

    /// Points (error, share) of the cumulative distribution at `count` + 1 places from 0 to
    /// `limit`.
    pub fn cdf(&self, limit: f64, count: usize) -> Vec<[f64; 2]> {
        let place = |n: usize| limit * n as f64 / count as f64;
        (0..=count).map(|n| [place(n), self.share_below(place(n))]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted(values: &[(f32, u8)]) -> Sorted {
        let mut errors = Errors::default();
        values.iter().for_each(|v| errors.push(v.0, v.1));
        assert_eq!(errors.clone().sorted(Weight::Column).count(), values.len() as u64);
        errors.sorted(Weight::Voxel)
    }

    #[test]
    fn by_hand() {
        let s = sorted(&[(3.0, 1), (1.0, 1), (2.0, 1), (0.5, 1)]);
        assert_eq!((s.quantile(0.5), s.mean(), s.count()), (1.5, 1.625, 4));
        assert_eq!((s.share_below(1.0), s.share_below(1.1)), (0.25, 0.5));
        // As if 2.0 occurred three times: 1 2 2 2 4.
        let s = sorted(&[(4.0, 1), (2.0, 3), (1.0, 1), (9.0, 0)]);
        assert_eq!((s.quantile(0.5), s.mean(), s.count()), (2.0, 2.2, 5));
        assert_eq!(s.histogram(1.0, 3), [0, 1, 4]);
        assert_eq!(s.cdf(4.0, 2), [[0.0, 0.0], [2.0, 0.2], [4.0, 0.8]]);
    }

    #[test]
    fn zero_and_nan() {
        let none = sorted(&[]);
        assert!(none.quantile(0.5).is_nan() && none.mean().is_nan());
        assert!(none.share_below(1.0).is_nan() && none.count() == 0);
        let bad = sorted(&[(f32::NAN, 1), (0.1, 1)]);
        assert_eq!((bad.share_below(0.3), bad.quantile(1.0)), (0.5, f64::INFINITY));
        assert_eq!(bad.histogram(0.1, 2), [0, 2]);
    }
}
