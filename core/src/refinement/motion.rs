//! Rigid motion of a cluster.

use nalgebra::{Matrix2x3, Matrix3, Vector3};

/// Maximum number of sweeps that a cluster is compared with: the pair's second, the one before the
/// pair, and the oldest, in which what is slow has moved most. More are not worth their time.
pub const TARGETS_MAX: usize = 3;

/// Rigid motion in the plane over one pair of sweeps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Displacement of the centre, voxels, and rotation about it, rad.
    pub delta: Vector3<f32>,
    /// Centre, voxels from the first sweep's window corner.
    pub centre: [f32; 2],
    /// Covariance of `delta`.
    pub covariance: Matrix3<f32>,
    /// How much later after its stamp each target sweep sees the cluster, in spans of the pair: a
    /// cluster passing by is not seen at the same time in every revolution.
    pub delay: [f32; TARGETS_MAX],
}

impl Motion {
    /// No motion, about a centre.
    pub fn around(centre: [f32; 2]) -> Motion {
        Motion { centre, ..Motion::default() }
    }

    /// The same motion with this displacement added.
    pub fn displaced(self, by: [f32; 2]) -> Motion {
        Motion { delta: self.delta + Vector3::new(by[0], by[1], 0.0), ..self }
    }

    /// The same motion about another centre.
    pub fn about(&self, centre: [f32; 2]) -> Motion {
        let [x, y] = self.of(centre);
        Motion { delta: Vector3::new(x, y, self.delta.z), centre, ..*self }
    }

    /// Whether it displaces its centre within `distance` of where another motion does.
    pub fn is_near(&self, other: &Motion, distance: f32) -> bool {
        let [x, y] = other.of(self.centre);
        libm::hypotf(self.delta.x - x, self.delta.y - y) < distance
    }

    /// Displacement of a place, voxels.
    pub fn of(&self, at: [f32; 2]) -> [f32; 2] {
        let [x, y] = [at[0] - self.centre[0], at[1] - self.centre[1]];
        [self.delta.x - self.delta.z * y, self.delta.y + self.delta.z * x]
    }

    /// Covariance of the displacement of a place (xx, xy, yy), voxels².
    pub fn covariance_of(&self, at: [f32; 2]) -> [f32; 3] {
        let [x, y] = [at[0] - self.centre[0], at[1] - self.centre[1]];
        let j = Matrix2x3::new(1.0, 0.0, -y, 0.0, 1.0, x);
        let c = j * self.covariance * j.transpose();
        [c[(0, 0)], c[(0, 1)], c[(1, 1)]]
    }
}
