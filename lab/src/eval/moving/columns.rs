//! Verdicts on columns.

use super::false_motion::FalseMotion;
use super::{MotionCounts, percent, sweeps};
use crate::eval::calibration::truth;
use crate::eval::facts::Facts;
use crate::eval::groups::{COUNT, ClassGroup, MotionGroup, cells};
use crate::eval::row::Row;
use crate::report::{Cell, Table, TableRow};

/// Columns of one class and motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct VerdictCounts {
    columns: u64,
    /// Reported as moving.
    moving: u64,
    /// Moving by the displacement alone.
    by_flow: u64,
}

/// Verdicts with one kind of truth.
#[derive(Clone, Debug, Default)]
struct TruthVerdicts {
    counts: MotionCounts,
    /// Including the ground below objects, as with boxes.
    by_boxes: MotionCounts,
    /// By class, then by [`Row::motion`].
    kinds: [[VerdictCounts; 3]; COUNT],
    wrong: FalseMotion,
}

/// Verdicts on the columns of drives with smoothed and with exact labels.
#[derive(Clone, Debug, Default)]
pub struct ColumnVerdicts([TruthVerdicts; 2]);

impl ColumnVerdicts {
    /// Counts a row; `exact`: it is from a drive with exact labels.
    pub fn row(&mut self, row: &Row, exact: bool) {
        if !row.in_view {
            return;
        }
        let of = &mut self.0[usize::from(exact)];
        let reported = row.is_reported_moving();
        if let Some(moves) = row.moves_by_boxes() {
            of.by_boxes.add(moves, reported, row.mover_m);
        }
        if row.below {
            return;
        }
        let kind = &mut of.kinds[row.class as usize][row.motion as usize];
        kind.columns += 1;
        kind.moving += u64::from(reported);
        kind.by_flow += u64::from(row.is_moving_by_flow());
        let Some(moves) = row.moves() else { return };
        of.counts.add(moves, reported, row.mover_m);
        if !moves {
            of.wrong.add_static(row, reported);
        }
    }

    /// Counts over both kinds of truth.
    pub fn all(&self) -> MotionCounts {
        let mut all = self.counts(true);
        all.merge(&self.counts(false));
        all
    }

    /// Counts with one kind of truth.
    pub fn counts(&self, exact: bool) -> MotionCounts {
        self.0[usize::from(exact)].counts
    }

    /// The same including the ground below objects, as with boxes.
    pub fn counts_by_boxes(&self, exact: bool) -> MotionCounts {
        self.0[usize::from(exact)].by_boxes
    }

    fn of(&self, exact: bool, group: ClassGroup, motion: MotionGroup) -> VerdictCounts {
        let mut all = VerdictCounts::default();
        for (class, motion) in cells(group, motion) {
            let kind = self.0[usize::from(exact)].kinds[class][motion];
            all.columns += kind.columns;
            all.moving += kind.moving;
            all.by_flow += kind.by_flow;
        }
        all
    }

    /// What is reported as moving, by what it is.
    pub fn by_kind(&self) -> Table {
        let mut rows = Vec::new();
        for exact in [true, false] {
            for group in ClassGroup::labelled().chain([ClassGroup::Class(0)]) {
                for motion in MotionGroup::of(group) {
                    let of = self.of(exact, group, *motion);
                    if of.columns > 0 {
                        rows.push(TableRow::new([
                            truth(exact).into(),
                            group.label().into(),
                            motion.label().into(),
                            Cell::Count(of.columns),
                            percent(of.moving, of.columns),
                            percent(of.by_flow, of.columns),
                        ]));
                    }
                }
            }
        }
        let columns =
            ["Truth", "Class", "Motion", "Columns", "Reported as moving, %", "By flow alone, %"];
        let caption = "Columns reported as moving, by what they are; by flow alone: by their \
            displacement, whatever the velocity.";
        Table::new("moving-by-class", caption, &columns, rows)
    }

    /// Where false motion occurs, by properties of the columns.
    pub fn false_motion(&self, drives: &[Facts]) -> Table {
        let of = |exact| (exact, sweeps(drives, exact), &self.0[usize::from(exact)].wrong);
        FalseMotion::table([true, false].map(of))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missed_and_false_motion() {
        let row = |class, motion, flow_x, velocity_x, mover_m| Row {
            class,
            motion,
            in_view: true,
            flow_x,
            velocity_x,
            mover_m,
            dt: 0.1,
            ..Row::default()
        };
        let mut verdicts = ColumnVerdicts::default();
        for row in [
            row(1, 2, 0.3, 2.9, 0.0),
            row(1, 2, 0.0, 0.0, 0.0),
            // A displacement though the tracklet is at rest, and the reverse.
            row(1, 0, 0.3, 0.2, 9.0),
            row(1, 0, 0.0, 2.0, 9.0),
            row(0, 0, -0.3, -3.0, 1.0),
            // A displacement too slow to count as moving; slow objects may be reported either way.
            row(0, 0, 0.04, 3.0, 0.2),
            row(8, 1, 0.1, 1.0, 0.0),
            Row { in_view: false, ..row(0, 0, 0.3, 3.0, 0.0) },
            // The road below a car.
            Row { below: true, ..row(1, 2, 0.0, 0.0, 0.0) },
        ] {
            verdicts.row(&row, true);
        }
        let found = MotionCounts { found: 1, missed: 1, wrong: [0, 1, 0] };
        assert_eq!(verdicts.counts(true), found);
        assert_eq!(verdicts.counts_by_boxes(true), MotionCounts { missed: 2, ..found });
        let of = |group, motion| {
            let VerdictCounts { columns, moving, by_flow } = verdicts.of(true, group, motion);
            [columns, moving, by_flow]
        };
        assert_eq!(of(ClassGroup::Labelled, MotionGroup::Moving), [2, 1, 1]);
        assert_eq!(of(ClassGroup::Labelled, MotionGroup::Parked), [2, 0, 1]);
        assert_eq!(of(ClassGroup::Labelled, MotionGroup::Slow), [1, 1, 1]);
        assert_eq!(of(ClassGroup::Class(0), MotionGroup::Any), [2, 1, 1]);
        // Cars and all labelled, moving and parked; slow ones, twice; the background.
        assert_eq!(verdicts.by_kind().rows.len(), 7);
    }
}
