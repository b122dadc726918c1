//! A report with every kind of element, with synthetic numbers.

use crate::labels::Kind;
use crate::report::*;
use raywake_core::pose::Pose;
use raywake_sim::Rng;

/// Errors of about 10 cm: most small, some far off.
fn errors(seed: u64, n: usize, typical: f64) -> Vec<f64> {
    let mut rng = Rng::new(seed);
    let mut uniform = move || 1.0 - rng.unit();
    let mut one = || {
        let far = if uniform() < 0.04 { 12.0 } else { 1.0 };
        far * typical * (-2.0 * uniform().ln()).sqrt()
    };
    (0..n).map(|_| one()).collect()
}

pub fn precision_recall() -> Chart {
    let curve = |bend: f64| -> Vec<[f64; 2]> {
        (0..=200).map(|i| f64::from(i) / 200.0).map(|r| [r, 1.0 - 0.7 * r.powf(bend)]).collect()
    };
    let mut lines =
        Lines::new(Axis::new("recall").range(0.0, 1.0), Axis::new("precision").range(0.0, 1.0));
    let mark = |recall: f64, label: &str| Mark {
        at: [recall, 1.0 - 0.7 * recall.powf(7.0)],
        label: label.into(),
    };
    lines.series.push(Series {
        marks: vec![mark(0.95, "95 % of the foreground"), mark(0.80, "80 %")],
        ..Series::line("trained filter", curve(7.0))
    });
    lines.series.push(Series::line("height alone", curve(2.0)));
    lines.series.push(Series::line("dissertation, read off", curve(5.0)));
    let caption = "Precision and recall of the background filter, foreground being the positive \
                   class; the dots are decision thresholds. n = 12,345 solid columns of 2 drives.";
    Chart::new("precision-recall", caption, Plot::Lines(lines))
}

pub fn histograms() -> Chart {
    let classes =
        [("Car", 9000, 0.10), ("Cyclist", 900, 0.14), ("Pedestrian", 400, 0.2), ("Tram", 0, 1.0)];
    let part = |(name, n, typical): (&str, usize, f64)| {
        let (mut counts, mut overflow) = (vec![0; 30], 0);
        for error in errors(7, n, typical) {
            *counts.get_mut((error / 0.05) as usize).unwrap_or(&mut overflow) += 1;
        }
        let line = Some((0.3, "cell, 0.30 m".into()));
        let (x, y) = ("error, m".into(), "columns".into());
        (name.to_string(), Plot::Histogram(Histogram { x, y, width: 0.05, counts, overflow, line }))
    };
    let parts = classes.into_iter().map(part).collect();
    let caption = "Error of the raw scene flow by class: distance between estimated and labelled \
                   displacement over 0.1 s. Note the different vertical scales.";
    Chart::small_multiples("raw-error", caption, parts)
}

pub fn cdfs() -> Chart {
    let part = |name: &str, typical: f64| {
        let mut lines = Lines::new(
            Axis::new("error, m/s").range(0.0, 5.0),
            Axis::new("share, %").range(0.0, 100.0),
        );
        for age in [1, 2, 4, 8, 10] {
            let mut values = errors(age, 3000, typical * 3.0 / (age as f64).sqrt());
            values.sort_by(f64::total_cmp);
            let points = (0..).zip(&values).map(|(n, v)| [*v, f64::from(n) / 30.0]).collect();
            lines.series.push(Series::line(&format!("age {age}"), points));
        }
        lines.ordered = true;
        (name.to_string(), Plot::Lines(lines))
    };
    let parts = vec![
        part("Car", 0.6),
        part("Cyclist", 0.9),
        part("Pedestrian", 0.5),
        part("All labelled", 0.6),
    ];
    let caption = "Error of the temporal scene flow by age of the tracklet in sweeps, cumulative.";
    Chart::small_multiples("temporal-error", caption, parts)
}

