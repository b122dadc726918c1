//! A scene has the same motion whatever the voxel size and the sensor's rate: parameters are in
//! metres and seconds.

#![forbid(unsafe_code)]

use glam::{DVec2, DVec3};
use raywake::order_statistics::median;
use raywake_core::output::ColumnFlow;
use raywake_core::params::Profile;
use raywake_core::stages::background_filter;
use raywake_core::sweep::{Sweep, Timing};
use raywake_sim::{Drive, ObjectState, Options, Path, Scene, SimSweep, State, models};
use raywake_tests::drives::Setup;
use std::collections::BTreeMap;

/// Edge of a voxel, m, and side of a 50 m window, voxels.
const VOXELS: [(f64, u32); 3] = [(0.20, 251), (0.30, 167), (0.40, 125)];
/// Sweeps per second.
const RATES: [f64; 2] = [10.0, 20.0];
/// Duration of the scene, and the time tracklets take to settle, s.
const DURATION_S: f64 = 3.0;
const SETTLED_S: f64 = 1.0;
/// Speed above which something counts as moving, m/s.
const MOVES_MPS: f64 = 0.5;

/// Number of moving objects.
const MOVING: usize = 5;
/// Bounds at every scale. Measured: medians of 0.03 to 0.18 m/s per object, 67 to 94 % of their
/// columns (an object's edge is as wide as a column), 2.5 to 3.4 % of those of stationary ones.
const ERROR_MAX_MPS: f64 = 0.25;
const RECALL_MIN: f64 = 0.6;
const FALSE_MOTION_MAX: f64 = 0.05;

/// Vehicles at 0 to 15 m/s and a pedestrian, seen from a vehicle at 6 m/s, slowed down by a factor
/// `slower`.
fn scene(slower: f64) -> (Scene, Path) {
    let mut scene = Scene::empty();
    let along = |x: f64, y: f64, yaw: f64, speed: f64| {
        Path::from(State { x, y, yaw, speed: speed / slower })
    };
    let back = std::f64::consts::PI;
    scene.add_car(along(-12.0, 7.0, 0.0, 15.0), 1);
    scene.add_car(along(22.0, -7.0, back, 9.0), 2);
    scene.add_car(along(-6.0, -12.0, 0.0, 4.0), 3);
    scene.add(models::van, along(20.0, 11.0, back, 7.0), 4);
    scene.add(models::pedestrian, along(8.0, 4.0, 0.5 * back, 1.5), 5);
    scene.add_car(along(10.0, -4.0, 0.0, 0.0), 6);
    scene.add(models::van, along(16.0, 5.0, 0.0, 0.0), 7);
    (scene, along(0.0, 0.0, 0.0, 6.0))
}

/// The scene at a rate: the simulator runs at 10 Hz, so a faster sensor is a slower world.
fn cast(rate: f64) -> (Drive, Vec<SimSweep>) {
    let (scene, path) = scene(rate / 10.0);
    let sweeps = (DURATION_S * rate) as usize;
    let drive = Drive::through(scene, path, 1, Options { sweeps, ..Options::default() });
    let sweeps = drive.clone().collect();
    (drive, sweeps)
}

/// Results for moving and for stationary objects.
#[derive(Default)]
struct Found {
    /// Errors of the velocity of columns, m/s, by moving object.
    errors: BTreeMap<u32, Vec<f64>>,
    /// Columns of moving objects found to move, and all of them.
    moving: [usize; 2],
    /// The same for stationary objects.
    standing: [usize; 2],
}

impl Found {
    fn add(&mut self, c: &ColumnFlow, object: &ObjectState, velocity: DVec2) {
        let found = DVec2::from_array(c.velocity_world_mps.map(f64::from));
        let moves = found.length() > MOVES_MPS;
        let stands = velocity == DVec2::ZERO;
        let count = if stands { &mut self.standing } else { &mut self.moving };
        *count = [count[0] + usize::from(moves), count[1] + 1];
        if moves && !stands {
            self.errors.entry(object.id).or_default().push((found - velocity).length());
        }
    }
}

fn inside(c: &ColumnFlow, object: &ObjectState) -> bool {
    let [x, y] = c.position_world_m;
    let centre = object.world_from_object.translation;
    let at = object.world_from_object.inverse().transform(DVec3::new(x, y, centre.z));
    at.x.abs() <= 0.5 * object.size[0] && at.y.abs() <= 0.5 * object.size[1]
}

/// Runs a profile over a scene cast at this rate.
fn run(profile: Profile, rate: f64, (drive, sweeps): &(Drive, Vec<SimSweep>)) -> Found {
    let faster = rate / 10.0;
    let mut setup = Setup::new(profile, Some(background_filter::SHIPPED.into()));
    if let Timing::Offset { from_s, span_s } = &mut setup.rig.timing {
        (*from_s, *span_s) = (*from_s / faster, *span_s / faster);
    }
    let mut pipeline = setup.drive(setup.scalar());
    let mut found = Found::default();
    let (mut before, mut objects) = (Vec::new(), Vec::new());
    for simulated in sweeps {
        let mut points = simulated.points.clone();
        points.iter_mut().for_each(|p| p.offset_s /= faster as f32);
        let mut twist = simulated.twist;
        (twist.linear, twist.angular) = (twist.linear * faster, twist.angular * faster);
        let sweep = Sweep {
            stamp_s: simulated.stamp_s / faster,
            points: &points,
            world_from_vehicle: simulated.world_from_vehicle,
            twist,
        };
        let stepped = pipeline.step(&sweep, &before).unwrap_or_else(|e| panic!("{e}"));
        let columns = stepped.output.flows.map_or(&[][..], |flows| flows.columns);
        for c in columns.iter().filter(|_| sweep.stamp_s > SETTLED_S) {
            if let Some(object) = objects.iter().find(|o| inside(c, o)) {
                found.add(c, object, object.velocity_world.truncate() * faster);
            }
        }
        objects = drive.objects(simulated.stamp_s);
        before = points;
    }
    found
}

#[test]
fn motion_is_the_same_at_any_scale() {
    for rate in RATES {
        let cast = cast(rate);
        for (voxel_m, side) in VOXELS {
            let profile = Profile { voxel_m, side, ..Profile::hdl64() };
            let found = run(profile, rate, &cast);
            let share = |[some, all]: [usize; 2]| some as f64 / all as f64;
            let (recall, false_motion) = (share(found.moving), share(found.standing));
            let of_object = |e: &Vec<f64>| median(e.iter().copied());
            let errors: Vec<f64> = found.errors.values().map(of_object).collect();
            println!(
                "{voxel_m:.2} m, {rate:2} Hz: {errors:.3?} m/s off, {recall:.3} of {} columns \
                 move, {false_motion:.4} of {} that stand",
                found.moving[1], found.standing[1]
            );
            assert!(errors.len() == MOVING && errors.iter().all(|e| *e <= ERROR_MAX_MPS));
            assert!(recall >= RECALL_MIN && false_motion <= FALSE_MOTION_MAX);
        }
    }
}
