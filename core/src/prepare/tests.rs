//! Rays of simple sweeps, worked out by hand.

extern crate std;
use super::*;
use crate::frame::place;
use crate::pose::Twist;
use crate::record::{NO_END, ray_end, ray_origin};
use crate::team::SingleThread;
use glam::DVec3;
use std::vec;
use std::vec::Vec;

fn rig(timing: Timing) -> Rig {
    let mut sensors = heapless::Vec::new();
    sensors.push(Pose::IDENTITY).unwrap();
    Rig {
        sensors,
        timing,
        distorted: true,
        ground_m: -1.73,
        own_vehicle: Some([[-1.5, -1.75], [4.5, 1.75]]),
    }
}

fn at(x: f32, y: f32, z: f32) -> Point {
    Point { position: [x, y, z], ..Default::default() }
}

struct Out {
    rays: Vec<Ray>,
    columns: Vec<u32>,
    placed: Vec<Placed>,
    origins: Vec<[i32; 4]>,
    dropped: DroppedReturns,
    window: Window,
}

fn run(profile: &Profile, rig: &Rig, pose: Pose, twist: Twist, points: &[Point]) -> Out {
    let window = place(profile, rig, &pose, Some(DVec3::ZERO));
    let sweep = Sweep { stamp_s: 0.0, points, world_from_vehicle: pose, twist };
    let (mut rays, mut columns) = (vec![[0; 2]; profile.returns()], vec![0; profile.returns()]);
    let mut origins = vec![[0; 4]; ORIGINS_MAX];
    let mut placed = vec![Placed::default(); points.len()];
    let (count, dropped) = Preparation::new().prepare(
        &SingleThread,
        &Placement { profile, rig, window: &window, sweep: &sweep },
        RayBuffers {
            rays: &mut rays,
            origins: &mut origins,
            columns: &mut columns,
            placed: &mut placed,
        },
    );
    rays.truncate(count);
    columns.truncate(points.len());
    Out { rays, columns, placed, origins, dropped, window }
}

#[test]
fn every_bad_return_is_counted() {
    let profile = Profile::hdl64();
    let points = vec![
        at(f32::NAN, 0.0, 0.0),
        at(0.0, f32::INFINITY, 0.0),
        at(0.0, 0.0, 0.0),
        at(1e30, 0.0, 0.0),
        at(-5000.0, 0.0, 0.0),
        at(1.0, 0.0, -1.0),
        at(10.0, 0.0, 0.0),
        Point { sensor: 3, ..at(10.0, 0.0, 0.0) },
    ];
    let out = run(&profile, &rig(Timing::AtStamp), Pose::IDENTITY, Twist::ZERO, &points);
    let d = out.dropped;
    assert_eq!((d.not_finite, d.no_return, d.too_far), (2, 1, 2));
    assert_eq!((d.own_vehicle, d.unknown_sensor, d.over_capacity), (1, 1, 0));
    assert_eq!(out.rays.len(), 2);
    assert_eq!(out.rays[0][1] & NO_END, NO_END);
    assert_eq!(out.columns.iter().filter(|c| **c != NONE).count(), 1);
}

#[test]
fn a_sweep_beyond_the_capacity_is_thinned_evenly() {
    let profile = Profile { returns_max: 100, ..Profile::hdl64() };
    let points: Vec<Point> = (0..150).map(|n| at(1.0 + 0.1 * n as f32, 6.0, 0.0)).collect();
    let out = run(&profile, &rig(Timing::AtStamp), Pose::IDENTITY, Twist::ZERO, &points);
    assert_eq!((out.dropped.over_capacity, out.rays.len()), (50, 100));
    // The first and the last lie at most two thirds of a return from the sweep's ends.
    let [first, last] = [out.placed[0], out.placed[99]].map(|p| p.at[0]);
    assert!((last - first - 148.0 * 0.1 / 0.3).abs() < 0.5, "{first} {last}");
}

