//! Boxes seen from above.

use glam::DVec3;
use raywake_core::pose::Pose;

/// Footprint of a box.
#[derive(Clone, Copy, Debug)]
pub struct Footprint {
    box_from_vehicle: Pose,
    half: [f64; 2],
}

impl Footprint {
    /// The footprint of a box of this length and width.
    pub fn new(vehicle_from_box: Pose, length: f64, width: f64) -> Footprint {
        Footprint {
            box_from_vehicle: vehicle_from_box.inverse(),
            half: [0.5 * length, 0.5 * width],
        }
    }

    /// Whether a point (vehicle frame) lies above or below it, or within `margin` m of it.
    pub fn holds(&self, at: DVec3, margin: f64) -> bool {
        let p = self.box_from_vehicle.transform(at);
        p.x.abs() <= self.half[0] + margin && p.y.abs() <= self.half[1] + margin
    }

    /// Distance of a point (vehicle frame) from it, seen from above, m; 0 within it.
    pub fn distance_m(&self, at: DVec3) -> f64 {
        let p = self.box_from_vehicle.transform(at);
        let [x, y] = [p.x.abs() - self.half[0], p.y.abs() - self.half[1]].map(|v| v.max(0.0));
        x.hypot(y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inside_and_beside() {
        let f = Footprint::new(Pose::planar(10.0, 2.0, -0.8, 0.5), 4.0, 2.0);
        let at =
            |x: f64, y: f64| Pose::planar(10.0, 2.0, 0.0, 0.5).transform(DVec3::new(x, y, 0.0));
        assert!(f.holds(at(1.99, -0.99), 0.0) && !f.holds(at(2.1, 0.0), 0.0));
        assert!(f.holds(at(2.1, 0.0), 0.15) && !f.holds(at(0.0, 1.2), 0.15));
        let off = [at(-1.9, 0.9), at(0.0, -1.5), at(-2.3, 1.4)].map(|p| f.distance_m(p));
        assert!(off.iter().zip([0.0, 0.5, 0.5]).all(|(a, b)| (a - b).abs() < 1e-9), "{off:?}");
    }
}
