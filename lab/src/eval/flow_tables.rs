//! Table 3.1 and related tables: errors of the raw flow.

use super::groups::{ClassGroup, Estimate, MotionGroup, Truth};
use super::statistics::{Sorted, Weight};
use super::tally::Tally;
use crate::report::{Cell, Table, TableRow};

/// Errors below this count as "within 30 cm" (table 3.1).
pub const WITHIN_M: f64 = 0.3;

/// Columns for displacements.
const FLOW: [&str; 3] = ["Median, cm", "Mean, cm", "Within 30 cm, %"];

/// Median, mean and share within 30 cm of displacements.
fn flow_cells(errors: &Sorted) -> [Cell; 3] {
    [
        Cell::Number(100.0 * errors.quantile(0.5), 1),
        Cell::Number(100.0 * errors.mean(), 1),
        Cell::Number(100.0 * errors.share_below(WITHIN_M), 1),
    ]
}

/// The tallies of the pipeline in normal operation and, if requested, of single pairs.
#[derive(Clone, Copy)]
pub struct Tallies<'a> {
    /// In normal operation.
    pub run: &'a Tally,
    /// Without history.
    pub pairs: Option<&'a Tally>,
}

/// What a figure of table 3.1 is about.
struct Counted<'a> {
    tally: &'a Tally,
    weight: Weight,
    name: &'static str,
}

impl<'a> Tallies<'a> {
    /// In the order in which they are listed side by side.
    fn counted(self) -> impl Iterator<Item = Counted<'a>> {
        let of = |tally, names: [&'static str; 2]| {
            let weights = [Weight::Column, Weight::Voxel].into_iter();
            weights.zip(names).map(move |(weight, name)| Counted { tally, weight, name })
        };
        let pairs = self.pairs.map(|pairs| of(pairs, ["pair by pair", "pair by pair, voxels"]));
        of(self.run, ["", "voxels"]).chain(pairs.into_iter().flatten())
    }
}

/// The dissertation's figures of table 3.1: voxels, moving and parked together.
fn published(group: ClassGroup) -> Option<(u64, [f64; 3])> {
    match group.label() {
        "Car" => Some((873_947, [10.2, 19.3, 83.8])),
        "Cyclist" => Some((9_890, [13.2, 24.5, 78.8])),
        "Pedestrian" => Some((7_527, [15.5, 38.9, 74.3])),
        "Background" => Some((19_899_708, [2.6, 14.9, 88.9])),
        "All labelled" => Some((1_126_264, [11.0, 22.1, 81.4])),
        _ => None,
    }
}

/// Columns of table 3.1 before its figures.
const HEAD: [&str; 4] = ["Class", "Motion", "Columns", "Voxels"];

/// The dissertation's row, under the columns for voxels.
fn published_row(group: ClassGroup, columns: usize) -> Option<TableRow> {
    let (count, figures) = published(group)?;
    let head = [group.label().into(), "dissertation".into(), Cell::Empty, Cell::Count(count)];
    let by_columns = std::iter::repeat_n(Cell::Empty, FLOW.len() + 1);
    let cells = head.into_iter().chain(by_columns).chain(figures.map(|v| Cell::Number(v, 1)));
    Some(TableRow::reference(cells.chain(std::iter::repeat(Cell::Empty)).take(columns)))
}

