//! Contents of a scene: fixtures of the background, and objects of several parts.

use crate::ground::Ground;
use crate::path::Path;
use crate::shape::Shape;
use glam::{DQuat, DVec3};
use raywake_core::pose::Pose;

/// What a return comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Class {
    /// Road, sidewalk and kerb.
    #[default]
    Ground = 0,
    /// Buildings and walls.
    Building = 1,
    /// Lamp posts, signs, tree trunks.
    Pole = 2,
    /// Crowns, hedges and bushes.
    Vegetation = 3,
    /// Fences, bins, boxes and other permanent installations.
    Fixture = 4,
    /// A car, parked or moving.
    Car = 5,
    /// A van, parked or moving.
    Van = 6,
    /// A truck, rigid or with a semi-trailer.
    Truck = 7,
    /// A bus.
    Bus = 8,
    /// A tram.
    Tram = 9,
    /// A motorcycle with its rider; no part moves relative to the rest.
    Motorcycle = 10,
    /// A cyclist, pedalling.
    Cyclist = 11,
    /// A person on foot.
    Pedestrian = 12,
    /// Rain, fog or dust: not an object at all.
    Clutter = 13,
}

impl Class {
    /// Whether a background filter should keep it: anything that could move, even if it does not.
    pub fn is_foreground(self) -> bool {
        (Class::Car..=Class::Pedestrian).contains(&self)
    }
}

/// How a surface responds to the laser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Share of the light that comes back at normal incidence, 0..1.
    pub reflectivity: f64,
    /// Probability that a ray hitting it gives no return (glass).
    pub loss: f64,
    /// Probability that a ray passes through as if nothing were there (leaves, wire).
    pub porosity: f64,
}

impl Surface {
    /// A solid, opaque surface.
    pub fn matt(reflectivity: f64) -> Surface {
        Surface { reflectivity, loss: 0.0, porosity: 0.0 }
    }

    /// Windows: most rays pass through or are deflected and never return.
    pub fn glass(reflectivity: f64) -> Surface {
        Surface { reflectivity, loss: 0.55, porosity: 0.0 }
    }

    /// Leaves or wire.
    pub fn porous(reflectivity: f64, porosity: f64) -> Surface {
        Surface { reflectivity, loss: 0.0, porosity }
    }
}

/// An element of the background, in the street frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Fixture {
    /// Its class.
    pub class: Class,
    /// Its solid.
    pub shape: Shape,
    /// `street_from_shape`.
    pub pose: Pose,
    /// Its surface.
    pub surface: Surface,
}

/// A limb's swing about the y axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swing {
    /// A point of the axis in the object's frame, m.
    pub pivot: DVec3,
    /// rad.
    pub amplitude: f64,
    /// rad/s.
    pub rate: f64,
    /// rad at time 0.
    pub phase: f64,
}

/// A solid of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its solid.
    pub shape: Shape,
    /// `object_from_part` without swing.
    pub rest: Pose,
    /// Its surface.
    pub surface: Surface,
    /// How it swings, if it does.
    pub swing: Option<Swing>,
}

impl Part {
    /// `object_from_part` at a time, s.
    pub fn pose(&self, t: f64) -> Pose {
        let Some(swing) = self.swing else {
            return self.rest;
        };
        let angle = swing.amplitude * (swing.rate * t + swing.phase).sin();
        let turn = DQuat::from_rotation_y(angle);
        let about = Pose::new(turn, swing.pivot - turn * swing.pivot);
        about * self.rest
    }
}

/// A traffic participant. Its frame has its origin at the centre of its box: x forward, y left, z
/// up.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Positive, unique in the scene.
    pub id: u32,
    /// Its class.
    pub class: Class,
    /// Length, width and height of its box, m.
    pub size: [f64; 3],
    /// Distance between its wheels along and across, m; zeros for an upright object.
    pub base: [f64; 2],
    /// How it moves on the ground, street frame.
    pub path: Path,
    /// Its solids.
    pub parts: Vec<Part>,
}

impl Object {
    /// `street_from_object` at a time, s.
    pub fn pose(&self, ground: &Ground, t: f64) -> Pose {
        let state = self.path.at(t);
        let mut pose = ground.standing_pose(state.x, state.y, state.yaw, self.base);
        pose.translation += pose.rotation * DVec3::new(0.0, 0.0, 0.5 * self.size[2]);
        pose
    }

    /// `street_from_part` of part `index` at a time, s.
    pub fn part_pose(&self, index: usize, ground: &Ground, t: f64) -> Pose {
        self.pose(ground, t) * self.parts[index].pose(t)
    }

    /// Whether neither it nor any of its parts ever moves.
    pub fn is_static(&self) -> bool {
        self.path.is_static() && self.parts.iter().all(|part| part.swing.is_none())
    }

    /// Radius of the sphere around its centre that contains all of it, m.
    pub fn reach(&self) -> f64 {
        let part = |p: &Part| {
            let arm = p.rest.translation.length() + p.shape.reach();
            // A swinging limb stays within its length of its pivot.
            let swung = |s: Swing| {
                s.pivot.length() + (p.rest.translation - s.pivot).length() + p.shape.reach()
            };
            p.swing.map_or(arm, swung)
        };
        self.parts.iter().map(part).fold(0.0, f64::max)
    }
}
