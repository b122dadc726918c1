//! Sweeps that do not occur in a street: too many returns, invalid or missing ones, all in one
//! place, without ground, ground only, along walls, in a crowd. Results stay bounded and counted,
//! and static structure stays static.

#![forbid(unsafe_code)]

use glam::DVec3;
use raywake_core::output::{PointFlow, Status};
use raywake_core::params::Profile;
use raywake_core::pose::Pose;
use raywake_core::stages::background_filter;
use raywake_core::sweep::Point;
use raywake_sim::{Class, Drive, Options, Path, Scene, Shape, SimSweep, State, Surface, models};
use raywake_tests::drives::{Setup, sweep};

/// Returns by status, and how many of them move.
#[derive(Debug, Default)]
struct Tally {
    returns: usize,
    /// Reported as moving: static ones, and moving ones.
    moving: [usize; 2],
    /// Returns of moving objects.
    of_movers: usize,
    of_status: [usize; Status::ALL.len()],
    over_capacity: u64,
}

impl Tally {
    fn add(&mut self, flow: &PointFlow, moves: bool) {
        self.returns += 1;
        self.of_movers += usize::from(moves);
        self.of_status[flow.status as usize] += 1;
        self.moving[usize::from(moves)] += usize::from(flow.status == Status::Moving);
    }

    fn of(&self, status: Status) -> usize {
        self.of_status[status as usize]
    }
}

/// Runs sweeps, each after being changed by `edit`.
fn run(profile: Profile, drive: &Drive, edit: impl Fn(&mut SimSweep)) -> Tally {
    run_with(&Setup::new(profile, Some(background_filter::SHIPPED.into())), drive, edit).0
}

/// The same, with the status of every return of the last pair's first sweep.
fn run_with(setup: &Setup, drive: &Drive, edit: impl Fn(&mut SimSweep)) -> (Tally, Vec<Status>) {
    let mut statuses = Vec::new();
    let mut pipeline = setup.drive(setup.scalar());
    let (mut tally, mut before) = (Tally::default(), SimSweep::clone(&drive.sweep(0)));
    before.points.clear();
    for index in 0..drive.sweeps() {
        let mut now = drive.sweep(index);
        edit(&mut now);
        let stepped = pipeline.step(&sweep(&now), &before.points);
        let output = stepped.unwrap_or_else(|e| panic!("{e}")).output;
        tally.over_capacity += output.dropped.over_capacity;
        if let Some(flows) = output.flows {
            assert_eq!(flows.points.count(), before.points.len());
            statuses = flows.points.iter().map(|flow| flow.status).collect();
            for (n, flow) in flows.points.iter().enumerate() {
                let moves = before.truth.get(n).is_some_and(|t| t.velocity_world != [0.0; 3]);
                tally.add(&flow, moves);
            }
        }
        before = now;
    }
    (tally, statuses)
}

fn along(x: f64, y: f64, speed: f64) -> Path {
    Path::from(State { x, y, yaw: 0.0, speed })
}

fn through(scene: Scene, speed: f64) -> Drive {
    Drive::through(scene, along(-20.0, 0.0, speed), 1, Options { sweeps: 12, ..Options::default() })
}

fn block(scene: &mut Scene, size: [f64; 3], at: [f64; 3]) {
    let [length, width, height] = size;
    let pose = Pose { translation: DVec3::from_array(at), ..Pose::IDENTITY };
    let shape = Shape::cuboid(length, width, height);
    scene.put(Class::Building, shape, pose, Surface::matt(0.4));
}

/// Keeps only the returns of a sweep whose class `keep` accepts.
fn keep(sweep: &mut SimSweep, keep: impl Fn(Class) -> bool) {
    let mut kept = sweep.truth.iter().map(|t| keep(t.class));
    sweep.points.retain(|_| kept.next().unwrap_or(false));
    sweep.truth.retain(|t| keep(t.class));
}

