//! Checks that all the manoeuvres that traffic should show occur.

use super::routes::Routes;
use crate::dimensions::LANE;
use crate::ego::Ego;
use crate::object::Class;
use crate::path::{Path, State};
use crate::rng::Rng;
use crate::scene::Scene;
use std::collections::BTreeSet;

const DURATION_S: f64 = 6.0;

/// States of all objects every half second, with the vehicle last.
fn states(seed: u64) -> (Vec<Class>, Vec<Vec<State>>) {
    let plan = Ego::Any.plan(seed, DURATION_S);
    let scene = Scene::around(seed, &plan, DURATION_S, 1.0, None);
    let times: Vec<f64> = (0..=12).map(|i| 0.5 * f64::from(i)).collect();
    let paths = scene.objects.iter().map(|o| &o.path).chain([&plan.path]);
    let states = paths.map(|p| times.iter().map(|&t| p.at(t)).collect()).collect();
    (scene.objects.iter().map(|o| o.class).collect(), states)
}

/// Whether `a` gets from behind `b` to ahead of it, both side by side in the same direction.
fn passes(a: &[State], b: &[State]) -> bool {
    let ahead = |i: usize| {
        let (s, c) = b[i].yaw.sin_cos();
        let (x, y) = (a[i].x - b[i].x, a[i].y - b[i].y);
        let beside = (a[i].yaw - b[i].yaw).cos() > 0.9 && (c * y - s * x).abs() < 4.5;
        (c * x + s * y, beside)
    };
    (1..a.len()).any(|i| {
        let ((before, near), (after, still_near)) = (ahead(i - 1), ahead(i));
        before < 0.0 && after > 0.0 && near && still_near
    })
}

#[test]
fn overtaking_cars_drive_straight_until_they_pull_out() {
    let slow = Path::from(State { x: -60.0, y: -LANE, yaw: 0.0, speed: 3.0 });
    let plan = Ego::Standing.plan(1, 30.0);
    for seed in 0..20 {
        let mut rng = Rng::new(seed);
        // Abreast within the drive, it pulls out a few seconds before.
        let path = Routes { plan: &plan, duration_s: 30.0, rng: &mut rng }.past(&slow);
        let [before, early] = [-20.0, -10.0].map(|t| path.at(t));
        assert!((before.y + LANE).abs() < 1e-9 && before.yaw == 0.0, "seed {seed}: {before:?}");
        assert!(early.x > before.x && early.speed == before.speed, "seed {seed}: {early:?}");
    }
}

#[test]
fn manoeuvres_of_all_kinds() {
    let mut seen = BTreeSet::new();
    let mut classes = BTreeSet::new();
    for seed in 0..12 {
        let (kinds, all) = states(seed);
        classes.extend(kinds.iter().copied());
        let ego = &all[kinds.len()];
        for (class, path) in kinds.iter().zip(&all).filter(|(_, p)| p[0].speed > 1.0) {
            let (first, last) = (path[0], path[path.len() - 1]);
            let drives = *class <= Class::Motorcycle;
            if drives && last.speed < first.speed - 2.0 {
                seen.insert("brakes");
            }
            if drives && (last.yaw - first.yaw).abs() > 1.2 {
                seen.insert("turns");
            }
            if drives && (first.yaw.cos().abs() < 0.1) && first.y * last.y < 0.0 {
                seen.insert("crosses the main road");
            }
            if *class == Class::Pedestrian && first.y * last.y < 0.0 {
                seen.insert("walks across");
            }
            if drives && passes(path, ego) {
                seen.insert("overtakes the vehicle");
            }
            let moving = all[..kinds.len()].iter().filter(|p| p[0].speed > 1.0);
            if drives && moving.into_iter().any(|other| passes(path, other)) {
                seen.insert("overtakes another");
            }
        }
    }
    assert_eq!(seen.len(), 6, "{seen:?}");
    assert_eq!(classes.len(), 8, "{classes:?}");
}
