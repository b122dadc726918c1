//! Whether covariances predict how large errors are: shares of true values in the ellipses claimed.

mod ellipse;
mod show;

pub use show::{reliability, table, truth};

use super::groups::{COUNT, ClassGroup, MotionGroup, cells};
use super::row::Row;
use super::statistics::{Errors, Sorted, Weight};
use super::tally::SETTLED;
use ellipse::{content, deviation};

/// The value a covariance is claimed for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Displacement between the sweeps, m.
    Flow,
    /// Velocity of settled tracklets, m/s.
    Settled,
    /// Velocity of every column, m/s.
    Velocity,
}

impl Quantity {
    /// All of them, in the order listed.
    pub const ALL: [Quantity; 3] = [Quantity::Flow, Quantity::Settled, Quantity::Velocity];

    /// The error and the covariance claimed; `None` if the row makes no such claim.
    fn of(self, row: &Row) -> Option<([f32; 2], [f32; 3])> {
        let truth = [row.smooth_x, row.smooth_y];
        match self {
            Quantity::Flow => Some((
                [row.flow_x - truth[0], row.flow_y - truth[1]],
                [row.flow_cov_xx, row.flow_cov_xy, row.flow_cov_yy],
            )),
            Quantity::Settled if row.age < SETTLED => None,
            _ => Some((
                [row.velocity_x - truth[0] / row.dt, row.velocity_y - truth[1] / row.dt],
                [row.covariance_xx, row.covariance_xy, row.covariance_yy],
            )),
        }
    }
}

/// A set of columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Columns {
    /// Those output with a displacement over ground, whatever they are.
    Displaced,
    /// Those of a group with a given motion.
    Of(ClassGroup, MotionGroup),
}

/// Claims and errors of some columns.
#[derive(Clone, Debug, Default)]
struct Claims {
    /// Content of the smallest ellipse that contains the truth.
    content: Errors,
    deviation: Errors,
    error: Errors,
    /// Columns without an ellipse.
    without: u64,
}

/// Claims and errors of some columns, in ascending order.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Content of the smallest ellipse that contains the truth, 0..1.
    pub content: Sorted,
    /// Standard deviation claimed along an axis, m or m/s.
    pub deviation: Sorted,
    /// Distance from the truth, m or m/s.
    pub error: Sorted,
    /// Columns that claim no covariance: background and those without a match.
    pub without: u64,
}

/// By class, [`Row::motion`], and whether a displacement was output.
type Cells = [[[Claims; 2]; 3]; COUNT];

/// Claims of all rows, against smoothed labels; those of exact labels separately.
#[derive(Clone, Debug, Default)]
pub struct Calibration {
    /// By quantity as in [`Quantity::ALL`], then by whether labels are exact.
    claims: [[Cells; 2]; 3],
}

impl Calibration {
    /// Counts a row; `exact`: it is from a drive with exact labels.
    pub fn row(&mut self, row: &Row, exact: bool) {
        if !row.in_view {
            return;
        }
        for (quantity, by_truth) in Quantity::ALL.iter().zip(&mut self.claims) {
            let Some((error, covariance)) = quantity.of(row) else { continue };
            let cells = &mut by_truth[usize::from(exact)];
            let moving = usize::from(row.is_displaced());
            let claims = &mut cells[row.class as usize][row.motion as usize][moving];
            if covariance == [0.0; 3] {
                claims.without += 1;
                continue;
            }
            claims.content.push(content(error, covariance) as f32, row.voxels);
            claims.deviation.push(deviation(covariance), row.voxels);
            claims.error.push(error[0].hypot(error[1]), row.voxels);
        }
    }

