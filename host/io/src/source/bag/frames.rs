//! Which frames hang together, and where the vehicle was.

use std::collections::BTreeMap;

use raywake_core::pose::Pose;

use super::messages::Transform;

/// Frames that never move in another one: `/tf_static`.
#[derive(Default)]
pub(super) struct FixedFrames {
    /// Parent of a frame, and where the frame is in it.
    parents: BTreeMap<String, (String, Pose)>,
}

impl FixedFrames {
    /// Adds a link; the last word on a frame counts.
    pub fn add(&mut self, transform: Transform) {
        let Transform { parent, child, parent_from_child, .. } = transform;
        self.parents.insert(child, (parent, parent_from_child));
    }

    /// The frame that a frame is fixed to in the end, itself where it is to none, and its place in
    /// that: that of a vehicle for its sensors. `None` where links lead in a circle.
    pub fn base(&self, frame: &str) -> Option<(String, Pose)> {
        let (mut base, mut base_from_frame) = (frame, Pose::IDENTITY);
        for _ in 0..=self.parents.len() {
            let Some((parent, pose)) = self.parents.get(base) else {
                return Some((base.to_owned(), base_from_frame));
            };
            (base, base_from_frame) = (parent, *pose * base_from_frame);
        }
        None
    }
}

/// Longest time between two poses that is bridged, ns.
const GAP_MAX_NS: i64 = 500_000_000;

/// Where a frame was, over time.
#[derive(Default)]
pub(super) struct Trajectory {
    /// Times, ns, and poses; in order of time once it is sorted.
    rows: Vec<(i64, Pose)>,
}

impl Trajectory {
    pub fn add(&mut self, stamp_ns: i64, pose: Pose) {
        self.rows.push((stamp_ns, pose));
    }

    pub fn sort(&mut self) {
        self.rows.sort_by_key(|row| row.0);
    }

    /// The pose at a time, ns, between the two beside it; `None` before the first, after the last
    /// and in gaps.
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
    fn frames_hang_together() {
        let mut fixed = FixedFrames::default();
        let mut link = |parent: &str, child: &str, x| {
            fixed.add(Transform {
                stamp_ns: 0,
                parent: parent.into(),
                child: child.into(),
                parent_from_child: Pose::planar(x, 0.0, 0.0, std::f64::consts::FRAC_PI_2),
            })
        };
        link("base", "mast", 1.0);
        link("mast", "lidar", 2.0);
        link("a", "b", 0.0);
        link("b", "a", 0.0);
        let (base, pose) = fixed.base("lidar").unwrap();
        // Along the mast's x axis, which is the base's y axis.
        assert!((pose.translation - glam::dvec3(1.0, 2.0, 0.0)).length() < 1e-12, "{pose:?}");
        assert_eq!((base.as_str(), fixed.base("camera").unwrap().0.as_str()), ("base", "camera"));
        assert!(fixed.base("a").is_none());
    }

    #[test]
    fn poses_between_others() {
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
