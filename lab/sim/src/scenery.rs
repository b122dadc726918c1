//! Kinds of scenery to drive through.

use crate::dimensions::Section;
use crate::ego::{Ego, Pace, Plan};
use crate::outskirts::{self, Place};
use crate::path::Path;
use crate::rng::Rng;
use crate::scene::Scene;
use crate::street::Extra;
use std::fmt;
use std::str::FromStr;

/// The scene to drive through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scenery {
    /// A street with houses, trees and parked cars: the one that all training uses.
    #[default]
    Street,
    /// The same with more of what makes static structure appear to move, for tuning and the
    /// encoder's training.
    StreetCluttered,
    /// The same with the traffic of a road out of town, 15 to 36 m/s, for tuning.
    StreetFast,
    /// The same with creeping vehicles and many strolling people, for tuning.
    StreetSlow,
    /// A slow one with crowds of people, standing and strolling among furniture, for tuning.
    StreetCrowded,
    /// A narrow one, with borders of all kinds right beside the sidewalks, for tuning and the
    /// encoder's training.
    StreetNarrow,
    /// A broad one, with several lanes each way and the traffic of a road out of town, for the
    /// encoder's training.
    StreetBroad,
    /// One of [`Place::ALL`], drawn by the seed: never used for training or tuning.
    Outskirts,
    /// This particular one.
    Only(Place),
}

/// A name that is not a scenery's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownScenery(String);

impl fmt::Display for UnknownScenery {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let names: Vec<_> = Scenery::all().map(Scenery::name).collect();
        write!(f, "no scenery is called `{}`; the available ones are {}", self.0, names.join(", "))
    }
}

impl std::error::Error for UnknownScenery {}

impl Scenery {
    /// The street and its variants.
    const STREETS: [Scenery; 7] = [
        Scenery::Street,
        Scenery::StreetCluttered,
        Scenery::StreetFast,
        Scenery::StreetSlow,
        Scenery::StreetCrowded,
        Scenery::StreetNarrow,
        Scenery::StreetBroad,
    ];

    /// Every scenery.
    pub fn all() -> impl Iterator<Item = Scenery> {
        let places = Place::ALL.into_iter().map(Scenery::Only);
        Scenery::STREETS.into_iter().chain([Scenery::Outskirts]).chain(places)
    }

    /// The name that [`Scenery::from_str`] accepts.
    pub fn name(self) -> &'static str {
        match self {
            Scenery::Street => "street",
            Scenery::StreetCluttered => "street-cluttered",
            Scenery::StreetFast => "street-fast",
            Scenery::StreetSlow => "street-slow",
            Scenery::StreetCrowded => "street-crowded",
            Scenery::StreetNarrow => "street-narrow",
            Scenery::StreetBroad => "street-broad",
            Scenery::Outskirts => "outskirts",
            Scenery::Only(place) => place.name(),
        }
    }

    /// The place in the outskirts that a drive with this seed goes through.
    pub fn place(self, seed: u64) -> Option<Place> {
        match self {
            Scenery::Outskirts => Some(Place::drawn(seed)),
            Scenery::Only(place) => Some(place),
            _ => None,
        }
    }

    /// A scene and the vehicle's path through it. `ego` applies to the street only.
    pub(crate) fn draw(self, seed: u64, ego: Ego, duration_s: f64, density: f64) -> (Scene, Path) {
        if let Some(place) = self.place(seed) {
            return outskirts::draw(place, seed, duration_s, density);
        }
        let (mut pace, mut section, mut extra) = (Pace::Town, Section::WIDE, None);
        match self {
            Scenery::StreetFast => pace = Pace::Fast,
            Scenery::StreetSlow => pace = Pace::Slow,
            Scenery::StreetCrowded => (pace, extra) = (Pace::Crowd, Some(Extra::Crowded)),
            Scenery::StreetCluttered => extra = Some(Extra::Cluttered),
            Scenery::StreetNarrow => section = Section::narrow(&mut Rng::split(seed, 11)),
            Scenery::StreetBroad => {
                (pace, section) = (Pace::Fast, Section::broad(&mut Rng::split(seed, 11)));
            }
            _ => {}
        }
        let ego = if pace == Pace::Fast { ego.out_of_town(seed) } else { ego };
        let plan = Plan { pace, ..ego.plan(seed, duration_s) };
        let plan = plan.on(section, &mut Rng::split(seed, 12));
        (Scene::around(seed, &plan, duration_s, density, extra), plan.path)
    }
}

