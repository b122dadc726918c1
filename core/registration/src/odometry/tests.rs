//! Drives with known motion.

use super::*;
use core::f64::consts::TAU;
use raywake_core::sweep::Timing;
use raywake_sim::{Drive, Ego, Options as Sim, Rng, SimSweep};
use std::vec;
use std::vec::Vec;

fn located(rig: &Rig, sweeps: &[SimSweep]) -> Vec<Located> {
    let mut odometry = raywake_alloc_guard::boxed!(Odometry, Odometry::new());
    sweeps.iter().map(|s| odometry.locate(s.stamp_s, &s.points, rig)).collect()
}

fn relative_pose(sweep: &SimSweep, since: &SimSweep) -> Pose {
    since.world_from_vehicle.inverse() * sweep.world_from_vehicle
}

fn drive(seed: u64, ego: Ego, sweeps: usize) -> Drive {
    Drive::new(seed, Sim { sweeps, ego, ..Sim::default() })
}

#[test]
fn simulated_drives_end_to_end() {
    let turn = Ego::Turn { left: true, speed: 5.0 };
    for (seed, ego, count) in [(4, Ego::Straight { speed: 11.0 }, 10), (5, turn, 25)] {
        let drive = drive(seed, ego, count);
        let rig = drive.rig();
        let sweeps: Vec<SimSweep> = drive.into_iter().collect();
        let found = located(&rig, &sweeps);
        assert_eq!(found[0].pose_status, PoseStatus::Start);
        assert!(found[1..].iter().all(|l| l.pose_status == PoseStatus::Registered), "{found:?}");
        let (end, last) = (found[count - 1], &sweeps[count - 1]);
        let truth = relative_pose(last, &sweeps[0]);
        let off = (truth.inverse() * end.world_from_vehicle).twist(1.0);
        let (metres, metres_away) = (off.linear.length(), truth.translation.length());
        assert!(metres < 0.003 * metres_away, "{metres} of {metres_away} m");
        assert!(off.angular.length() < 3e-3, "{off:?}");
        assert!((end.twist.linear - last.twist.linear).length() < 0.3, "{:?}", end.twist);
        if count == 10 {
            assert_eq!(found, located(&rig, &sweeps));
        }
    }
}

/// With the stamp at the start of each sweep, the first motion moves all returns in one direction.
#[test]
fn stamps_at_the_start_of_a_sweep() {
    let drive = drive(4, Ego::Straight { speed: 11.0 }, 4);
    let mut rig = drive.rig();
    let Timing::Offset { from_s, .. } = &mut rig.timing else { panic!("{:?}", rig.timing) };
    let sooner_s = std::mem::take(from_s);
    let mut sweeps: Vec<SimSweep> = drive.into_iter().collect();
    let points = sweeps.iter_mut().flat_map(|sweep| &mut sweep.points);
    points.for_each(|point| point.offset_s -= sooner_s as f32);
    let found = located(&rig, &sweeps);
    // The motion is constant: it is the same between stamps as between starts.
    for (sweep, found) in sweeps.iter().zip(&found) {
        let off = relative_pose(sweep, &sweeps[0]).inverse() * found.world_from_vehicle;
        assert!(off.translation.length() < 0.02, "{off:?}");
    }
}

/// Missing or empty sweeps along the way: it continues with constant motion, then recovers.
#[test]
fn gaps() {
    let drive = drive(4, Ego::Straight { speed: 11.0 }, 9);
    let rig = drive.rig();
    let mut sweeps: Vec<SimSweep> = drive.into_iter().collect();
    let bad = Point { position: [f32::NAN; 3], ..Point::default() };
    sweeps[5].points.fill(bad);
    sweeps.remove(3);
    let found = located(&rig, &sweeps);
    let lost: Vec<usize> =
        (1..8).filter(|n| found[*n].pose_status != PoseStatus::Registered).collect();
    assert_eq!((lost, found[4].pose_status), (vec![4], PoseStatus::Lost), "{found:?}");
    for (sweep, found) in sweeps.iter().zip(&found) {
        let off = relative_pose(sweep, &sweeps[0]).inverse() * found.world_from_vehicle;
        assert!(off.translation.length() < 0.05, "{off:?}");
    }
}

#[test]
fn a_tunnel_leaves_the_distance_undetermined() {
    let mut rng = Rng::new(9);
    let mut sweep = || -> Vec<Point> {
        let mut at = || {
            let (along, angle) = (rng.range(-40.0, 40.0), rng.range(0.0, TAU));
            let radius = 5.0 + 0.02 * rng.bell();
            [along, radius * libm::cos(angle), 2.0 + radius * libm::sin(angle)].map(|v| v as f32)
        };
        (0..40_000).map(|_| Point { position: at(), ..Point::default() }).collect()
    };
    let rig = at_stamp();
    let mut odometry = raywake_alloc_guard::boxed!(Odometry, Odometry::new());
    for n in 0..4 {
        let found = odometry.locate(0.1 * f64::from(n), &sweep(), &rig);
        let expected = if n == 0 { PoseStatus::Start } else { PoseStatus::Degenerate };
        assert_eq!(found.pose_status, expected, "{found:?}");
    }
}

