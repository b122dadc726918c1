//! Tables 3.2 and 3.3 and related ones.

use super::facts::Facts;
use super::groups::{ClassGroup, MotionGroup};
use super::statistics::Weight;
use super::tally::Tally;
use crate::curve::{Curve, OperatingPoint};
use crate::report::{Cell, Table, TableRow};
use raywake::order_statistics::Spread;
use raywake::statistics::BUDGET_MS;

/// The dissertation's share of the foreground kept by the filter (section 3.4.2).
pub const RECALL: f64 = 0.95;

/// Columns of table 3.2.
const TRACKLETS: [&str; 10] = [
    "Class",
    "Motion",
    "Count",
    "Median, m/s",
    "Mean, m/s",
    "Coverage, %",
    "Raw labels: median, m/s",
    "Raw labels: mean, m/s",
    "Raw labels' floor: median, m/s",
    "Floor: mean, m/s",
];

/// Table 3.2: settled tracklets.
pub fn tracklets(tally: &Tally) -> Table {
    let mut rows = Vec::new();
    for group in ClassGroup::labelled() {
        for motion in MotionGroup::ALL {
            let [all, covered] = tally.coverage(group, motion);
            if all == 0 {
                continue;
            }
            let errors = tally.settled(group, motion, Weight::Column);
            let [raw, floor] = tally.settled_raw(group, motion);
            let cells = [
                Cell::Count(errors.count()),
                Cell::Number(errors.quantile(0.5), 2),
                Cell::Number(errors.mean(), 2),
                Cell::Number(100.0 * covered as f64 / all as f64, 1),
                Cell::Number(raw.quantile(0.5), 2),
                Cell::Number(raw.mean(), 2),
                Cell::Number(floor.quantile(0.5), 2),
                Cell::Number(floor.mean(), 2),
            ];
            let head = [group.label(), motion.label()].map(Cell::from);
            rows.push(TableRow::new(head.into_iter().chain(cells)));
        }
        rows.extend(published_tracklets(group));
    }
    let caption = "As table 3.2 of the dissertation: error of the velocity of tracklets of age 10 \
        or more. Truth: smoothed labels, parked objects at rest; and separately the labels as \
        given, whose distance from the smoothed ones is their floor; a simulator's labels are \
        exact. Coverage: share of all columns that have such a tracklet.";
    Table::new("table-3-2", caption, &TRACKLETS, rows)
}

fn published_tracklets(group: ClassGroup) -> Option<TableRow> {
    let (count, median, mean) = match group.label() {
        "Car" => (216_026, 0.49, 0.65),
        "Cyclist" => (1_507, 1.01, 1.09),
        "Pedestrian" => (537, 0.86, 0.93),
        "All labelled" => {
            let numbers = [(0.50, 2), (0.66, 2), (100.0 * 266_237.0 / 1_126_264.0, 1)];
            return Some(published(group, 266_237, &numbers));
        }
        _ => return None,
    };
    Some(published(group, count, &[(median, 2), (mean, 2)]))
}

/// Figures of the dissertation: a count, then numbers with as many decimals as printed.
fn published(group: ClassGroup, count: u64, numbers: &[(f64, usize)]) -> TableRow {
    let head = [group.label(), "dissertation"].map(Cell::from).into_iter();
    let numbers = numbers.iter().map(|&(v, digits)| Cell::Number(v, digits));
    let cells = head.chain([Cell::Count(count)]).chain(numbers);
    let rest = std::iter::repeat(Cell::Empty);
    TableRow::reference(cells.chain(rest).take(TRACKLETS.len()))
}

/// How well the background is rejected at every threshold; `None` without a filter or encoder, or
/// if nothing is labelled, or everything is.
pub struct Rejection {
    pub filter: Option<Curve>,
    pub encoder: Option<Curve>,
    /// The encoder's threshold, nat.
    pub could_move_min: f64,
}

