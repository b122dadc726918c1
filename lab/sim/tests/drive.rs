//! Whole sweeps against exact expectations.

use glam::DVec3;
use raywake_core::sweep::Timing;
use raywake_sim::{
    Class, Clutter, Drive, Ego, Options, Path, Scene, Scenery, Sensor, SensorRig, SimSweep, State,
    Surface,
};
use raywake_sim::{Shape, models};
use std::collections::BTreeSet;

fn options(ego: Ego, sweeps: usize) -> Options {
    Options { ego, sweeps, ..Options::default() }
}

/// A drive without noise through a given scene.
fn ideal(scene: Scene, path: Path) -> Drive {
    Drive::through(scene, path, 1, Options { rig: SensorRig::ideal(), ..Options::default() })
}

fn vector(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// Returns in the world frame, each by the pose at its own time.
fn in_world<'a>(drive: &'a Drive, sweep: &'a SimSweep) -> impl Iterator<Item = (DVec3, f64)> + 'a {
    sweep.points.iter().map(|p| {
        let t = sweep.stamp_s + f64::from(p.offset_s);
        (drive.world_from_vehicle(t).transform(vector(p.position)), t)
    })
}

#[test]
fn thread_count_does_not_affect_results() {
    let make = |threads: usize| {
        let options = Options { threads, ..options(Ego::Any, 2) };
        Drive::new(11, options).collect::<Vec<_>>()
    };
    let (one, two, three) = (make(1), make(2), make(3));
    assert_eq!(one, two);
    assert_eq!(one, three);
    let bits = |s: &SimSweep| {
        s.points.iter().flat_map(|p| p.position.map(f32::to_bits)).collect::<Vec<_>>()
    };
    assert_eq!(bits(&one[1]), bits(&two[1]));
    assert_ne!(one[0].points, one[1].points);
    assert_ne!(Drive::new(12, options(Ego::Any, 2)).sweep(0).points, one[0].points);
    assert_eq!(Drive::new(11, options(Ego::Any, 2)).sweep(1), one[1], "any sweep on its own");
}

#[test]
fn amounts() {
    for seed in 0..6 {
        let drive = Drive::new(seed, options(Ego::Any, 20));
        let (mut moving, mut classes) = (BTreeSet::new(), BTreeSet::new());
        for index in [0, 10, 19] {
            let sweep = drive.sweep(index);
            assert_eq!(sweep.points.len(), sweep.truth.len());
            let n = sweep.points.len();
            assert!((60_000..=131_072).contains(&n), "seed {seed}: {n} returns");
            for t in &sweep.truth {
                assert_eq!(t.object > 0, t.class.is_foreground());
                classes.insert(t.class);
                if vector(t.velocity_world).length() > 0.5 {
                    moving.insert(t.object);
                }
            }
        }
        assert!(moving.len() >= 12, "seed {seed}: {} moving objects seen", moving.len());
        assert!(classes.len() >= 8, "seed {seed}: {classes:?}");
    }
}

#[test]
fn rig_and_time() {
    let drive = Drive::new(5, options(Ego::Straight { speed: 10.0 }, 3));
    let rig = drive.rig();
    assert_eq!(rig.timing, Timing::Offset { from_s: -0.05, span_s: 0.1 });
    assert!(rig.distorted && rig.sensors.len() == 1 && rig.ground_m == -1.73);
    let sweep = drive.sweep(1);
    assert_eq!(sweep.stamp_s, 0.1);
    assert!((sweep.twist.linear.x - 10.0).abs() < 0.1 && sweep.twist.linear.y.abs() < 0.1);
    let (first, last) = (sweep.points[0], sweep.points[sweep.points.len() - 1]);
    assert!(first.position[0] < 0.0 && first.position[1] > 0.0, "starts at the rear left");
    assert!(last.position[0] < 0.0 && last.position[1] < 0.0, "ends at the rear right");
    let mut before = -0.05;
    for p in &sweep.points {
        assert!(p.offset_s >= before && p.offset_s < 0.05);
        before = p.offset_s;
        // Clockwise, forward at the stamp: the azimuth gives the time.
        let azimuth = f64::from(p.position[1]).atan2(f64::from(p.position[0]));
        let off = (azimuth + f64::from(p.offset_s) / 0.1 * std::f64::consts::TAU).abs();
        let off = off.min((std::f64::consts::TAU - off).abs());
        assert!(off < 0.002, "{p:?}: {off}");
    }
}

#[test]
fn the_twist_at_the_stamp_stands_for_the_sweep() {
    let egos = [true, false].map(|left| Ego::Turn { left, speed: 6.0 });
    for ego in egos.into_iter().chain([Ego::StopAndGo { speed: 10.0 }]) {
        let drive = Drive::new(7, Options { density: 0.0, ..options(ego, 100) });
        let mut turned = 0.0f64;
        for n in 0..drive.sweeps() {
            let stamp_s = raywake_sim::stamp_s(n);
            let at = |s: f64| drive.world_from_vehicle(stamp_s + s);
            let twist = drive.twist(stamp_s);
            for s in [-0.05, 0.05] {
                // Points 20 m ahead and to the side, as moved by the twist and by the path.
                for p in [DVec3::X, DVec3::Y].map(|axis| 20.0 * axis) {
                    let off = (at(0.0) * twist.over(s)).transform(p) - at(s).transform(p);
                    assert!(off.length() < 0.03, "{ego:?}, sweep {n}: {} m", off.length());
                }
            }
            turned = turned.max(twist.angular.z.abs());
        }
        let stops = matches!(ego, Ego::StopAndGo { .. });
        assert!(stops || turned > 0.5, "{ego:?}: {turned} rad/s");
    }
}

#[test]
fn ground_and_wall_are_planes() {
    let mut scene = Scene::empty();
    let pose = raywake_core::pose::Pose::planar(20.0, 0.0, 2.0, 0.0);
    scene.put(Class::Building, Shape::cuboid(2.0, 60.0, 4.0), pose, Surface::matt(0.5));
    let start = State { speed: 12.0, yaw: 0.3, ..State::default() };
    let drive = ideal(scene, Path::from(start).then(5.0, 0.0, 0.05));
    let sweep = drive.sweep(2);
    let (mut ground, mut wall) = (0, 0);
    for ((p, _), truth) in in_world(&drive, &sweep).zip(&sweep.truth) {
        assert_eq!((truth.object, truth.velocity_world), (0, [0.0; 3]));
        if truth.class == Class::Ground {
            assert!(p.z.abs() < 1e-4, "{p}");
            ground += 1;
        } else if p.z < 3.9999 {
            let off = (p.x - 19.0).abs().min((p.y.abs() - 30.0).abs());
            assert!(off < 1e-4, "{p}");
            wall += 1;
        }
    }
    assert!(ground > 50_000 && wall > 2_000, "{ground} {wall}");
}

#[test]
fn no_ray_is_missed() {
    let (centre, radius) = (DVec3::new(-6.0, 4.0, 1.4), 0.7);
    let mut scene = Scene::empty();
    let pose = raywake_core::pose::Pose::new(glam::DQuat::IDENTITY, centre);
    let ball = Shape::ellipsoid(radius, radius, radius);
    scene.put(Class::Fixture, ball, pose, Surface::matt(0.5));
    let drive = ideal(scene, Path::stationary(0.0, 0.0, 0.0));
    let sensor = Sensor::ideal();
    let eye = DVec3::new(0.0, 0.0, SensorRig::ideal().origin.z);
    let rays = (0..sensor.columns).flat_map(|c| sensor.beams.iter().map(move |b| (c, b)));
    let expected = rays.filter(|&(column, beam)| {
        let ((sa, ca), (se, ce)) =
            ((sensor.azimuth(column) + beam.azimuth).sin_cos(), beam.elevation.sin_cos());
        let ray = DVec3::new(ce * ca, ce * sa, se);
        (centre - eye).cross(ray).length() < radius && ray.dot(centre - eye) > 0.0
    });
    let sweep = drive.sweep(0);
    let seen = sweep.truth.iter().filter(|t| t.class == Class::Fixture);
    let (expected, seen) = (expected.count(), seen.count());
    assert!(seen > 500);
    assert_eq!(seen, expected);
}

#[test]
fn every_sensor_of_every_rig_sees_the_same_planes() {
    for name in SensorRig::NAMES {
        let mut rig: SensorRig = name.parse().unwrap();
        for m in &mut rig.mounts {
            let Sensor { range_noise, angle_noise, dropout, signal, .. } = Sensor::ideal();
            m.sensor = Sensor { range_noise, angle_noise, dropout, signal, ..m.sensor.clone() };
        }
        let mut scene = Scene::empty();
        let pose = raywake_core::pose::Pose::planar(20.0, 0.0, 3.0, 0.0);
        scene.put(Class::Building, Shape::cuboid(2.0, 60.0, 6.0), pose, Surface::matt(0.5));
        let path = Path::from(State { speed: 12.0, yaw: 0.3, ..State::default() });
        let drive = Drive::through(scene, path, 1, Options { rig, ..Options::default() });
        let declared = drive.rig();
        let mut seen = vec![[0, 0]; declared.sensors.len()];
        let sweep = drive.sweep(2);
        let most = if name == "hdl32x4-full" { 262_144 } else { 131_072 };
        assert!(sweep.points.len() <= most, "{name}: {}", sweep.points.len());
        for (((p, t), point), truth) in
            in_world(&drive, &sweep).zip(&sweep.points).zip(&sweep.truth)
        {
            // Within 0.1 s, in chronological order, above the ground as the rig states.
            assert!((-0.05..0.05).contains(&point.offset_s));
            let wall = usize::from(truth.class == Class::Building);
            let here = drive.world_from_vehicle(t).inverse().transform(p);
            if wall == 0 {
                // The vehicle pitches by at most 0.003 rad.
                let up = (here.z - declared.ground_m).abs();
                assert!(p.z.abs() < 1e-4 && up < 0.01 + 0.005 * here.length(), "{name}: {here}");
            } else if p.z < 5.9999 {
                let off = (p.x - 19.0).abs().min((p.y.abs() - 30.0).abs());
                assert!(off < 1e-4, "{name}: {p}");
            }
            seen[point.sensor as usize][wall] += 1;
        }
        assert!(sweep.points.windows(2).all(|p| p[0].offset_s <= p[1].offset_s));
        assert!(seen.iter().all(|s| s[0] > 5_000 && s[1] > 400), "{name}: {seen:?}");
        assert_eq!(drive.sweep(2), sweep);
    }
}

/// Scene with one moving object of each kind, one of them turning.
fn movers() -> Scene {
    let mut scene = Scene::empty();
    let at = |x: f64, y: f64, yaw: f64, speed: f64| State { x, y, yaw, speed };
    scene.add_car(Path::from(at(8.0, 4.0, 0.4, 9.0)).then(5.0, 1.5, 0.08), 1);
    scene.add(models::van, Path::from(at(14.0, -6.0, 3.0, 6.0)), 2);
    scene.add(models::cyclist, Path::from(at(-7.0, 3.0, 0.0, 4.0)), 3);
    scene.add(models::pedestrian, Path::from(at(5.0, -4.0, 1.0, 1.4)), 4);
    scene.add_car(Path::stationary(-8.0, -5.0, 0.2), 5);
    scene
}

#[test]
fn airborne_clutter_is_not_an_object() {
    for clutter in Clutter::ALL {
        let options = Options { clutter, ..options(Ego::Straight { speed: 8.0 }, 20) };
        let [one, two] =
            [1, 2].map(|threads| Drive::new(3, Options { threads, ..options.clone() }).sweep(15));
        assert_eq!(one, two);
        let of = |t: &&raywake_sim::Truth| t.class == Class::Clutter;
        let echoes = one.truth.iter().filter(of).count();
        let share = echoes as f64 / one.truth.len() as f64;
        let wanted = match clutter {
            Clutter::None => 0.0..=0.0,
            Clutter::Rain => 0.005..=0.02,
            Clutter::Fog => 0.03..=0.2,
            Clutter::Dust => 0.001..=0.2,
        };
        assert!(wanted.contains(&share), "{clutter:?}: {share}");
        for t in one.truth.iter().filter(of) {
            assert_eq!((t.object, t.flow_world, t.class.is_foreground()), (0, [0.0; 3], false));
        }
    }
}

#[test]
fn every_scenery_is_the_same_however_many_threads() {
    for scenery in Scenery::all() {
        let options = Options { scenery, ..options(Ego::Any, 10) };
        let [one, three] =
            [1, 3].map(|threads| Drive::new(2, Options { threads, ..options.clone() }).sweep(4));
        assert_eq!(one, three, "{}", scenery.name());
        let moves = |t: &&raywake_sim::Truth| vector(t.velocity_world).length() > 0.5;
        let moving = one.truth.iter().filter(moves).count();
        assert!(one.points.len() > 60_000 && moving > 200, "{}: {moving}", scenery.name());
    }
}

#[test]
fn velocity_is_the_pose_s_derivative() {
    let drive = ideal(movers(), Path::from(State { speed: 5.0, ..State::default() }));
    let sweep = drive.sweep(3);
    let mut seen = BTreeSet::new();
    for ((p, t), truth) in in_world(&drive, &sweep).zip(&sweep.truth) {
        if truth.object == 0 {
            continue;
        }
        seen.insert(truth.object);
        let index = truth.object as usize - 1;
        let state = |t: f64| drive.objects(t)[index];
        let h = 1e-3;
        let fixed = state(t).world_from_object.inverse().transform(p);
        let at = |t: f64| state(t).world_from_object.transform(fixed);
        let expected = (at(t + h) - at(t - h)) / (2.0 * h);
        let off = (vector(truth.velocity_world) - expected).length();
        // Limbs also swing, at up to their length times amplitude times rate.
        let limit = if state(t).class.max(Class::Van) > Class::Van { 2.5 } else { 1e-3 };
        assert!(off < limit, "{:?}: {off} m/s", state(t).class);
        let [l, w, height] = state(t).size.map(|v| 0.5 * v);
        if state(t).class <= Class::Van {
            let inside = fixed.x.abs() < l + 0.02
                && fixed.y.abs() < w + 0.02
                && fixed.z.abs() < height + 0.02;
            assert!(inside, "{fixed} outside the box");
        }
        if index == 4 {
            assert_eq!(truth.velocity_world, [0.0; 3], "parked");
        }
    }
    assert_eq!(seen.len(), 5);
    let torso: Vec<_> = sweep.truth.iter().filter(|t| t.object == 4).collect();
    let exact = |t: &&&raywake_sim::Truth| (vector(t.velocity_world).length() - 1.4).abs() < 1e-4;
    let steady = torso.iter().filter(exact).count();
    assert!(steady > 20 && steady < torso.len(), "{steady} of {} on the torso", torso.len());
}

#[test]
fn flow_is_the_displacement_of_the_material() {
    let mut scene = movers();
    let at = |x: f64, y: f64, yaw: f64, speed: f64| State { x, y, yaw, speed };
    scene.add(models::truck, Path::from(at(20.0, 9.0, 0.3, 7.0)).then(9.0, -0.5, 0.03), 6);
    scene.add(models::tram, Path::from(at(-10.0, -14.0, 0.1, 8.0)), 7);
    scene.add(models::motorcycle, Path::from(at(6.0, 9.0, 2.0, 11.0)), 8);
    let drive = ideal(scene, Path::from(State { speed: 5.0, ..State::default() }));
    let sweep = drive.sweep(3);
    let (mut seen, mut turned) = (BTreeSet::new(), 0.0f64);
    for ((p, t), truth) in in_world(&drive, &sweep).zip(&sweep.truth) {
        let flow = vector(truth.flow_world);
        if truth.object == 0 || truth.object == 5 {
            assert_eq!(truth.flow_world, [0.0; 3], "background and parked");
            continue;
        }
        seen.insert(truth.object);
        let object = &drive.scene().objects[truth.object as usize - 1];
        // Street and world frame coincide here. The part that was hit is not recorded: one of them
        // must have the point on its surface, and carry it to where the flow says.
        let ground = &drive.scene().ground;
        let off = (0..object.parts.len()).map(|part| {
            let pose = |t: f64| object.part_pose(part, ground, t);
            let fixed = pose(t).inverse().transform(p);
            let out = (fixed.abs() - object.parts[part].shape.half()).max_element().max(0.0);
            out + (pose(t + 0.1).transform(fixed) - p - flow).length()
        });
        assert!(off.fold(f64::INFINITY, f64::min) < 1e-3, "{truth:?} at {p}");
        // Over 0.1 s, speed times time is close, but ignores turning and braking.
        let straight = 0.1 * vector(truth.velocity_world);
        if object.class <= Class::Tram {
            assert!((flow - straight).length() < 0.08, "{flow} {straight}");
            turned = turned.max((flow - straight).length());
        }
    }
    assert_eq!(seen.len(), 7);
    assert!(turned > 0.01, "{turned}");
}

#[test]
fn objects_vanish_behind_others_and_come_back() {
    let (mut vanished, mut back) = (0, 0);
    for seed in 0..3 {
        let drive = Drive::new(seed, options(Ego::Straight { speed: 6.0 }, 40));
        let returns: Vec<Vec<usize>> = (0..40)
            .step_by(4)
            .map(|index| {
                let mut count = vec![0; drive.scene().objects.len() + 1];
                drive.sweep(index).truth.iter().for_each(|t| count[t.object as usize] += 1);
                count
            })
            .collect();
        for object in 1..returns[0].len() {
            let mut seen = returns.iter().map(|r| r[object]).skip_while(|&n| n < 10);
            if seen.any(|n| n == 0) {
                vanished += 1;
                back += usize::from(seen.any(|n| n >= 10));
            }
        }
    }
    assert!(vanished > 10 && back >= 3, "{vanished} vanish, {back} come back");
}

#[test]
fn states_move_at_their_velocity() {
    let drive = Drive::new(21, options(Ego::Standing, 40));
    let (t, h) = (1.37, 0.01);
    let states = drive.objects(t);
    assert!(states.len() > 40);
    for (i, s) in states.iter().enumerate() {
        assert_eq!(s.id as usize, i + 1);
        assert!(s.class.is_foreground());
        let [a, b] = [t - h, t + h].map(|t| drive.objects(t)[i].world_from_object.translation);
        assert!(((b - a) / (2.0 * h) - s.velocity_world).length() < 0.1, "{s:?}");
    }
    let parked = states.iter().filter(|s| s.velocity_world == DVec3::ZERO && s.class <= Class::Van);
    assert!(parked.count() > 10);
}

#[test]
fn traffic_keeps_clear() {
    for seed in 0..8 {
        let drive = Drive::new(seed, options(Ego::Any, 40));
        for step in 0..40 {
            let t = f64::from(step) * 0.1;
            let ego = drive.world_from_vehicle(t).translation;
            for s in drive.objects(t) {
                let apart = (s.world_from_object.translation - ego).truncate().length();
                assert!(apart > 1.0, "seed {seed}, {t} s: {s:?} at {apart} m");
            }
        }
    }
}