/// A sweep of a vehicle at 22 m/s between guard rails, among others that are as fast, with or
/// without posts beside the rails.
fn motorway(rng: &mut Rng, sweep: usize, posts: bool) -> Vec<Point> {
    let gone_m = 2.2 * sweep as f64;
    let mut points = Vec::new();
    let mut add = |at: [f64; 3]| {
        let position = at.map(|v| (v + 0.01 * rng.bell()) as f32);
        points.push(Point { position, ..Point::default() });
    };
    for n in 0..150 {
        let x = 0.5 * f64::from(n) - 37.5;
        (0..24).for_each(|j| add([x, 0.5 * f64::from(j) - 6.0, -1.7]));
        [-6.5, 6.5]
            .into_iter()
            .for_each(|y| (0..4).for_each(|k| add([x, y, 0.25 * f64::from(k) - 1.7])));
    }
    // The rear of each of the others.
    for (x, y) in [(12.0, 0.0), (-9.0, 3.5), (20.0, 3.5)] {
        (0..8).for_each(|j| {
            (0..6).for_each(|k| add([x, y + 0.25 * f64::from(j), 0.25 * f64::from(k) - 1.5]))
        });
    }
    for post in 0..if posts { 80 } else { 0 } {
        let x = 9.0 * f64::from(post) - 20.0 - gone_m;
        for y in [-9.0, 8.0].into_iter().filter(|_| x.abs() < 40.0) {
            (0..12).for_each(|j| {
                (0..24).for_each(|k| add([x, y + 0.25 * f64::from(j), 0.25 * f64::from(k) - 1.5]))
            });
        }
    }
    points
}

#[test]
fn traffic_on_a_motorway_leaves_the_speed_undetermined() {
    let mut rng = Rng::new(3);
    let rig = at_stamp();
    let mut odometry = raywake_alloc_guard::boxed!(Odometry, Odometry::new());
    let found: Vec<Located> = (0..24)
        .map(|n| odometry.locate(0.1 * n as f64, &motorway(&mut rng, n, n >= 12), &rig))
        .collect();
    let among = &found[1..12];
    assert!(among.iter().all(|l| l.pose_status == PoseStatus::Degenerate), "{among:?}");
    // Static structure decides, once there is some.
    let last = found[23];
    assert_eq!(last.pose_status, PoseStatus::Registered, "{last:?}");
    assert!((last.twist.linear.x - 22.0).abs() < 0.3, "{last:?}");
}

/// Largest error of speed on a motorway without posts, m/s, behind lorries slower by 2 m/s, if the
/// speed is expected to be right within this distance per sweep.
fn speed_error(within_m: f64) -> f64 {
    let (mut rng, rig) = (Rng::new(3), at_stamp());
    let mut odometry = raywake_alloc_guard::boxed!(Odometry, Odometry::new());
    let twist = Twist { linear: 22.0 * DVec3::X, ..Twist::ZERO };
    let mut error = |n: usize| {
        let mut points = motorway(&mut rng, n, false);
        for (rear, y) in [(8.0, -5.0), (15.0, -1.5), (24.0, 2.0), (31.0, -5.0)] {
            let x = rear - 0.2 * n as f64;
            let all = (0..120)
                .map(|at| [x, y + 0.25 * f64::from(at % 10), 0.25 * f64::from(at / 10) - 1.2]);
            points.extend(all.map(|at| Point {
                position: at.map(|v| (v + 0.01 * rng.bell()) as f32),
                ..Point::default()
            }));
        }
        odometry.expect(twist, within_m);
        let found = odometry.locate(0.1 * n as f64, &points, &rig);
        (found.twist.linear.x - 22.0).abs()
    };
    (0..12).map(&mut error).fold(0.0, f64::max)
}

#[test]
fn a_well_known_speed_is_not_taken_from_traffic() {
    let [rough, fine] = [EXPECTED_WITHIN_M, 0.05].map(speed_error);
    assert!(rough > 0.2 && fine < 0.02, "{rough} {fine}");
}

/// A rig whose clouds are as they were at the stamp.
fn at_stamp() -> Rig {
    Rig {
        sensors: [Pose::IDENTITY].into_iter().collect(),
        timing: Timing::AtStamp,
        distorted: false,
        ground_m: -1.7,
        own_vehicle: None,
    }
}

#[test]
fn nothing_at_all() {
    let mut odometry = raywake_alloc_guard::boxed!(Odometry, Odometry::new());
    let rig = drive(1, Ego::Standing, 1).rig();
    for n in 0..3 {
        let found = odometry.locate(0.1 * f64::from(n), &[], &rig);
        let expected = if n == 0 { PoseStatus::Start } else { PoseStatus::Lost };
        assert_eq!((found.pose_status, found.world_from_vehicle), (expected, Pose::IDENTITY));
    }
}
