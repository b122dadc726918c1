//! How frames are connected.

use std::collections::BTreeMap;

use raywake_core::pose::Pose;

use super::messages::Transform;

/// Frames that never move in another frame: `/tf_static`.
#[derive(Default)]
pub(super) struct FixedFrames {
    /// Parent of a frame, and where the frame is in it.
    parents: BTreeMap<String, (String, Pose)>,
}

impl FixedFrames {
    /// Adds a link; the last one given for a frame counts.
    pub fn add(&mut self, transform: Transform) {
        let Transform { parent, child, parent_from_child, .. } = transform;
        self.parents.insert(child, (parent, parent_from_child));
    }

    /// Whether a frame is fixed to another one.
    pub fn has(&self, frame: &str) -> bool {
        self.parents.contains_key(frame)
    }

    /// The frame that a frame is ultimately fixed to (itself if to none), and the frame's pose in
    /// it: for sensors, the vehicle's. `None` if links form a circle.
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
}