#[test]
fn static_points_keep_their_lattice_cell() {
    // A wall seen from two poses: the same lattice cells, whatever the window.
    let profile = Profile::hdl64();
    let rig = rig(Timing::AtStamp);
    let wall: Vec<DVec3> = (0..40).map(|n| DVec3::new(10.17, n as f64 * 0.3 - 6.0, 0.3)).collect();
    let cells = |pose: Pose| -> Vec<[i32; 3]> {
        let points: Vec<Point> = wall
            .iter()
            .map(|w| {
                let p = pose.inverse().transform(*w);
                at(p.x as f32, p.y as f32, p.z as f32)
            })
            .collect();
        let out = run(&profile, &rig, pose, Twist::ZERO, &points);
        let corner = out.window.corner;
        out.rays
            .iter()
            .map(|r| {
                let e = ray_end(*r);
                [e[0] + corner[0], e[1] + corner[1], e[2] + corner[2]]
            })
            .collect()
    };
    let first = cells(Pose::IDENTITY);
    assert_eq!(first, cells(Pose::planar(2.77, -1.3, 0.2, 0.4)));
    assert_eq!(first[20], [34, 0, 1]);
}

#[test]
fn a_return_is_placed_at_its_own_time() {
    // A fast, turning vehicle sees a post at any time of a revolution: always at the same place.
    let profile = Profile::hdl64();
    let twist = Twist { linear: DVec3::new(20.0, 1.0, 0.0), angular: DVec3::Z * 0.5 };
    let post = DVec3::new(9.0, -14.0, 0.4);
    let times: Vec<f64> = (0..1000).map(|n| (n as f64 / 999.0 - 0.5) * 0.1).collect();
    let seen = |t: f64| {
        let p = twist.over(t).inverse().transform(post);
        Point { offset_s: t as f32, ..at(p.x as f32, p.y as f32, p.z as f32) }
    };
    let points: Vec<Point> = times.iter().map(|t| seen(*t)).collect();
    let timing = Timing::Offset { from_s: -0.05, span_s: 0.1 };
    let out = run(&profile, &rig(timing), Pose::IDENTITY, twist, &points);
    let centre = central(&profile);
    for (placed, t) in out.placed.iter().zip(&times) {
        assert!((placed.offset_s - *t as f32).abs() < 1e-6);
        for a in 0..3 {
            let at = f64::from(placed.at[a]) - 0.5 - f64::from(centre[a]);
            // Slot by slot the error would be 1 cm.
            assert!((at * profile.voxel_m - post[a]).abs() < 1e-3, "{placed:?}");
        }
    }
    // The direction of a return gives its time if nothing else does.
    let timing = Timing::Azimuth { span_s: 0.1 };
    let around: Vec<Point> = (0..500)
        .map(|n| {
            let angle = 3.1 - n as f32 * 0.0124;
            at(20.0 * libm::cosf(angle), 20.0 * libm::sinf(angle), 0.0)
        })
        .collect();
    let out = run(&profile, &rig(timing), Pose::IDENTITY, twist, &around);
    for (n, placed) in out.placed.iter().enumerate() {
        let turn = (3.1 - n as f32 * 0.0124) / core::f32::consts::TAU;
        assert!((placed.offset_s + 0.1 * turn).abs() < 1e-6, "{n}: {placed:?}");
    }
}

#[test]
fn azimuth_moves_points_and_origins() {
    let profile = Profile::hdl64();
    let rig = rig(Timing::Azimuth { span_s: 0.1 });
    let twist = Twist { linear: DVec3::new(12.0, 0.0, 0.0), angular: DVec3::ZERO };
    // Just left of the rear: the start of the revolution, 50 ms before the stamp.
    let points = [at(-20.0, 0.05, 0.0), at(20.0, 0.0, 0.0), at(-20.0, -0.05, 0.0)];
    let out = run(&profile, &rig, Pose::IDENTITY, twist, &points);
    let x = |n: usize| ray_end(out.rays[n])[0] - 83;
    assert_eq!([x(0), x(1), x(2)], [-69, 67, -65]);
    let o = |n: usize| out.origins[ray_origin(out.rays[n])][0] - 83;
    assert_eq!([o(0), o(1), o(2)], [-2, 0, 2]);
    // Without deskew, as in the dissertation, everything happens at the stamp.
    let out = run(&Profile::dissertation(), &rig, Pose::IDENTITY, twist, &points);
    assert!((0..3).all(|n| out.origins[ray_origin(out.rays[n])][0] == 83));
    assert_eq!(ray_end(out.rays[0])[0] - 83, -67);
}