fn printed_rejection() -> TableRow {
    let [recall, rejected] = [95.0, 74.5].map(|n| Cell::Number(n, 1));
    TableRow::reference([
        "dissertation".into(),
        "at 95 % recall".into(),
        recall,
        rejected,
        Cell::Empty,
    ])
}

/// The background filter and the encoder, each at its own threshold and at the dissertation's
/// recall.
pub fn rejection(curves: &Rejection) -> Table {
    let row = |name: &str, at: &str, p: OperatingPoint| {
        let values = [p.recall, p.background_accuracy, p.precision];
        let names = [name, at].map(Cell::from);
        TableRow::new(names.into_iter().chain(values.map(|v| Cell::Number(100.0 * v, 1))))
    };
    let rows = |name, curve: &Option<Curve>, own: &str, threshold: f64| {
        let points = curve.as_ref().map(|c| {
            let at_recall = row(name, "at 95 % recall", c.at_recall(RECALL));
            [row(name, own, c.above(threshold)), at_recall]
        });
        points.into_iter().flatten()
    };
    let filter = rows("background filter", &curves.filter, "threshold of the weights", 0.0);
    let encoder = rows("encoder", &curves.encoder, "`could_move_min`", curves.could_move_min);
    let rows = filter.chain(encoder).chain([printed_rejection()]).collect();
    let columns = ["By", "Threshold", "Recall, %", "Background accuracy, %", "Precision, %"];
    let caption = "Rejection of the background over solid columns in view. Foreground is whatever \
        lies in a labelled box, moving or not; background accuracy is the share of the other \
        columns that are rejected. The encoder is judged by its score of what could move.";
    Table::new("rejection", caption, &columns, rows)
}

/// Name, among the stages, of the total time.
const TOTAL: &str = "total";
/// Name, among the stages, of the total time without the filter.
const ALL_COLUMNS: &str = "total, all columns (no filter)";

/// Times of all pairs of all drives by stage, ms; then their totals, with and without the filter.
pub fn stages(drives: &[Facts]) -> Vec<(String, Vec<f64>)> {
    let mut stages: Vec<(String, Vec<f64>)> = Vec::new();
    for stage in drives.iter().flat_map(|d| &d.stages) {
        match stages.iter_mut().find(|s| s.0 == stage.name) {
            Some(known) => known.1.extend(&stage.ms),
            None => stages.push((stage.name.clone(), stage.ms.clone())),
        }
    }
    let totals = drives.iter().flat_map(|d| &d.totals).copied().collect();
    stages.push((TOTAL.into(), totals));
    let unfiltered: Vec<f64> = drives.iter().flat_map(|d| &d.unfiltered).copied().collect();
    if !unfiltered.is_empty() {
        stages.push((ALL_COLUMNS.into(), unfiltered));
    }
    stages
}

/// A step of table 3.3.
pub struct PrintedStep {
    pub name: &'static str,
    /// Our stages that make up the step.
    pub stages: &'static [&'static str],
    /// Mean and standard deviation on the author's GTX 1080, ms.
    printed_ms: [f64; 2],
}

/// The first of the steps: the occupancy grid (appendix B.4).
pub const GRID: PrintedStep = PrintedStep {
    name: "occupancy grid generation",
    stages: &["rays", "shift", "ray_merge", "plan", "ray_trace", "columns"],
    printed_ms: [12.5, 0.87],
};

/// The steps in order. Refining the flow, encoding columns and passing on results belong to none.
const STEPS: [PrintedStep; 5] = [
    GRID,
    PrintedStep {
        name: "background filter",
        stages: &["background_filter", "prefix_sum", "compact"],
        printed_ms: [1.2, 0.10],
    },
    PrintedStep {
        name: "occupancy constancy",
        stages: &["occupancy_constancy", "window"],
        printed_ms: [41.4, 0.83],
    },
    PrintedStep {
        name: "iterative expectation-maximisation",
        stages: &["expectation", "maximisation"],
        printed_ms: [28.5, 5.53],
    },
    PrintedStep { name: "filtered temporal flow", stages: &["track"], printed_ms: [0.4, 0.43] },
];

