//! Simulated objects move as fast as their tracklets state.

#![forbid(unsafe_code)]

use glam::{DVec2, DVec3};
use raywake::order_statistics::median;
use raywake_core::output::{ColumnFlow, FlowBasis};
use raywake_core::params::Profile;
use raywake_core::stages::background_filter;
use raywake_sim::{Class, Drive, ObjectState, Options, Path, Scene, State, models};
use raywake_tests::drives::{Setup, sweep};
use std::collections::BTreeMap;

/// Observations from which on a tracklet's velocity is checked.
const AGE: u32 = 10;
/// Columns of an object, over all sweeps, below which no conclusion is drawn.
const COLUMNS_MIN: usize = 50;
/// Largest median error, m/s.
const LIMIT: f64 = 0.4;
/// Speed above which something counts as moving, m/s.
const MOVES: f64 = 0.5;

/// Objects at 3 to 15 m/s, each in its own lane, in view for a few seconds.
fn scene() -> Scene {
    let mut scene = Scene::empty();
    let along = |x: f64, y: f64, speed: f64| Path::from(State { x, y, yaw: 0.0, speed });
    let against =
        |x: f64, y: f64, speed: f64| Path::from(State { x, y, yaw: std::f64::consts::PI, speed });
    scene.add_car(along(-20.0, 7.0, 15.0), 1);
    scene.add_car(against(24.0, -8.0, 12.0), 2);
    scene.add_car(along(-10.0, -13.0, 6.0), 3);
    scene.add(models::van, against(20.0, 11.0, 9.0), 4);
    scene.add(models::van, along(-8.0, 15.0, 7.5), 5);
    scene.add_car(along(-3.0, -18.0, 3.0), 6);
    scene.add_car(against(20.0, 18.0, 11.0), 7);
    scene
}

