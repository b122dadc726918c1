//! Moving or not: motion put out where there is none, and none where there is.

use super::calibration::truth;
use super::groups::{COUNT, ClassGroup, MotionGroup, cells};
use super::row::Row;
use super::statistics::{Errors, Weight};
use crate::labels::trajectory::MOVING_MPS;
use crate::report::{self, Cell, Table};

/// Speeds of some columns, m/s.
#[derive(Clone, Debug, Default)]
struct Speeds {
    /// By the displacement.
    flow: Errors,
    /// By the velocity.
    velocity: Errors,
    /// What is true.
    truth: Errors,
    /// Columns put out as moving.
    moving: u64,
}

/// By class, then by [`Row::motion`].
type Cells = [[Speeds; 3]; COUNT];

/// Speeds put out and true ones, of drives with smoothed and with exact labels.
#[derive(Clone, Debug, Default)]
pub struct Verdicts([Cells; 2]);

impl Verdicts {
    /// Counts a row; `exact`: of a drive whose labels are exact.
    pub fn row(&mut self, row: &Row, exact: bool) {
        if !row.in_view {
            return;
        }
        let speeds = &mut self.0[usize::from(exact)][row.class as usize][row.motion as usize];
        let velocity = row.velocity_x.hypot(row.velocity_y);
        speeds.flow.push(row.flow_x.hypot(row.flow_y) / row.dt, row.voxels);
        speeds.velocity.push(velocity, row.voxels);
        speeds.truth.push(row.smooth_x.hypot(row.smooth_y) / row.dt, row.voxels);
        let moving = row.is_put_out_moving() && f64::from(velocity) >= MOVING_MPS;
        speeds.moving += u64::from(moving);
    }

    fn of(&self, exact: bool, group: ClassGroup, motion: MotionGroup) -> Speeds {
        let mut all = Speeds::default();
        for (class, motion) in cells(group, motion) {
            let speeds = &self.0[usize::from(exact)][class][motion];
            all.flow.extend(&speeds.flow);
            all.velocity.extend(&speeds.velocity);
            all.truth.extend(&speeds.truth);
            all.moving += speeds.moving;
        }
        all
    }

    /// What was put out, by what is true.
    pub fn table(&self) -> Table {
        let sets = [MotionGroup::Moving, MotionGroup::Slow, MotionGroup::Parked]
            .map(|m| (ClassGroup::Labelled, m));
        let sets = sets.into_iter().chain([(ClassGroup::Class(0), MotionGroup::Any)]);
        let mut rows = Vec::new();
        for exact in [true, false] {
            for (group, motion) in sets.clone() {
                let speeds = self.of(exact, group, motion);
                let moving = speeds.moving as f64;
                let [flow, velocity, true_speed] =
                    [speeds.flow, speeds.velocity, speeds.truth].map(|s| s.sorted(Weight::Column));
                if flow.count() == 0 {
                    continue;
                }
                let fast = 1.0 - flow.share_below(MOVING_MPS);
                rows.push(report::TableRow::new([
                    truth(exact).into(),
                    group.label().into(),
                    motion.label().into(),
                    Cell::Count(flow.count()),
                    Cell::Number(100.0 * moving / flow.count() as f64, 1),
                    Cell::Number(100.0 * fast, 1),
                    Cell::Number(flow.quantile(0.5), 2),
                    Cell::Number(velocity.quantile(0.5), 2),
                    Cell::Number(true_speed.quantile(0.5), 2),
                ]));
            }
        }
        let columns = [
            "Truth",
            "Columns",
            "Motion",
            "Count",
            "Put out as moving, %",
            "By flow alone, %",
            "Median speed of flow, m/s",
            "Median speed of velocity, m/s",
            "True median, m/s",
        ];
        let caption = format!(
            "Moving or not: columns put out with a displacement and a velocity of {MOVING_MPS} m/s \
             or more; by flow alone, with a displacement of as much over the time between the \
             sweeps."
        );
        let note = "What moves and is not put out so is missed; what is parked or background and \
            is put out so is false. What no label holds counts as background at rest.";
        Table::new("moving-or-not", caption, &columns, rows).note(note)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missed_and_false_motion() {
        let row = |class, motion, flow_x, velocity_x, smooth_x| Row {
            class,
            motion,
            in_view: true,
            flow_x,
            velocity_x,
            smooth_x,
            dt: 0.1,
            ..Row::default()
        };
        let mut verdicts = Verdicts::default();
        for row in [
            row(1, 2, 0.3, 2.9, 0.29),
            row(1, 2, 0.0, 0.0, 0.25),
            // A displacement, though the tracklet says that it stands, and the reverse.
            row(1, 0, 0.3, 0.2, 0.0),
            row(1, 0, 0.0, 2.0, 0.0),
            row(0, 0, -0.3, -3.0, 0.0),
            Row { in_view: false, ..row(0, 0, 0.3, 3.0, 0.0) },
        ] {
            verdicts.row(&row, true);
        }
        let of = |group, motion| {
            let speeds = verdicts.of(true, group, motion);
            let flow = speeds.flow.sorted(Weight::Column);
            (speeds.moving, flow.count(), flow.share_below(MOVING_MPS))
        };
        assert_eq!(of(ClassGroup::Labelled, MotionGroup::Moving), (1, 2, 0.5));
        assert_eq!(of(ClassGroup::Labelled, MotionGroup::Parked), (0, 2, 0.5));
        assert_eq!(of(ClassGroup::Class(0), MotionGroup::Any), (1, 1, 0.0));
        // Moving, parked and background: nothing is slow, nothing of smoothed labels.
        assert_eq!(verdicts.table().rows.len(), 3);
    }
}
