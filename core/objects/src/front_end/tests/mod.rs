//! Hand-made sweeps, and the resulting tracks.

mod objects;

extern crate std;
use super::association::velocity_distance2;
use super::scene::{PARAMS, Run, SceneBox, ground, rig, seen};
use super::*;
use crate::centroid_ekf::CentroidEkf;
use glam::DVec3;
use raywake_core::output::{ColumnFlow, PointFlows, ReturnFlow, Status};
use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::{Point, Timing};
use std::vec;
use std::vec::Vec;

#[test]
fn cars_are_followed_far_from_the_origin() {
    let things = [SceneBox::car(10.0, 4.0, [8.0, 0.0]), SceneBox::car(30.0, -4.0, [-8.0, 0.0])];
    let mut run = Run::new(1, 8);
    // The world's origin is thousands of kilometres away.
    run.place = Pose::planar(4e5, 5e6, 300.0, 0.0);
    for n in 0..20 {
        let counts = run.see(&things, n as f64 * 0.1);
        assert_eq!((counts.segments, counts.ended), (2, 0), "{counts:?}");
        assert_eq!(counts.born, if n == 0 { 2 } else { 0 });
    }
    let live = run.live();
    assert_eq!(live.len(), 2);
    for track in live {
        let state = *track.history().last().unwrap();
        let thing = things
            .iter()
            .min_by(|a, b| {
                let off = |t: &SceneBox| (4e5 + t.at[0] - track.anchor[0]).abs();
                off(a).total_cmp(&off(b))
            })
            .unwrap();
        assert!((state.speed - 8.0).abs() < 0.5, "{state:?}");
        assert!((state.heading.cos() - thing.velocity[0] / 8.0).abs() < 0.05, "{state:?}");
        assert!((state.position[0] - 1.9 * thing.velocity[0]).abs() < 0.2, "{state:?}");
        assert_eq!((track.history().len(), track.observations), (20, 20));
        // The states before it departed have its heading, too.
        assert!((track.history()[0].heading - state.heading).abs() < 0.3);
        assert!(track.returns_seen() > 3000);
        assert_eq!(track.state(), Some(state));
        assert!(track.latest().len() > 100);
        assert!(track.latest().iter().all(|r| (r.time_s as f64 - state.time_s).abs() < 1e-6));
        for r in track.returns() {
            let moved = thing.velocity[0] * r.time_s as f64;
            assert!((r.position[0] as f64 - moved).abs() < 2.1, "{r:?}");
            assert!(r.position[2] > -1.0 && r.position[2] < 1.0);
            assert!((r.origin[2] as f64 - (301.7 - track.anchor[2])).abs() < 1e-3);
        }
    }
    let ids: Vec<u32> = run.tracks.iter().map(|t| t.id).collect();
    assert_eq!(ids[..2], [0, 1]);
    assert_eq!(run.front_end.finish(&mut run.tracks), 2);
    assert!(run.live().is_empty());
}

/// Two sensors that see the same car half a revolution apart, as one sweep or as two.
#[test]
fn sensors_need_not_be_in_step() {
    let things = [SceneBox::car(12.0, 3.0, [15.0, 0.0])];
    for apart in [false, true] {
        let mut run = Run::new(2, 8);
        for n in 0..15 {
            let stamp_s = n as f64 * 0.1;
            let first = seen(&things, stamp_s, 0.01, 0);
            if apart {
                // The second sensor has its own stamps.
                run.take(stamp_s, &first, None);
                let second = seen(&things, stamp_s + 0.05, 0.01, 1);
                run.take(stamp_s + 0.05, &second, None);
            } else {
                let both = [first, seen(&things, stamp_s, 0.06, 1)].concat();
                run.take(stamp_s, &both, None);
            }
            let counts = run.step();
            assert_eq!((counts.segments, counts.ended), (1, 0), "{n}: {counts:?}");
        }
        let track = run.live()[0];
        assert_eq!(track.observations, 15);
        assert!((track.history()[14].speed - 15.0).abs() < 0.3, "{:?}", track.history()[14]);
        let mut of_sensor = [0; 2];
        for r in track.returns() {
            of_sensor[r.sensor as usize] += 1;
            // On the car at the return's own time, relative to the first mean time.
            let off = r.position[0] as f64 - 15.0 * r.time_s as f64;
            assert!(off.abs() < 2.1, "{apart}: {r:?}");
            // Each sensor's rays begin at that sensor.
            let y = r.origin[1] as f64 + track.anchor[1];
            assert!((y - r.sensor as f64).abs() < 1e-4);
        }
        assert!(of_sensor.iter().all(|n| *n > 1000), "{of_sensor:?}");
    }
}

