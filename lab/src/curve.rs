//! How well scores separate two classes, at every threshold.

use serde::Serialize;

/// The effect of a threshold: everything that scores above it is kept.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OperatingPoint {
    /// Just below the lowest score kept.
    pub threshold: f64,
    /// Share of the foreground that is kept.
    pub recall: f64,
    /// Share of the foreground in what is kept.
    pub precision: f64,
    /// Share of the background that is rejected.
    pub background_accuracy: f64,
}

/// Weighted counts at every distinct score, from the highest down.
pub struct Curve {
    /// Score, and the weight of foreground and background from there up.
    steps: Vec<(f64, f64, f64)>,
    total: [f64; 2],
    area: f64,
}

impl Curve {
    /// Builds the curve from rows of score, class (true: foreground) and weight; scores must be
    /// finite. `None` unless both classes are present.
    pub fn of(rows: impl Iterator<Item = (f64, bool, f64)>) -> Option<Curve> {
        let mut rows: Vec<_> = rows.collect();
        rows.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (mut kept, mut wrong, mut area) = (0.0, 0.0, 0.0);
        let mut steps = Vec::new();
        for same in rows.chunk_by(|a, b| a.0 == b.0) {
            let sum = |class: bool| same.iter().filter(|r| r.1 == class).map(|r| r.2).sum::<f64>();
            let (more, worse) = (sum(true), sum(false));
            // Ties count half.
            area += worse * (kept + 0.5 * more);
            (kept, wrong) = (kept + more, wrong + worse);
            steps.push((same[0].0, kept, wrong));
        }
        let both = kept > 0.0 && wrong > 0.0;
        both.then_some(Curve { steps, total: [kept, wrong], area })
    }

    /// The effect of every threshold, strictest first.
    pub fn points(&self) -> impl Iterator<Item = OperatingPoint> {
        (0..self.steps.len()).map(|at| self.operating(at))
    }

    /// Probability that foreground scores above background.
    pub fn auc(&self) -> f64 {
        self.area / (self.total[0] * self.total[1])
    }

    /// The highest threshold that keeps this share of the foreground, 0..1.
    pub fn at_recall(&self, recall: f64) -> OperatingPoint {
        let wanted = recall * self.total[0] * (1.0 - 1e-12);
        let at = self.steps.partition_point(|s| s.1 < wanted).min(self.steps.len() - 1);
        self.operating(at)
    }

    /// The effect of keeping everything that scores above `threshold`.
    pub fn above(&self, threshold: f64) -> OperatingPoint {
        match self.steps.partition_point(|s| s.0 > threshold) {
            0 => {
                OperatingPoint { threshold, recall: 0.0, precision: 1.0, background_accuracy: 1.0 }
            }
            n => OperatingPoint { threshold, ..self.operating(n - 1) },
        }
    }

    fn operating(&self, at: usize) -> OperatingPoint {
        let (score, kept, wrong) = self.steps[at];
        let next = self.steps.get(at + 1).map_or(score - 1.0, |s| s.0);
        OperatingPoint {
            threshold: 0.5 * (score + next),
            recall: kept / self.total[0],
            precision: kept / (kept + wrong),
            background_accuracy: 1.0 - wrong / self.total[1],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(rows: &[(f64, bool)]) -> Curve {
        Curve::of(rows.iter().map(|r| (r.0, r.1, 1.0))).unwrap()
    }

    #[test]
    fn thresholds_and_area_of_five_rows() {
        let rows = [(3.0, true), (2.0, false), (1.0, true), (1.0, false), (0.0, true)];
        let c = curve(&rows);
        // Pairs won: 3 beats both, 1 beats one half of the second, 0 none.
        assert!((c.auc() - 2.5 / 6.0).abs() < 1e-12);
        let at = c.at_recall(0.5);
        assert_eq!((at.threshold, at.recall), (0.5, 2.0 / 3.0));
        assert_eq!((at.precision, at.background_accuracy), (0.5, 0.0));
        assert_eq!(c.at_recall(0.2).background_accuracy, 1.0);
        assert_eq!(c.at_recall(1.0).recall, 1.0);
        assert_eq!(c.above(2.0).recall, 1.0 / 3.0);
        assert_eq!((c.above(9.0).recall, c.above(-9.0).recall), (0.0, 1.0));
    }

    #[test]
    fn one_class_alone_has_no_curve() {
        assert!(Curve::of([(1.0, true, 1.0)].into_iter()).is_none());
        assert!(Curve::of([(1.0, false, 1.0)].into_iter()).is_none());
        assert!(Curve::of(std::iter::empty()).is_none());
    }
}
