//! Tables and figures of `eval flsf`.

use super::network::D_MAX;
use super::outcome::{Compared, Outcome, PICTURED};
use super::tally::{ErrorSums, METHODS, Tally};
use crate::curve::Curve;
use crate::learning::pair_loss;
use crate::report::{
    Axis, Cell, Chart, Lines, Picture, Plot, Report, Results, Series, Table, TableRow,
};
use raywake_io::Error;
use std::path::Path;

/// Table 4.2 as published: mean error in cm and share within 30 cm in per cent, for occupancy
/// constancy and for features.
const PUBLISHED: [(&str, [f64; 4]); 4] = [
    ("car", [19.3, 83.8, 15.6, 89.2]),
    ("cyclist", [24.5, 78.8, 15.9, 93.1]),
    ("pedestrian", [38.9, 74.3, 22.9, 89.0]),
    ("all dynamic", [22.1, 81.4, 16.4, 88.2]),
];

/// Names of the metrics of figure 4.8.
const METRICS: [&str; 3] = [
    "occupancy constancy of the column",
    "occupancy constancy with its window",
    "learned features",
];

/// Writes the report.
pub fn conclude(outcome: &Outcome, facts: &[(&str, String)], out: &Path) -> Result<Results, Error> {
    let mut report = Report::new("Learned features", "Chapter 4 as printed, by one protocol");
    for (name, value) in facts {
        report.fact(name, value);
    }
    report.fact("Pairs of sweeps", &outcome.pairs.to_string());
    let [filled, valid] = &outcome.tallies;
    let all = filled.of(|_, _| true);
    let change = 100.0 * (all[4].mean_cm() / all[3].mean_cm() - 1.0);
    report.headline(&format!("{change:.0} %"), "mean error", "features relative to constancy");
    report.section("Table 4.2").table(table(
        "table-4-2",
        "Table 4.2: raw flow of labelled cells, those a method leaves without flow taken as static",
        filled,
    ));
    report.section("Table 4.2 where a method has flow").table(table(
        "table-4-2-valid",
        "The same where a method has flow, as the author's program counts: each method on its own \
            cells",
        valid,
    ));
    let curves = curves(&outcome.compared);
    report.section("Figure 4.8").table(precision(&curves)).chart(figure_4_8(&curves));
    for (kind, id) in PICTURED.iter().zip(["figure-4-6", "figure-4-7"]) {
        if let Some(distances) = outcome.distances.get(kind) {
            let kind = format!("{kind:?}").to_lowercase();
            let caption = format!(
                "Three moving cells ({kind}), in the pair with most of them: distance of their \
                 features from those around them one sweep later. Dots are cells with a return, a \
                 white frame is where the cell went; forward is up, 9.3 m across."
            );
            let title =
                format!("Figure 4.{}: distances, {kind}", id.trim_start_matches("figure-4-"));
            let picture = Picture { id: id.into(), caption, png: distances.png()? };
            report.section(&title).picture(picture);
        }
    }
    report.section("Figure 4.5").chart(figure_4_5());
    report.section("Time").table(times(outcome));
    report.write(out)
}

fn cells(sums: [ErrorSums; METHODS.len()]) -> Vec<Cell> {
    let references = sums[..3].iter().map(|s| Cell::Number(s.mean_cm(), 1));
    let methods = sums[3..]
        .iter()
        .flat_map(|s| [s.count.into(), Cell::Number(s.mean_cm(), 1), Cell::Number(s.within(), 1)]);
    [Cell::from(sums[0].count)].into_iter().chain(references).chain(methods).collect()
}

