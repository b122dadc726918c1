//! Collision checks between paths.

use crate::object::Fixture;
use crate::path::Path;
use crate::shape::Shape;

/// Interval between times at which paths are compared, s.
const CHECK_S: f64 = 0.1;

/// Discs that cover an object over time.
pub(super) struct Footprint {
    /// Centres by time, then along the object, m; a single time if it never moves.
    centres: Vec<Vec<[f64; 2]>>,
    radius: f64,
    /// Box of all centres, grown by the radius: minimum and maximum, m.
    bounds: [[f64; 2]; 2],
}

impl Footprint {
    pub(super) fn new(path: &Path, length: f64, width: f64, duration_s: f64) -> Footprint {
        let count = (length / width).ceil().max(1.0);
        let discs = |t: f64| {
            let state = path.at(t);
            let (s, c) = state.yaw.sin_cos();
            let along = |i: u32| (f64::from(i) + 0.5) / count * length - 0.5 * length;
            (0..count as u32).map(|i| [state.x + c * along(i), state.y + s * along(i)]).collect()
        };
        let steps = if path.is_static() { 1 } else { (duration_s / CHECK_S).ceil() as u32 + 1 };
        let centres: Vec<Vec<[f64; 2]>> =
            (0..steps).map(|i| discs(f64::from(i) * CHECK_S)).collect();
        let radius = 0.5 * width + 0.15;
        let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for c in centres.iter().flatten() {
            for axis in 0..2 {
                bounds[0][axis] = bounds[0][axis].min(c[axis] - radius);
                bounds[1][axis] = bounds[1][axis].max(c[axis] + radius);
            }
        }
        Footprint { centres, radius, bounds }
    }

    pub(super) fn touches(&self, other: &Footprint) -> bool {
        let (a, b) = (&self.bounds, &other.bounds);
        if (0..2).any(|i| a[1][i] < b[0][i] || b[1][i] < a[0][i]) {
            return false;
        }
        let apart = (self.radius + other.radius).powi(2);
        let near =
            |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) < apart;
        let meet = |a: &[[f64; 2]], b: &[[f64; 2]]| a.iter().any(|p| b.iter().any(|q| near(p, q)));
        let (a, b) = (&self.centres, &other.centres);
        let at = |v: &'_ [Vec<[f64; 2]>], i: usize| i.min(v.len() - 1);
        (0..a.len().max(b.len())).any(|i| meet(&a[at(a, i)], &b[at(b, i)]))
    }
}

/// Footprint of something one could walk into: poles, bins, bicycles and similar. Longer fixtures
/// lie where no path leads, and crowns hang above.
pub(super) fn obstacle(fixture: &Fixture) -> Option<Footprint> {
    let [length, width] = match fixture.shape {
        Shape::Cylinder { radius, .. } => [2.0 * radius; 2],
        Shape::Cuboid { half } if half.x < 1.0 => [2.0 * half.x, 2.0 * half.y],
        _ => return None,
    };
    let at = fixture.pose.translation;
    let place = Path::stationary(at.x, at.y, fixture.pose.yaw_rad());
    Some(Footprint::new(&place, length.max(width), length.min(width).max(0.1), 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::State;

    #[test]
    fn two_paths_that_cross() {
        let to = |x: f64, y: f64, yaw: f64| {
            let path = Path::from(State { x, y, yaw, speed: 5.0 });
            Footprint::new(&path, 4.0, 2.0, 6.0)
        };
        let a = to(0.0, 0.0, 0.0);
        assert!(a.touches(&to(10.0, -10.0, std::f64::consts::FRAC_PI_2)), "at the same time");
        assert!(!a.touches(&to(10.0, -25.0, std::f64::consts::FRAC_PI_2)), "later");
        let still = |x: f64, y: f64| Footprint::new(&Path::stationary(x, y, 0.0), 0.2, 0.2, 0.0);
        assert!(a.touches(&still(20.0, 1.1)) && still(20.0, 1.1).touches(&a), "on the way");
        assert!(!a.touches(&still(20.0, 1.6)) && !a.touches(&still(40.0, 0.0)), "beside, beyond");
    }
}
