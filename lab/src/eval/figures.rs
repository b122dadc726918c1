//! Figures 3.6 to 3.9 and B.4 of an evaluation.

use super::facts::Facts;
use super::groups::{ClassGroup, Estimate, MotionGroup, Truth};
use super::statistics::{Sorted, Weight};
use super::tables::{GRID, RECALL, Rejection, stages};
use super::tally::{SETTLED, Tally};
use crate::curve::{Curve, OperatingPoint};
use crate::report::{
    Axis, Bar, BarSeries, Bars, Chart, Guide, Histogram, Lines, Mark, Plot, Series, Style,
};
use raywake::order_statistics::Spread;
use raywake::statistics::BUDGET_MS;

/// Bins of the histograms: 5 cm, up to 1.5 m.
const BIN_M: f64 = 0.05;
const BINS: usize = 30;
/// Ends of the axes of distributions.
const CDF_M: f64 = 1.0;
const CDF_MPS: f64 = 3.0;
/// Points of a curve.
const POINTS: usize = 200;

/// Classes with a figure of their own in the dissertation, and all others present.
fn groups(tally: &Tally) -> Vec<ClassGroup> {
    let some = |g: &ClassGroup| tally.coverage(*g, MotionGroup::Any)[0] > 0;
    ClassGroup::labelled().chain([ClassGroup::Class(0)]).filter(some).collect()
}

/// Name of a part of a figure.
fn title(group: ClassGroup, motion: MotionGroup) -> String {
    match motion {
        MotionGroup::Any => group.label().to_string(),
        _ => format!("{}, {}", group.label(), motion.label()),
    }
}

/// Figure 3.6: precision over recall of the background filter, and of the encoder.
pub fn precision_recall(curves: &Rejection) -> Chart {
    let mark =
        |p: OperatingPoint, label: &str| Mark { at: [p.recall, p.precision], label: label.into() };
    let series = |name: &str, curve: &Curve, own: f64| {
        let all: Vec<_> = curve.points().collect();
        let thin = all.len().div_ceil(4 * POINTS).max(1);
        Series {
            name: name.into(),
            points: all.iter().step_by(thin).map(|p| [p.recall, p.precision]).collect(),
            style: Style::Line,
            marks: vec![mark(curve.above(own), "shipped"), mark(curve.at_recall(RECALL), "95 %")],
        }
    };
    let mut lines = Lines::new(
        Axis::new("recall of labelled columns").range(0.0, 1.0),
        Axis::new("precision").range(0.0, 1.0),
    );
    let filter = curves.filter.iter().map(|c| series("background filter", c, 0.0));
    let encoder = curves.encoder.iter().map(|c| series("encoder", c, curves.could_move_min));
    lines.series.extend(filter.chain(encoder));
    let caption = "As figure 3.6 of the dissertation: precision and recall of the background \
        filter over solid columns in view, for every threshold; foreground is the positive class. \
        The encoder is judged by its score of what could move.";
    Chart::new("figure-3-6", caption, Plot::Lines(lines))
}

fn histogram(errors: &Sorted, cell_m: f64) -> Plot {
    let mut counts = errors.histogram(BIN_M, BINS + 1);
    let overflow = counts.pop().unwrap_or(0);
    let histogram = Histogram {
        x: "error, m".into(),
        y: "columns".into(),
        width: BIN_M,
        counts,
        overflow,
        line: Some((cell_m, "cell".into())),
    };
    Plot::Histogram(histogram)
}

/// Figures 3.7 and 3.8: errors of the raw flow by class, and of all, moving and parked columns.
pub fn histograms(tally: &Tally, cell_m: f64) -> [Chart; 2] {
    let of = |group, motion| {
        histogram(&tally.flow(Estimate::Ours, Truth::Raw, group, motion, Weight::Column), cell_m)
    };
    let by_class = groups(tally)
        .into_iter()
        .filter(|g| *g != ClassGroup::Labelled)
        .flat_map(|g| MotionGroup::of(g).iter().map(move |m| (g, *m)))
        .filter(|(g, m)| tally.coverage(*g, *m)[0] > 0)
        .map(|(g, m)| (title(g, m), of(g, m)));
    let motions = [MotionGroup::Any, MotionGroup::Moving, MotionGroup::Parked];
    let by_motion = motions.map(|m| (title(ClassGroup::Labelled, m), of(ClassGroup::Labelled, m)));
    [
        Chart::small_multiples(
            "figure-3-7",
            "As figure 3.7 of the dissertation: errors of the raw flow by class, moving and parked \
             separately; the dashed line is the size of a cell.",
            by_class.collect(),
        ),
        Chart::small_multiples(
            "figure-3-8",
            "As figure 3.8 of the dissertation: errors of the raw flow of all labelled columns, \
            then of moving and of parked ones.",
            by_motion.into(),
        ),
    ]
}

fn cdf(name: &str, errors: &Sorted, limit: f64, style: Style) -> Series {
    let name = format!("{name}, n = {}", errors.count());
    Series { name, points: errors.cdf(limit, POINTS), style, marks: Vec::new() }
}