#[test]
fn static_structure_is_static_for_a_moving_vehicle() {
    let things = [SceneBox::car(25.0, 4.0, [0.0, 0.0])];
    let mut run = Run::new(1, 8);
    run.rig = rig(1, Timing::Azimuth { span_s: 0.1 });
    run.rig.distorted = true;
    let twist = Twist { linear: DVec3::new(10.0, 0.0, 0.0), angular: DVec3::ZERO };
    for n in 0..20 {
        let stamp_s = n as f64 * 0.1;
        run.place = Pose::planar(10.0 * stamp_s, 0.0, 0.0, 0.0);
        let as_seen = |p: [f64; 3]| {
            // As seen from where the vehicle is when the sensor faces that way.
            let mut t = 0.0;
            for _ in 0..20 {
                let x = p[0] - 10.0 * (stamp_s + t);
                t = -p[1].atan2(x) / std::f64::consts::TAU * 0.1;
            }
            let x = p[0] - 10.0 * (stamp_s + t);
            Point { position: [x as f32, p[1] as f32, p[2] as f32], ..Point::default() }
        };
        let around = |p: &[f64; 3]| {
            let [x, y] = [p[0] - 10.0 * stamp_s, p[1]];
            (2.0..40.0).contains(&x.hypot(y))
        };
        let places = ground().into_iter().chain(things[0].points(0.0));
        let points: Vec<Point> = places.filter(around).map(as_seen).collect();
        let world_from_vehicle = run.place;
        let sweep = Sweep { stamp_s, points: &points, world_from_vehicle, twist };
        run.front_end.take(&PARAMS, &run.rig, &sweep, None);
        run.step();
    }
    let track = run.live()[0];
    assert_eq!(track.observations, 20);
    let at = track.history()[19].position;
    assert!(at[0].hypot(at[1]) < 0.02, "{at:?}");
    for r in track.returns() {
        assert!(r.position[0].abs() < 2.05 && r.position[1].abs() < 0.95, "{r:?}");
    }
}

#[test]
fn walls_and_crumbs_are_no_objects() {
    let wall = SceneBox { at: [10.0, 10.0], size: [30.0, 0.4, 3.0], velocity: [0.0; 2] };
    let crumb = SceneBox { at: [5.0, -5.0], size: [0.1, 0.1, 1.6], velocity: [0.0; 2] };
    let kerb = SceneBox { at: [5.0, -9.0], size: [10.0, 0.4, 0.2], velocity: [0.0; 2] };
    let mut run = Run::new(1, 8);
    let counts = run.see(&[wall, crumb, kerb], 0.0);
    assert_eq!((counts.too_large, counts.too_small, counts.segments), (1, 1, 0));
    assert_eq!(counts.born, 0);
}

#[test]
fn ground_map_is_used_where_no_ground_is_seen() {
    // A slope that the returns do not show, and a flat table standing on it.
    let height = |x: f64| 0.3 * x;
    let heights: Vec<f32> =
        (0..100 * 100).map(|n| height((n % 100) as f64 - 49.5) as f32).collect();
    let map = GroundMap { corner: [-50.0, -50.0], cell_m: 1.0, columns: 100, heights: &heights };
    assert_eq!(map.height(10.5, 3.0), Some(height(10.5) as f32));
    assert_eq!((map.height(-50.1, 0.0), map.height(0.0, 50.1)), (None, None));
    assert_eq!(map.height(f64::NAN, 0.0), None);
    let table: Vec<Point> = (0..400)
        .map(|n| {
            let [x, y] = [10.0 + (n % 20) as f64 * 0.1, 5.0 + (n / 20) as f64 * 0.1];
            Point {
                position: [x as f32, y as f32, (height(10.5) + 0.9) as f32],
                ..Point::default()
            }
        })
        .collect();
    for (map, found) in [(Some(&map), 1), (None, 0)] {
        let mut run = Run::new(1, 8);
        run.take(0.0, &table, None);
        let counts = run.front_end.step(&PARAMS, map, &mut run.tracks);
        assert_eq!(counts.segments, found, "{counts:?}");
    }
}