/// The author's total.
const PRINTED_TOTAL_MS: [f64; 2] = [85.7, 6.38];

impl PrintedStep {
    /// Times of the pairs of a drive, ms.
    pub fn of(&self, drive: &Facts) -> Vec<f64> {
        let parts = drive.stages.iter().filter(|s| self.stages.contains(&s.name.as_str()));
        let mut sums = vec![0.0; drive.totals.len()];
        parts.for_each(|part| sums.iter_mut().zip(&part.ms).for_each(|(sum, ms)| *sum += ms));
        sums
    }
}

/// Table 3.3: time per step and per stage.
pub fn times(drives: &[Facts]) -> Table {
    let row = |name: &str, ms: &[f64], printed: Option<[f64; 2]>| {
        let s = Spread::of(ms)?;
        let ours = [s.mean, s.sd, s.median, s.p99].map(|v| Cell::Number(v, 2));
        let his = printed.unwrap_or([f64::NAN; 2]).into_iter().zip([1, 2]);
        let his = his.map(|(v, digits)| Cell::Number(v, digits));
        Some(TableRow::new([Cell::from(name)].into_iter().chain(ours).chain(his)))
    };
    let steps = STEPS.iter().filter_map(|step| {
        let ms: Vec<f64> = drives.iter().flat_map(|d| step.of(d)).collect();
        row(step.name, &ms, Some(step.printed_ms))
    });
    let stages = stages(drives);
    let stages = stages
        .iter()
        .filter_map(|(name, ms)| row(name, ms, (name == TOTAL).then_some(PRINTED_TOTAL_MS)));
    let totals: Vec<f64> = drives.iter().flat_map(|d| &d.totals).copied().collect();
    let within = totals.iter().filter(|t| **t < BUDGET_MS).count();
    let share = 100.0 * within as f64 / totals.len().max(1) as f64;
    let caption = format!(
        "As table 3.3 of the dissertation: time per pair of sweeps, {} pairs; {share:.1} % of them \
        within 100 ms (the dissertation: over 99 %). Its steps, then our stages that make them up.",
        totals.len(),
    );
    let columns = [
        "Step",
        "Mean, ms",
        "Standard deviation, ms",
        "Median, ms",
        "99 %, ms",
        "Dissertation, GTX 1080: mean, ms",
        "Dissertation: standard deviation, ms",
    ];
    Table::new("table-3-3", caption, &columns, steps.chain(stages).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_of_rejection_at_their_own_thresholds() {
        let curve = |scores: [f64; 4]| {
            let labelled = [true, true, false, false];
            Curve::of(scores.into_iter().zip(labelled).map(|(score, of)| (score, of, 1.0)))
        };
        let encoder = curve([3.0, -6.0, -5.0, -8.0]);
        let both =
            Rejection { filter: curve([2.0, 1.0, 1.5, -1.0]), encoder, could_move_min: -5.5 };
        let shown = |of: &Rejection| -> Vec<Vec<String>> {
            let rows = rejection(of).rows;
            rows.iter().map(|r| r.cells.iter().map(|c| format!("{c:?}")).collect()).collect()
        };
        let all = shown(&both);
        let point = |recall: f64, accuracy: f64, precision: f64| {
            [recall, accuracy, precision].map(|n| format!("{:?}", Cell::Number(n, 1)))
        };
        assert_eq!(all.len(), 5, "{all:?}");
        assert_eq!(all[0][2..4], point(100.0, 50.0, 0.0)[..2]);
        assert_eq!(all[2][2..], point(50.0, 50.0, 50.0));
        assert_eq!(all[3][2..4], point(100.0, 50.0, 0.0)[..2]);
        assert_eq!(shown(&Rejection { encoder: None, ..both }), [&all[..2], &all[4..]].concat());
    }
}
