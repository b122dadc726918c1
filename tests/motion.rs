//! Simulated objects move as fast as their tracklets say.

#![forbid(unsafe_code)]

use glam::{DVec2, DVec3};
use raywake_core::background_filter;
use raywake_core::output::{ColumnFlow, Origin};
use raywake_core::params::Profile;
use raywake_sim::{Class, Drive, ObjectState, Options, Path, Scene, State, models};
use raywake_tests::drives::{Setup, sweep};
use std::collections::BTreeMap;

/// Observations after which a tracklet is held to its word.
const AGE: u32 = 10;
/// Columns of an object, over all sweeps, below which nothing is concluded.
const ENOUGH: usize = 50;
/// Largest median error, m/s.
const LIMIT: f64 = 0.5;
/// The same of a van: along its long smooth sides whole cells are hard to tell apart (0.65 m/s at
/// most where this was set).
const LIMIT_OF_VANS: f64 = 0.8;

/// Objects at 3 to 15 m/s, each in a lane of its own, within sight for a few seconds.
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

/// What the vehicle does: it stands, goes straight on, turns.
fn drives() -> [(&'static str, Drive); 3] {
    let straight = Path::from(State { speed: 8.0, ..State::default() });
    let turning = Path::from(State { speed: 5.0, ..State::default() }).then(5.0, 0.0, 0.06);
    let options = || Options { sweeps: 60, ..Options::default() };
    [("standing", Path::standing(0.0, 0.0, 0.0)), ("moving", straight), ("turning", turning)]
        .map(|(name, path)| (name, Drive::through(scene(), path, 1, options())))
}

fn inside(c: &ColumnFlow, object: &ObjectState) -> bool {
    let [x, y] = c.position_world_m;
    let centre = object.world_from_object.translation;
    let at = object.world_from_object.inverse().transform(DVec3::new(x, y, centre.z));
    at.x.abs() <= 0.5 * object.size[0] && at.y.abs() <= 0.5 * object.size[1]
}

/// Errors of velocity (m/s, world axes) of old matched columns, by the object they lie in.
fn errors(drive: &Drive) -> BTreeMap<u32, Vec<DVec2>> {
    let setup = Setup::new(Profile::hdl64(), Some(background_filter::SHIPPED.into()));
    let mut pipeline = setup.drive(setup.scalar());
    let mut errors = BTreeMap::<u32, Vec<DVec2>>::new();
    let (mut before, mut objects) = (Vec::new(), Vec::new());
    for index in 0..drive.sweeps() {
        let now = drive.sweep(index);
        let stepped = pipeline.step(&sweep(&now), &before).unwrap_or_else(|e| panic!("{e}"));
        let columns = stepped.flows.map_or(&[][..], |flows| flows.columns);
        for c in columns.iter().filter(|c| c.origin == Origin::Matched && c.age >= AGE) {
            if let Some(object) = objects.iter().find(|o| inside(c, o)) {
                let found = DVec2::from_array(c.velocity_world_mps.map(f64::from));
                let off = found - object.velocity_world.truncate();
                errors.entry(object.id).or_default().push(off);
            }
        }
        objects = drive.objects(now.stamp_s);
        before = now.points;
    }
    errors
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// What the tracklets of an object say together, component by component, m/s off.
fn together(errors: &[DVec2]) -> f64 {
    let x = median(errors.iter().map(|e| e.x).collect());
    let y = median(errors.iter().map(|e| e.y).collect());
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
            let limit = if object.class == Class::Van { LIMIT_OF_VANS } else { LIMIT };
            let (count, off) = (errors.len(), together(&errors));
            let each = median(errors.iter().map(|e| e.length()).collect());
            println!(
                "{case}: object {id}, {speed:4.1} m/s: {off:.2} m/s off, each {each:.2}, {count} columns"
            );
            if count < ENOUGH {
                continue;
            }
            held += 1;
            all.extend(errors.iter().map(|e| e.length()));
            if off > limit {
                late.push(format!("{case}: object {id}, {off:.2} m/s"));
            }
        }
    }
    assert!(held >= 8, "only {held} objects show enough columns");
    assert!(late.is_empty(), "{late:?}");
    let each = median(all);
    assert!(each <= LIMIT, "a column is {each:.2} m/s off");
}