/// A person who passes a parked car within arm's length.
#[test]
fn flow_separates_neighbours() {
    let car = SceneBox::car(12.0, 5.0, [0.0; 2]);
    let person = SceneBox { at: [8.0, 3.7], size: [0.4, 0.4, 1.7], velocity: [1.5, 0.0] };
    let speeds = |of_person: [f32; 2]| {
        let mut run = Run::new(1, 8);
        let (mut born, mut flows) = (0, Vec::new());
        for n in 0..40 {
            let stamp_s = n as f64 * 0.1;
            let points = seen(&[car, person], stamp_s, 0.0, 0);
            let alone = seen(&[car], stamp_s, 0.0, 0).len();
            flows.clear();
            flows.resize(alone, ReturnFlow::new(None, Status::Static));
            let moving = [ColumnFlow { velocity_world_mps: of_person, ..ColumnFlow::default() }];
            flows.resize(points.len(), ReturnFlow::new(Some(0), Status::Static));
            let of = PointFlows::at_rest(&moving, &flows, &points);
            run.take(stamp_s, &points, Some(Flows { of, reach_m: 40.0 }));
            born += run.step().born;
        }
        let mut speeds: Vec<f64> =
            run.live().iter().map(|t| t.history().last().unwrap().speed.abs()).collect();
        speeds.sort_by(f64::total_cmp);
        (born, speeds)
    };
    let (born, with) = speeds([1.5, 0.0]);
    assert_eq!((born, with.len()), (2, 2));
    assert!(with[0] < 0.2 && (with[1] - 1.5).abs() < 0.2, "{with:?}");
    let (_, without) = speeds([0.0; 2]);
    assert_ne!(without.len(), 2, "{without:?}");
}

/// Two cars that pass each other so fast that positions alone are ambiguous.
#[test]
fn velocities_join_the_gate() {
    let mut ekf = CentroidEkf::birth(&PARAMS.centroid, 0.0, [0.0; 3]);
    for n in 1..20 {
        let t = n as f64 * 0.1;
        ekf.predict(&PARAMS.centroid, t);
        ekf.update(&PARAMS.centroid, [10.0 * t, 0.0, 0.0]);
    }
    let distance2 = |v| velocity_distance2(&ekf, v, PARAMS.segment_velocity_sigma_mps);
    assert!(distance2([10.0, 0.0]) < 1.0);
    assert!(distance2([-10.0, 0.0]) > PARAMS.association_with_flow_d2);
}

#[test]
fn everything_beyond_a_capacity_is_counted() {
    let things: Vec<SceneBox> = (0..196)
        .map(|n| SceneBox {
            at: [(n % 14) as f64 * 5.5 - 38.0, (n / 14) as f64 * 5.5 - 38.0],
            size: [0.6, 0.6, 1.6],
            velocity: [0.0; 2],
        })
        .collect();
    for capacity in [0, 4, TRACKS_MAX, TRACKS_MAX + 10] {
        let mut run = Run::new(1, capacity);
        let followed = capacity.min(TRACKS_MAX) as u64;
        for n in 0..3 {
            let counts = run.see(&things, n as f64 * 0.1);
            let born = if n == 0 { followed } else { 0 };
            assert_eq!((counts.segments, counts.born), (196, born), "{counts:?}");
            assert_eq!(counts.unborn, 196 - followed);
            assert_eq!(counts.updated, followed - born);
        }
    }
    // Returns.
    let mut run = Run::new(1, 8);
    let many = vec![Point { position: [5.0, 5.0, 1.0], ..Point::default() }; 140_000];
    run.take(0.0, &many, None);
    run.take(0.0, &many, None);
    let counts = run.step();
    assert_eq!(counts.dropped.over_capacity, 280_000 - raywake_core::params::POINTS_MAX as u64);
}

#[test]
fn chunks_and_segments_beyond_their_capacity() {
    // More crumbs than there is room for chunks: 1.5 m high stacks of single returns.
    let mut points = Vec::new();
    for n in 0..16_900 {
        let [x, y] = [(n % 130) as f32 * 0.75 - 48.0, (n / 130) as f32 * 0.75 - 48.0];
        for k in 0..3 {
            points.push(Point { position: [x, y, 0.5 * k as f32 + 0.5], ..Point::default() });
        }
    }
    let mut run = Run::new(1, 8);
    run.take(0.0, &points, None);
    let params = FrontEndParams { returns_min: 1, ..PARAMS };
    let counts = run.front_end.step(&params, None, &mut run.tracks);
    let chunked = counts.object_returns - counts.unchunked;
    assert!(chunked == chunks::CHUNKS_MAX as u64 && counts.unchunked > 0, "{counts:?}");
    assert_eq!(counts.segments, SEGMENTS_MAX as u64);
    assert!(counts.unlisted > 0 && counts.born == 8, "{counts:?}");
    // The next batch is unaffected.
    let counts = run.see(&[SceneBox::car(10.0, 0.0, [0.0; 2])], 0.1);
    assert_eq!((counts.unchunked, counts.segments), (0, 1));
}

