//! Registration without an initial pose: ICP from several starts, and when to accept a result.

use crate::cloud::OrientedCloud;
use crate::gauss_newton::Correspondence;
use crate::icp::{IcpOptions, Registration, register};
use raywake_core::pose::Pose;

/// Minimum share of a cloud's flat patches that must lie on the other's: for clouds of different
/// places it is below 0.32, for sweeps 5 m apart above 0.5 (KITTI).
pub const OVERLAP_MIN: f64 = 0.4;
/// From this share on, no better pose is searched for: for consecutive sweeps of a drive it is
/// above 0.65, for a street shifted along itself below 0.5 (KITTI, Argoverse 2, simulated streets
/// at 33 m/s).
const OVERLAP_SURE: f64 = 0.5;
/// Further starts are this far off, in four directions, m, for motions that registration from no
/// motion does not reach.
const OFFSET_M: f64 = 5.0;
/// They are also rotated by this much to either side, rad.
const TURNED_RAD: f64 = 0.17;

impl Registration {
    /// Whether the clouds show the same place and determine the motion on the ground.
    pub fn is_accepted(&self) -> bool {
        self.converged && self.overlap >= OVERLAP_MIN && self.unobservable.planar == 0
    }

    fn is_sure(&self) -> bool {
        self.is_accepted() && self.overlap >= OVERLAP_SURE
    }
}

/// Finds the motion that aligns `source` with `target`, both from sweeps of one sensor close to
/// each other: starting at no motion and, if the result is not clear, at poses around it. Returns
/// the result with the largest overlap, accepted ones first; see [`Registration::is_accepted`].
pub fn register_multi_start(
    source: &OrientedCloud,
    target: &OrientedCloud,
    correspondences: &mut [Correspondence],
) -> Registration {
    let mut from = |start| register(source, target, start, &IcpOptions::DEFAULT, correspondences);
    let rank = |r: &Registration| (r.is_accepted(), r.overlap);
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

/// Starts other than no motion.
fn starts() -> impl Iterator<Item = Pose> {
    let places = [(0.0, 0.0), (OFFSET_M, 0.0), (-OFFSET_M, 0.0), (0.0, OFFSET_M), (0.0, -OFFSET_M)];
    let turned = move |yaw| places.map(|(x, y)| Pose::planar(x, y, 0.0, yaw));
    [0.0, TURNED_RAD, -TURNED_RAD].into_iter().flat_map(turned).skip(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deskew::{TimedPoint, thin_sweep};
    use crate::icp::CORRESPONDENCES;
    use crate::point::OrientedPoint;
    use core::f64::consts::TAU;
    use glam::DVec3;
    use raywake_core::pose::Twist;
    use raywake_core::sweep::{Point, Rig};
    use raywake_sim::{Drive, Ego, Options as Sim, Path, Rng, Scene, State};
    use std::vec;
    use std::vec::Vec;

    fn oriented(points: &[Point], rig: &Rig) -> Vec<OrientedPoint> {
        let mut storage = vec![TimedPoint::default(); points.len()];
        let thinned = thin_sweep(points, rig, &mut storage);
        thinned.iter().map(|p| p.at_stamp(&Twist::ZERO).into()).collect()
    }

    /// Motion from one sweep of a drive to the next, as found and as it was, using only what is
    /// more than this far above the ground.
    fn found_above(drive: &Drive, above_m: f64) -> (Registration, Pose) {
        let rig = Rig { distorted: false, ..drive.rig() };
        let [mut first, mut second] = [0, 1].map(|index| drive.sweep(index));
        let low_m = (rig.ground_m + above_m) as f32;
        let mut clouds = [&mut first, &mut second].map(|sweep| {
            sweep.points.retain(|p| p.position[2] > low_m);
            oriented(&sweep.points, &rig)
        });
        let truth = first.world_from_vehicle.inverse() * second.world_from_vehicle;
        (registered(&mut clouds), truth)
    }

    fn registered([target, source]: &mut [Vec<OrientedPoint>; 2]) -> Registration {
        let [target, source] = [target, source].map(|points| OrientedCloud::new(points));
        let mut correspondences = vec![Correspondence::default(); CORRESPONDENCES];
        register_multi_start(&source, &target, &mut correspondences)
    }

    /// Checks that the motion found, along the ground and in tilt, is close to the truth.
    fn close(found: &Registration, truth: &Pose, limit_m: f64) {
        let off = (truth.inverse() * found.pose).twist(1.0);
        let (metres, [_, _, yaw]) = (off.linear.length(), off.angular.to_array());
        assert!(found.is_accepted(), "{found:?}");
        assert!(metres < 0.05 && off.linear.truncate().length() < limit_m, "{off:?}, {found:?}");
        assert!(yaw.abs() < 1e-3 && off.angular.length() < 5e-3, "{off:?}, {found:?}");
    }

    /// A street looks much the same a few metres further on; at 33 m/s and above, registration may
    /// wrongly settle on no motion.
    #[test]
    fn fast_along_a_street() {
        for (seed, speed) in [(2, 33.0), (8, 40.0)] {
            let options = Sim { sweeps: 2, ego: Ego::Straight { speed }, ..Sim::default() };
            let (found, truth) = found_above(&Drive::new(seed, options), f64::NEG_INFINITY);
            close(&found, &truth, 0.05);
        }
    }

    /// Without ground hardly anything determines height, roll and pitch.
    #[test]
    fn clouds_without_ground() {
        for (seed, curvature) in (1..7).zip([0.0, 0.03].into_iter().cycle()) {
            let path =
                Path::from(State { speed: 12.0, ..State::default() }).then(1.0, 0.0, curvature);
            let options = Sim { sweeps: 2, ..Sim::default() };
            let drive = Drive::through(Scene::street(seed), path, seed, options);
            let (found, truth) = found_above(&drive, 0.3);
            close(&found, &truth, 0.02);
        }
    }

    /// Points on a surface of two parameters (0..1), with the noise of a sensor.
    fn surface(seed: u64, at: impl Fn(f64, f64) -> [f64; 3]) -> Vec<OrientedPoint> {
        let mut rng = Rng::new(seed);
        let mut points = Vec::new();
        for _ in 0..8000 {
            let mut noise = || 0.02 * rng.bell();
            let noise = DVec3::new(noise(), noise(), noise());
            let place = DVec3::from_array(at(rng.range(0.0, 1.0), rng.range(0.0, 1.0)));
            points.push((place + noise).into());
        }
        points
    }

    /// Scenes that look the same when displaced along some direction, seen twice: no motion would
    /// be a guess.
    #[test]
    fn underdetermined_input_is_refused() {
        let wall = |u: f64, v: f64| [40.0 * u - 20.0, 6.0, 8.0 * v - 1.7];
        let tunnel = |u: f64, v: f64| {
            let (sin, cos) = (libm::sin(TAU * v), libm::cos(TAU * v));
            [60.0 * u - 30.0, 5.0 * cos, 5.0 * sin + 2.0]
        };
        let ground = |u: f64, v: f64| [50.0 * u - 25.0, 50.0 * v - 25.0, -1.7];
        let mut scenes = [
            ([1, 2].map(|seed| surface(seed, wall)), 1),
            ([3, 4].map(|seed| surface(seed, tunnel)), 1),
            ([5, 6].map(|seed| surface(seed, ground)), 3),
        ];
        for (clouds, planar) in &mut scenes {
            let found = registered(clouds);
            assert_eq!(found.unobservable.planar, *planar, "{found:?}");
            assert!(found.overlap > OVERLAP_MIN && !found.is_accepted(), "{found:?}");
        }
    }
}
