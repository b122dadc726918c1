//! The same scene has the same motion whatever the voxel's size and the sensor's rate: parameters are
//! in metres and seconds.

#![forbid(unsafe_code)]

use glam::{DVec2, DVec3};
use raywake::order_statistics::median;
use raywake_core::background_filter;
use raywake_core::output::ColumnFlow;
use raywake_core::params::Profile;
use raywake_core::sweep::{Sweep, Timing};
use raywake_sim::{Drive, ObjectState, Options, Path, Scene, SimSweep, State, models};
use raywake_tests::drives::Setup;

/// Edges of a voxel, m, each with a window of 50 m.
const VOXELS: [(f64, u32); 3] = [(0.20, 251), (0.30, 167), (0.40, 125)];
/// Sweeps per second.
const RATES: [f64; 2] = [10.0, 20.0];
/// Duration of the scene, s, and of what tracklets take to settle.
const DURATION_S: f64 = 3.0;
const SETTLED_S: f64 = 1.0;
/// Speed from which on something counts as moving, m/s.
const MOVES_MPS: f64 = 0.5;

/// Vehicles at 0 to 15 m/s and a pedestrian, seen from a vehicle at 6 m/s, played `slower` times as
/// slow.
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

/// The scene at a rate: the simulator turns at 10 Hz, so a faster sensor is a slower world.
fn cast(rate: f64) -> (Drive, Vec<SimSweep>) {
    let (scene, path) = scene(rate / 10.0);
    let sweeps = (DURATION_S * rate) as usize;
    let drive = Drive::through(scene, path, 1, Options { sweeps, ..Options::default() });
    let sweeps = drive.clone().collect();
    (drive, sweeps)
}

/// What is found of the moving objects, of those that stand, and how well.
#[derive(Default)]
struct Found {
    /// Errors of the velocity of columns of moving objects, m/s, and how many of them move.
    errors: Vec<f64>,
    moving: usize,
    /// Columns of standing objects, and how many of them move.
    standing: [usize; 2],
}

impl Found {
    fn add(&mut self, c: &ColumnFlow, object: &ObjectState, velocity: DVec2) {
        let found = DVec2::from_array(c.velocity_world_mps.map(f64::from));
        let moves = found.length() > MOVES_MPS;
        if object.velocity_world.length() == 0.0 {
            self.standing[0] += usize::from(moves);
            self.standing[1] += 1;
        } else {
            self.errors.push((found - velocity).length());
            self.moving += usize::from(moves);
        }
    }

    fn recall(&self) -> f64 {
        self.moving as f64 / self.errors.len() as f64
    }

    fn false_motion(&self) -> f64 {
        self.standing[0] as f64 / self.standing[1] as f64
    }
}

fn inside(c: &ColumnFlow, object: &ObjectState) -> bool {
    let [x, y] = c.position_world_m;
    let centre = object.world_from_object.translation;
    let at = object.world_from_object.inverse().transform(DVec3::new(x, y, centre.z));
    at.x.abs() <= 0.5 * object.size[0] && at.y.abs() <= 0.5 * object.size[1]
}

/// Runs a profile over a scene that was cast at a rate.
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
        let columns = stepped.flows.map_or(&[][..], |flows| flows.columns);
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
            let found = run(Profile { voxel_m, side, ..Profile::hdl64() }, rate, &cast);
            let error = median(found.errors.iter().copied());
            let (recall, false_motion) = (found.recall(), found.false_motion());
            println!(
                "{voxel_m:.2} m, {rate} Hz: median error {error:.3} m/s, moving {recall:.3} of {}, \
                 standing ones {false_motion:.4} of {}",
                found.errors.len(),
                found.standing[1]
            );
        }
    }
}
