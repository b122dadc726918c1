//! Tables 3.1 to 3.3 and what belongs beside them.

use super::facts::Facts;
use super::groups::{ClassGroup, Estimate, MotionGroup, Truth};
use super::statistics::{Sorted, Weight};
use super::tally::Tally;
use crate::curve::{Curve, Operating};
use crate::report::{Cell, Table, TableRow};
use raywake::order_statistics::Spread;
use raywake::statistics::BUDGET_MS;

/// Errors below this count as "within 30 cm" (table 3.1).
pub const WITHIN_M: f64 = 0.3;
/// The dissertation's share of the foreground that the filter keeps (section 3.4.2).
pub const RECALL: f64 = 0.95;

/// Columns of tables of displacements.
const FLOW: [&str; 4] = ["Count", "Median, cm", "Mean, cm", "Within 30 cm, %"];

/// Count, median, mean and share within 30 cm of displacements.
fn flow_cells(errors: &Sorted) -> [Cell; 4] {
    [
        Cell::Count(errors.count()),
        Cell::Number(100.0 * errors.quantile(0.5), 1),
        Cell::Number(100.0 * errors.mean(), 1),
        Cell::Number(100.0 * errors.share_below(WITHIN_M), 1),
    ]
}

fn row(head: [&str; 2], cells: impl IntoIterator<Item = Cell>) -> TableRow {
    TableRow::new(head.map(Cell::from).into_iter().chain(cells))
}

/// Figures of the dissertation: a count, then numbers with as many decimals as it has.
fn published(group: ClassGroup, count: u64, numbers: &[(f64, usize)], empty: usize) -> TableRow {
    let head = [group.label(), "dissertation"].map(Cell::from).into_iter();
    let numbers = numbers.iter().map(|&(v, digits)| Cell::Number(v, digits));
    let rest = std::iter::repeat_n(Cell::Empty, empty);
    TableRow::reference(head.chain([Cell::Count(count)]).chain(numbers).chain(rest))
}

/// The dissertation's row of table 3.1: voxels counted, moving and parked together.
fn published_flow(group: ClassGroup) -> Option<TableRow> {
    let (count, numbers) = match group.label() {
        "Car" => (873_947, [10.2, 19.3, 83.8]),
        "Cyclist" => (9_890, [13.2, 24.5, 78.8]),
        "Pedestrian" => (7_527, [15.5, 38.9, 74.3]),
        "Background" => (19_899_708, [2.6, 14.9, 88.9]),
        "All labelled" => (1_126_264, [11.0, 22.1, 81.4]),
        _ => return None,
    };
    Some(published(group, count, &numbers.map(|v| (v, 1)), 0))
}

/// Table 3.1: raw flow by class, moving and parked apart.
pub fn raw_flow(tally: &Tally, weight: Weight) -> Table {
    let mut rows = Vec::new();
    for group in ClassGroup::labelled().chain([ClassGroup::Class(0)]) {
        let all = [MotionGroup::Any].iter().filter(|_| group != ClassGroup::Class(0));
        for motion in all.chain(MotionGroup::of(group)) {
            let errors = tally.flow(Estimate::Ours, Truth::Raw, group, *motion, weight);
            if errors.count() > 0 {
                rows.push(row([group.label(), motion.label()], flow_cells(&errors)));
            }
        }
        rows.extend(published_flow(group).filter(|_| weight == Weight::Voxel));
    }
    let (id, of) = match weight {
        Weight::Column => ("table-3-1-columns", "columns"),
        Weight::Voxel => {
            ("table-3-1-voxels", "occupied voxels, as the dissertation's programs count")
        }
    };
    let caption = format!(
        "As table 3.1 of the dissertation: error of the raw flow of a pair of sweeps, by {of}."
    );
    Table::new(id, caption, &[&["Class", "Motion"], &FLOW[..]].concat(), rows)
}

/// Every estimate beside every other, all labelled columns.
pub fn references(tally: &Tally, truth: Truth) -> Table {
    let mut rows = Vec::new();
    for motion in MotionGroup::ALL {
        for estimate in Estimate::ALL {
            let errors = tally.flow(estimate, truth, ClassGroup::Labelled, motion, Weight::Column);
            if errors.count() == 0 {
                continue;
            }
            let head = [motion.label(), estimate.label()].map(Cell::from);
            let cells = head.into_iter().chain(flow_cells(&errors));
            rows.push(if estimate.is_reference() {
                TableRow::reference(cells)
            } else {
                TableRow::new(cells)
            });
        }
    }
    let (id, what) = match truth {
        Truth::Raw => ("references-raw", "labels as they are"),
        Truth::Smooth => ("references-smooth", "smoothed labels, parked objects at rest"),
    };
    let caption = format!(
        "Raw flow of all labelled columns beside estimates that need no LIDAR; truth: {what}."
    );
    Table::new(id, caption, &[&["Motion", "Estimate"], &FLOW[..]].concat(), rows)
}

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
                Cell::Number(floor.quantile(0.5), 2),
            ];
            rows.push(row([group.label(), motion.label()], cells));
        }
        rows.extend(published_tracklets(group));
    }
    let columns = [
        "Class",
        "Motion",
        "Count",
        "Median, m/s",
        "Mean, m/s",
        "Coverage, %",
        "Median against raw labels, m/s",
        "Raw labels' own floor, m/s",
    ];
    let caption = "As table 3.2 of the dissertation: error of the velocity of tracklets of age 10 \
        and more. Truth: smoothed labels, parked objects at rest; a simulator's labels are exact. \
        Coverage: columns with such a tracklet, of all.";
    Table::new("table-3-2", caption, &columns, rows)
}

