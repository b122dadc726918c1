//! Solids placed at one moment, the nearest of them on a ray, and the half plane in which a column
//! of rays hits them.

use crate::object::{Class, Object, Surface};
use crate::rng::Rng;
use crate::shape::Shape;
use glam::{DMat3, DVec3};
use raywake_core::pose::Pose;

/// A solid at one moment, ready to be hit by rays in the street frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Target {
    pub(crate) shape: Shape,
    /// `part_from_street`.
    pub(crate) turn: DMat3,
    pub(crate) centre: DVec3,
    pub(crate) reach: f64,
    pub(crate) surface: Surface,
    pub(crate) class: Class,
    pub(crate) object: u32,
    /// Indices of the object and part it belongs to, if that moves.
    pub(crate) mover: Option<(usize, usize)>,
    /// Unique in the scene, from 1: seeds whether a ray passes through, and decides between two at
    /// the same range, so that the order in which they are tested does not matter.
    pub(crate) number: u64,
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
        // Above the numbers of all fixtures.
        let number = (1 + index as u64) << 32 | part as u64;
        Target {
            mover: moves.then_some((index, part)),
            object: object.id,
            ..Target::solid(p.shape, pose, p.surface, object.class, number)
        }
    }

    pub(crate) fn solid(
        shape: Shape,
        pose: Pose,
        surface: Surface,
        class: Class,
        number: u64,
    ) -> Target {
        let turn = pose.matrix().transpose();
        let (centre, reach) = (pose.translation, shape.reach());
        Target { shape, turn, centre, reach, surface, class, object: 0, mover: None, number }
    }

    /// Half extents along the street's axes of a box containing the solid.
    pub(crate) fn half(&self) -> DVec3 {
        let half = self.shape.half();
        // Rows of `street_from_part` are columns of its transpose.
        DVec3::from_array([0, 1, 2].map(|i| self.turn.col(i).abs().dot(half)))
    }
}

/// A ray in the street frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub(crate) origin: DVec3,
    /// A unit vector.
    pub(crate) direction: DVec3,
    /// Seed of all random decisions along it.
    pub(crate) seed: u64,
}

/// The nearest surface found so far on a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit<'t> {
    pub(crate) range: f64,
    pub(crate) cosine: f64,
    /// `None`: the ground.
    pub(crate) target: Option<&'t Target>,
}

impl<'t> Hit<'t> {
    /// Takes the target instead if the ray hits it nearer; returns whether it did.
    pub(crate) fn consider(&mut self, ray: &Ray, target: &'t Target) -> bool {
        let (turn, surface) = (&target.turn, &target.surface);
        let origin = *turn * (ray.origin - target.centre);
        let Some(c) = target.shape.cross(origin, *turn * ray.direction) else {
            return false;
        };
        let mut range = c.near;
        if surface.porosity > 0.0 && range <= self.range {
            let mut rng = Rng::split(ray.seed, target.number);
            if rng.chance(surface.porosity) {
                return false;
            }
            // Foliage returns rays from within, mostly from its outer part.
            let u = rng.unit();
            range += 0.6 * u * u * (c.far - c.near);
        }
        let number = self.target.map_or(0, |t| t.number);
        let nearer = range < self.range || (range == self.range && target.number < number);
        if nearer {
            *self = Hit { range, cosine: c.cosine, target: Some(target) };
        }
        nearer
    }
}

/// One column's half plane in the street frame.
pub(crate) struct Fan {
    pub(crate) origin: DVec3,
    /// In the half plane, along the column's azimuth.
    pub(crate) forward: DVec3,
    /// Normal of the half plane.
    pub(crate) across: DVec3,
    /// Maximum distance of a ray from the half plane, per metre ahead.
    pub(crate) spread: f64,
    /// Farthest range, m.
    pub(crate) range: f64,
}

impl Fan {
    /// Whether a ray of the column can hit the sphere.
    pub(crate) fn meets(&self, centre: DVec3, reach: f64) -> bool {
        let to = centre - self.origin;
        let ahead = to.dot(self.forward);
        ahead > -reach
            && ahead < self.range + reach
            && to.dot(self.across).abs() < reach + self.spread * (ahead.abs() + reach)
    }
}
