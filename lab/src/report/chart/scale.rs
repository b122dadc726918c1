//! Axes: from values to places, and the values worth a label.

use crate::report::encode::{fixed, short};

/// How many steps an axis should have, about.
const STEPS: f64 = 5.0;

/// One axis of a plot.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Quantity and unit, as in "error, m".
    pub label: String,
    /// Ends; those of the data where none are given. What lies outside is not drawn.
    pub range: Option<[f64; 2]>,
    /// Logarithmic: only values above zero are drawn.
    pub log: bool,
}

impl Axis {
    /// A linear axis as long as its data.
    pub fn new(label: &str) -> Axis {
        Axis { label: label.into(), range: None, log: false }
    }

    /// The same from `low` to `high`.
    pub fn range(self, low: f64, high: f64) -> Axis {
        Axis { range: Some([low, high]), ..self }
    }

    /// The same with a logarithmic scale.
    pub fn log(self) -> Axis {
        Axis { log: true, ..self }
    }
}

/// An axis with ends.
#[derive(Clone, Debug)]
pub(super) struct Scale {
    /// Ends, in decades where logarithmic.
    ends: [f64; 2],
    log: bool,
    /// Values with a label.
    pub ticks: Vec<(f64, String)>,
}

impl Scale {
    /// Of an axis that is to show these values; nothing where none can be shown.
    pub fn new(axis: &Axis, values: impl IntoIterator<Item = f64>) -> Option<Scale> {
        let shown = |v: &f64| v.is_finite() && !(axis.log && *v <= 0.0);
        let mut ends = None;
        for v in values.into_iter().filter(shown) {
            let [low, high] = ends.unwrap_or([v, v]);
            ends = Some([f64::min(low, v), f64::max(high, v)]);
        }
        let data = ends?;
        let given = axis.range.filter(|r| r.iter().all(shown) && r[0] < r[1]);
        if axis.log { log_scale(given.unwrap_or(data)) } else { linear_scale(given, data) }
    }

    /// Where a value lies, 0 to 1 between the ends; nothing for what has no place.
    pub fn place(&self, value: f64) -> Option<f64> {
        let v = if self.log { value.log10() } else { value };
        let place = (v - self.ends[0]) / (self.ends[1] - self.ends[0]);
        // Further out than anything drawn, and too far for a renderer's numbers.
        place.is_finite().then_some(place.clamp(-100.0, 100.0))
    }
}

/// The round number (1, 2 or 5 times a power of ten) nearest above a step.
fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let digit = [1.0, 2.0, 5.0].into_iter().find(|d| d * power >= step * 0.999);
    digit.unwrap_or(10.0) * power
}

fn linear_scale(given: Option<[f64; 2]>, data: [f64; 2]) -> Option<Scale> {
    let [mut low, mut high] = given.unwrap_or(data);
    if given.is_none() {
        // A span that begins near zero says more with its zero.
        if low > 0.0 && low < 0.5 * high {
            low = 0.0;
        }
        if low == high {
            (low, high) = if low == 0.0 { (0.0, 1.0) } else { (low.min(0.0), high.max(0.0)) };
        }
    }
    let step = round_step((high - low) / STEPS);
    if !step.is_normal() || step <= 1e-12 * low.abs().max(high.abs()) {
        return None;
    }
    let (first, last) = match given {
        Some(_) => ((low / step - 1e-6).ceil(), (high / step + 1e-6).floor()),
        None => ((low / step).floor(), (high / step - 1e-6).ceil()),
    };
    if given.is_none() {
        (low, high) = (first * step, last * step);
    }
    let decimals = (-step.log10() - 1e-9).ceil().clamp(0.0, 12.0) as usize;
    let label = |v: f64| {
        let long = step < 1e-6 || low.abs().max(high.abs()) >= 1e7;
        if long && v != 0.0 { format!("{v:.1e}") } else { fixed(v, decimals) }
    };
    let ticks = (0..=(last - first) as usize).map(|i| (first + i as f64) * step);
    Some(Scale { ends: [low, high], log: false, ticks: ticks.map(|v| (v, label(v))).collect() })
}

fn log_scale([low, high]: [f64; 2]) -> Option<Scale> {
    let mut ends = [low.log10(), high.log10()];
    if ends[1] - ends[0] < 0.3 {
        ends = [ends[0] - 0.2, ends[1] + 0.2];
    }
    let decades = ends[1] - ends[0];
    let digits: &[f64] = if decades < 3.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let stride = (decades / 8.0).ceil().max(1.0) as usize;
    let powers = (ends[0].floor() as i32..=ends[1].ceil() as i32).step_by(stride);
    let values = powers.flat_map(|p| digits.iter().map(move |d| d * 10f64.powi(p)));
    let inside = |v: &f64| (ends[0] - 1e-9..=ends[1] + 1e-9).contains(&v.log10());
    let label = |v: f64| match v {
        1.0..1e7 => fixed(v, 0),
        1e-4..1.0 => short(v).trim_end_matches('0').into(),
        _ => format!("{v:.0e}"),
    };
    let ticks = values.filter(inside).map(|v| (v, label(v)));
    Some(Scale { ends, log: true, ticks: ticks.collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: Axis, values: &[f64]) -> Option<Vec<String>> {
        let scale = Scale::new(&axis, values.iter().copied())?;
        Some(scale.ticks.into_iter().map(|t| t.1).collect())
    }

    #[test]
    fn round_numbers_around_the_data() {
        let of = |values: &[f64]| labels(Axis::new(""), values).unwrap().join(" ");
        assert_eq!(of(&[0.1, 0.97]), "0.0 0.2 0.4 0.6 0.8 1.0");
        assert_eq!(of(&[-3.0, 3.0]), "\u{2212}4 \u{2212}2 0 2 4");
        assert_eq!(of(&[0.0, 42_000.0]), "0 10,000 20,000 30,000 40,000 50,000");
        assert_eq!(of(&[7.0]), "0 2 4 6 8");
        assert_eq!(of(&[0.0]), "0.0 0.2 0.4 0.6 0.8 1.0");
    }

    #[test]
    fn given_ends_stay() {
        let scale = Scale::new(&Axis::new("").range(0.5, 1.0), [3.0]).unwrap();
        assert_eq!((scale.place(0.5), scale.place(1.0)), (Some(0.0), Some(1.0)));
        assert_eq!(
            labels(Axis::new("").log(), &[0.05, 20.0]).unwrap().join(" "),
            "0.05 0.1 0.2 0.5 1 2 5 10 20"
        );
    }

    #[test]
    fn what_cannot_be_shown_is_nothing() {
        let axis = || Axis::new("");
        assert!(Scale::new(&axis(), []).is_none());
        assert!(Scale::new(&axis(), [f64::NAN, f64::INFINITY]).is_none());
        assert!(Scale::new(&axis().log(), [0.0, -1.0]).is_none());
        assert!(Scale::new(&axis(), [f64::MIN, f64::MAX]).is_none());
        assert!(Scale::new(&axis(), [1e18, 1e18 + 256.0]).is_none());
        assert!(Scale::new(&axis().range(f64::NAN, 1.0), [1.0]).is_some());
        let scale = Scale::new(&axis(), [0.0, 1.0]).unwrap();
        assert_eq!((scale.place(f64::NAN), scale.place(f64::INFINITY)), (None, None));
    }
}