pub fn bars() -> Chart {
    let categories = [
        "percent of cars within 30 cm",
        "percent of cyclists within 30 cm",
        "percent of pedestrians within 30 cm",
    ];
    let bars = Bars {
        x: Axis::new("share of columns, %"),
        categories: categories.map(String::from).to_vec(),
        series: vec![
            BarSeries {
                name: "this run".into(),
                reference: false,
                bars: vec![
                    Some(Bar { value: 84.25, spread: Some([82.0, 86.0]) }),
                    Some(Bar { value: 77.0, spread: Some([70.0, 85.0]) }),
                    Some(f64::NAN.into()),
                ],
            },
            BarSeries {
                name: "dissertation, Table 3.1".into(),
                reference: true,
                bars: vec![Some(83.8.into()), Some(78.8.into()), Some(74.3.into())],
            },
        ],
    };
    let caption = "Columns with an error below the size of a cell; lines are 95 % intervals.";
    Chart::new("within-a-cell", caption, Plot::Bars(bars))
}

pub fn stages() -> Chart {
    let bars = Bars {
        x: Axis::new("time, ms (median; line to p99)"),
        categories: ["trace", "merge", "columns", "filter", "constancy", "flow"]
            .map(String::from)
            .to_vec(),
        series: vec![BarSeries {
            name: "scalar".into(),
            reference: false,
            bars: [4.1, 0.8, 0.35, 1.2, 9.6, 3.0]
                .map(|v| Some(Bar { value: v, spread: Some([v, 1.35 * v]) }))
                .to_vec(),
        }],
    };
    Chart::new("stages", "Time of each stage, n = 154 sweeps, one core.", Plot::Bars(bars))
}

fn scatter() -> Chart {
    let noise = errors(3, 300, 0.8);
    let points = (0..300).map(|i| {
        let returns = 60_000.0 + 250.0 * f64::from(i);
        [returns, 5.0 + returns * 1e-4 + noise[i as usize]]
    });
    let mut lines = Lines::new(Axis::new("returns in the sweep"), Axis::new("time, ms"));
    lines.series.push(Series { style: Style::Dots, ..Series::line("sweeps", points.collect()) });
    lines.series.push(Series::line("least squares", vec![[60e3, 12.0], [135e3, 19.4]]));
    lines.guides.push(Guide::Y(25.0, "budget".into()));
    Chart::new("time-by-returns", "Time against returns, n = 300.", Plot::Lines(lines))
}

fn reliability() -> Chart {
    let points = (1..10).map(|i| f64::from(i) / 10.0).map(|p| [p, p.powf(1.3)]).collect();
    let mut lines = Lines::new(
        Axis::new("predicted probability").range(0.0, 1.0),
        Axis::new("observed share").range(0.0, 1.0),
    );
    lines.series.push(Series::line("filter", points));
    lines.guides.push(Guide::Diagonal("calibrated".into()));
    Chart::new("reliability", "Reliability of the filter's probabilities.", Plot::Lines(lines))
}

pub fn nothing() -> Chart {
    let lines = Lines::new(Axis::new("x"), Axis::new("y"));
    let (x, y, counts) = ("x".into(), "y".into(), vec![0; 10]);
    let h = Histogram { x, y, width: 0.1, counts, overflow: 0, line: None };
    let bars = Bars { x: Axis::new("x"), categories: vec![], series: vec![] };
    let mut nan = lines.clone();
    nan.series.push(Series::line("n", vec![[f64::NAN, 1.0], [1.0, f64::INFINITY]]));
    let parts = [Plot::Lines(lines), Plot::Lines(nan), Plot::Histogram(h), Plot::Bars(bars)];
    let parts = parts.into_iter().map(|p| ("Nothing".to_string(), p)).collect();
    Chart::small_multiples("nothing", "What was not measured.", parts)
}

