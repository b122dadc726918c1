//! One step of Gauss and Newton: the rigid motion that brings points closer to planes.

use super::eigen;
use glam::{DMat3, DVec3};
use raywake_core::pose::{Pose, Twist};

/// A point and the plane it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Point of the source as the current pose places it, m.
    pub point: DVec3,
    /// A point of the plane, m.
    pub on: DVec3,
    /// Unit normal of the plane.
    pub normal: DVec3,
    /// How much the pair counts.
    pub weight: f64,
}

impl Pair {
    /// Distance of the point from the plane, m, with the sign of the normal.
    pub fn residual(&self) -> f64 {
        self.normal.dot(self.point - self.on)
    }
}

/// What a set of pairs asks for.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// To be applied after the current pose.
    pub motion: Pose,
    /// Length of the step, m: translation, and rotation times the spread of the points.
    pub length_m: f64,
    /// Least eigenvalue of the normal matrix, for pairs of weight one in all and rotations in units
    /// of the points' spread: at most 1/3, and zero where some motion leaves every residual alone.
    pub least_eigenvalue: f64,
    /// Independent motions that the pairs do not tell; the step has nothing of them.
    pub unobserved: usize,
}

/// The step that minimises the weighted squares of the linearised residuals. Motions whose
/// eigenvalue is below `observable` are left out. `None` where the weights sum to nothing.
///
/// Unknowns are a rotation (times the spread) about the pairs' centre, then a translation, so that
/// all six are lengths and the two do not mix.
pub fn solve(pairs: &[Pair], observable: f64) -> Option<Step> {
    let total: f64 = pairs.iter().map(|p| p.weight).sum();
    if total.is_nan() || total <= 0.0 {
        return None;
    }
    let centre = pairs.iter().map(|p| p.weight * p.point).sum::<DVec3>() / total;
    let square = |p: &Pair| p.weight * p.point.distance_squared(centre);
    let spread = (pairs.iter().map(square).sum::<f64>() / total).sqrt().max(1e-9);
    let (mut matrix, mut right) = ([[0.0; 6]; 6], [0.0; 6]);
    for pair in pairs {
        let row = jacobian(pair, centre, spread);
        let weight = pair.weight / total;
        let pull = -weight * pair.residual();
        for i in 0..6 {
            right[i] += pull * row[i];
            for j in 0..6 {
                matrix[i][j] += weight * row[i] * row[j];
            }
        }
    }
    let (values, vectors) = eigen::symmetric(matrix);
    let mut x = [0.0; 6];
    for (value, vector) in values.iter().zip(&vectors).filter(|(v, _)| **v > observable) {
        let along: f64 = vector.iter().zip(&right).map(|(a, b)| a * b).sum();
        for (x, v) in x.iter_mut().zip(vector) {
            *x += along / value * v;
        }
    }
    let (turn, shift) = (DVec3::new(x[0], x[1], x[2]), DVec3::new(x[3], x[4], x[5]));
    Some(Step {
        motion: about(centre, turn / spread, shift),
        length_m: turn.length() + shift.length(),
        least_eigenvalue: values[0].max(0.0),
        unobserved: values.iter().filter(|v| **v <= observable).count(),
    })
}

/// Derivatives of the residual by rotation about the centre (times the spread) and translation.
fn jacobian(pair: &Pair, centre: DVec3, spread: f64) -> [f64; 6] {
    let turn = (pair.point - centre).cross(pair.normal) / spread;
    let n = pair.normal;
    [turn.x, turn.y, turn.z, n.x, n.y, n.z]
}

/// Rotation by a vector (rad) about a centre, then a translation.
fn about(centre: DVec3, turn: DVec3, shift: DVec3) -> Pose {
    let rotation = Twist { linear: DVec3::ZERO, angular: turn }.over(1.0).rotation;
    let fixed = centre - DMat3::from_quat(rotation) * centre;
    Pose { rotation, translation: fixed + shift }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_sim::Rng;

    fn vector(rng: &mut Rng) -> DVec3 {
        DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0))
    }

    #[test]
    fn jacobian_is_the_derivative() {
        let mut rng = Rng::new(1);
        const H: f64 = 1e-5;
        for _ in 0..20 {
            let pair = Pair {
                point: 10.0 * vector(&mut rng),
                on: 10.0 * vector(&mut rng),
                normal: vector(&mut rng).normalize(),
                weight: 1.0,
            };
            let (centre, spread) = (vector(&mut rng), 7.0);
            let row = jacobian(&pair, centre, spread);
            for (k, derivative) in row.iter().enumerate() {
                let moved = |h: f64| {
                    let axis = h * DVec3::AXES[k % 3];
                    let motion = match k < 3 {
                        true => about(centre, axis / spread, DVec3::ZERO),
                        false => about(centre, DVec3::ZERO, axis),
                    };
                    Pair { point: motion.transform(pair.point), ..pair }.residual()
                };
                let numeric = (moved(H) - moved(-H)) / (2.0 * H);
                assert!((numeric - derivative).abs() < 1e-8, "{k}: {numeric} {derivative}");
            }
        }
    }

    #[test]
    fn one_plane_leaves_three_motions_open() {
        let mut rng = Rng::new(2);
        let plane: Vec<Pair> = (0..100)
            .map(|_| {
                let on = 10.0 * vector(&mut rng) * DVec3::new(1.0, 1.0, 0.0);
                let point = on + DVec3::new(0.0, 0.0, 0.3);
                Pair { point, on, normal: DVec3::Z, weight: 1.0 }
            })
            .collect();
        let step = solve(&plane, 1e-3).unwrap();
        assert!(step.unobserved == 3 && step.least_eigenvalue < 1e-12);
        let moved = step.motion.translation - DVec3::new(0.0, 0.0, -0.3);
        assert!(moved.length() < 1e-9 && step.motion.rotation.xyz().length() < 1e-9);
        assert!(solve(&[], 1e-3).is_none());
        let weightless = [Pair { weight: 0.0, ..plane[0] }];
        assert!(solve(&weightless, 1e-3).is_none());
    }
}
