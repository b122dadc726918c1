//! Moving and parked objects: each on a path clear of fixtures, of the others and of the vehicle.

use super::clearance::SweptArea;
use crate::ground::Ground;
use crate::object::{Fixture, Object};
use crate::path::Path;
use crate::rng::Rng;

/// Attempts at finding a clear path for an object.
const TRIES: u32 = 15;
/// Margin kept clear around every object, m.
const MARGIN_M: f64 = 0.1;

/// One of [`crate::models`].
pub(super) type Model = fn(u32, Path, &mut Rng) -> Object;

/// Traffic while it is being drawn.
pub(super) struct Crowd<'a> {
    pub(super) objects: Vec<Object>,
    pub(super) rng: &'a mut Rng,
    /// Duration of the drive, s.
    pub(super) duration_s: f64,
    density: f64,
    taken: Vec<SweptArea>,
}

impl<'a> Crowd<'a> {
    /// An empty crowd among these fixtures, with the vehicle on its path.
    pub(super) fn new(
        (ground, fixtures): (&Ground, &[Fixture]),
        vehicle: SweptArea,
        (duration_s, density): (f64, f64),
        rng: &'a mut Rng,
    ) -> Crowd<'a> {
        let mut taken = vec![vehicle];
        taken.extend(fixtures.iter().map(|fixture| SweptArea::under(fixture, ground)));
        Crowd { objects: Vec::new(), rng, duration_s, density, taken }
    }

    /// Adds an object if its path is clear; returns whether it was.
    pub(super) fn try_add(&mut self, model: Model, path: Path) -> bool {
        let object = model(self.objects.len() as u32 + 1, path, self.rng);
        let swept = SweptArea::along(&object.path, object.size, MARGIN_M, self.duration_s);
        let clear = !self.taken.iter().any(|other| swept.meets(other));
        if clear {
            self.taken.push(swept);
            self.objects.push(object);
        }
        clear
    }

    /// Adds a stationary object there, with the density as probability, if there is room.
    pub(super) fn park(&mut self, model: Model, path: Path) {
        if self.rng.chance(self.density) {
            self.try_add(model, path);
        }
    }

    /// Adds this many of a kind at density 1, each on the first drawn path that is clear.
    pub(super) fn add(
        &mut self,
        amount: f64,
        model: Model,
        mut draw: impl FnMut(&mut Rng, f64) -> Path,
    ) {
        for _ in 0..(amount * self.density).round() as u32 {
            for _ in 0..TRIES {
                let path = draw(self.rng, self.duration_s);
                if self.try_add(model, path) {
                    break;
                }
            }
        }
    }
}
