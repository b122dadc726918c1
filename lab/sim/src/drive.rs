//! A drive through a scene, sweep by sweep.

use crate::cast::Caster;
use crate::clutter::Clutter;
use crate::ego::Ego;
use crate::path::Path;
use crate::rig::{PERIOD_S, SensorRig, stamp_s};
use crate::rng::Rng;
use crate::scene::{ObjectState, Scene};
use crate::scenery::Scenery;
use crate::static_scene::StaticScene;
use crate::truth::Truth;
use glam::DQuat;
use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::{Point, Rig};

/// Options of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Sweeps, 10 a second.
    pub sweeps: usize,
    /// Scene that is driven through.
    pub scenery: Scenery,
    /// What the vehicle does in a street; elsewhere the scene determines it.
    pub ego: Ego,
    /// Amount of traffic; 1 is a busy street, 0 an empty one.
    pub density: f64,
    /// What is in the air.
    pub clutter: Clutter,
    /// The sensors.
    pub rig: SensorRig,
    /// Threads that cast rays; 0: as many as the machine can run at once. The number does not
    /// affect the sweeps.
    pub threads: usize,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            sweeps: 30,
            scenery: Scenery::Street,
            ego: Ego::Any,
            density: 1.0,
            clutter: Clutter::None,
            rig: SensorRig::hdl64(),
            threads: 0,
        }
    }
}

/// One simulated sweep with its truth.
#[derive(Clone, Debug, PartialEq)]
pub struct SimSweep {
    /// Time of the stamp, at the middle of the sweep, s; starts from 0.
    pub stamp_s: f64,
    /// Returns in chronological order, each in the vehicle frame at its own time (distorted by the
    /// vehicle's motion), `offset_s` after the stamp.
    pub points: Vec<Point>,
    /// What every return really comes from.
    pub truth: Vec<Truth>,
    /// Pose of the vehicle at the stamp.
    pub world_from_vehicle: Pose,
    /// Velocity of the vehicle at the stamp, in its own frame.
    pub twist: Twist,
}

/// A drive: iterate over its sweeps, or request a particular one.
#[derive(Clone, Debug)]
pub struct Drive {
    scene: Scene,
    static_scene: StaticScene,
    path: Path,
    options: Options,
    seed: u64,
    next: usize,
}

impl Drive {
    /// Draws a scene from the seed and drives through it.
    pub fn new(seed: u64, options: Options) -> Drive {
        let duration_s = options.sweeps as f64 * PERIOD_S;
        let Options { scenery, ego, density, .. } = options;
        let (scene, path) = scenery.draw(seed, ego, duration_s, density);
        Drive::through(scene, path, seed, options)
    }

    /// Drives along a path (street frame) through a given scene; the seed draws the noise, and the
    /// options' ego and density are ignored.
    pub fn through(scene: Scene, path: Path, seed: u64, options: Options) -> Drive {
        Drive { static_scene: StaticScene::new(&scene), scene, path, options, seed, next: 0 }
    }

    /// Scene that is driven through.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Number of sweeps of the drive.
    pub fn sweeps(&self) -> usize {
        self.options.sweeps
    }

    /// The fixed description of the sensors.
    pub fn rig(&self) -> Rig {
        self.options.rig.declared()
    }

    /// The objects at a time, s, in the world frame.
    pub fn objects(&self, t: f64) -> Vec<ObjectState> {
        self.scene.states(t)
    }

    /// Pose of the vehicle at a time, s.
    pub fn world_from_vehicle(&self, t: f64) -> Pose {
        self.scene.world_from_street * self.street_from_vehicle(t)
    }

    fn street_from_vehicle(&self, t: f64) -> Pose {
        let state = self.path.at(t);
        let foot = self.scene.ground.standing_pose(state.x, state.y, state.yaw, [2.7, 1.5]);
        // The body pitches and rolls a little on its springs once it moves.
        let swing = 0.003 * (state.speed.abs() / 8.0).min(1.0);
        let nod = DQuat::from_rotation_y(swing * (7.3 * t + 0.4).sin());
        let roll = DQuat::from_rotation_x(0.6 * swing * (9.1 * t).sin());
        foot * Pose::new(nod * roll, self.options.rig.origin)
    }

    /// Velocity of the vehicle at a time, s, in its own frame.
    pub fn twist(&self, t: f64) -> Twist {
        const STEP_S: f64 = 1e-3;
        let here = self.street_from_vehicle(t).inverse();
        let [back, on] =
            [-STEP_S, STEP_S].map(|s| (here * self.street_from_vehicle(t + s)).twist(s));
        Twist {
            linear: 0.5 * (back.linear + on.linear),
            angular: 0.5 * (back.angular + on.angular),
        }
    }

    fn threads(&self) -> usize {
        match self.options.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n,
        }
    }

    /// Casts sweep `index`, independently of the sweeps cast before.
    pub fn sweep(&self, index: usize) -> SimSweep {
        let stamp_s = stamp_s(index);
        let Options { rig, clutter, .. } = &self.options;
        let caster = Caster::new(&self.scene, &self.static_scene, rig, *clutter);
        let seed = Rng::split(self.seed, 16 + index as u64).bits();
        let ego = |t: f64| self.street_from_vehicle(t);
        let (points, truth) = caster.sweep(&ego, index, seed, self.threads());
        SimSweep {
            stamp_s,
            points,
            truth,
            world_from_vehicle: self.world_from_vehicle(stamp_s),
            twist: self.twist(stamp_s),
        }
    }
}

impl Iterator for Drive {
    type Item = SimSweep;

    fn next(&mut self) -> Option<SimSweep> {
        let index = self.next;
        (index < self.options.sweeps).then(|| {
            self.next += 1;
            self.sweep(index)
        })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.options.sweeps - self.next.min(self.options.sweeps);
        (left, Some(left))
    }
}
