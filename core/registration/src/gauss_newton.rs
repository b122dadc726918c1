//! One Gauss-Newton step of point-to-plane ICP: the rigid motion that brings points closer to their
//! planes.

use glam::{DMat3, DVec3};
use nalgebra::{Matrix6, SymmetricEigen, U6, Vector6};
use raywake_core::pose::{Pose, Twist};

/// A point of the source and the plane of the target it belongs to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Correspondence {
    /// The point as the current pose places it, m.
    pub point: DVec3,
    /// A point on the plane, m.
    pub on: DVec3,
    /// Unit normal of the plane.
    pub normal: DVec3,
    /// How much the correspondence counts.
    pub weight: f64,
}

impl Correspondence {
    /// One without any effect.
    pub const NONE: Correspondence =
        Correspondence { point: DVec3::ZERO, on: DVec3::ZERO, normal: DVec3::ZERO, weight: 0.0 };

    /// Distance of the point from the plane, m, signed along the normal.
    pub fn residual(&self) -> f64 {
        self.normal.dot(self.point - self.on)
    }
}

/// The step that a set of correspondences calls for.
#[derive(Clone, Copy, Debug)]
pub struct GaussNewtonStep {
    /// To be applied after the current pose.
    pub motion: Pose,
    /// Root mean square of the changes the step makes to the residuals, m.
    pub change_m: f64,
    /// Smallest eigenvalue of the normal matrix, for weights that sum to one and rotations in units
    /// of the points' spread: at most 1/3, and zero if some motion changes no residual.
    pub least_eigenvalue: f64,
    /// Motions that the correspondences do not determine; the step undoes what earlier ones did in
    /// these.
    pub unobservable: UnobservableMotions,
}

/// Number of independent motions that no residual determines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UnobservableMotions {
    /// Mostly translation along the ground or rotation on it: x, y, yaw.
    pub planar: usize,
    /// Mostly height, roll or pitch, which change little within a sweep.
    pub upright: usize,
}

impl UnobservableMotions {
    /// Nothing is known.
    pub const ALL: UnobservableMotions = UnobservableMotions { planar: 3, upright: 3 };

    /// The number of both kinds.
    pub fn count(&self) -> usize {
        self.planar + self.upright
    }
}

/// Points closer together than this have no direction, m.
const SPREAD_MIN_M: f64 = 1e-9;

/// The step that minimises the weighted squares of the linearised residuals. For motions whose
/// eigenvalue is not above `observable`, it undoes their part of `done`, the motion of all steps
/// before it. `None` if the weights sum to zero.
///
/// The unknowns are a rotation (times the spread) about the points' centre, then a translation, so
/// that all six are lengths and the two do not mix.
pub fn solve(
    correspondences: &[Correspondence],
    done: &Pose,
    observable: f64,
) -> Option<GaussNewtonStep> {
    let total: f64 = correspondences.iter().map(|c| c.weight).sum();
    if total.is_nan() || total <= 0.0 {
        return None;
    }
    let (centre, spread) = centre_and_spread(correspondences, total);
    let (mut matrix, mut right) = (Matrix6::zeros(), Vector6::zeros());
    for correspondence in correspondences {
        let row = jacobian(correspondence, centre, spread);
        let weight = correspondence.weight / total;
        matrix.ger(weight, &row, &row, 1.0);
        right.axpy(-weight * correspondence.residual(), &row, 1.0);
    }
    let eigen = SymmetricEigen::new(matrix);
    let done = about_inverse(done, centre, spread);
    let (x, unobservable) = observed(&eigen, &right, &done, observable);
    let (turn, shift) = (DVec3::new(x[0], x[1], x[2]), DVec3::new(x[3], x[4], x[5]));
    Some(GaussNewtonStep {
        motion: about(centre, turn / spread, shift),
        change_m: libm::sqrt(x.dot(&(matrix * x)).max(0.0)),
        least_eigenvalue: eigen.eigenvalues.min().max(0.0),
        unobservable,
    })
}

/// Weighted mean of the points and the root mean square of their distances from it, m.
fn centre_and_spread(correspondences: &[Correspondence], total: f64) -> (DVec3, f64) {
    let centre = correspondences.iter().map(|c| c.weight * c.point).sum::<DVec3>() / total;
    let square = |c: &Correspondence| c.weight * c.point.distance_squared(centre);
    let spread = libm::sqrt(correspondences.iter().map(square).sum::<f64>() / total);
    (centre, spread.max(SPREAD_MIN_M))
}

