//! Moments of points and the plane they lie on.

use glam::DVec3;
use nalgebra::{Matrix3, SymmetricEigen};

/// A patch is flat if its smallest variance is below this share of the middle one.
const FLAT: f64 = 0.1;
/// A patch is not a line if its middle variance is above this share of the largest one. Along a
/// line, such as a single beam leaves on the ground, the normal is arbitrary.
const WIDE: f64 = 0.05;

/// Number, sum and squares of points near the origin.
#[derive(Clone, Copy, Debug)]
pub struct PointMoments {
    /// Number of points; old ones may count as fractions.
    pub count: f64,
    sum: DVec3,
    /// xx, yy, zz.
    squares: DVec3,
    /// yz, zx, xy.
    products: DVec3,
}

impl PointMoments {
    /// The moments of no points.
    pub const NONE: PointMoments =
        PointMoments { count: 0.0, sum: DVec3::ZERO, squares: DVec3::ZERO, products: DVec3::ZERO };

    /// Adds a point.
    pub fn add(&mut self, p: DVec3) {
        self.count += 1.0;
        self.sum += p;
        self.squares += p * p;
        self.products += DVec3::new(p.y * p.z, p.z * p.x, p.x * p.y);
    }

    /// Makes every point so far count half from now on.
    pub fn halve(&mut self) {
        self.count *= 0.5;
        self.sum *= 0.5;
        self.squares *= 0.5;
        self.products *= 0.5;
    }

    /// Mean of the points.
    pub fn mean(&self) -> DVec3 {
        self.sum / self.count
    }

    /// Unit normal of the plane of the points (principal components: Hoppe et al. 1992), and the
    /// variance of its direction (rad^2); `None` if they do not lie on a plane.
    pub fn normal(&self) -> Option<(DVec3, f64)> {
        let m = self.mean();
        let [xx, yy, zz] = (self.squares / self.count - m * m).to_array();
        let cross = DVec3::new(m.y * m.z, m.z * m.x, m.x * m.y);
        let [yz, zx, xy] = (self.products / self.count - cross).to_array();
        let covariance = Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz);
        let eigen = SymmetricEigen::new(covariance);
        let mut order = [0, 1, 2];
        order.sort_unstable_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
        let [least, middle, largest] = order.map(|n| eigen.eigenvalues[n]);
        if least < FLAT * middle && middle > WIDE * largest {
            let [x, y, z] = [0, 1, 2].map(|row| eigen.eigenvectors[(row, order[0])]);
            let normal = DVec3::new(x, y, z).try_normalize()?;
            return Some((normal, least.max(0.0) / (middle * self.count)));
        }
        None
    }
}
