//! A second kind of scenery, for testing only, never for training: nothing that is placed or drawn
//! here comes from the builders of the first kind ([`crate::street`], [`crate::traffic`]).
//!
//! Solids, models of vehicles and people, paths, relief and casting are shared with the rest of the
//! simulator.

mod car_park;
mod clearance;
mod country;
mod crowd;
mod market;
mod motorway;
mod openings;
mod plants;
mod residential;
mod roundabout;
mod site;

#[cfg(test)]
mod tests;

use crate::dimensions::VEHICLE;
use crate::ground::Ground;
use crate::path::Path;
use crate::rng::Rng;
use crate::scene::Scene;
use clearance::SweptArea;
use crowd::Crowd;
use raywake_core::pose::Pose;
use site::Site;
use std::f64::consts::PI;

/// Margin kept clear around the vehicle, m.
const MARGIN_M: f64 = 0.35;
/// How far ahead and behind the scene extends, m.
const VIEW_M: f64 = 120.0;

/// A kind of place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// A road between banks, ditches, hedges and fences.
    Country,
    /// Guard rails, a concrete barrier, noise walls; fast traffic both ways.
    Motorway,
    /// Traffic circling a planted mound.
    Roundabout,
    /// Rows of parked cars, people among them, manoeuvring cars.
    CarPark,
    /// House fronts with rooms behind, stalls, scaffolds, a crowd.
    Market,
    /// Houses in gardens behind fences, hedges and walls.
    Residential,
}

impl Place {
    /// All of them.
    pub const ALL: [Place; 6] = [
        Place::Country,
        Place::Motorway,
        Place::Roundabout,
        Place::CarPark,
        Place::Market,
        Place::Residential,
    ];

    /// The place drawn by a seed.
    pub fn drawn(seed: u64) -> Place {
        let mut rng = Rng::split(seed, 4);
        Place::ALL[(rng.unit() * Place::ALL.len() as f64) as usize]
    }

    /// Its name on a command line.
    pub fn name(self) -> &'static str {
        match self {
            Place::Country => "country-road",
            Place::Motorway => "motorway",
            Place::Roundabout => "roundabout",
            Place::CarPark => "car-park",
            Place::Market => "market-street",
            Place::Residential => "residential",
        }
    }

    fn layout(self, rng: &mut Rng, duration_s: f64) -> Box<dyn Layout> {
        match self {
            Place::Country => Box::new(country::Country::drawn(rng, duration_s)),
            Place::Motorway => Box::new(motorway::Motorway::drawn(rng, duration_s)),
            Place::Roundabout => Box::new(roundabout::Roundabout::drawn(rng)),
            Place::CarPark => Box::new(car_park::CarPark::drawn(rng, duration_s)),
            Place::Market => Box::new(market::Market::drawn(rng, duration_s)),
            Place::Residential => Box::new(residential::Residential::drawn(rng, duration_s)),
        }
    }
}

/// A place of one kind, drawn.
trait Layout {
    fn ground(&self) -> Ground;
    /// The path of the vehicle that carries the sensors.
    fn vehicle(&self) -> Path;
    fn furnish(&self, site: &mut Site);
    fn populate(&self, crowd: &mut Crowd);
}

/// Draws a scene of this kind around its own drive, and the vehicle's path through it.
pub(crate) fn draw(place: Place, seed: u64, duration_s: f64, density: f64) -> (Scene, Path) {
    let mut rng = Rng::split(seed, 5);
    let [x, y, yaw] = [200.0, 200.0, PI].map(|far| rng.range(-far, far));
    let world_from_street = Pose::planar(x, y, 0.0, yaw);
    let layout = place.layout(&mut rng, duration_s);
    let ground = layout.ground().uneven(rng.range(0.004, 0.02));
    let path = layout.vehicle();
    let swept = SweptArea::along(&path, VEHICLE, MARGIN_M, duration_s);
    let mut chance = Rng::split(seed, 6);
    let mut site = Site::new(&ground, &mut chance, swept.clone());
    layout.furnish(&mut site);
    let fixtures = site.fixtures;
    let mut chance = Rng::split(seed, 7);
    let mut crowd = Crowd::new((&ground, &fixtures), swept, (duration_s, density), &mut chance);
    layout.populate(&mut crowd);
    let objects = crowd.objects;
    (Scene { ground, fixtures, objects, world_from_street }, path)
}
