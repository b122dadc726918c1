//! Checks that nobody drives through anything, that there is something to see, and that it moves.

use super::{Place, draw};
use crate::collisions::check_clear;
use crate::dimensions::VEHICLE;
use crate::path::Path;
use crate::scene::Scene;
use glam::DVec3;

const DURATION_S: f64 = 6.0;
const SEEDS: u64 = 10;

fn scenes() -> impl Iterator<Item = (String, Scene, Path)> {
    Place::ALL.into_iter().flat_map(|place| {
        (0..SEEDS).map(move |seed| {
            let (scene, path) = draw(place, seed, DURATION_S, 1.0);
            (format!("{} {seed}", place.name()), scene, path)
        })
    })
}

#[test]
fn no_object_passes_through_another() {
    for (name, scene, path) in scenes() {
        check_clear(&name, &scene, &scene.fixtures, Some((&path, VEHICLE)));
    }
}

#[test]
fn scenes_have_fixtures_and_movers_in_view() {
    for (name, scene, path) in scenes() {
        let near = |at: DVec3, t: f64| {
            let here = path.at(t);
            (at.x - here.x).hypot(at.y - here.y) < 60.0
        };
        let standing = scene.fixtures.iter().filter(|f| near(f.pose.translation, 3.0)).count();
        assert!(standing > 80, "{name}: {standing} fixtures");
        let moving = scene.objects.iter().filter(|o| {
            let at = o.path.at(3.0);
            at.speed.abs() > 0.5 && near(DVec3::new(at.x, at.y, 0.0), 3.0)
        });
        assert!(moving.count() >= 4, "{name}");
        let ids: Vec<u32> = scene.objects.iter().map(|o| o.id).collect();
        assert_eq!(ids, (1..=ids.len() as u32).collect::<Vec<_>>());
    }
}

#[test]
fn the_ground_is_continuous() {
    for (name, scene, path) in scenes() {
        let at = path.at(2.0);
        for n in 0..4000 {
            let turn = 0.01 * f64::from(n);
            let (far, step) = (0.012 * f64::from(n), 1e-3);
            let [x, y] = [at.x + far * turn.cos(), at.y + far * turn.sin()];
            let here = scene.ground.height(x, y);
            for (dx, dy) in [(step, 0.0), (0.0, step)] {
                let rise = (scene.ground.height(x + dx, y + dy) - here).abs();
                assert!(rise < 2.0 * step, "{name}: {rise} m at {x}, {y}");
            }
        }
    }
}

#[test]
fn the_same_seed_draws_the_same() {
    for place in Place::ALL {
        let of = |seed: u64| draw(place, seed, DURATION_S, 1.0);
        assert_eq!(of(3), of(3));
        assert_ne!(of(3).0, of(4).0);
        assert!(draw(place, 3, DURATION_S, 0.0).0.objects.is_empty(), "{}", place.name());
    }
}
