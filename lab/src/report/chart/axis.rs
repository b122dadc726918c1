//! Axes: the range of a plot's values, and their labels.

use crate::report::encode::{fixed, short};
use std::ops::Range;

/// Shortest axis and largest value: beyond these plotters searches for labels forever.
const SPAN: [f64; 2] = [1e-9, 1e12];

/// One axis of a plot.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Quantity and unit, as in "error, m".
    pub label: String,
    /// Ends; those of the data if none are given. What lies outside is not drawn.
    pub range: Option<[f64; 2]>,
}

impl Axis {
    /// An axis as long as its data.
    pub fn new(label: &str) -> Axis {
        Axis { label: label.into(), range: None }
    }

    /// The same axis from `low` to `high`.
    pub fn range(self, low: f64, high: f64) -> Axis {
        Axis { range: Some([low, high]), ..self }
    }

    /// Ends that contain these values, all of them drawable; none if there are no such ends.
    pub(super) fn ends(&self, values: impl IntoIterator<Item = f64>) -> Option<Range<f64>> {
        let data = values.into_iter().fold(None, |ends: Option<[f64; 2]>, v| {
            Some(ends.map_or([v, v], |[low, high]| [low.min(v), high.max(v)]))
        })?;
        let [low, high] = self.range.unwrap_or_else(|| grown(data));
        let (span, most) = (high - low, low.abs().max(high.abs()));
        let sound = span > SPAN[0].max(1e-9 * most) && most < SPAN[1];
        sound.then_some(low..high)
    }
}

/// Ends of the data with a margin; a span that begins near zero is extended to zero.
fn grown([low, high]: [f64; 2]) -> [f64; 2] {
    if low == high {
        return if low == 0.0 { [0.0, 1.0] } else { [low.min(0.0), high.max(0.0)] };
    }
    let margin = 0.04 * (high - low);
    let low = if low >= 0.0 && low < 0.5 * high { 0.0 } else { low - margin };
    [low, high + margin]
}

/// Labels of linear axes between these ends.
pub(super) fn linear_label(ends: Range<f64>) -> impl Fn(&f64) -> String {
    let decimals = (1.3 - (ends.end - ends.start).log10()).floor().clamp(0.0, 6.0);
    move |v| fixed(*v, decimals as usize)
}

pub(super) fn log_label(v: &f64) -> String {
    if (1e-4..1e7).contains(v) { short(*v) } else { format!("{v:.0e}") }
}