/// Table 3.1: raw flow by class, moving and parked separately; by columns and by voxels, with and
/// without history.
pub fn raw_flow(tallies: Tallies) -> Table {
    let figures = |counted: Counted| {
        let named = move |figure: &str| match counted.name {
            "" => figure.to_string(),
            name => format!("{figure} ({name})"),
        };
        FLOW.into_iter().chain(["Relative, %"]).map(named)
    };
    let columns: Vec<String> = HEAD.into_iter().map(String::from).collect();
    let columns = [columns, tallies.counted().flat_map(figures).collect()].concat();
    let mut rows = Vec::new();
    for group in ClassGroup::labelled().chain([ClassGroup::Class(0)]) {
        let all = [MotionGroup::Any].iter().filter(|_| group != ClassGroup::Class(0));
        for motion in all.chain(MotionGroup::of(group)) {
            rows.extend(raw_flow_row(tallies, group, *motion));
        }
        rows.extend(published_row(group, columns.len()));
    }
    let caption = "As table 3.1 of the dissertation: error of the raw flow of a pair of sweeps.";
    let note = "Voxels: every column counts as often as it has occupied voxels, as in the \
        dissertation's programs. Relative: median error of moving columns as a share of their \
        displacement; people do not walk 30 cm from one sweep to the next, so the share within 30 \
        cm says nothing about them. Pair by pair: all history is discarded before each pair \
        (`--pairs`).";
    let names: Vec<&str> = columns.iter().map(String::as_str).collect();
    Table::new("table-3-1", caption, &names, rows).note(note)
}

fn raw_flow_row(tallies: Tallies, group: ClassGroup, motion: MotionGroup) -> Option<TableRow> {
    let counts = [Weight::Column, Weight::Voxel]
        .map(|weight| tallies.run.flow(Estimate::Ours, Truth::Raw, group, motion, weight).count());
    let figures = |c: Counted| {
        let [median, mean, within] =
            flow_cells(&c.tally.flow(Estimate::Ours, Truth::Raw, group, motion, c.weight));
        let people = group == ClassGroup::PEOPLE && c.weight == Weight::Column;
        let moving = Some(motion).filter(|m| *m == MotionGroup::Moving);
        let relative = moving.map_or(Cell::Empty, |motion| {
            Cell::Number(100.0 * c.tally.relative(group, motion, c.weight).quantile(0.5), 1)
        });
        [median, mean, if people { Cell::Empty } else { within }, relative]
    };
    let head = [group.label(), motion.label()].map(Cell::from);
    let cells = head.into_iter().chain(counts.map(Cell::Count));
    (counts[0] > 0).then(|| TableRow::new(cells.chain(tallies.counted().flat_map(figures))))
}

/// Every estimate beside every other, for all labelled columns.
pub fn references(tallies: Tallies, truth: Truth) -> Table {
    let mut rows = Vec::new();
    for motion in MotionGroup::ALL {
        let flow = |tally: &Tally, estimate| {
            tally.flow(estimate, truth, ClassGroup::Labelled, motion, Weight::Column)
        };
        for estimate in Estimate::ALL {
            let (name, reference) = (estimate.label(), estimate.is_reference());
            let of_run = estimate_cells(motion, name, &flow(tallies.run, estimate));
            let row = if reference { TableRow::reference } else { TableRow::new };
            rows.extend(of_run.map(row));
            // Without LIDAR nothing depends on history.
            let of_pairs = tallies.pairs.filter(|_| !reference).and_then(|pairs| {
                let name = format!("{name}, pair by pair");
                estimate_cells(motion, &name, &flow(pairs, estimate))
            });
            rows.extend(of_pairs.map(TableRow::new));
        }
    }
    let (id, what) = match truth {
        Truth::Raw => ("references-raw", "labels as given"),
        Truth::Smooth => ("references-smooth", "smoothed labels, parked objects at rest"),
    };
    let caption = format!(
        "Raw flow of all labelled columns beside estimates that need no LIDAR; truth: {what}."
    );
    Table::new(id, caption, &[&["Motion", "Estimate", "Count"], &FLOW[..]].concat(), rows)
}

/// The cells of an estimate; `None` if there is nothing to estimate.
fn estimate_cells(motion: MotionGroup, name: &str, errors: &Sorted) -> Option<Vec<Cell>> {
    let head = [motion.label().into(), name.into(), Cell::Count(errors.count())];
    (errors.count() > 0).then(|| head.into_iter().chain(flow_cells(errors)).collect())
}
