//! A point on a surface and its place in the k-d tree.

use glam::DVec3;

/// A point on a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OrientedPoint {
    /// Where it is, m.
    pub position: DVec3,
    /// Unit normal of either sign; zero if the surroundings are not flat.
    pub normal: DVec3,
    /// Axis along which the k-d tree splits at this point.
    pub(crate) axis: u8,
}

impl From<DVec3> for OrientedPoint {
    /// A point whose normal is not known yet.
    fn from(position: DVec3) -> OrientedPoint {
        OrientedPoint { position, ..OrientedPoint::default() }
    }
}

impl OrientedPoint {
    /// Whether its surroundings are flat.
    pub fn is_flat(&self) -> bool {
        self.normal != DVec3::ZERO
    }
}
