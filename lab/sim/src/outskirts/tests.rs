//! That nobody drives through anything, that there is something to see, and that it moves.

use super::{Place, VEHICLE, draw};
use crate::object::Fixture;
use crate::path::Path;
use crate::scene::Scene;
use glam::DVec3;
use raywake_core::pose::Pose;

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

/// Points of a box that stands at a pose, low, at half its height and high, 0.3 m apart at most
/// and well within it.
fn points(pose: &Pose, size: [f64; 3]) -> Vec<DVec3> {
    let [count_x, count_y] = [size[0], size[1]].map(|length| (length / 0.3).ceil() as u32);
    let along =
        |n: u32, count: u32, length: f64| 0.95 * length * (f64::from(n) / f64::from(count) - 0.5);
    let mut points = Vec::new();
    for i in 0..=count_x {
        for j in 0..=count_y {
            for up in [0.3, 0.5 * size[2], 0.9 * size[2]] {
                let at = DVec3::new(along(i, count_x, size[0]), along(j, count_y, size[1]), up);
                points.push(pose.transform(at));
            }
        }
    }
    points
}

fn holds(fixture: &Fixture, point: DVec3) -> bool {
    let at = fixture.pose.inverse().transform(point).abs();
    (fixture.shape.half() - at).min_element() > 0.0
}

#[test]
fn nobody_goes_through_anything() {
    for (name, scene, path) in scenes() {
        let others = scene.objects.iter().map(|o| (&o.path, o.size));
        let all: Vec<_> = [(&path, VEHICLE)].into_iter().chain(others).collect();
        for step in 0..=12 {
            let t = 0.5 * f64::from(step);
            let place = |(path, size): &(&Path, [f64; 3])| {
                let at = path.at(t);
                let pose = Pose::planar(at.x, at.y, scene.ground.height(at.x, at.y), at.yaw);
                (pose, *size, 0.5 * DVec3::from_array(*size).length())
            };
            let boxes: Vec<_> = all.iter().map(place).collect();
            for (n, (pose, size, reach)) in boxes.iter().enumerate() {
                if step > 0 && all[n].0.is_still() {
                    continue;
                }
                let apart = |other: DVec3| (other - pose.translation).length() - reach;
                let near = |f: &&Fixture| apart(f.pose.translation) < f.shape.reach() + 1.0;
                let fixtures: Vec<_> = scene.fixtures.iter().filter(near).collect();
                let mut others: Vec<_> =
                    boxes.iter().enumerate().filter(|(m, _)| *m != n).collect();
                others.retain(|(_, (other, _, reach))| apart(other.translation) < *reach);
                for point in points(pose, *size) {
                    let hit = fixtures.iter().find(|f| holds(f, point));
                    assert!(hit.is_none(), "{name}, {t} s: {n} of {size:?} at {point} in {hit:?}");
                    for (m, (other, size, _)) in &others {
                        let at = other.inverse().transform(point).abs();
                        let inside = at.x < 0.5 * size[0] && at.y < 0.5 * size[1];
                        assert!(!inside, "{name}, {t} s: {n} and {m} at {point}");
                    }
                }
            }
        }
    }
}

#[test]
fn there_is_something_to_see_and_it_moves() {
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
