//! Places fixtures, except where the vehicle drives.

use super::clearance::SweptArea;
use crate::ground::Ground;
use crate::object::{Class, Fixture, Surface};
use crate::rng::Rng;
use crate::shape::Shape;
use glam::{DQuat, DVec3};
use raywake_core::pose::Pose;

/// How deep everything on the ground is sunk, m, so that no ray passes beneath it on a slope.
const SUNK_M: f64 = 0.4;

/// Calls `put` every `step` metres from one station up to another.
pub(super) fn every([from, to]: [f64; 2], step: f64, put: impl FnMut(f64)) {
    let count = ((to - from) / step).ceil() as u32;
    (0..count).map(|n| from + step * f64::from(n)).for_each(put);
}

/// The place this far away from another in a direction, rad.
pub(super) fn away([x, y]: [f64; 2], turn: f64, far: f64) -> [f64; 2] {
    [x + far * turn.cos(), y + far * turn.sin()]
}

/// A scene's background under construction.
pub(super) struct Site<'a> {
    pub(super) ground: &'a Ground,
    pub(super) rng: &'a mut Rng,
    pub(super) fixtures: Vec<Fixture>,
    /// The vehicle's path.
    swept: SweptArea,
}

impl<'a> Site<'a> {
    pub(super) fn new(ground: &'a Ground, rng: &'a mut Rng, swept: SweptArea) -> Site<'a> {
        Site { ground, rng, fixtures: Vec::new(), swept }
    }

    /// Adds a fixture (`pose` is `street_from_shape`) unless it is in the vehicle's way.
    pub(super) fn fix(&mut self, class: Class, shape: Shape, pose: Pose, surface: Surface) {
        let fixture = Fixture { class, shape, pose, surface };
        if !SweptArea::under(&fixture, self.ground).meets(&self.swept) {
            self.fixtures.push(fixture);
        }
    }

    /// A box at (x, y) rotated by yaw, with its lower face `lift` above the ground there.
    pub(super) fn raised(
        &mut self,
        class: Class,
        [x, y, yaw]: [f64; 3],
        size: [f64; 3],
        lift: f64,
        surface: Surface,
    ) {
        let z = self.ground.height(x, y) + lift + 0.5 * size[2];
        let shape = Shape::cuboid(size[0], size[1], size[2]);
        self.fix(class, shape, Pose::planar(x, y, z, yaw), surface);
    }

    /// A box standing at (x, y), rotated by yaw.
    pub(super) fn block(&mut self, class: Class, at: [f64; 3], size: [f64; 3], surface: Surface) {
        let [length, width, height] = size;
        self.raised(class, at, [length, width, height + SUNK_M], -SUNK_M, surface);
    }

    /// An upright pane of glass of this width and height.
    pub(super) fn pane(&mut self, at: [f64; 3], [wide, high]: [f64; 2], lift: f64) {
        self.raised(Class::Fixture, at, [wide, 0.03, high], lift, Surface::glass(0.3));
    }

    /// A round post.
    pub(super) fn post(&mut self, class: Class, [x, y]: [f64; 2], [radius, height]: [f64; 2]) {
        let shape = Shape::cylinder(radius, height + SUNK_M);
        let z = self.ground.height(x, y) + 0.5 * (height - SUNK_M);
        self.fix(class, shape, Pose::planar(x, y, z, 0.0), Surface::matt(0.4));
    }

    /// A bar from one point to another, each (x, y, height above the ground there), m.
    pub(super) fn bar(&mut self, class: Class, ends: [[f64; 3]; 2], radius: f64, surface: Surface) {
        let [a, b] = ends.map(|[x, y, up]| DVec3::new(x, y, self.ground.height(x, y) + up));
        let turn = DQuat::from_rotation_arc(DVec3::Z, (b - a).normalize());
        let shape = Shape::cylinder(radius, (b - a).length());
        self.fix(class, shape, Pose::new(turn, 0.5 * (a + b)), surface);
    }

    /// A clump of leaves of these full extents, with its lower end `lift` above the ground.
    pub(super) fn leaves(&mut self, [x, y]: [f64; 2], size: [f64; 3], lift: f64, porosity: f64) {
        let turn = DQuat::from_rotation_z(self.rng.range(0.0, 3.0));
        let tilt = DQuat::from_rotation_x(self.rng.range(-0.25, 0.25));
        let z = self.ground.height(x, y) + lift + 0.5 * size[2];
        let shape = Shape::ellipsoid(0.5 * size[0], 0.5 * size[1], 0.5 * size[2]);
        let surface = Surface::porous(self.rng.range(0.3, 0.6), porosity);
        self.fix(Class::Vegetation, shape, Pose::new(turn * tilt, DVec3::new(x, y, z)), surface);
    }

    /// A random integer from `from` up to but excluding `to`.
    pub(super) fn count(&mut self, from: u32, to: u32) -> u32 {
        from + (self.rng.unit() * f64::from(to - from)) as u32
    }
}