/// Motions of the vehicle: stationary, straight on, turning.
fn drives() -> [(&'static str, Drive); 3] {
    let straight = Path::from(State { speed: 8.0, ..State::default() });
    let turning = Path::from(State { speed: 5.0, ..State::default() }).then(5.0, 0.0, 0.06);
    let options = || Options { sweeps: 60, ..Options::default() };
    [("standing", Path::stationary(0.0, 0.0, 0.0)), ("moving", straight), ("turning", turning)]
        .map(|(name, path)| (name, Drive::through(scene(), path, 1, options())))
}

/// Whether a column lies in an object, or within `beside` m of it.
fn inside(c: &ColumnFlow, object: &ObjectState, beside: f64) -> bool {
    let [x, y] = c.position_world_m;
    let centre = object.world_from_object.translation;
    let at = object.world_from_object.inverse().transform(DVec3::new(x, y, centre.z));
    at.x.abs() <= 0.5 * object.size[0] + beside && at.y.abs() <= 0.5 * object.size[1] + beside
}

/// Calls `each` with the columns of every pair of consecutive sweeps, and the objects at the pair's
/// first one.
fn follow(
    drive: &Drive,
    sweeps: impl Iterator<Item = usize>,
    mut each: impl FnMut(&[ColumnFlow], &[ObjectState]),
) {
    let setup = Setup::new(Profile::hdl64(), Some(background_filter::SHIPPED.into()));
    let mut pipeline = setup.drive(setup.scalar());
    let (mut before, mut objects) = (Vec::new(), Vec::new());
    for index in sweeps {
        let now = drive.sweep(index);
        let stepped = pipeline.step(&sweep(&now), &before).unwrap_or_else(|e| panic!("{e}"));
        each(stepped.output.flows.map_or(&[][..], |flows| flows.columns), &objects);
        objects = drive.objects(now.stamp_s);
        before = now.points;
    }
}

/// Velocity errors (m/s, world axes) of old matched columns, with the object they lie in.
fn errors_of(columns: &[ColumnFlow], objects: &[ObjectState]) -> Vec<(u32, DVec2)> {
    let old = columns.iter().filter(|c| c.basis == FlowBasis::Matched && c.age >= AGE);
    let error = |c: &ColumnFlow| {
        let object = objects.iter().find(|o| inside(c, o, 0.0))?;
        let found = DVec2::from_array(c.velocity_world_mps.map(f64::from));
        Some((object.id, found - object.velocity_world.truncate()))
    };
    old.filter_map(error).collect()
}

/// The same of a whole drive, by object.
fn errors(drive: &Drive) -> BTreeMap<u32, Vec<DVec2>> {
    let mut errors = BTreeMap::<u32, Vec<DVec2>>::new();
    follow(drive, 0..drive.sweeps(), |columns, objects| {
        for (id, off) in errors_of(columns, objects) {
            errors.entry(id).or_default().push(off);
        }
    });
    errors
}

/// Error of the combined velocity of an object's tracklets, by the median of each component, m/s.
fn together(errors: &[DVec2]) -> f64 {
    let x = median(errors.iter().map(|e| e.x));
    let y = median(errors.iter().map(|e| e.y));
    x.hypot(y)
}

#[test]
fn tracklets_recover_the_velocity_of_moving_objects() {
    let (mut late, mut held, mut all) = (Vec::new(), 0, Vec::new());
    for (case, drive) in drives() {
        let objects = drive.objects(1.0);
        for (id, errors) in errors(&drive) {
            let object = &objects[id as usize - 1];
            let speed = object.velocity_world.length();
            let (count, off) = (errors.len(), together(&errors));
            let each = median(errors.iter().map(|e| e.length()));
            println!(
                "{case}: object {id}, {speed:4.1} m/s: {off:.2} m/s off, each {each:.2}, {count} columns"
            );
            if count < COLUMNS_MIN {
                continue;
            }
            held += 1;
            all.extend(errors.iter().map(|e| e.length()));
            if off > LIMIT {
                late.push(format!("{case}: object {id}, {off:.2} m/s"));
            }
        }
    }
    assert!(held >= 8, "only {held} objects show enough columns");
    assert!(late.is_empty(), "{late:?}");
    let each = median(all);
    assert!(each <= LIMIT, "a column is {each:.2} m/s off");
}

/// Past parked cars, houses and trees, where only the vehicle moves.
/// Where a sweep is missing, tracklets keep their age and velocity.
#[test]
fn tracklets_outlive_a_lost_sweep() {
    let (lost, [_, (_, drive), _]) = (30, drives());
    let mut pairs = Vec::new();
    follow(&drive, (0..lost + 4).filter(|n| *n != lost), |columns, objects| {
        let errors = errors_of(columns, objects).into_iter().map(|(_, off)| off);
        pairs.push(errors.collect::<Vec<_>>());
    });
    // The pair with the gap, and those after it.
    for errors in &pairs[lost..] {
        assert!(errors.len() > COLUMNS_MIN && together(errors) < LIMIT, "{}", errors.len());
    }
}

#[test]
fn nothing_moves_in_a_static_street() {
    // Counts of moving columns and of all: on parked cars, and away from any object.
    let (mut parked, mut background) = ([0; 2], [0; 2]);
    for seed in [5, 6, 7] {
        let mut scene = Scene::street(seed);
        scene.objects.retain(|o| o.is_static());
        let path = Path::from(State { x: -20.0, y: -1.75, yaw: 0.0, speed: 12.0 });
        let drive = Drive::through(scene, path, seed, Options { sweeps: 40, ..Options::default() });
        follow(&drive, 0..drive.sweeps(), |columns, objects| {
            for c in columns {
                let is_car = |o: &&ObjectState| o.class == Class::Car && inside(c, o, 0.0);
                let count = if objects.iter().any(|o| is_car(&o)) {
                    &mut parked
                } else if !objects.iter().any(|o| inside(c, o, 0.5)) {
                    &mut background
                } else {
                    continue;
                };
                let speed = DVec2::from_array(c.velocity_world_mps.map(f64::from)).length();
                count[0] += (speed > MOVES) as usize;
                count[1] += 1;
            }
        });
        println!("street {seed}: {parked:?} {background:?}");
    }
    let share = |[moving, all]: [usize; 2]| moving as f64 / all as f64;
    let (parked_share, background_share) = (share(parked), share(background));
    println!("of parked cars {parked_share:.4}, of the background {background_share:.4}");
    assert!(parked[1] > 15_000 && background[1] > 150_000, "{parked:?} {background:?}");
    assert!(parked_share <= 0.025, "{parked_share:.4} of parked cars move");
    assert!(background_share <= 0.004, "{background_share:.4} of the background move");
}
