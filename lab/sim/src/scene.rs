//! A scene: ground, fixtures and traffic, in a street frame placed anywhere in the world.

use crate::ego::Ego;
use crate::ground::Ground;
use crate::models;
use crate::object::{Class, Fixture, Object, Surface};
use crate::path::Path;
use crate::rng::Rng;
use crate::shape::Shape;
use crate::{street, traffic};
use glam::DVec3;
use raywake_core::pose::Pose;

/// Everything a sensor can see. Positions and paths are in the street frame: x along the main road,
/// y left, z up.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// What everything stands on.
    pub ground: Ground,
    /// The background other than the ground.
    pub fixtures: Vec<Fixture>,
    /// Traffic, parked or moving, by ascending id from 1.
    pub objects: Vec<Object>,
    /// Pose of the street frame in the world.
    pub world_from_street: Pose,
}

/// State of an object at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectState {
    /// As in [`crate::Truth::object`].
    pub id: u32,
    /// Its class.
    pub class: Class,
    /// Pose of its box's centre in the world; x forward, y left, z up.
    pub world_from_object: Pose,
    /// Length, width and height of its box, m.
    pub size: [f64; 3],
    /// Velocity of the centre over ground along world axes, m/s.
    pub velocity_world: DVec3,
}

impl Scene {
    /// Only the plane z = 0; street and world frame coincide. For tests that place what they need.
    pub fn empty() -> Scene {
        Scene {
            ground: Ground::flat(),
            fixtures: Vec::new(),
            objects: Vec::new(),
            world_from_street: Pose::IDENTITY,
        }
    }

    /// A street with buildings, parked cars and twenty seconds of traffic around a vehicle standing
    /// in the right lane at the street frame's origin.
    pub fn street(seed: u64) -> Scene {
        Scene::around(seed, &Ego::Standing.plan(seed, 20.0), 20.0, 1.0, None)
    }

    /// A street built for this motion of the vehicle over `duration_s`: no path of traffic crosses
    /// it. `density` scales the amount of traffic; `extra` are additional fixtures.
    pub(crate) fn around(
        seed: u64,
        plan: &crate::ego::Plan,
        duration_s: f64,
        density: f64,
        extra: Option<street::Extra>,
    ) -> Scene {
        let mut rng = Rng::split(seed, 1);
        let slopes = [rng.range(-0.025, 0.025), rng.range(-0.025, 0.025)];
        let (across, bend) = (rng.range(-0.012, 0.012), rng.range(-20.0, 60.0));
        let ground = Ground::street(slopes, across, bend, plan.crossing, rng.range(0.08, 0.16));
        let ground = ground.with_section(plan.section).uneven(rng.range(0.004, 0.02));
        let heading = rng.range(-std::f64::consts::PI, std::f64::consts::PI);
        let world_from_street =
            Pose::planar(rng.range(-200.0, 200.0), rng.range(-200.0, 200.0), 0.0, heading);
        let extent = street::Extent::around(&plan.path, duration_s);
        let mut street = street::build(&ground, extent, plan.crossing, &mut Rng::split(seed, 2));
        if let Some(extra) = extra {
            let mut chance = Rng::split(seed, 9);
            let more = street::add(&ground, extent, plan.crossing, extra, &mut chance);
            street.fixtures.extend(more);
        }
        let mut chance = Rng::split(seed, 3);
        let objects = traffic::fill(&street, extent, plan, duration_s, density, &mut chance);
        Scene { ground, fixtures: street.fixtures, objects, world_from_street }
    }

    /// Adds a fixture to the background; `pose` is `street_from_shape`.
    pub fn put(&mut self, class: Class, shape: Shape, pose: Pose, surface: Surface) {
        self.fixtures.push(Fixture { class, shape, pose, surface });
    }

    /// Adds an object and returns its id. `model` is one of [`crate::models`]; `seed` determines
    /// its size and paint.
    pub fn add(&mut self, model: fn(u32, Path, &mut Rng) -> Object, path: Path, seed: u64) -> u32 {
        let id = self.objects.len() as u32 + 1;
        self.objects.push(model(id, path, &mut Rng::new(seed)));
        id
    }

    /// Adds a car on a path (street frame) and returns its id.
    pub fn add_car(&mut self, path: Path, seed: u64) -> u32 {
        self.add(models::car, path, seed)
    }

    /// The objects at a time, s, by id.
    pub fn states(&self, t: f64) -> Vec<ObjectState> {
        self.objects.iter().map(|object| self.state(object, t)).collect()
    }

    fn state(&self, object: &Object, t: f64) -> ObjectState {
        const STEP_S: f64 = 5e-4;
        let at = |t: f64| self.world_from_street * object.pose(&self.ground, t);
        let still = object.path.is_static();
        let moved = || (at(t + STEP_S).translation - at(t - STEP_S).translation) / (2.0 * STEP_S);
        ObjectState {
            id: object.id,
            class: object.class,
            world_from_object: at(t),
            size: object.size,
            velocity_world: if still { DVec3::ZERO } else { moved() },
        }
    }
}
