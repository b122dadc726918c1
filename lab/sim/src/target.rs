//! Solids placed at one moment, and the half plane in which a column of rays meets them.

use crate::object::{Class, Object, Surface};
use crate::shape::Shape;
use glam::{DMat3, DVec3};
use raywake_core::pose::Pose;

/// How far a ray may lie beside its column's plane, per metre: the beams' own azimuths (0.08
/// degrees) and 3.5 deviations of angular noise, with room.
const SPREAD: f64 = 4e-3;

/// A solid at one moment, ready to be met by rays of the street frame.
#[derive(Clone, Debug)]
pub(crate) struct Target {
    pub(crate) shape: Shape,
    /// `part_from_street`.
    pub(crate) turn: DMat3,
    pub(crate) centre: DVec3,
    pub(crate) reach: f64,
    pub(crate) surface: Surface,
    pub(crate) class: Class,
    pub(crate) object: u32,
    /// Object and part it is of, where that moves.
    pub(crate) mover: Option<(usize, usize)>,
}

impl Target {
    pub(crate) fn of_part(
        index: usize,
        object: &Object,
        part: usize,
        pose: Pose,
        moves: bool,
    ) -> Target {
        let p = &object.parts[part];
        Target {
            mover: moves.then_some((index, part)),
            object: object.id,
            ..Target::solid(p.shape, pose, p.surface, object.class)
        }
    }

    pub(crate) fn solid(shape: Shape, pose: Pose, surface: Surface, class: Class) -> Target {
        let turn = pose.matrix().transpose();
        let (centre, reach) = (pose.translation, shape.reach());
        Target { shape, turn, centre, reach, surface, class, object: 0, mover: None }
    }
}

/// One column's half plane in the street frame.
pub(crate) struct Fan {
    pub(crate) origin: DVec3,
    /// In the half plane, along the column's azimuth.
    pub(crate) forward: DVec3,
    /// Normal of the half plane.
    pub(crate) across: DVec3,
}

impl Fan {
    /// Whether a ray of the column can meet the sphere within `range`.
    pub(crate) fn meets(&self, centre: DVec3, reach: f64, range: f64) -> bool {
        let to = centre - self.origin;
        let ahead = to.dot(self.forward);
        ahead > -reach
            && ahead < range + reach
            && to.dot(self.across).abs() < reach + SPREAD * (ahead.abs() + reach)
    }
}
