//! What rays say about a place.

use super::super::sample::SurfaceWeight;
use super::super::sightlines::{Sightlines, UnsortedRay};
use super::*;
use crate::frame;
use crate::params::SIGHTLINES_MAX;
use crate::pose::{Pose, Twist};
use crate::prepare::Placement;
use crate::random::Random;
use crate::sweep::{Rig, Sweep, Timing};
use raywake_simd::Simd;

/// A sensor in the window, and one beside it.
const EYES: [[f32; 3]; 2] = [[20.0, 20.0, 5.0], [-40.0, 30.0, 5.0]];
/// A surface of unknown orientation: taken as perpendicular to the line of sight.
const UNKNOWN: SurfaceWeight = [1.0, 0.0, 0.0, 1.0, 0.0, 1.0];

fn sightlines(sensors: &SensorPaths, ends: &[([f32; 3], u32, f32)]) -> Box<Sightlines> {
    let mut sightlines = raywake_alloc_guard::boxed!(Sightlines, Sightlines::new());
    let point = |&(_, sensor, _): &(_, u32, f32)| Point { sensor, ..Point::default() };
    let points: Vec<Point> = ends.iter().map(point).collect();
    let placed: Vec<Placed> =
        ends.iter().map(|&(at, _, offset_s)| Placed { at, offset_s }).collect();
    let mut rays = [UnsortedRay::NONE; SIGHTLINES_MAX];
    sightlines.fill(sensors, all(&points), &placed, Simd::BASELINE, &mut rays);
    sightlines
}

#[test]
fn rays_pass_through_end_at_or_stop_before_a_place() {
    let sensors = SensorPaths::at_rest(EYES);
    // All around the sensor, including across the seam of azimuths.
    for n in 0..400 {
        let azimuth = n as f32 * std::f32::consts::TAU / 400.0;
        let along = |distance: f32| {
            let [x, y] = [azimuth.cos(), azimuth.sin()].map(|v| v * distance);
            [EYES[0][0] + x, EYES[0][1] + y, 5.0 + 0.1 * distance]
        };
        let depth = |end: f32, off: f32| {
            let rays = sightlines(&sensors, &[(along(end), 0, 0.0)]);
            let [x, y, z] = along(20.0);
            rays.depth(Simd::BASELINE, &scaled(), [x, y, z + off], &UNKNOWN, 0.0)
        };
        // With the slope, 20 voxels in the plane are 20.1 along the ray.
        for end in [12.0, 20.0, 33.0] {
            let behind = depth(end, 0.0).unwrap();
            assert!((behind - 1.005 * (end - 20.0)).abs() < 0.05, "{n}: {end} {behind}");
        }
        // 0.1 m is a third of a voxel.
        assert!(depth(33.0, 0.3).is_some() && depth(33.0, -0.3).is_some(), "{n}");
        assert!(depth(33.0, 0.4).is_none() && depth(33.0, -0.4).is_none(), "{n}");
    }
}

#[test]
fn the_nearest_ray_of_all_sensors_decides() {
    let sensors = SensorPaths::at_rest(EYES);
    let place = [30.0, 30.0, 5.0];
    let through = |sensor: usize, off: f32| {
        let eye = EYES[sensor];
        let end: [f32; 3] = std::array::from_fn(|a| eye[a] + 2.0 * (place[a] - eye[a]));
        ([end[0], end[1], end[2] + 2.0 * off], sensor as u32, 0.0)
    };
    let at = ([30.0, 30.0, 5.1], 0, 0.0);
    let depth = |ends: &[_]| {
        sightlines(&sensors, ends).depth(Simd::BASELINE, &scaled(), place, &UNKNOWN, 0.0).unwrap()
    };
    assert!(depth(&[at, through(1, 0.0)]) > 10.0);
    assert!(depth(&[at, through(1, 0.2)]).abs() < 0.1);
    // Along a wall, a ray passes near and never meets it.
    let wall: SurfaceWeight = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    let beside = ([60.0, 29.9, 5.0], 1, 0.0);
    let along = sightlines(&SensorPaths::at_rest([EYES[0], [-40.0, 29.8, 5.0]]), &[beside]);
    assert!(
        along
            .depth(Simd::BASELINE, &scaled(), place, &UNKNOWN, 0.0)
            .is_some_and(|behind| behind > 10.0)
    );
    assert!(along.depth(Simd::BASELINE, &scaled(), place, &wall, 0.0).is_none());
}