fn table(id: &str, caption: &str, tally: &Tally) -> Table {
    let row = |name: &str, sums| TableRow::new([Cell::from(name)].into_iter().chain(cells(sums)));
    let mut rows: Vec<TableRow> = tally
        .kinds()
        .into_iter()
        .map(|kind| row(&format!("{kind:?}").to_lowercase(), tally.of(|k, _| k == kind)))
        .collect();
    rows.push(row("all", tally.of(|_, _| true)));
    rows.push(row("all moving", tally.of(|_, moves| moves)));
    rows.push(row("all parked", tally.of(|_, moves| !moves)));
    for (name, [constancy, right, features, features_right]) in PUBLISHED {
        let number = |v| Cell::Number(v, 1);
        let empty = || Cell::Empty;
        rows.push(TableRow::reference([
            format!("published: {name}").into(),
            empty(),
            empty(),
            empty(),
            empty(),
            empty(),
            number(constancy),
            number(right),
            empty(),
            number(features),
            number(features_right),
        ]));
    }
    let columns = [
        "class",
        "cells",
        "zero flow, cm",
        "ego motion only, cm",
        "rounded truth, cm",
        "constancy: cells",
        "mean, cm",
        "within 30 cm, %",
        "features: cells",
        "mean, cm",
        "within 30 cm, %",
    ];
    Table::new(id, caption, &columns, rows).note(
        "Cells with a return in a labelled box; flow in whole cells of 0.30 m. Published: other \
         drives, the two methods by different protocols.",
    )
}

fn curves(compared: &[Compared]) -> Vec<Option<Curve>> {
    let of = |n: usize| Curve::of(compared.iter().map(|c| (-c.costs[n], c.matching, 1.0)));
    (0..METRICS.len()).map(of).collect()
}

/// The precision averaged over recall.
fn average_precision(curve: &Curve) -> f64 {
    let mut before = 0.0;
    let mut sum = 0.0;
    for point in curve.points() {
        sum += point.precision * (point.recall - before);
        before = point.recall;
    }
    sum
}

fn precision(curves: &[Option<Curve>]) -> Table {
    let rows = METRICS.iter().zip(curves).map(|(name, curve)| {
        let of = |f: &dyn Fn(&Curve) -> f64| curve.as_ref().map_or(f64::NAN, f);
        TableRow::new([
            Cell::from(*name),
            Cell::Number(of(&average_precision), 3),
            Cell::Number(of(&Curve::auc), 3),
            Cell::Number(of(&|c| c.at_recall(0.9).precision), 3),
        ])
    });
    let columns = ["metric", "average precision", "AUC", "precision at recall 0.9"];
    let caption = "Whether two labelled cells match, over pairs of which half match";
    Table::new("match", caption, &columns, rows.collect())
}

fn figure_4_8(curves: &[Option<Curve>]) -> Chart {
    let mut plot =
        Lines::new(Axis::new("recall").range(0.0, 1.0), Axis::new("precision").range(0.4, 1.02));
    for (name, curve) in METRICS.iter().zip(curves) {
        let points = curve.iter().flat_map(Curve::points).map(|p| [p.recall, p.precision]);
        plot.series.push(Series::line(name, points.collect()));
    }
    Chart::new(
        "figure-4-8",
        "Figure 4.8: matching cells distinguished from others",
        Plot::Lines(plot),
    )
}

fn figure_4_5() -> Chart {
    let mut plot = Lines::new(Axis::new("distance of the encodings"), Axis::new("loss"));
    for (name, matching) in [("matching", true), ("not matching", false)] {
        let at = |n: u8| 0.15 * f32::from(n);
        let loss = |d: f32| pair_loss(&[0.0], &[d], matching, D_MAX).0;
        let points = (0..=100).map(|n| [at(n), loss(at(n))].map(f64::from)).collect();
        plot.series.push(Series::line(name, points));
    }
    Chart::new("figure-4-5", "Figure 4.5: the loss of a pair (4.6)", Plot::Lines(plot))
}

fn times(outcome: &Outcome) -> Table {
    let seconds = outcome.seconds;
    let mean = |s: f64| Cell::Number(1000.0 * s / outcome.pairs as f64, 0);
    let rows = [
        ("network, per sweep, two threads", seconds.encoder),
        ("distances and energy minimisation", seconds.features),
        ("occupancy constancy and energy minimisation", seconds.constancy),
    ];
    let rows = rows.map(|(name, s)| TableRow::new([Cell::from(name), mean(s)]));
    Table::new(
        "time-flsf",
        "Mean time of a pair, without ray tracing",
        &["part", "ms"],
        rows.to_vec(),
    )
    .note("The dissertation: 188 ms on a GTX 1080 with features, below 100 ms without.")
}