pub fn table() -> Table {
    let columns = ["class", "columns", "median, cm", "mean, cm", "within 30 cm, %"];
    let number = |v| Cell::Number(v, 1);
    Table {
        id: "raw-flow".into(),
        caption: "Error of the raw scene flow.".into(),
        columns: columns.map(String::from).to_vec(),
        rows: vec![
            TableRow::new([
                "Car".into(),
                12_345u64.into(),
                number(10.1234),
                number(19.5),
                number(84.25),
            ]),
            TableRow::reference([
                "Car, dissertation".into(),
                873_947u64.into(),
                number(10.2),
                number(19.3),
                number(83.8),
            ]),
            TableRow::new([
                "<b>\"Tram\" & co</b>".into(),
                0u64.into(),
                number(f64::NAN),
                Cell::Empty,
                Cell::Empty,
            ]),
        ],
        notes: vec!["Intervals by bootstrap over tracks: `n = 1000`.".into()],
    }
}

/// A street of synthetic returns with one labelled car.
pub fn panel(title: &str, vector: [f64; 2]) -> Panel {
    let ring = |r: i32| {
        (0..720).map(move |i| {
            let a = (f64::from(i) * 0.5).to_radians();
            let r = 3.0 + 1.6 * f64::from(r);
            [(r * a.cos()) as f32, (r * a.sin()) as f32, -1.7]
        })
    };
    let wall = (0..4000).map(|i| [-20.0 + 0.01 * i as f32, 7.0, -1.7 + 0.003 * (i % 1000) as f32]);
    let side = |i: usize| [10.0 + 0.3 * (i % 14) as f64, 2.2 + 0.3 * (i / 14) as f64];
    let column = |i: usize| Column {
        at: side(i),
        error: Some(0.02 * i as f64),
        truth: Some([1.4, 0.1]),
        estimate: Some([vector[0] + 0.01 * i as f64, vector[1]]),
    };
    Panel {
        title: title.into(),
        points: (0..12).flat_map(ring).chain(wall).chain([[f32::NAN, 0.0, 0.0]]).collect(),
        outlines: vec![
            Outline {
                pose: Pose::planar(12.0, 3.0, -0.9, 0.05),
                size: [4.4, 1.9],
                kind: Kind::Car,
            },
            Outline {
                pose: Pose::planar(-8.0, -4.0, -0.9, 1.2),
                size: [0.8, 0.7],
                kind: Kind::Pedestrian,
            },
        ],
        columns: (0..84).map(column).collect(),
    }
}

pub fn look() -> Look {
    Look {
        half_extent_m: 25.0,
        cell_m: 0.3,
        error: "error, m".into(),
        worst: 1.0,
        arrows: "way in 0.1 s".into(),
    }
}

/// The whole report.
pub fn report() -> Report {
    let mut report = Report::new("Scene flow <on> two drives", "Chapter 3 & appendix B, evaluated");
    report
        .headline("84.3 %", "of the columns of cars within 30 cm", "dissertation 83.8 %")
        .headline("0.49 m/s", "median error of tracklets of ten sweeps", "dissertation 0.50 m/s")
        .headline("20.3 ms", "a sweep, one core, median", "dissertation 85.7 ms on a GTX 1080")
        .fact("Drives", "2011_09_26 drive 0005 (154 sweeps), drive 0011 (233 sweeps)")
        .fact("Profile", "`hdl64`: 167 x 167 x 14 voxels of 0.30 m")
        .fact("Digest", "`3f9c0a4be71d22aa`");
    report
        .section("Background filter")
        .text(
            "How well the filter tells foreground from background.\n\nThe threshold is the \
            shipped one.",
        )
        .chart(precision_recall())
        .chart(reliability());
    report.section("Raw scene flow").table(table()).chart(histograms()).chart(bars());
    report.section("Temporal scene flow").chart(cdfs());
    let panels = [panel("Relative to the vehicle", [0.2, 0.1]), panel("Over ground", [1.4, 0.1])];
    let png = birds_eye(&panels, &look()).unwrap();
    let caption = "Flow of one sweep, in the vehicle's frame and over ground.".into();
    report.section("Motion compensation").picture(Picture { id: "ego-world".into(), caption, png });
    report.section("Time").chart(stages()).chart(scatter());
    report.section("Nothing").text("").chart(nothing()).table(Table {
        id: "none".into(),
        rows: vec![],
        ..table()
    });
    report
}
