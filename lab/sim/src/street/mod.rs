//! The street's background. A plain street has it block by block: closed rows of houses, houses
//! behind gardens, parks.

mod broad;
mod cluttered;
mod crowded;
mod fronts;
mod furniture;
mod green;
mod houses;
mod narrow;

use crate::dimensions::{CROSS_HALF, Section};
use crate::ground::Ground;
use crate::object::{Class, Fixture, Surface};
use crate::path::Path;
use crate::rng::Rng;
use crate::shape::Shape;
use glam::{DQuat, DVec3};
use raywake_core::pose::Pose;

/// How far the scene extends around the vehicle's path, m.
const VIEW: f64 = 125.0;

/// Part of the street frame that is furnished: minimum and maximum, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Extent {
    pub(crate) x: [f64; 2],
    pub(crate) y: [f64; 2],
}

impl Extent {
    pub(crate) fn around(path: &Path, duration_s: f64) -> Extent {
        let mut extent = Extent { x: [0.0; 2], y: [0.0; 2] };
        let steps = (duration_s * 4.0).ceil() as u32;
        for i in 0..=steps {
            let s = path.at(f64::from(i) * 0.25);
            extent.x = [extent.x[0].min(s.x), extent.x[1].max(s.x)];
            extent.y = [extent.y[0].min(s.y), extent.y[1].max(s.y)];
        }
        let widen = |v: [f64; 2]| [v[0] - VIEW, v[1] + VIEW];
        Extent { x: widen(extent.x), y: widen(extent.y) }
    }
}

/// What stands along a street.
pub(crate) struct Background {
    pub(crate) fixtures: Vec<Fixture>,
    /// Where cars may be parked beside houses.
    pub(crate) driveways: Vec<Path>,
}

/// Builds the background on this ground; `crossing` is x of the crossing road's centre line, m.
pub(crate) fn build(ground: &Ground, extent: Extent, crossing: f64, rng: &mut Rng) -> Background {
    let mut yard = Yard::new(ground, crossing, rng);
    let section = ground.section();
    let (plain, broad) = (section == Section::WIDE, section.lanes > 1);
    let narrow = !plain && !broad;
    for side in [-1.0, 1.0] {
        if plain {
            yard.blocks(extent.x, side)
        } else if broad {
            yard.roadside(extent.x, side)
        } else {
            yard.plots(extent.x, side)
        }
        yard.houses_along_crossing(extent.y, side);
        if !narrow {
            yard.kerb_side(extent.x, side);
        }
    }
    if !narrow {
        yard.signals();
    }
    if section.median_half > 0.0 {
        yard.median(extent.x);
    }
    Background { fixtures: yard.fixtures, driveways: yard.driveways }
}

/// What a street has in addition to the plain one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Extra {
    /// That of [`crate::Scenery::StreetCluttered`].
    Cluttered,
    /// That of [`crate::Scenery::StreetCrowded`].
    Crowded,
}

/// Builds the additional background of a street.
pub(crate) fn add(
    ground: &Ground,
    extent: Extent,
    crossing: f64,
    extra: Extra,
    rng: &mut Rng,
) -> Vec<Fixture> {
    let mut yard = Yard::new(ground, crossing, rng);
    match extra {
        Extra::Cluttered => yard.clutter(extent.x),
        Extra::Crowded => yard.crowd(extent.x),
    }
    yard.fixtures
}

struct Yard<'a> {
    ground: &'a Ground,
    fixtures: Vec<Fixture>,
    driveways: Vec<Path>,
    crossing: f64,
    rng: &'a mut Rng,
}