/// Raw flow of moving and of parked columns beside estimates that need no LIDAR.
pub fn references(tally: &Tally) -> Chart {
    let part = |motion: MotionGroup| {
        let mut lines = Lines::new(
            Axis::new("error, m").range(0.0, CDF_M),
            Axis::new("share of columns").range(0.0, 1.0),
        );
        lines.series = Estimate::ALL
            .iter()
            .map(|e| {
                let errors =
                    tally.flow(*e, Truth::Raw, ClassGroup::Labelled, motion, Weight::Column);
                Series { name: e.label().into(), ..cdf("", &errors, CDF_M, Style::Line) }
            })
            .collect();
        (motion.label().to_string(), Plot::Lines(lines))
    };
    let caption = "Raw flow of all labelled columns beside estimates that need no LIDAR.";
    let parts = [MotionGroup::Moving, MotionGroup::Parked].map(part);
    Chart::small_multiples("figure-references", caption, parts.into())
}

/// Figure 3.9: errors of tracklets by age and class: moving ones, and all parked ones.
pub fn tracklets(tally: &Tally) -> Chart {
    let part = |(group, motion): (ClassGroup, MotionGroup)| {
        let mut lines = Lines::new(
            Axis::new("error, m/s").range(0.0, CDF_MPS),
            Axis::new("share of columns").range(0.0, 1.0),
        );
        lines.ordered = true;
        let series = |name: String, errors: &Sorted| Series {
            name,
            ..cdf("", errors, CDF_MPS, Style::Line)
        };
        let ages = Tally::AGES.iter().enumerate();
        lines.series = ages
            .map(|(n, a)| series(format!("age {a}"), &tally.at_age(n, group, motion)))
            .collect();
        let settled = tally.settled(group, motion, Weight::Column);
        lines.series.push(series(format!("{SETTLED} or more"), &settled));
        (title(group, motion), Plot::Lines(lines))
    };
    let moving = groups(tally).into_iter().map(|g| (g, MotionGroup::Moving));
    let parts = moving.chain([(ClassGroup::Labelled, MotionGroup::Parked)]);
    let parts = parts.filter(|(g, m)| *g != ClassGroup::Class(0) && tally.coverage(*g, *m)[0] > 0);
    let caption = "As figure 3.9 of the dissertation: errors of the velocity of tracklets after \
        exactly this many observations, or at least this many. Age 0 includes flow whose tracklet \
        the gate ended.";
    Chart::small_multiples("figure-3-9", caption, parts.map(part).collect())
}

/// Settled tracklets, moving and parked separately.
pub fn settled(tally: &Tally) -> Chart {
    let mut lines = Lines::new(
        Axis::new("error, m/s").range(0.0, CDF_MPS),
        Axis::new("share of columns").range(0.0, 1.0),
    );
    for motion in [MotionGroup::Moving, MotionGroup::Parked] {
        let errors = tally.settled(ClassGroup::Labelled, motion, Weight::Column);
        lines.series.push(cdf(motion.label(), &errors, CDF_MPS, Style::Line));
    }
    lines.guides.push(Guide::Y(0.5, "median".into()));
    let caption = "Errors of the velocity of tracklets of age 10 or more, all labelled columns.";
    Chart::new("figure-settled", caption, Plot::Lines(lines))
}

/// Table 3.3 as bars: median and 99 % quantile of every stage.
pub fn times(drives: &[Facts]) -> Chart {
    let stages = stages(drives);
    let bar = |ms: &[f64]| {
        Spread::of(ms).map(|s| Bar { value: s.median, spread: Some([s.median, s.p99]) })
    };
    let series = BarSeries {
        name: "median, with a line to the 99 % quantile".into(),
        reference: false,
        bars: stages.iter().map(|s| bar(&s.1)).collect(),
    };
    let categories = stages.iter().map(|s| s.0.clone()).collect();
    let bars = Bars { x: Axis::new("ms"), categories, series: vec![series] };
    let caption =
        "Time of every stage per pair of sweeps: median, and a line to the 99 % quantile.";
    Chart::new("figure-stages", caption, Plot::Bars(bars))
}

/// Section B.4: time of the occupancy grid, and of a whole pair, against the number of returns.
pub fn time_by_points(drives: &[Facts]) -> Chart {
    let series = |name: &str, ms: &dyn Fn(&Facts) -> Vec<f64>| {
        let points = drives.iter().flat_map(|d| d.points.iter().zip(ms(d)));
        Series {
            name: name.into(),
            points: points.map(|(n, ms)| [*n as f64, ms]).collect(),
            style: Style::Dots,
            marks: Vec::new(),
        }
    };
    let mut lines = Lines::new(Axis::new("returns in the sweep"), Axis::new("time, ms"));
    lines.series.push(series(GRID.name, &|d| GRID.of(d)));
    lines.series.push(series("whole pair of sweeps", &|d| d.totals.clone()));
    let slowest = drives.iter().flat_map(|d| &d.totals).fold(0.0, |a, b| f64::max(a, *b));
    if slowest > 0.5 * BUDGET_MS {
        lines.guides.push(Guide::Y(BUDGET_MS, "time between sweeps".into()));
    }
    let caption = "As section B.4 of the dissertation: time of the occupancy grid against the \
        number of returns, beside the time of a whole pair of sweeps.";
    Chart::new("figure-b-4", caption, Plot::Lines(lines))
}