/// The solution along the eigenvectors whose eigenvalue is above `observable`, the way back along
/// the others, and how many of which kind those are.
fn observed(
    eigen: &SymmetricEigen<f64, U6>,
    right: &Vector6<f64>,
    done: &Vector6<f64>,
    observable: f64,
) -> (Vector6<f64>, UnobservableMotions) {
    let (mut x, mut unobservable) = (Vector6::zeros(), UnobservableMotions::default());
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > observable {
            x.axpy(vector.dot(right) / value, &vector, 1.0);
            continue;
        }
        x.axpy(-vector.dot(done), &vector, 1.0);
        let planar: f64 = vector.fixed_rows::<3>(2).norm_squared();
        match planar > 0.5 {
            true => unobservable.planar += 1,
            false => unobservable.upright += 1,
        }
    }
    (x, unobservable)
}

/// Derivatives of the residual with respect to rotation about the centre (times the spread) and
/// translation.
fn jacobian(of: &Correspondence, centre: DVec3, spread: f64) -> Vector6<f64> {
    let turn = (of.point - centre).cross(of.normal) / spread;
    Vector6::new(turn.x, turn.y, turn.z, of.normal.x, of.normal.y, of.normal.z)
}

/// Rotation by a vector (rad) about a centre, then a translation.
fn about(centre: DVec3, turn: DVec3, shift: DVec3) -> Pose {
    let rotation = Twist { linear: DVec3::ZERO, angular: turn }.over(1.0).rotation;
    let fixed = centre - DMat3::from_quat(rotation) * centre;
    Pose { rotation, translation: fixed + shift }
}

/// The unknowns of a motion that has led to where the centre is now.
fn about_inverse(motion: &Pose, centre: DVec3, spread: f64) -> Vector6<f64> {
    let turn = motion.twist(1.0).angular * spread;
    let shift = centre - motion.inverse().transform(centre);
    Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_sim::Rng;
    use std::vec::Vec;

    fn vector(rng: &mut Rng) -> DVec3 {
        DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0))
    }

    #[test]
    fn jacobian_is_the_derivative() {
        let mut rng = Rng::new(1);
        const H: f64 = 1e-5;
        for _ in 0..20 {
            let correspondence = Correspondence {
                point: 10.0 * vector(&mut rng),
                on: 10.0 * vector(&mut rng),
                normal: vector(&mut rng).normalize(),
                weight: 1.0,
            };
            let (centre, spread) = (vector(&mut rng), 7.0);
            let row = jacobian(&correspondence, centre, spread);
            for (k, derivative) in row.iter().enumerate() {
                let moved = |h: f64| {
                    let axis = h * DVec3::AXES[k % 3];
                    let motion = match k < 3 {
                        true => about(centre, axis / spread, DVec3::ZERO),
                        false => about(centre, DVec3::ZERO, axis),
                    };
                    Correspondence {
                        point: motion.transform(correspondence.point),
                        ..correspondence
                    }
                    .residual()
                };
                let numeric = (moved(H) - moved(-H)) / (2.0 * H);
                assert!((numeric - derivative).abs() < 1e-8, "{k}: {numeric} {derivative}");
            }
        }
    }

    #[test]
    fn one_plane_leaves_three_motions_unobserved() {
        let mut rng = Rng::new(2);
        let plane: Vec<Correspondence> = (0..100)
            .map(|_| {
                let on = 10.0 * vector(&mut rng) * DVec3::new(1.0, 1.0, 0.0);
                let point = on + DVec3::new(0.0, 0.0, 0.3);
                Correspondence { point, on, normal: DVec3::Z, weight: 1.0 }
            })
            .collect();
        let step = solve(&plane, &Pose::IDENTITY, 1e-3).unwrap();
        assert!(
            step.unobservable == UnobservableMotions { planar: 3, upright: 0 }
                && step.least_eigenvalue < 1e-12
        );
        let moved = step.motion.translation - DVec3::new(0.0, 0.0, -0.3);
        assert!(moved.length() < 1e-9 && step.motion.rotation.xyz().length() < 1e-9);
        assert!(solve(&[], &Pose::IDENTITY, 1e-3).is_none());
        let weightless = [Correspondence { weight: 0.0, ..plane[0] }];
        assert!(solve(&weightless, &Pose::IDENTITY, 1e-3).is_none());
    }
}
