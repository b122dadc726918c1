//! Tables of single returns: the metrics of Argoverse 2 and KITTI.

use super::facts::Facts;
use super::points::{ESTIMATES, PointScores};
use crate::metrics::{Category, Class, PointMotion, Range};
use crate::report::{Cell, Table, TableRow};

/// Sums of the scores of all drives, in the order of [`ESTIMATES`].
pub fn scores(drives: &[Facts]) -> [PointScores; 3] {
    let mut sums: [PointScores; 3] = Default::default();
    for (sum, n) in sums.iter_mut().zip(0..) {
        drives.iter().for_each(|d| sum.merge(&d.scores[n]));
    }
    sums
}

fn estimate_row(n: usize, cells: impl IntoIterator<Item = Cell>) -> TableRow {
    let cells = [Cell::from(ESTIMATES[n])].into_iter().chain(cells);
    if n == 0 { TableRow::new(cells) } else { TableRow::reference(cells) }
}

/// Bucket-normalised and three-way error of single returns (Argoverse 2).
pub fn argoverse(scores: &[PointScores; 3]) -> [Table; 2] {
    let normalised = |s: &PointScores| {
        let errors = s.bucketed.errors(Range::Near);
        let classes = errors.classes.iter().skip(1).map(|c| c.dynamic);
        let all: Vec<f64> = [errors.mean_dynamic].into_iter().chain(classes).collect();
        all.into_iter().map(|v| Cell::Number(v, 3))
    };
    let names = Class::ALL.iter().skip(1).map(|c| c.name());
    let columns: Vec<&str> = ["Estimate", "Mean"].into_iter().chain(names).collect();
    let rows = scores.iter().enumerate().map(|(n, s)| estimate_row(n, normalised(s))).collect();
    let caption = "Bucket-normalised error of moving returns within 35 m, the ranking of Argoverse \
        2: an estimate of no motion scores 1.";
    let bucketed = Table::new("bucketed", caption, &columns, rows);
    let three = |s: &PointScores| {
        let e = s.three_way.errors(Range::Near);
        let parts = [e.foreground_dynamic, e.foreground_static, e.background_static];
        let mean = parts.iter().map(|p| p.epe_m).sum::<f64>() / 3.0;
        let count = Cell::Count(e.foreground_dynamic.count);
        let all = [mean, parts[0].epe_m, parts[1].epe_m, parts[2].epe_m];
        [count].into_iter().chain(all.map(|v| Cell::Number(v, 4)))
    };
    let columns = [
        "Estimate",
        "Moving returns",
        "Mean, m",
        "Foreground moving, m",
        "Foreground static, m",
        "Background static, m",
    ];
    let rows = scores.iter().enumerate().map(|(n, s)| estimate_row(n, three(s))).collect();
    let caption = "Three-way error of returns within 35 m (Argoverse 2, 2023).";
    [bucketed, Table::new("three-way", caption, &columns, rows)]
}

/// EPE3D, accuracies and outliers of single returns (KITTI).
pub fn accuracy(scores: &[PointScores; 3]) -> Table {
    let mut rows = Vec::new();
    for (name, motion) in [("moving", PointMotion::Moving), ("static", PointMotion::Standing)] {
        for (n, s) in scores.iter().enumerate() {
            let foreground =
                |c: Category| c.class().is_some_and(|class| class != Class::Background);
            let a = s.accuracy.accuracy(foreground, motion);
            let cells = [
                Cell::from(name),
                Cell::Count(a.count),
                Cell::Number(a.epe_m, 4),
                Cell::Number(100.0 * a.strict, 1),
                Cell::Number(100.0 * a.relaxed, 1),
                Cell::Number(100.0 * a.outliers, 1),
            ];
            rows.push(estimate_row(n, cells));
        }
    }
    let columns =
        ["Estimate", "Objects", "Returns", "EPE3D, m", "AccS, %", "AccR, %", "Outliers, %"];
    let caption = "KITTI scene flow metrics for the returns of labelled objects, with the \
        vehicle's motion removed. For static ones every error counts as an outlier.";
    Table::new("accuracy", caption, &columns, rows)
}
