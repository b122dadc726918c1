//! From rows to errors by class and motion, the basis of tables 3.1 and 3.2 and figures 3.6 to 3.9.

use super::groups::{COUNT, ClassGroup, Estimate, MotionGroup, Truth, cells};
use super::row::Row;
use super::statistics::{Errors, Sorted, Weight};
use crate::curve::Curve;

/// From this age on a tracklet counts as settled (table 3.2).
pub const SETTLED: u32 = 10;

/// Errors by class, then by [`Row::motion`].
type Cells = [[Errors; 3]; COUNT];

/// Errors of settled tracklets.
#[derive(Clone, Debug, Default)]
struct Velocities {
    smooth: Cells,
    raw: Cells,
    /// Distance between the two truths: the lower bound for errors against the raw one.
    floor: Cells,
}

/// All data for the tables.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// By estimate as in [`Estimate::ALL`], against the labels as given.
    raw: [Cells; 5],
    /// The same against smoothed labels.
    smooth: [Cells; 5],
    /// For moving columns: errors against the labels as given, divided by the true displacement.
    relative: Cells,
    /// Settled tracklets.
    settled: Velocities,
    /// Errors of tracklets by age, against smoothed labels.
    by_age: Vec<(u32, Cells)>,
    /// Solid columns in view, and those with a settled tracklet.
    columns: [[u64; 3]; COUNT],
    covered: [[u64; 3]; COUNT],
    /// Scores of every solid column in view, and whether it is labelled: the filter's, and the
    /// encoder's of what could move.
    scores: Vec<(i32, f32, bool)>,
    /// Rows that do not count because labels are incomplete there.
    pub out_of_view: u64,
    /// Rows that do not count because they are of the ground below an object.
    pub below: u64,
}

