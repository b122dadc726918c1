//! Differences between motions and reference motions, as a table.

use raywake::order_statistics::quantiles;
use raywake_core::pose::Pose;
use std::fmt::{self, Write};

const ROWS: [&str; 8] =
    ["x m", "y m", "z m", "translation m", "roll deg", "pitch deg", "yaw deg", "rotation deg"];

/// Differences of steps, and of the path they chain to.
#[derive(Default)]
pub struct Differences {
    rows: [Vec<f64>; 8],
    path_m: f64,
}

impl Differences {
    /// Adds a step, found and given, both `before_from_now`.
    pub fn add(&mut self, found: &Pose, given: &Pose) {
        let apart = (given.inverse() * *found).twist(1.0);
        let (t, r) = (apart.linear, apart.angular * 1f64.to_degrees());
        let values = [t.x, t.y, t.z, t.length(), r.x, r.y, r.z, r.length()];
        for (row, value) in self.rows.iter_mut().zip(values) {
            row.push(value.abs());
        }
        self.path_m += given.translation.length();
    }

    /// Length of the path of the given steps, m.
    #[cfg(test)]
    pub fn path_m(&self) -> f64 {
        self.path_m
    }

    /// The largest difference of a step, m.
    #[cfg(test)]
    pub fn worst_m(&self) -> f64 {
        self.rows[3].iter().copied().fold(0.0, f64::max)
    }

    /// The table, and how far apart the two paths end.
    pub fn table(&self, found: &Pose, given: &Pose) -> Result<String, fmt::Error> {
        let mut text = String::new();
        writeln!(text, "{:<16}{:>10}{:>10}{:>10}", "per step", "median", "95 %", "max")?;
        for (name, row) in ROWS.iter().zip(&self.rows) {
            let [median, high, max] = quantiles(row.iter().copied(), [0.5, 0.95, 1.0]);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_off_by_known_amounts() {
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
