//! How far motions are from those they are compared with, as a table.

use raywake_core::pose::Pose;
use std::fmt::{self, Write};

/// Names and units of the rows.
const ROWS: [&str; 8] =
    ["x m", "y m", "z m", "translation m", "roll deg", "pitch deg", "yaw deg", "rotation deg"];

/// Differences of steps, and of what they chain to.
#[derive(Default)]
pub struct Differences {
    rows: [Vec<f64>; 8],
    path_m: f64,
}

impl Differences {
    /// Adds a step: what was found against what is given, both `before_from_now`.
    pub fn add(&mut self, found: &Pose, given: &Pose) {
        let apart = (given.inverse() * *found).twist(1.0);
        let (t, r) = (apart.linear, apart.angular * 1f64.to_degrees());
        let values = [t.x, t.y, t.z, t.length(), r.x, r.y, r.z, r.length()];
        for (row, value) in self.rows.iter_mut().zip(values) {
            row.push(value.abs());
        }
        self.path_m += given.translation.length();
    }

    /// The table, and how far apart the drives end.
    pub fn table(&self, found: &Pose, given: &Pose) -> Result<String, fmt::Error> {
        let mut text = String::new();
        writeln!(text, "{:<16}{:>10}{:>10}{:>10}", "per step", "median", "95 %", "max")?;
        for (name, row) in ROWS.iter().zip(&self.rows) {
            let mut sorted = row.clone();
            sorted.sort_by(f64::total_cmp);
            let [median, high, max] = [0.5, 0.95, 1.0].map(|share| quantile(&sorted, share));
            writeln!(text, "{name:<16}{median:>10.4}{high:>10.4}{max:>10.4}")?;
        }
        let end = (given.inverse() * *found).twist(1.0);
        writeln!(
            text,
            "at the end      {:.2} m and {:.2} deg apart after {:.1} m (x {:.2}, y {:.2}, z {:.2})",
            end.linear.length(),
            end.angular.length().to_degrees(),
            self.path_m,
            end.linear.x,
            end.linear.y,
            end.linear.z
        )?;
        Ok(text)
    }
}

/// The value that a share of the sorted ones does not exceed; 0 of none.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_and_rows() {
        let sorted: Vec<f64> = (1..=100).map(f64::from).collect();
        let of = |share| quantile(&sorted, share);
        assert_eq!([of(0.5), of(0.95), of(1.0), quantile(&[], 0.5)], [50.0, 95.0, 100.0, 0.0]);
        let mut differences = Differences::default();
        let given = Pose::planar(1.0, 0.0, 0.0, 0.1);
        let off = Pose::planar(0.0, -0.02, 0.0, 0.5f64.to_radians());
        differences.add(&(given * off), &given);
        assert!((differences.rows[1][0] - 0.02).abs() < 1e-12);
        assert!((differences.rows[6][0] - 0.5).abs() < 1e-12);
        let table = differences.table(&given, &given).unwrap();
        assert!(
            table.contains("0.0200") && table.contains("0.00 deg apart after 1.0 m"),
            "{table}"
        );
    }
}
