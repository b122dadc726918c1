//! Latency statistics in constant memory.

use serde::Serialize;

/// Steps per millisecond: the resolution.
const STEPS_OF_MS: f64 = 10.0;
/// Number of steps with a count of their own: one second.
const STEPS: usize = 10_000;

/// A histogram of latencies, in steps of 0.1 ms.
pub struct Latencies {
    counts: Box<[u64; STEPS]>,
    /// Latencies longer than the steps cover.
    beyond: u64,
    max_ms: f64,
}

/// Latency figures, ms: to 0.1 ms up to a second; beyond that, the maximum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LatencyFigures {
    /// Half are no longer.
    pub median: f64,
    /// 99 % are no longer.
    pub p99: f64,
    /// The longest.
    pub max: f64,
}

impl Default for Latencies {
    /// No latencies yet.
    fn default() -> Latencies {
        Latencies { counts: Box::new([0; STEPS]), beyond: 0, max_ms: 0.0 }
    }
}

impl Latencies {
    /// Counts a latency.
    pub fn add(&mut self, ms: f64) {
        // Reported as the end of its step, which is no less.
        match self.counts.get_mut((ms * STEPS_OF_MS) as usize) {
            Some(count) => *count += 1,
            None => self.beyond += 1,
        }
        self.max_ms = self.max_ms.max(ms);
    }

    /// Returns the figures; `None` if nothing was counted.
    pub fn figures(&self) -> Option<LatencyFigures> {
        let total = self.counts.iter().sum::<u64>() + self.beyond;
        let share = |share: f64| {
            let rank = (share * total as f64).ceil() as u64;
            let mut below = 0;
            let step = self.counts.iter().position(|count| {
                below += count;
                below >= rank
            });
            step.map_or(self.max_ms, |step| ((step + 1) as f64 / STEPS_OF_MS).min(self.max_ms))
        };
        let figures = || LatencyFigures { median: share(0.5), p99: share(0.99), max: self.max_ms };
        (total > 0).then(figures)
    }
}

impl LatencyFigures {
    /// Formats the figures for the user.
    pub fn line(&self) -> String {
        let LatencyFigures { median, p99, max } = self;
        format!("{median:.1} ms median, {p99:.1} p99, {max:.1} max")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks() {
        let mut latencies = Latencies::default();
        assert_eq!(latencies.figures(), None);
        latencies.add(3.25);
        let one = LatencyFigures { median: 3.25, p99: 3.25, max: 3.25 };
        assert_eq!(latencies.figures(), Some(one));
        let mut latencies = Latencies::default();
        (0..198).for_each(|n| latencies.add(f64::from(n) + 0.01));
        latencies.add(4000.0);
        latencies.add(5000.0);
        let figures = latencies.figures().unwrap();
        assert!((figures.median - 99.1).abs() < 1e-9 && (figures.p99 - 197.1).abs() < 1e-9);
        assert_eq!(figures.max, 5000.0);
    }
}