#[test]
fn sensor_origin_is_taken_at_the_time_of_the_return() {
    // It moves 7 voxels per sweep and rotates once, clockwise from the rear; at 20 voxels, 7 voxels
    // are 19 degrees.
    let twist = Twist { linear: glam::DVec3::X * 21.0, ..Default::default() };
    let rig = Rig {
        sensors: [Pose::IDENTITY].into_iter().collect(),
        timing: Timing::Offset { from_s: -0.05, span_s: 0.1 },
        distorted: true,
        ground_m: -1.73,
        own_vehicle: None,
    };
    let profile = profile();
    let pose = Pose::IDENTITY;
    let sweep = Sweep { stamp_s: 0.0, points: &[], world_from_vehicle: pose, twist };
    let window = &frame::place(&profile, &rig, &pose, None);
    let placement = Placement { profile: &profile, rig: &rig, window, sweep: &sweep };
    let sensors = SensorPaths::new(&placement);
    let eye = |offset_s: f32| sensors.at(0, sensors.part(offset_s));
    let [first, last] = [-0.05, 0.05].map(eye);
    let gone: [f32; 3] = std::array::from_fn(|a| last[a] - first[a]);
    assert!((gone[0] - 7.0).abs() < 1e-4 && gone[1] == 0.0 && gone[2] == 0.0, "{gone:?}");
    // At the stamp it is 1.73 m, 5.77 voxels, above the ground, at the height of the anchor.
    assert!(
        (eye(0.0)[0] - 31.5).abs() < 1e-4 && (eye(0.0)[2] - 7.5).abs() < 1e-4,
        "{:?}",
        eye(0.0)
    );
    let along = |n: usize, distance: f32| {
        let (offset_s, turned) =
            (0.000025 * n as f32 - 0.05, n as f32 * std::f32::consts::TAU / 4000.0);
        let eye = eye(offset_s);
        let at = [eye[0] - distance * turned.cos(), eye[1] + distance * turned.sin(), eye[2]];
        (at, 0, offset_s)
    };
    let ends: Vec<_> = (0..4000).map(|n| along(n, 30.0)).collect();
    let rays = sightlines(&sensors, &ends);
    // Except for the rear, where the sweep begins and ends.
    for n in (400..3600).step_by(7) {
        let place = along(n, 20.0).0;
        // Whenever it is assumed to have been seen.
        for offset_s in [-0.05, 0.0, 0.05] {
            let behind = rays.depth(Simd::BASELINE, &scaled(), place, &UNKNOWN, offset_s);
            assert!(behind.is_some_and(|b| (b - 10.0).abs() < 0.1), "{n} {offset_s}: {behind:?}");
        }
    }
}

#[test]
fn more_rays_than_there_is_room_for_are_thinned_evenly() {
    let sensors = SensorPaths::at_rest(EYES);
    // Column by column of 64 rings, as a spinning sensor sends them.
    let end = |n: usize| {
        let (azimuth, ring) = ((n / 64) as f32 * std::f32::consts::TAU / 4096.0, n % 64);
        let [x, y] = [azimuth.cos(), azimuth.sin()].map(|v| 20.0 + 30.0 * v);
        ([x, y, 5.0 + 0.25 * (ring as f32 - 32.0)], 0, 0.0)
    };
    let ends: Vec<_> = (0..4 * SIGHTLINES_MAX).map(end).collect();
    let rays = sightlines(&sensors, &ends);
    // Every place has a kept ray within reach; with only every fourth ring, some would have none.
    for n in (0..ends.len()).step_by(37) {
        let behind = rays.depth(Simd::BASELINE, &scaled(), ends[n].0, &UNKNOWN, 0.0);
        assert!(behind.is_some_and(|behind| behind.abs() < 0.1), "{n}: {behind:?}");
    }
}

#[test]
fn a_ring_moving_with_the_sensor_is_static() {
    // A wall 6 voxels beside the path, at 7 voxels per sweep; one ring is seen on it: a hyperbola.
    let wall = |n: usize| {
        let eye = [10.0 + 7.0 * n as f32, 20.0, GROUND + 6.0];
        // No ray reaches what lies behind it.
        let mut returns = Returns::default();
        for placed in Returns::flat().placed.iter().filter(|p| p.at[1] < 26.0) {
            returns.add(placed.at, 0);
        }
        for k in -60..60 {
            let along = 0.25 * k as f32;
            let at = [eye[0] + along, 25.9, eye[2] - 0.35 * along.hypot(5.9)];
            returns.add(at, 0);
        }
        (returns, SensorPaths::at_rest([eye; 2]))
    };
    let found = |sight_residual: f32| {
        let mut profile = profile();
        profile.refinement.sight_residual = sight_residual;
        let mut refinement = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
        for n in 0..3 {
            let (returns, sensors) = wall(n);
            give_seen(&mut refinement, &profile, &returns, &sensors, n);
        }
        run(&mut refinement, &vec![pack_flow([7, 0]); SIDE * SIDE]);
        motions(&refinement).iter().flatten().count()
    };
    // If only nearby returns decide, it moves.
    let [decided, near] = [scaled().params.sight_residual, 1.1].map(found);
    assert!(decided == 0 && near > 20, "{decided} {near}");
}

#[test]
fn bands_hide_no_ray() {
    // Rays of all slopes, and places anywhere: near the sensor, above and below it.
    let mut random = Random(5);
    let mut place = || [(0.0, 80.0), (0.0, 80.0), (-12.0, 18.0)].map(|(a, b)| random.between(a, b));
    let ends: Vec<_> = (0..40_000).map(|_| (place(), 0, 0.0)).collect();
    let with = |sensors| {
        let mut paths = SensorPaths::at_rest(EYES);
        paths.sensors = sensors;
        sightlines(&paths, &ends)
    };
    // For one sensor, and as if there were so many that each has two bands.
    let [many, few] = [with(1), with(8)];
    let mut decided = 0;
    for n in 0..20_000 {
        let (at, scale) = (place(), [1.0, 0.1, 0.01][n % 3]);
        let at = [0, 1, 2].map(|a| EYES[0][a] + scale * (at[a] - EYES[0][a]));
        let depth = |of: &Sightlines| of.depth(Simd::BASELINE, &scaled(), at, &UNKNOWN, 0.0);
        assert_eq!(depth(&many), depth(&few), "{at:?}");
        decided += usize::from(depth(&many).is_some());
    }
    assert!(decided > 5000, "{decided}");
}