#[test]
fn non_finite_input_leaves_no_trace() {
    let things = [SceneBox::car(10.0, 4.0, [5.0, 0.0])];
    let (mut clean, mut soiled) = (Run::new(1, 8), Run::new(1, 8));
    for n in 0..10 {
        let stamp_s = n as f64 * 0.1;
        clean.see(&things, stamp_s);
        let mut points = seen(&things, stamp_s, 0.0, 0);
        let at = points.len() / 2;
        points.insert(at, Point { position: [f32::NAN, 10.0, 1.0], ..Point::default() });
        points.insert(at, Point { position: [10.0, f32::INFINITY, 1.0], ..Point::default() });
        points.push(Point { offset_s: f32::NAN, position: [10.0, 4.0, 1.0], ..Point::default() });
        points.push(Point { sensor: 7, position: [10.0, 4.0, 1.0], ..Point::default() });
        for far in [[3e8, 4.0, 1.0], [10.0, 4.0, 3e38], [10.0, 4.0, -3e38]] {
            points.push(Point { position: far, ..Point::default() });
        }
        points.push(Point::default());
        soiled.take(stamp_s, &points, None);
        // A sweep without a stamp, and one without a pose.
        soiled.take(f64::NAN, &points, None);
        soiled.place = Pose { translation: DVec3::NAN, ..Pose::IDENTITY };
        soiled.take(stamp_s, &points, None);
        soiled.place = Pose::IDENTITY;
        let d = soiled.step().dropped;
        assert_eq!(d.not_finite, 3 + 2 * points.len() as u64);
        assert_eq!((d.no_return, d.unknown_sensor, d.too_far), (1, 1, 3));
    }
    let [clean, soiled] = [&clean, &soiled].map(|run| run.live()[0].history().to_vec());
    assert_eq!(clean, soiled);
}

#[test]
fn unseen_tracks_wait_then_end() {
    let car = [SceneBox::car(10.0, 4.0, [5.0, 0.0])];
    let mut run = Run::new(1, 8);
    // Seen only once, it does not wait.
    run.see(&car, 0.0);
    assert_eq!(run.see(&[], 0.1).ended, 1);
    for n in 2..10 {
        run.see(&car, n as f64 * 0.1);
    }
    // A batch without returns, and no batch at all.
    run.take(1.0, &[], None);
    let counts = run.step();
    assert_eq!((counts.waiting, counts.ended), (1, 0));
    assert_eq!(run.step(), TrackingCounts::default());
    // It is found again where it has moved to.
    let counts = run.see(&car, 1.1);
    assert_eq!((counts.updated, counts.born), (1, 0));
    for n in 12..16 {
        assert_eq!(run.see(&[], n as f64 * 0.1).waiting, 1);
    }
    let counts = run.see(&[], 1.7);
    assert_eq!((counts.waiting, counts.ended), (0, 1));
    // It can be read until the next step.
    let ended: Vec<&Track> = run.tracks.iter().filter(|t| t.status == TrackStatus::Ended).collect();
    assert_eq!((ended.len(), ended[0].observations), (1, 9));
    assert!((ended[0].last_s() - 1.1).abs() < 1e-6);
    run.see(&[], 1.8);
    assert!(run.tracks.iter().all(|t| t.status == TrackStatus::Free && t.returns().is_empty()));
}

#[test]
fn gaps_and_backward_time_end_all_tracks() {
    let car = [SceneBox::car(10.0, 4.0, [0.0, 0.0])];
    for (next_s, reset) in [(3.0, 0), (0.2, 1), (-5.0, 1)] {
        let mut run = Run::new(1, 8);
        for n in 0..5 {
            run.see(&car, n as f64 * 0.1);
        }
        let counts = run.see(&car, next_s);
        assert_eq!((counts.ended, counts.reset, counts.born), (1, reset, 1));
        for n in 1..5 {
            let counts = run.see(&car, next_s + n as f64 * 0.1);
            assert_eq!((counts.updated, counts.ended), (1, 0));
        }
        assert_eq!(run.live()[0].start_s, next_s);
    }
}