fn distance(a: [f32; 2], b: [f32; 2]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

impl Tally {
    /// Ages shown separately.
    pub const AGES: [u32; 5] = [0, 2, 5, 10, 20];

    /// An empty tally.
    pub fn new() -> Tally {
        Tally { by_age: Tally::AGES.map(|a| (a, Cells::default())).to_vec(), ..Tally::default() }
    }

    /// Counts a row.
    pub fn row(&mut self, row: &Row) {
        if !row.in_view {
            self.out_of_view += 1;
            return;
        }
        if row.below {
            self.below += 1;
            return;
        }
        let (class, motion) = (row.class as usize, row.motion as usize);
        self.scores.push((row.score, row.encoder_score, row.class > 0));
        let (raw, smooth) = ([row.true_x, row.true_y], [row.smooth_x, row.smooth_y]);
        for (n, estimate) in Estimate::ALL.iter().enumerate() {
            // Of the background, by far the largest part, only what is shown is kept.
            if class == 0 && *estimate != Estimate::Ours {
                continue;
            }
            let Some(flow) = estimate.of(row) else { continue };
            self.raw[n][class][motion].push(distance(flow, raw), row.voxels);
            self.smooth[n][class][motion].push(distance(flow, smooth), row.voxels);
        }
        if row.is_moving() {
            let error = distance([row.flow_x, row.flow_y], raw) / raw[0].hypot(raw[1]);
            self.relative[class][motion].push(error, row.voxels);
        }
        self.columns[class][motion] += 1;
        if row.is_matched() {
            self.tracklet(row, class, motion);
        }
    }

    fn tracklet(&mut self, row: &Row, class: usize, motion: usize) {
        let found = [row.velocity_x, row.velocity_y];
        let truth = [row.smooth_x / row.dt, row.smooth_y / row.dt];
        let error = distance(found, truth);
        if let Some((_, cells)) = self.by_age.iter_mut().find(|a| a.0 == row.age) {
            cells[class][motion].push(error, row.voxels);
        }
        if row.age < SETTLED {
            return;
        }
        self.covered[class][motion] += 1;
        let raw = [row.true_x / row.dt, row.true_y / row.dt];
        self.settled.smooth[class][motion].push(error, row.voxels);
        self.settled.raw[class][motion].push(distance(found, raw), row.voxels);
        self.settled.floor[class][motion].push(distance(truth, raw), row.voxels);
    }

    /// The filter's operating points at every threshold (figure 3.6); `None` if nothing is
    /// labelled, or everything is.
    pub fn filter(&self) -> Option<Curve> {
        Curve::of(self.scores.iter().map(|s| (f64::from(s.0), s.2, 1.0)))
    }

    /// The same for the encoder's score of what could move.
    pub fn encoder(&self) -> Option<Curve> {
        Curve::of(self.scores.iter().map(|s| (f64::from(s.1), s.2, 1.0)))
    }

    /// Errors of displacement, m.
    pub fn flow(
        &self,
        estimate: Estimate,
        truth: Truth,
        group: ClassGroup,
        motion: MotionGroup,
        weight: Weight,
    ) -> Sorted {
        let by = if truth == Truth::Raw { &self.raw } else { &self.smooth };
        let n = Estimate::ALL.iter().position(|e| *e == estimate).expect("all are listed");
        gather(&by[n], group, motion).sorted(weight)
    }

    /// Errors of displacement as shares of the true one; only moving columns have any.
    pub fn relative(&self, group: ClassGroup, motion: MotionGroup, weight: Weight) -> Sorted {
        gather(&self.relative, group, motion).sorted(weight)
    }

    /// Errors of the velocity of settled tracklets against smoothed labels, m/s.
    pub fn settled(&self, group: ClassGroup, motion: MotionGroup, weight: Weight) -> Sorted {
        gather(&self.settled.smooth, group, motion).sorted(weight)
    }

    /// The same against labels as given, and the distance of those from the smoothed ones.
    pub fn settled_raw(&self, group: ClassGroup, motion: MotionGroup) -> [Sorted; 2] {
        [&self.settled.raw, &self.settled.floor]
            .map(|cells| gather(cells, group, motion).sorted(Weight::Column))
    }

    /// Errors of the velocity of tracklets of one age, an index into [`Self::AGES`], m/s.
    pub fn at_age(&self, age: usize, group: ClassGroup, motion: MotionGroup) -> Sorted {
        gather(&self.by_age[age].1, group, motion).sorted(Weight::Column)
    }

    /// Solid columns in view, and how many of them have a settled tracklet.
    pub fn coverage(&self, group: ClassGroup, motion: MotionGroup) -> [u64; 2] {
        [&self.columns, &self.covered].map(|counts| {
            let chosen = cells(group, motion);
            chosen.map(|(class, motion)| counts[class][motion]).sum()
        })
    }
}

fn gather(of: &Cells, group: ClassGroup, motion: MotionGroup) -> Errors {
    let mut all = Errors::default();
    cells(group, motion).for_each(|(class, motion)| all.extend(&of[class][motion]));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(class: u8, motion: u8, flow: f32, truth: f32) -> Row {
        Row {
            class,
            motion,
            in_view: true,
            basis: 2,
            voxels: 2,
            flow_x: flow,
            true_x: truth,
            smooth_x: truth,
            carried_x: -1.0,
            velocity_x: flow * 10.0,
            dt: 0.1,
            age: 10,
            ..Row::default()
        }
    }

    #[test]
    fn classes_and_motions_are_kept_apart() {
        let mut tally = Tally::new();
        tally.row(&row(1, 2, 0.6, 0.5));
        tally.row(&row(1, 0, 0.0, 0.02));
        tally.row(&Row { voxels: 5, basis: 1, ..row(7, 2, 0.0, 0.4) });
        tally.row(&row(0, 0, 0.3, 0.0));
        tally.row(&Row { in_view: false, ..row(1, 2, 9.0, 0.0) });
        tally.row(&Row { below: true, ..row(1, 2, 9.0, 0.0) });
        let flow = |e, g, m| tally.flow(e, Truth::Raw, g, m, Weight::Column);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6;
        assert!(near(flow(Estimate::Ours, ClassGroup::Class(1), MotionGroup::Moving).mean(), 0.1));
        assert!(near(
            flow(Estimate::Ours, ClassGroup::Labelled, MotionGroup::Any).mean(),
            0.52 / 3.0
        ));
        assert!(near(flow(Estimate::Zero, ClassGroup::Labelled, MotionGroup::Moving).mean(), 1.45));
        assert!(near(flow(Estimate::Ours, ClassGroup::Class(0), MotionGroup::Any).mean(), 0.3));
        assert_eq!(flow(Estimate::Matched, ClassGroup::Labelled, MotionGroup::Any).count(), 2);
        let voxels = tally.flow(
            Estimate::Ours,
            Truth::Raw,
            ClassGroup::Labelled,
            MotionGroup::Any,
            Weight::Voxel,
        );
        assert_eq!(voxels.count(), 9);
        // 0.1 m of 0.5 m, and all of 0.4 m.
        let relative = tally.relative(ClassGroup::Labelled, MotionGroup::Any, Weight::Column);
        assert!(relative.count() == 2 && near(relative.mean(), 0.6));
        assert_eq!(tally.coverage(ClassGroup::Labelled, MotionGroup::Moving), [2, 1]);
        assert!(near(
            tally.settled(ClassGroup::Labelled, MotionGroup::Moving, Weight::Column).mean(),
            1.0
        ));
        assert!(near(tally.settled_raw(ClassGroup::Labelled, MotionGroup::Any)[1].mean(), 0.0));
        assert_eq!(tally.at_age(3, ClassGroup::Labelled, MotionGroup::Any).count(), 2);
        assert_eq!(tally.out_of_view, 1);
        assert_eq!(tally.filter().unwrap().auc(), 0.5);
    }
}
