//! Poses of a vehicle over time.

use raywake_core::pose::Pose;

/// Longest time between two poses that is interpolated, ns.
const GAP_MAX_NS: i64 = 500_000_000;

/// Poses of a frame over time.
#[derive(Default)]
pub(super) struct Trajectory {
    /// Times, ns, and poses; ordered by time once sorted.
    rows: Vec<(i64, Pose)>,
}

impl Trajectory {
    pub fn add(&mut self, stamp_ns: i64, pose: Pose) {
        self.rows.push((stamp_ns, pose));
    }

    pub fn sort(&mut self) {
        self.rows.sort_by_key(|row| row.0);
    }

    /// The pose at a time, ns; up to `slack_ns` beyond an end, the pose there.
    pub fn near(&self, stamp_ns: i64, slack_ns: i64) -> Option<Pose> {
        let (first, last) = (self.rows.first()?.0, self.rows.last()?.0);
        let inside = stamp_ns.clamp(first, last);
        self.at(inside).filter(|_| inside.abs_diff(stamp_ns) <= slack_ns.unsigned_abs())
    }

    /// The pose at a time, ns, interpolated between its neighbours; `None` before the first, after
    /// the last and in gaps.
    pub fn at(&self, stamp_ns: i64) -> Option<Pose> {
        let after = self.rows.partition_point(|row| row.0 < stamp_ns);
        let (end_ns, end) = *self.rows.get(after)?;
        if end_ns == stamp_ns {
            return Some(end);
        }
        let (begin_ns, begin) = *self.rows.get(after.checked_sub(1)?)?;
        let gap_ns = end_ns.checked_sub(begin_ns).filter(|gap| *gap <= GAP_MAX_NS)?;
        let step = (begin.inverse() * end).twist(1.0);
        Some(begin * step.over((stamp_ns - begin_ns) as f64 / gap_ns as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_interpolated() {
        let mut trajectory = Trajectory::default();
        for n in [2, 0, 1, 9] {
            trajectory.add(n * 100_000_000, Pose::planar(n as f64, 0.0, 0.0, 0.1 * n as f64));
        }
        trajectory.sort();
        let at = |ns| trajectory.at(ns).map(|p| (p.translation.x, p.yaw_rad()));
        let (x, yaw) = at(125_000_000).unwrap();
        assert!((x - 1.25).abs() < 0.01 && (yaw - 0.125).abs() < 1e-9, "{x} {yaw}");
        assert_eq!(at(0).unwrap().0, 0.0);
        assert!(at(-1).is_none() && at(901_000_000).is_none() && at(500_000_000).is_none());
    }
}
