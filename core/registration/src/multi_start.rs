//! Registration without an initial pose: ICP from several starts, and when a result is accepted.

use crate::cloud::OrientedCloud;
use crate::gauss_newton::Correspondence;
use crate::icp::{IcpOptions, Registration, register};
use raywake_core::pose::Pose;

/// Least share of a cloud's flat patches that must lie on the other's: of clouds of different
/// places it is below 0.32, of sweeps 5 m apart above 0.5 (KITTI).
pub const OVERLAP_MIN: f64 = 0.4;
/// From this share on no better pose is looked for: of neighbours in a drive it is above 0.65, of
/// a street displaced along itself below 0.5 (KITTI, Argoverse 2, simulated streets at 33 m/s).
const OVERLAP_SURE: f64 = 0.5;
/// What registration from no motion does not reach is started this far off, in four directions, m.
const AWAY_M: f64 = 5.0;
/// And turned by this much to both sides, rad.
const TURNED_RAD: f64 = 0.17;

impl Registration {
    /// Whether the clouds show the same place and the pose is to be believed.
    pub fn is_accepted(&self) -> bool {
        self.converged && self.overlap >= OVERLAP_MIN
    }

    fn is_sure(&self) -> bool {
        self.converged && self.overlap >= OVERLAP_SURE && self.unobserved == 0
    }
}

/// The motion that lays `source` onto `target`, both of sweeps of one sensor near each other: from
/// no motion, and where that is not a clear answer from starts around it. The result that converged
/// with the largest overlap; [`Registration::is_accepted`] tells whether it will do.
pub fn register_multi_start(
    source: &OrientedCloud,
    target: &OrientedCloud,
    correspondences: &mut [Correspondence],
) -> Registration {
    let mut from = |start| register(source, target, start, &IcpOptions::DEFAULT, correspondences);
    let rank = |r: &Registration| (r.converged, r.overlap);
    let mut best = from(Pose::IDENTITY);
    for start in starts() {
        if best.is_sure() {
            break;
        }
        let other = from(start);
        if rank(&other) > rank(&best) {
            best = other;
        }
    }
    best
}

/// Where to start besides no motion.
fn starts() -> impl Iterator<Item = Pose> {
    let places = [(0.0, 0.0), (AWAY_M, 0.0), (-AWAY_M, 0.0), (0.0, AWAY_M), (0.0, -AWAY_M)];
    let turned = move |yaw| places.map(|(x, y)| Pose::planar(x, y, 0.0, yaw));
    [0.0, TURNED_RAD, -TURNED_RAD].into_iter().flat_map(turned).skip(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deskew::{TimedPoint, thin_sweep};
    use crate::icp::CORRESPONDENCES;
    use crate::point::OrientedPoint;
    use raywake_core::pose::Twist;
    use raywake_core::sweep::{Point, Rig};
    use raywake_sim::{Drive, Ego, Options as Sim};
    use std::vec;
    use std::vec::Vec;

    fn oriented(points: &[Point], rig: &Rig) -> Vec<OrientedPoint> {
        let mut storage = vec![TimedPoint::default(); points.len()];
        let thinned = thin_sweep(points, rig, &mut storage);
        thinned.iter().map(|p| p.at_stamp(&Twist::ZERO).into()).collect()
    }

    /// A street looks like itself a few metres on; at 33 m/s and more no motion is a wrong answer
    /// that registration settles on.
    #[test]
    fn fast_along_a_street() {
        for (seed, speed) in [(2, 33.0), (8, 40.0)] {
            let options = Sim { sweeps: 2, ego: Ego::Straight { speed }, ..Sim::default() };
            let drive = Drive::new(seed, options);
            let [first, second] = [0, 1].map(|index| drive.sweep(index));
            let rig = Rig { distorted: false, ..drive.rig() };
            let mut clouds = [&first, &second].map(|sweep| oriented(&sweep.points, &rig));
            let [target, source] = clouds.each_mut().map(|points| OrientedCloud::new(points));
            let mut correspondences = vec![Correspondence::default(); CORRESPONDENCES];
            let found = register_multi_start(&source, &target, &mut correspondences);
            let truth = first.world_from_vehicle.inverse() * second.world_from_vehicle;
            let off = (truth.inverse() * found.pose).twist(1.0);
            let (metres, degrees) = (off.linear.length(), off.angular.length().to_degrees());
            assert!(found.is_accepted(), "{found:?}");
            assert!(metres < 0.05 && degrees < 0.15, "{metres} m, {degrees} degrees: {found:?}");
        }
    }
}