fn published_tracklets(group: ClassGroup) -> Option<TableRow> {
    let (count, median, mean) = match group.label() {
        "Car" => (216_026, 0.49, 0.65),
        "Cyclist" => (1_507, 1.01, 1.09),
        "Pedestrian" => (537, 0.86, 0.93),
        "All labelled" => {
            let numbers = [(0.50, 2), (0.66, 2), (100.0 * 266_237.0 / 1_126_264.0, 1)];
            return Some(published(group, 266_237, &numbers, 2));
        }
        _ => return None,
    };
    Some(published(group, count, &[(median, 2), (mean, 2)], 3))
}

/// The filter at its own threshold and at the dissertation's recall.
pub fn filter(curve: Option<&Curve>) -> Table {
    let row = |name: &str, p: Option<Operating>| {
        let values = p.map_or([f64::NAN; 3], |p| [p.recall, p.background_accuracy, p.precision]);
        TableRow::new(
            [Cell::from(name)].into_iter().chain(values.map(|v| Cell::Number(100.0 * v, 1))),
        )
    };
    let dissertation = ["dissertation".into(), Cell::Number(95.0, 1), Cell::Number(74.5, 1)];
    let rows = vec![
        row("threshold of the weights", curve.map(|c| c.above(0.0))),
        row("at 95 % recall", curve.map(|c| c.at_recall(RECALL))),
        TableRow::reference(dissertation.into_iter().chain([Cell::Empty])),
    ];
    let columns = ["Operating point", "Recall, %", "Background accuracy, %", "Precision, %"];
    let caption = "Background filter over solid columns in view. Foreground is what lies in a \
        labelled box; background accuracy is the share of the other columns that are rejected.";
    Table::new("filter", caption, &columns, rows)
}

/// Name of the time without the filter among the stages.
const ALL_COLUMNS: &str = "total, all columns (no filter)";

/// Times of all pairs of all drives by stage, ms; then their sums, with and without the filter.
pub fn stages(drives: &[Facts]) -> Vec<(String, Vec<f64>)> {
    let mut stages: Vec<(String, Vec<f64>)> = Vec::new();
    for stage in drives.iter().flat_map(|d| &d.stages) {
        match stages.iter_mut().find(|s| s.0 == stage.name) {
            Some(known) => known.1.extend(&stage.ms),
            None => stages.push((stage.name.clone(), stage.ms.clone())),
        }
    }
    let totals = drives.iter().flat_map(|d| &d.totals).copied().collect();
    stages.push(("total".into(), totals));
    let unfiltered: Vec<f64> = drives.iter().flat_map(|d| &d.unfiltered).copied().collect();
    if !unfiltered.is_empty() {
        stages.push((ALL_COLUMNS.into(), unfiltered));
    }
    stages
}

/// Table 3.3: time per stage.
pub fn times(drives: &[Facts]) -> Table {
    let stages = stages(drives);
    let mut rows: Vec<TableRow> = stages
        .iter()
        .filter_map(|(name, ms)| {
            let s = Spread::of(ms)?;
            let cells = [s.mean, s.sd, s.median, s.p99].map(|v| Cell::Number(v, 2));
            Some(TableRow::new([Cell::from(name.as_str())].into_iter().chain(cells)))
        })
        .collect();
    let published = ["dissertation, GTX 1080, total".into(), Cell::Number(85.7, 1)];
    let published = published.into_iter().chain([Cell::Number(6.38, 2), Cell::Empty, Cell::Empty]);
    rows.push(TableRow::reference(published));
    let totals: Vec<f64> = drives.iter().flat_map(|d| &d.totals).copied().collect();
    let within = totals.iter().filter(|t| **t < BUDGET_MS).count();
    let share = 100.0 * within as f64 / totals.len().max(1) as f64;
    let caption = format!(
        "As table 3.3 of the dissertation: time per pair of sweeps, {} pairs; {share:.1} % of \
        them within 100 ms (the dissertation: over 99 %).",
        totals.len(),
    );
    let columns = ["Step", "Mean, ms", "Standard deviation, ms", "Median, ms", "99 %, ms"];
    Table::new("table-3-3", caption, &columns, rows)
}
