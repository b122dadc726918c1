//! Where a return really comes from, and how that moves.

use crate::object::Class;
use crate::rig::PERIOD_S;
use crate::scene::Scene;
use crate::target::Hit;
use glam::DVec3;
use raywake_core::pose::Pose;

/// Where a return really comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Truth {
    /// Id of the object, 0 for the static background.
    pub object: u32,
    /// Its class.
    pub class: Class,
    /// Velocity over ground of the exact point hit, at the ray's time, along world axes, m/s: a
    /// turning car's corners differ, a walker's leg is faster than the walker.
    pub velocity_world: [f32; 3],
    /// Motion over ground, along world axes, of that same material point within the 0.1 s (one
    /// sweep) after the ray's time, m; exact.
    pub flow_world: [f32; 3],
}

impl Truth {
    /// Truth of clutter in the air: no object, at rest.
    pub(crate) const CLUTTER: Truth =
        Truth { object: 0, class: Class::Clutter, velocity_world: [0.0; 3], flow_world: [0.0; 3] };
}

/// Half the step of the central difference that yields velocities, s.
const STEP_S: f64 = 5e-4;

/// Motion of one part of an object around one time.
#[derive(Clone, Copy)]
struct Motion {
    part_from_street: Pose,
    /// `street_from_part` a step earlier, a step later, and a sweep later.
    before: Pose,
    after: Pose,
    next: Pose,
}

impl Motion {
    fn of(scene: &Scene, (index, part): (usize, usize), t: f64) -> Motion {
        let pose = |t: f64| scene.objects[index].part_pose(part, &scene.ground, t);
        Motion {
            part_from_street: pose(t).inverse(),
            before: pose(t - STEP_S),
            after: pose(t + STEP_S),
            next: pose(t + PERIOD_S),
        }
    }
}

/// The motions at one time of the parts that were hit.
pub(crate) struct Motions<'a> {
    scene: &'a Scene,
    t: f64,
    known: Vec<((usize, usize), Motion)>,
}

impl<'a> Motions<'a> {
    pub(crate) fn at(scene: &'a Scene, t: f64) -> Motions<'a> {
        Motions { scene, t, known: Vec::new() }
    }

    fn of(&mut self, mover: (usize, usize)) -> Motion {
        if let Some(known) = self.known.iter().find(|k| k.0 == mover) {
            return known.1;
        }
        let motion = Motion::of(self.scene, mover, self.t);
        self.known.push((mover, motion));
        motion
    }

    /// The truth of a hit at a place in the street frame.
    pub(crate) fn truth(&mut self, hit: &Hit, at: DVec3) -> Truth {
        let Some(target) = hit.target else {
            return Truth::default();
        };
        let truth = Truth { object: target.object, class: target.class, ..Truth::default() };
        let Some(mover) = target.mover else {
            return truth;
        };
        let motion = self.of(mover);
        let fixed = motion.part_from_street.transform(at);
        let in_world = |v: DVec3| (self.scene.world_from_street.rotation * v).as_vec3().to_array();
        let moved = motion.after.transform(fixed) - motion.before.transform(fixed);
        Truth {
            velocity_world: in_world(moved / (2.0 * STEP_S)),
            flow_world: in_world(motion.next.transform(fixed) - at),
            ..truth
        }
    }
}