/// A street where only the vehicle moves.
fn still_street(seed: u64) -> Drive {
    let mut scene = Scene::street(seed);
    scene.objects.retain(|o| o.is_static());
    let path = Path::from(State { x: -20.0, y: -1.75, yaw: 0.0, speed: 8.0 });
    Drive::through(scene, path, seed, Options { sweeps: 12, ..Options::default() })
}

#[test]
fn a_sweep_with_twice_the_capacity_is_thinned_and_says_so() {
    let drive = still_street(5);
    let most = drive.sweep(0).points.len() as u32 / 2;
    let thinned = run(Profile { returns_max: most, ..Profile::hdl64() }, &drive, |_| ());
    let left_out = thinned.of(Status::OverCapacity);
    assert!((0.4..0.6).contains(&(left_out as f64 / thinned.returns as f64)), "{thinned:?}");
    assert!(thinned.over_capacity as usize >= left_out, "{thinned:?}");
    let whole = run(Profile::hdl64(), &drive, |_| ());
    assert_eq!((whole.of(Status::OverCapacity), whole.over_capacity), (0, 0));
    // A still street: in either case next to nothing moves.
    for tally in [&thinned, &whole] {
        assert!(tally.moving[0] * 2000 < tally.returns, "{tally:?}");
    }
}

/// Returns that no street has, and what becomes of them if the vehicle takes up 1 m.
fn strays() -> [(Point, Status); 5] {
    let at = |position| Point { position, ..Point::default() };
    [
        (at([0.0; 3]), Status::NoEcho),
        (at([5.0, f32::NAN, 1.0]), Status::Invalid),
        (Point { sensor: 7, ..at([5.0, 5.0, 1.0]) }, Status::Invalid),
        (at([0.4, 0.4, -0.5]), Status::OwnVehicle),
        (at([90.0, 5.0, 1.0]), Status::OutsideWindow),
    ]
}

#[test]
fn every_return_has_a_status() {
    const TIMES: usize = 20;
    let path = Path::from(State { x: -20.0, y: -1.75, yaw: 0.0, speed: 8.0 });
    let drive =
        Drive::through(Scene::street(5), path, 5, Options { sweeps: 6, ..Options::default() });
    let mut setup = Setup::new(Profile::hdl64(), Some(background_filter::SHIPPED.into()));
    setup.rig.own_vehicle = Some([[-0.5; 2], [0.5; 2]]);
    let add = |sweep: &mut SimSweep| {
        (0..TIMES).for_each(|_| sweep.points.extend(strays().map(|(point, _)| point)));
    };
    // The strays' statuses, round by round.
    let of_strays = |all: &[Status]| all[all.len() - TIMES * strays().len()..].to_vec();
    let (all, statuses) = run_with(&setup, &drive, add);
    for (n, status) in of_strays(&statuses).into_iter().enumerate() {
        assert_eq!(status, strays()[n % strays().len()].1, "{n}");
    }
    for status in Status::ALL {
        assert_eq!(all.of(status) > 0, status != Status::OverCapacity, "{status:?} in {all:?}");
    }
    // With room for half of them, each keeps its status or is left out.
    setup.profile.returns_max = drive.sweep(0).points.len() as u32 / 2;
    let (_, statuses) = run_with(&setup, &drive, add);
    let statuses = of_strays(&statuses);
    for (n, (_, given)) in strays().into_iter().enumerate() {
        let (kept, left_out): (Vec<&Status>, Vec<&Status>) =
            statuses.iter().skip(n).step_by(strays().len()).partition(|s| **s == given);
        assert!(!kept.is_empty() && !left_out.is_empty(), "{given:?}");
        assert!(left_out.iter().all(|s| **s == Status::OverCapacity), "{left_out:?}");
    }
}

