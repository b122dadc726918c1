//! Clouds with known motion.

use super::*;
use crate::point::OrientedPoint;
use glam::{DQuat, DVec3};
use raywake_sim::Rng;
use std::vec;
use std::vec::Vec;

/// A wall, ground and a slope, sampled every 0.3 m.
fn corner() -> Vec<DVec3> {
    let mut points = Vec::new();
    for i in 0..60 {
        for j in 0..20 {
            let (u, v) = (0.3 * f64::from(i) - 9.0, 0.3 * f64::from(j));
            points.push(DVec3::new(u, v - 3.0, -1.7));
            points.push(DVec3::new(u, 6.0, v));
            points.push(DVec3::new(9.0 + 0.3 * v, u, v - 1.0));
        }
    }
    points
}

/// Registers copies of two point sets.
fn registered(source: &[DVec3], target: &[DVec3], initial: Pose) -> Registration {
    let oriented =
        |points: &[DVec3]| -> Vec<_> { points.iter().copied().map(OrientedPoint::from).collect() };
    let (mut source, mut target) = (oriented(source), oriented(target));
    let [source, target] = [&mut source, &mut target].map(|points| OrientedCloud::new(points));
    let mut correspondences = vec![Correspondence::default(); CORRESPONDENCES];
    register(&source, &target, initial, &IcpOptions::DEFAULT, &mut correspondences)
}

fn moved(points: &[DVec3], pose: &Pose) -> Vec<DVec3> {
    points.iter().map(|p| pose.transform(*p)).collect()
}

/// Distance and angle (rad) between two poses.
fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
    let between = (a.inverse() * *b).twist(1.0);
    (between.linear.length(), between.angular.length())
}

fn motion(degrees: f64, axis: DVec3, translation: DVec3) -> Pose {
    Pose::new(DQuat::from_axis_angle(axis.normalize(), degrees.to_radians()), translation)
}

#[test]
fn an_exact_motion_is_recovered() {
    let target = corner();
    let cases = [
        motion(0.0, DVec3::X, DVec3::ZERO),
        motion(1.0, DVec3::new(0.2, -0.1, 1.0), DVec3::new(0.3, -0.1, 0.05)),
        motion(5.0, DVec3::new(0.1, 0.1, 1.0), DVec3::new(1.5, 0.5, -0.2)),
    ];
    for truth in cases {
        let source = moved(&target, &truth.inverse());
        let found = registered(&source, &target, Pose::IDENTITY);
        let (metres, radians) = apart(&found.pose, &truth);
        assert!(found.converged && found.unobservable.count() == 0, "{found:?}");
        assert!(metres < 1e-6 && radians < 1e-6, "{metres} m, {radians} rad, {found:?}");
        assert!(found.rms_m < 1e-6 && found.inliers > 3000, "{found:?}");
        assert_eq!(found, registered(&source, &target, Pose::IDENTITY));
    }
}

#[test]
fn moving_objects_do_not_count() {
    let truth = motion(2.0, DVec3::Z, DVec3::new(0.6, 0.0, 0.0));
    let mut rng = Rng::new(5);
    // A lorry's side and rear, a seventh of all points, that moves half a metre by itself.
    let lorry: Vec<DVec3> = (0..600)
        .map(|n| match n % 2 {
            0 => DVec3::new(rng.range(0.0, 8.0), 2.5, rng.range(-1.5, 1.5)),
            _ => DVec3::new(0.0, rng.range(2.5, 5.0), rng.range(-1.5, 1.5)),
        })
        .collect();
    let first: Vec<DVec3> = corner().into_iter().chain(lorry.iter().copied()).collect();
    let ahead = lorry.iter().map(|p| *p + DVec3::new(0.5, 0.3, 0.0));
    let second: Vec<DVec3> = corner().into_iter().chain(ahead).collect();
    let source = moved(&second, &truth.inverse());
    let found = registered(&source, &first, Pose::IDENTITY);
    let (metres, radians) = apart(&found.pose, &truth);
    assert!(found.converged && metres < 0.005 && radians < 5e-4, "{metres} m, {radians} rad");
}

#[test]
fn a_plane_determines_three_motions_and_no_more() {
    let mut rng = Rng::new(7);
    let mut plane = || -> Vec<DVec3> {
        let mut at = || rng.range(-10.0, 10.0);
        (0..4000).map(|_| DVec3::new(at(), at(), 0.001 * at())).collect()
    };
    let target = plane();
    let source: Vec<_> = plane().into_iter().map(|p| p - DVec3::new(0.0, 0.0, 0.2)).collect();
    let initial = Pose::planar(0.7, 0.1, 0.0, 0.02);
    let found = registered(&source, &target, initial);
    assert_eq!(found.unobservable.planar, 3, "{found:?}");
    assert!(found.least_eigenvalue < OBSERVABLE);
    let t = found.pose.translation;
    assert!((t - DVec3::new(0.7, 0.1, 0.2)).length() < 0.01, "{t}");
    assert!((found.pose.yaw_rad() - 0.02).abs() < 1e-3);
}

#[test]
fn bad_clouds_do_not_converge() {
    let good = corner();
    let empty = Vec::new();
    let identical = vec![DVec3::ONE; 5000];
    let few = good[..12].to_vec();
    let initial = Pose::planar(0.3, 0.0, 0.0, 0.01);
    for bad in [&empty, &identical, &few] {
        for (source, target) in [(bad, &good), (&good, bad), (bad, bad)] {
            let found = registered(source, target, initial);
            assert!(!found.converged && found.pose == initial, "{found:?}");
            assert!(found.rms_m == 0.0 && found.inliers == 0);
        }
    }
    // Nothing within reach.
    let away = Pose::planar(1e300, 0.0, 0.0, 0.0);
    assert!(!registered(&good, &good, away).converged);
    let nan = Pose { translation: DVec3::NAN, ..Pose::IDENTITY };
    let found = registered(&good, &good, nan);
    assert!(!found.converged && found.pose == Pose::IDENTITY);
}
