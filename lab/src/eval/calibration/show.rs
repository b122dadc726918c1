//! The table and figure of calibration.

use super::{Calibration, Columns, Quantity};
use crate::eval::groups::{ClassGroup, MotionGroup};
use crate::report::{Axis, Cell, Chart, Guide, Lines, Plot, Series, Table, TableRow};

/// Contents of the table's ellipses.
const CONTENTS: [f64; 2] = [0.68, 0.95];
/// The curves end at this content: nothing is claimed with certainty.
const END: f64 = 0.99;
/// Points of a curve.
const POINTS: usize = 99;

impl Quantity {
    fn label(self) -> &'static str {
        match self {
            Quantity::Flow => "flow",
            Quantity::Settled => "tracklets of age 10 or more",
            Quantity::Velocity => "velocity at any age",
        }
    }

    fn unit(self) -> &'static str {
        if self == Quantity::Flow { "m" } else { "m/s" }
    }
}

impl Columns {
    fn label(self) -> String {
        match self {
            Columns::Displaced => "output with a displacement".into(),
            Columns::Of(group, MotionGroup::Any) => group.label().into(),
            Columns::Of(group, motion) => format!("{}, {}", group.label(), motion.label()),
        }
    }

    /// All sets of columns, in the order listed.
    fn all() -> impl Iterator<Item = Columns> {
        let movers = ClassGroup::labelled().map(|g| Columns::Of(g, MotionGroup::Moving));
        let rest = [MotionGroup::Slow, MotionGroup::Parked, MotionGroup::Any];
        let rest = rest.map(|m| Columns::Of(ClassGroup::Labelled, m));
        let background = [Columns::Of(ClassGroup::Class(0), MotionGroup::Any)];
        [Columns::Displaced].into_iter().chain(movers).chain(rest).chain(background)
    }
}

/// Name of the truth, for display.
pub fn truth(exact: bool) -> &'static str {
    if exact { "exact" } else { "labels" }
}

/// Shares of true values in the ellipses, deviations claimed and errors found.
pub fn table(calibration: &Calibration) -> Table {
    let mut rows = Vec::new();
    for quantity in Quantity::ALL {
        for exact in [true, false] {
            for columns in Columns::all() {
                let s = calibration.sample(quantity, exact, columns);
                if s.content.count() + s.without == 0 {
                    continue;
                }
                let [p, q] = CONTENTS.map(|p| Cell::Number(100.0 * s.content.share_below(p), 1));
                rows.push(TableRow::new([
                    format!("{}, {}", quantity.label(), quantity.unit()).into(),
                    truth(exact).into(),
                    columns.label().into(),
                    Cell::Count(s.content.count()),
                    Cell::Count(s.without),
                    p,
                    q,
                    Cell::Number(s.deviation.quantile(0.5), 3),
                    Cell::Number(s.error.quantile(0.5), 3),
                ]));
            }
        }
    }
    let columns = [
        "Value",
        "Truth",
        "Columns",
        "Count",
        "Without an ellipse",
        "In the 68 % ellipse, %",
        "In the 95 % ellipse, %",
        "Median deviation claimed",
        "Median error",
    ];
    let caption = "Covariances beside errors: share of true values in the 68 % and the 95 % \
        ellipse of the output covariance (squared Mahalanobis distance up to 2.279 and 5.991).";
    let note = "Columns with a covariance of zero, background and those without a match, have no \
        ellipse; they are counted separately and excluded from the shares. The deviation is the \
        root of half the trace, in the unit of the value; for a correct circular covariance the \
        median error is 1.18 times it.";
    Table::new("calibration", caption, &columns, rows).note(note)
}

/// Share of true values in ellipses of every content; correct covariances lie on the diagonal.
pub fn reliability(calibration: &Calibration) -> Chart {
    let series = |quantity, exact, motion: MotionGroup| {
        let columns = Columns::Of(ClassGroup::Labelled, motion);
        let content = calibration.sample(quantity, exact, columns).content;
        let points = if content.count() > 0 { content.cdf(END, POINTS) } else { Vec::new() };
        Series::line(motion.label(), points)
    };
    let mut parts = Vec::new();
    for quantity in [Quantity::Flow, Quantity::Settled] {
        for exact in [true, false] {
            let mut lines = Lines::new(
                Axis::new("claimed probability of the ellipse").range(0.0, 1.0),
                Axis::new("share of true values in it").range(0.0, 1.0),
            );
            lines.series = [MotionGroup::Moving, MotionGroup::Parked]
                .map(|m| series(quantity, exact, m))
                .into();
            if lines.series.iter().all(|s| s.points.is_empty()) {
                continue;
            }
            lines.guides.push(Guide::Diagonal("as claimed".into()));
            let title = format!("{}; truth: {}", quantity.label(), truth(exact));
            parts.push((title, Plot::Lines(lines)));
        }
    }
    let caption = "Reliability of the covariances of labelled columns: below the diagonal they are \
        overconfident, above it too cautious.";
    Chart::small_multiples("figure-reliability", caption, parts)
}