#[test]
fn all_returns_in_one_column() {
    let drive = through(Scene::empty(), 8.0);
    let tally = run(Profile::hdl64(), &drive, |sweep| {
        let place = sweep.world_from_vehicle.inverse().transform(DVec3::new(4.0, 3.0, 0.0));
        let at = place.as_vec3().to_array();
        sweep.points = (0..200_000)
            .map(|n| Point {
                position: [at[0], at[1], at[2] + n as f32 * 5e-6],
                ..Point::default()
            })
            .collect();
        sweep.truth.clear();
    });
    assert!(tally.returns == 11 * 200_000 && tally.moving == [0, 0], "{tally:?}");
}

#[test]
fn static_streets_are_static_with_and_without_their_ground() {
    // Of returns with the ground, and without.
    let (mut moving, mut all) = ([0; 2], [0; 2]);
    for seed in 5..9 {
        let drive = still_street(seed);
        let whole = run(Profile::hdl64(), &drive, |_| ());
        let cut = run(Profile::hdl64(), &drive, |s| keep(s, |c| c != Class::Ground));
        for (n, tally) in [whole, cut].iter().enumerate() {
            moving[n] += tally.moving[0];
            all[n] += tally.returns;
        }
    }
    // 324 and 3,912; before P(moves) came from trees 3,594 and 10,389.
    assert!(all[0] > 4_000_000 && all[1] > 1_500_000, "{all:?}");
    assert!(moving[0] * 5000 < all[0] && moving[1] * 500 < all[1], "{moving:?} of {all:?}");
}

#[test]
fn ground_alone_is_static() {
    let tally = run(Profile::hdl64(), &still_street(5), |s| keep(s, |c| c == Class::Ground));
    assert!(tally.returns > 100_000 && tally.moving[0] == 0, "{tally:?}");
}

/// Nothing reveals how fast one drives along it, so nothing may be reported as moving either.
#[test]
fn a_wall_and_a_tunnel_are_static() {
    let mut wall = Scene::empty();
    block(&mut wall, [400.0, 1.0, 12.0], [0.0, 3.0, 0.0]);
    let mut tunnel = wall.clone();
    block(&mut tunnel, [400.0, 1.0, 12.0], [0.0, -5.0, 0.0]);
    block(&mut tunnel, [400.0, 10.0, 1.0], [0.0, -1.0, 5.0]);
    for scene in [wall, tunnel] {
        let tally = run(Profile::hdl64(), &through(scene, 20.0), |_| ());
        assert!(tally.returns > 100_000 && tally.moving[0] == 0, "{tally:?}");
    }
}

/// People all around walk along with the vehicle; the houses next to them stay put.
#[test]
fn in_a_crowd_people_move_and_houses_are_static() {
    let mut scene = Scene::empty();
    for side in [-14.0, 14.0] {
        block(&mut scene, [120.0, 2.0, 8.0], [0.0, side, 0.0]);
    }
    for n in 0..60 {
        let (row, column) = (f64::from(n / 10), f64::from(n % 10));
        let [x, y] = [-30.0 + 2.5 * column, -7.5 + 3.0 * row];
        // Not where the vehicle is.
        if (x + 20.0).abs() > 4.0 || y.abs() > 2.0 {
            scene.add(models::pedestrian, along(x, y + 0.3 * column, 1.5), n as u64);
        }
    }
    let tally = run(Profile::hdl64(), &through(scene, 1.5), |_| ());
    assert!(tally.moving[1] * 2 > tally.of_movers, "{tally:?}");
    let still = tally.returns - tally.of_movers;
    assert!(tally.moving[0] * 100 < still, "{tally:?}");
}

#[test]
#[should_panic(expected = "returns of the sweep before")]
fn returns_of_another_sweep_are_not_mistaken_for_the_last() {
    let drive = through(Scene::empty(), 5.0);
    let setup = Setup::new(Profile::hdl64(), Some(background_filter::SHIPPED.into()));
    let mut pipeline = setup.drive(setup.scalar());
    for index in 0..2 {
        let _ = pipeline.step(&sweep(&drive.sweep(index)), &[]);
    }
}