impl FromStr for Scenery {
    type Err = UnknownScenery;

    fn from_str(name: &str) -> Result<Scenery, UnknownScenery> {
        let found = Scenery::all().find(|scenery| scenery.name() == name);
        found.ok_or_else(|| UnknownScenery(name.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collisions::check_clear;
    use crate::dimensions::VEHICLE;
    use crate::object::{Class, Fixture, Object};
    use crate::path::State;
    use crate::shape::Shape;
    use std::collections::BTreeSet;

    #[test]
    fn names() {
        for scenery in Scenery::all() {
            assert_eq!(scenery.name().parse(), Ok(scenery));
        }
        let error = "strase".parse::<Scenery>().unwrap_err().to_string();
        assert!(error.contains("strase") && error.contains("motorway"), "{error}");
    }

    #[test]
    fn no_object_passes_through_what_a_street_has_in_addition() {
        let kinds = [Scenery::StreetCluttered, Scenery::StreetCrowded];
        for (seed, scenery) in (0..10).flat_map(|seed| kinds.map(|scenery| (seed, scenery))) {
            let of = |scenery: Scenery| scenery.draw(seed, Ego::Any, 6.0, 1.0);
            let (plain, _) = of(Scenery::Street);
            let (scene, path) = of(scenery);
            let more = &scene.fixtures[plain.fixtures.len()..];
            assert_eq!(plain.fixtures[..], scene.fixtures[..plain.fixtures.len()]);
            assert!(more.len() > 200, "{}", more.len());
            let empty = Scene { objects: Vec::new(), ..scene.clone() };
            check_clear("the vehicle", &empty, more, Some((&path, VEHICLE)));
            for object in scene.objects {
                let alone = Scene { objects: vec![object], ..empty.clone() };
                check_clear(&format!("{scenery:?}, seed {seed}"), &alone, more, None);
            }
        }
    }

    /// That nothing on this street passes through what stands on it, leaves aside.
    fn check_solid(name: &str, scene: &Scene, path: &Path) {
        // Crowns may hang over a parked car, bushes over a sidewalk.
        let leaves = |f: &&Fixture| matches!(f.shape, Shape::Ellipsoid { .. });
        let solid: Vec<_> = scene.fixtures.iter().filter(|f| !leaves(f)).cloned().collect();
        let alone = Scene { objects: Vec::new(), ..scene.clone() };
        check_clear("the vehicle", &alone, &solid, Some((path, VEHICLE)));
        for object in &scene.objects {
            let alone = Scene { objects: vec![object.clone()], ..alone.clone() };
            check_clear(name, &alone, &solid, None);
        }
    }

    #[test]
    fn narrow_streets_are_built_close_and_nothing_passes_through_what_stands_there() {
        for seed in 0..20 {
            let (scene, path) = Scenery::StreetNarrow.draw(seed, Ego::Any, 6.0, 1.0);
            let section = scene.ground.section();
            assert!(section.edge() < Section::WIDE.edge() - 2.0, "{section:?}");
            let beside = |f: &&Fixture| {
                (section.edge()..section.edge() + 0.6).contains(&f.pose.translation.y.abs())
            };
            assert!(scene.fixtures.iter().filter(beside).count() > 10);
            check_solid(&format!("narrow, seed {seed}"), &scene, &path);
        }
    }

    #[test]
    fn broad_roads_have_traffic_in_every_lane_and_nothing_passes_through_what_stands_there() {
        let (mut lanes, mut own, mut medians) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
        for seed in 0..20 {
            let (scene, path) = Scenery::StreetBroad.draw(seed, Ego::Any, 6.0, 1.0);
            let section = scene.ground.section();
            check_solid(&format!("broad, seed {seed}"), &scene, &path);
            check_clear(&format!("broad, seed {seed}"), &scene, &[], Some((&path, VEHICLE)));
            let lane_of = |path: &Path| {
                let State { y, yaw, speed, .. } = path.at(3.0);
                // On the right-hand side, and neither crossing nor overtaking.
                let beside = -y * yaw.cos().signum();
                let near = |lane: &u32| (beside - section.lane(*lane)).abs() < 1e-6;
                let lane = (0..section.lanes).find(near).map(|lane| (section.lanes, lane));
                lane.filter(|_| speed >= 15.0 && yaw.sin().abs() < 1e-6)
            };
            lanes.extend(scene.objects.iter().filter_map(|o| lane_of(&o.path)));
            own.extend(lane_of(&path));
            let in_middle = |f: &&Fixture| f.pose.translation.y == 0.0;
            medians
                .insert((section.median_half > 0.0, scene.fixtures.iter().any(|f| in_middle(&f))));
        }
        let every = BTreeSet::from([(2, 0), (2, 1), (3, 0), (3, 1), (3, 2)]);
        assert_eq!((&lanes, &own), (&every, &every));
        assert_eq!(medians, BTreeSet::from([(false, false), (true, true)]));
    }

    #[test]
    fn crowded_streets_have_people_close_together() {
        let (scene, _) = Scenery::StreetCrowded.draw(1, Ego::Any, 6.0, 1.0);
        check_clear("a crowd", &scene, &[], None);
        let people: Vec<_> =
            scene.objects.iter().filter(|o| o.class == Class::Pedestrian).collect();
        let standing = people.iter().filter(|o| o.path.is_static()).count();
        assert!(people.len() > 60 && 4 * standing > people.len(), "{standing} of {}", people.len());
        let near = |a: &Object| {
            let beside = |b: &&&Object| {
                let [a, b] = [a, *b].map(|o| o.path.at(3.0));
                (a.x - b.x).hypot(a.y - b.y) < 1.5
            };
            // It is beside itself, too.
            people.iter().filter(beside).count() > 1
        };
        let close = people.iter().filter(|o| near(o)).count();
        assert!(3 * close > people.len(), "{close} of {}", people.len());
    }

    #[test]
    fn slow_streets_have_creeping_cars_and_strolling_people() {
        let of = |scenery: Scenery, seed| scenery.draw(seed, Ego::Any, 6.0, 1.0).0.objects;
        let (mut speeds, mut people) = (Vec::new(), [0, 0]);
        for seed in 0..5 {
            for object in of(Scenery::StreetSlow, seed) {
                let speed = object.path.at(3.0).speed;
                match object.class {
                    Class::Pedestrian => {
                        assert!(speed <= 1.4, "{speed}");
                        people[0] += 1;
                    }
                    Class::Cyclist => {}
                    _ if speed > 0.0 => speeds.push(speed),
                    _ => {}
                }
            }
            let plain = of(Scenery::Street, seed);
            people[1] += plain.iter().filter(|o| o.class == Class::Pedestrian).count();
        }
        speeds.sort_by(f64::total_cmp);
        assert!(speeds.len() > 30 && speeds[speeds.len() * 3 / 4] <= 5.0, "{speeds:?}");
        assert!(2 * people[0] > 3 * people[1], "{people:?}");
    }

    #[test]
    fn seeds_cover_every_place() {
        let drawn: BTreeSet<_> = (0..60).filter_map(|n| Scenery::Outskirts.place(n)).collect();
        assert_eq!(drawn.len(), Place::ALL.len());
        assert_eq!(Scenery::Street.place(1), None);
    }
}