    /// The claims of some columns.
    pub fn sample(&self, quantity: Quantity, exact: bool, columns: Columns) -> Sample {
        let n = Quantity::ALL.iter().position(|q| *q == quantity).expect("all are listed");
        let of = &self.claims[n][usize::from(exact)];
        let mut all = Claims::default();
        let mut add = |claims: &Claims| {
            all.content.extend(&claims.content);
            all.deviation.extend(&claims.deviation);
            all.error.extend(&claims.error);
            all.without += claims.without;
        };
        match columns {
            Columns::Displaced => of.iter().flatten().for_each(|c| add(&c[1])),
            Columns::Of(group, motion) => {
                cells(group, motion).for_each(|(c, m)| of[c][m].iter().for_each(&mut add));
            }
        }
        let sorted = |errors: Errors| errors.sorted(Weight::Column);
        Sample {
            content: sorted(all.content),
            deviation: sorted(all.deviation),
            error: sorted(all.error),
            without: all.without,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_sim::Rng;

    /// The `n`-th pair of normal numbers (Box and Muller).
    fn normal(n: u64) -> [f64; 2] {
        let mut rng = Rng::split(1, n);
        let (radius, turn) = ((1.0 - rng.unit()).ln(), rng.unit());
        let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
        [cos, sin].map(|v| v * (-2.0 * radius).sqrt())
    }

    const COUNT: u64 = 4000;

    /// A column whose flow error is drawn from `flow`'s covariance and whose velocity error is 20
    /// times that.
    fn row(n: u64) -> Row {
        // Covariance (0.04, 0.03, 0.09), from its root.
        let [a, b] = normal(n);
        let error = [0.2 * a, 0.15 * a + 0.0675f64.sqrt() * b];
        Row {
            class: 1,
            motion: 2,
            in_view: true,
            basis: 2,
            flow_x: (1.0 + error[0]) as f32,
            flow_y: (-0.5 + error[1]) as f32,
            smooth_x: 1.0,
            smooth_y: -0.5,
            flow_cov_xx: 0.04,
            flow_cov_xy: 0.03,
            flow_cov_yy: 0.09,
            velocity_x: (10.0 + 20.0 * error[0]) as f32,
            velocity_y: (-5.0 + 20.0 * error[1]) as f32,
            covariance_xx: 4.0,
            covariance_xy: 3.0,
            covariance_yy: 9.0,
            age: 10 * (n % 2) as u32,
            dt: 0.1,
            ..Row::default()
        }
    }

    /// Within four deviations of a binomial count.
    fn is_share(found: f64, p: f64, n: u64) -> bool {
        (found - p).abs() < 4.0 * (p * (1.0 - p) / n as f64).sqrt()
    }

    #[test]
    fn coverage_of_normal_errors_is_as_claimed() {
        let mut calibration = Calibration::default();
        (0..COUNT).for_each(|n| calibration.row(&row(n), true));
        let moving = Columns::Of(ClassGroup::Labelled, MotionGroup::Moving);
        let flow = calibration.sample(Quantity::Flow, true, moving);
        assert_eq!((flow.content.count(), flow.without), (COUNT, 0));
        for p in [0.1, 0.5, 0.68, 0.95, 0.99] {
            assert!(is_share(flow.content.share_below(p), p, COUNT), "{p}");
        }
        assert!((flow.deviation.quantile(0.5) - 0.065f64.sqrt()).abs() < 1e-6);
        assert!((flow.error.quantile(0.5) / 0.065f64.sqrt() - 1.15).abs() < 0.1);
        // Velocities err twice as much as they claim: 4 times chi-square's scale.
        let expected = |d2: f64| 1.0 - (-d2 / 8.0).exp();
        let velocity = calibration.sample(Quantity::Velocity, true, moving);
        let share = velocity.content.share_below(0.95);
        assert!(is_share(share, expected(5.991), COUNT), "{share}");
        let settled = calibration.sample(Quantity::Settled, true, moving);
        assert_eq!(settled.content.count(), COUNT / 2);
        assert!(is_share(settled.content.share_below(0.68), expected(2.279), COUNT / 2));
    }

    #[test]
    fn sets_of_columns_and_what_claims_nothing() {
        let mut calibration = Calibration::default();
        let zero = Row { flow_cov_xx: 0.0, flow_cov_xy: 0.0, flow_cov_yy: 0.0, ..row(1) };
        let still = Row { flow_x: 0.0, flow_y: 0.0, motion: 0, ..row(2) };
        for row in [
            zero,
            still,
            Row { class: 0, motion: 0, ..row(3) },
            Row { class: 7, ..row(4) },
            Row { in_view: false, ..row(5) },
        ] {
            calibration.row(&row, false);
        }
        let counts = |columns| {
            let s = calibration.sample(Quantity::Flow, false, columns);
            [s.content.count(), s.without]
        };
        assert_eq!(counts(Columns::Displaced), [2, 1]);
        assert_eq!(counts(Columns::Of(ClassGroup::Labelled, MotionGroup::Any)), [2, 1]);
        assert_eq!(counts(Columns::Of(ClassGroup::Class(1), MotionGroup::Moving)), [0, 1]);
        assert_eq!(counts(Columns::Of(ClassGroup::Class(0), MotionGroup::Any)), [1, 0]);
        let exact = calibration.sample(Quantity::Flow, true, Columns::Displaced);
        assert!(exact.content.share_below(0.95).is_nan() && exact.without == 0);
    }
}