impl<'a> Yard<'a> {
    fn new(ground: &'a Ground, crossing: f64, rng: &'a mut Rng) -> Yard<'a> {
        Yard { ground, fixtures: Vec::new(), driveways: Vec::new(), crossing, rng }
    }

    /// Distance of the kerb from the road's centre line, m.
    fn kerb(&self) -> f64 {
        self.ground.section().road_half
    }

    /// Distance of a sidewalk's far edge from the road's centre line, m.
    fn edge(&self) -> f64 {
        self.ground.section().edge()
    }

    /// Everything beyond the sidewalk, in blocks of one kind each.
    fn blocks(&mut self, x: [f64; 2], side: f64) {
        let mut at = x[0];
        while at < x[1] {
            let end = at + self.rng.range(30.0, 80.0);
            match (self.rng.unit() * 10.0) as u32 {
                0..4 => {
                    self.row_of_houses([at, end], side);
                    self.house_side([at, end], side, [1.5, 12.0]);
                }
                4..8 => self.gardens([at, end], side),
                _ => {
                    self.park([at, end], side);
                    self.house_side([at, end], side, [1.0, 8.0]);
                }
            }
            at = end;
        }
    }

    /// Adds a fixture; `pose` is `street_from_shape`.
    fn fix(&mut self, class: Class, shape: Shape, pose: Pose, surface: Surface) {
        self.fixtures.push(Fixture { class, shape, pose, surface });
    }

    /// Puts a solid `height` tall with its foot at (x, y), `lift` above the ground.
    fn put(
        &mut self,
        class: Class,
        shape: Shape,
        at: [f64; 3],
        height: f64,
        yaw: f64,
        surface: Surface,
    ) {
        let z = self.ground.height(at[0], at[1]) + at[2] + 0.5 * height;
        self.fix(class, shape, Pose::planar(at[0], at[1], z, yaw), surface);
    }

    /// A box of this length, width and height standing at (x, y).
    fn cuboid(&mut self, class: Class, at: [f64; 2], size: [f64; 3], yaw: f64, surface: Surface) {
        // Sunk a little, so that no ray passes beneath it on a slope.
        let height = size[2] + 0.5;
        let shape = Shape::cuboid(size[0], size[1], height);
        self.put(class, shape, [at[0], at[1], -0.5], height, yaw, surface);
    }

    /// A box with its lower face `at[2]` above the ground.
    fn raised(&mut self, class: Class, at: [f64; 3], size: [f64; 3], yaw: f64, surface: Surface) {
        self.put(class, Shape::cuboid(size[0], size[1], size[2]), at, size[2], yaw, surface);
    }

    /// A clump of leaves of these full extents, with its lower end `at[2]` above the ground.
    fn leaves(&mut self, at: [f64; 3], size: [f64; 3], porosity: f64) {
        let tilt = DQuat::from_rotation_y(self.rng.range(-0.3, 0.3));
        let turn = DQuat::from_rotation_z(self.rng.range(0.0, 3.0));
        let z = self.ground.height(at[0], at[1]) + at[2] + 0.5 * size[2];
        let pose = Pose::new(turn * tilt, DVec3::new(at[0], at[1], z));
        let shape = Shape::ellipsoid(0.5 * size[0], 0.5 * size[1], 0.5 * size[2]);
        let surface = Surface::porous(self.rng.range(0.3, 0.6), porosity);
        self.fix(Class::Vegetation, shape, pose, surface);
    }

    fn pole(&mut self, x: f64, y: f64, radius: f64, height: f64) {
        let shape = Shape::cylinder(radius, height + 0.2);
        self.put(Class::Pole, shape, [x, y, -0.2], height + 0.2, 0.0, Surface::matt(0.4));
    }

    /// Whether x, or a stretch of this half length around it, touches the crossing road or its
    /// sidewalks.
    fn in_crossing(&self, x: f64, half: f64) -> bool {
        (x - self.crossing).abs() < CROSS_HALF + 3.0 + half
    }

    /// A random integer from `from` up to but excluding `to`.
    fn count(&mut self, from: u32, to: u32) -> u32 {
        from + (self.rng.unit() * f64::from(to - from)) as u32
    }
}
