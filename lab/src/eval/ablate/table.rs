//! One row per variant.

use super::variants::{VARIANTS, Variant};
use crate::eval::facts::Facts;
use crate::eval::flow_tables::WITHIN_M;
use crate::eval::groups::{ClassGroup, Estimate, MotionGroup, Truth};
use crate::eval::moving::ColumnVerdicts;
use crate::eval::statistics::Weight;
use crate::eval::tally::Tally;
use crate::report::{Cell, Table, TableRow};
use raywake::budget::device_bytes;
use raywake::order_statistics::median;
use raywake_core::params::Profile;

const COLUMNS: [&str; 22] = [
    "Variant",
    "What",
    "Moving columns",
    "Moving: median, cm",
    "Moving: mean, cm",
    "Moving: within 30 cm, %",
    "Parked: median, cm",
    "Parked: mean, cm",
    "Parked: within 30 cm, %",
    "Background: within 30 cm, %",
    "Tracklets, moving: median, m/s",
    "Tracklets, parked: median, m/s",
    "Tracklets: coverage, %",
    "Total, ms",
    "Constancy and window, ms",
    "Flow, ms",
    "Refine, track, out, ms",
    "Device, MB",
    "Reported as moving: precision, %",
    "Recall, %",
    "Precision, 0.5 m forgiven, %",
    "False per sweep, 2 m or more from movers",
];

/// Stages of a pair that are shown as one figure.
const PARTS: [&[&str]; 3] = [
    &["occupancy_constancy", "window"],
    &["expectation", "maximisation"],
    &["refine", "track", "out"],
];

/// The row of a variant, from its rows and facts.
pub fn row(
    variant: &Variant,
    profile: &Profile,
    (tally, verdicts): (&Tally, &ColumnVerdicts),
    drives: &[Facts],
) -> TableRow {
    let mut cells = vec![Cell::from(variant.name), variant.what.into()];
    let flow =
        |group, motion| tally.flow(Estimate::Ours, Truth::Raw, group, motion, Weight::Column);
    let percent = |share: f64| Cell::Number(100.0 * share, 1);
    for motion in [MotionGroup::Moving, MotionGroup::Parked] {
        let errors = flow(ClassGroup::Labelled, motion);
        if motion == MotionGroup::Moving {
            cells.push(Cell::Count(errors.count()));
        }
        cells.extend([
            Cell::Number(100.0 * errors.quantile(0.5), 1),
            Cell::Number(100.0 * errors.mean(), 1),
            percent(errors.share_below(WITHIN_M)),
        ]);
    }
    cells.push(percent(flow(ClassGroup::Class(0), MotionGroup::Any).share_below(WITHIN_M)));
    for motion in [MotionGroup::Moving, MotionGroup::Parked] {
        let errors = tally.settled(ClassGroup::Labelled, motion, Weight::Column);
        cells.push(Cell::Number(errors.quantile(0.5), 2));
    }
    let [all, covered] = tally.coverage(ClassGroup::Labelled, MotionGroup::Any);
    cells.push(percent(covered as f64 / all as f64));
    let time = |ms| Cell::Number(ms, 1);
    cells.push(time(median(drives.iter().flat_map(|d| &d.totals).copied())));
    cells.extend(PARTS.map(|names| time(median(drives.iter().flat_map(|d| part(d, names))))));
    cells.push(Cell::Number(device_bytes(profile) as f64 / 1e6, 1));
    let moving = verdicts.all();
    let shares = [moving.precision(), moving.recall(), moving.tolerant_precision()];
    cells.extend(shares.map(percent));
    let pairs: u64 = drives.iter().filter(|d| d.has_boxes()).map(|d| d.pairs).sum();
    cells.push(Cell::Number(moving.far() as f64 / pairs as f64, 2));
    TableRow::new(cells)
}

/// The row of a variant without figures.
pub fn failed(variant: &Variant) -> TableRow {
    let head = [variant.name, variant.what].map(Cell::from).into_iter();
    TableRow::new(head.chain(std::iter::repeat_n(Cell::Empty, COLUMNS.len() - 2)))
}

/// Summed time of some stages for each pair, ms.
fn part<'a>(facts: &'a Facts, names: &'a [&str]) -> impl Iterator<Item = f64> + 'a {
    let stages = || facts.stages.iter().filter(|s| names.contains(&s.name.as_str()));
    (0..facts.totals.len()).map(move |n| stages().filter_map(|s| s.ms.get(n)).sum())
}

/// The table of all rows; `failures` states why variants have no figures.
pub fn table(rows: Vec<TableRow>, failures: &[String]) -> Table {
    let caption = "Variants of the base, one change in each: error of the raw flow of labelled \
        columns (labels as given) and of the background, median error of the velocity of tracklets \
        of age 10 or more (smoothed labels), columns with such a tracklet, median times of a pair \
        of sweeps, bytes of the device's heaps; and what is reported as moving, counted as in \
        `eval`.";
    let note = "Times in one table are from one machine, one variant and one drive at a time, \
        while another thread makes rows. Voxels are cubes: with smaller cells the levels of a \
        column shrink too, though the learned parameters are for levels of 0.30 m; and columns and \
        their truth are those of the variant's own grid, so compare rows of the same window. The \
        search spans 15 cells either way, fixed at compile time: its reach in metres follows from \
        the cell size. So does that of the window of 3 x 3 columns over which costs are summed. In \
        the sensor's frame nothing is refined below a cell: compare its row with `refine-0`.";
    let mut table = Table::new("ablations", caption, &COLUMNS, rows).note(note);
    table.notes.extend_from_slice(failures);
    table
}

/// Names of the variants.
pub fn names() -> [&'static str; VARIANTS.len()] {
    VARIANTS.map(|v| v.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::facts::Stage;

    #[test]
    fn stages_of_a_part_are_summed_by_pair() {
        let stage = |name: &str, ms: [f64; 3]| Stage { name: name.into(), ms: ms.into() };
        let facts = Facts {
            stages: vec![
                stage("window", [1.0, 2.0, 3.0]),
                stage("expectation", [9.0; 3]),
                stage("occupancy_constancy", [30.0, 10.0, 20.0]),
            ],
            totals: vec![40.0, 21.0, 32.0],
            ..Facts::default()
        };
        assert_eq!(part(&facts, PARTS[0]).collect::<Vec<_>>(), [31.0, 12.0, 23.0]);
        assert_eq!(median(part(&facts, PARTS[0])), 23.0);
        assert_eq!(median(part(&facts, PARTS[2])), 0.0);
        let none = (&Tally::new(), &ColumnVerdicts::default());
        let row = row(&VARIANTS[0], &Profile::hdl64(), none, &[facts]);
        let whole = table(vec![row, failed(&VARIANTS[1])], &["refine-0: why".into()]);
        assert!(whole.text().contains("refine-0") && whole.notes.len() == 2);
    }
}
