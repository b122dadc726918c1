//! Objects that move as the filter expects, and otherwise.

extern crate std;
use super::*;
use crate::random::Random;
use std::vec::Vec;

const PARAMS: CentroidParams = CentroidParams::DEFAULT;

#[test]
fn the_jacobian_is_that_of_the_motion() {
    let at = StateVector::from([3.0, -2.0, 0.5, 2.1, 8.0, -0.4, 0.7]);
    for dt in [0.01, 0.1, 0.9] {
        let jacobian = jacobian(&at, dt);
        for n in 0..STATE {
            let (mut low, mut high) = (at, at);
            (low[n], high[n]) = (at[n] - 1e-5, at[n] + 1e-5);
            let difference = (advance(&high, dt) - advance(&low, dt)) / 2e-5;
            assert!((difference - jacobian.column(n)).amax() < 1e-8, "{dt}: {n}");
        }
    }
}

/// Returns the states after every update, with the history revised.
fn follow(truth: impl Fn(f64) -> [f64; 3], seed: u64, noise: f64) -> Vec<ObjectState> {
    let mut random = Random(seed);
    let mut see = |t: f64| truth(t).map(|v| v + noise * random.normal());
    let mut ekf = CentroidEkf::birth(&PARAMS, 0.0, see(0.0));
    let mut states = Vec::from([ekf.state()]);
    for n in 1..60 {
        let t = n as f64 * 0.1;
        ekf.predict(&PARAMS, t);
        let revision = ekf.update(&PARAMS, see(t));
        revision.revise(&ekf.state(), &mut states);
        states.push(ekf.state());
        assert!(ekf.covariance().iter().all(|v| v.is_finite()));
        assert!((0..STATE).all(|n| ekf.covariance()[(n, n)] >= 0.0));
    }
    states
}

/// As from two sensors that see two sides of an object in immediate succession.
#[test]
fn centroids_at_one_time_give_no_motion() {
    for after_s in [0.0, 1e-300, 1e-30, 1e-12, 1e-6] {
        let mut ekf = CentroidEkf::birth(&PARAMS, 0.0, [0.0; 3]);
        for n in 1..4 {
            ekf.predict(&PARAMS, after_s * n as f64);
            ekf.update(&PARAMS, [2.0 * n as f64, 0.0, 0.0]);
            let state = ekf.state();
            assert!(state.speed.abs() < 100.0, "{after_s}: {state:?}");
            assert!(ekf.covariance().iter().all(|v| v.is_finite()), "{after_s}");
        }
    }
}

fn off(from: f64, to: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    ((from - to + PI).rem_euclid(TAU) - PI).abs()
}

#[test]
fn straight_whichever_way() {
    for speed in [1.5, 5.0, 15.0] {
        for way in 0..12 {
            let heading = way as f64 * 0.5 - 3.0;
            let truth = |t: f64| [speed * t * heading.cos(), speed * t * heading.sin(), 0.2 * t];
            let states = follow(truth, 5 + way, 0.1);
            let last = states[59];
            assert!(off(last.heading, heading) < 0.5 / speed, "{speed}, {heading}: {last:?}");
            assert!((last.speed - speed).abs() < 0.6, "{speed}, {heading}: {last:?}");
            assert!((last.climb - 0.2).abs() < 0.2, "{last:?}");
            // No jump by half a turn, from first to last.
            for pair in states.windows(2) {
                assert!((pair[1].heading - pair[0].heading).abs() < 1.0, "{speed}: {pair:?}");
            }
        }
    }
}

#[test]
fn a_circle_unwraps_the_heading() {
    let (radius, rate) = (10.0, 1.2);
    for way in [1.0, -1.0] {
        let truth = |t: f64| {
            let angle = rate * t;
            [radius * angle.sin(), way * radius * (1.0 - angle.cos()), 0.0]
        };
        let last = follow(truth, 3, 0.05)[59];
        assert!((last.heading - way * rate * 5.9).abs() < 0.2, "{last:?}");
        assert!((last.turn_rate - way * rate).abs() < 0.2, "{last:?}");
        assert!((last.speed - radius * rate).abs() < 0.6, "{last:?}");
    }
}

#[test]
fn static_structure_stays() {
    // Exactly, without ever having a heading.
    let states = follow(|_| [4.0, 5.0, 6.0], 1, 0.0);
    assert!(states.iter().all(|s| s.position == [4.0, 5.0, 6.0] && s.speed == 0.0));
    // Within its noise.
    for seed in 0..50 {
        let last = follow(|_| [4.0, 5.0, 6.0], seed, 0.1)[59];
        assert!((last.position[0] - 4.0).hypot(last.position[1] - 5.0) < 0.4, "{last:?}");
        assert!(last.speed.abs() < 1.2 && last.turn_rate.abs() < 1.0, "{last:?}");
    }
}

#[test]
fn backwards_headings_flip_once_unless_reversing() {
    let mut random = Random(4);
    // It reverses after three seconds.
    let truth = |t: f64| [if t < 3.0 { 4.0 * t } else { 24.0 - 4.0 * t }, 0.0, 0.0];
    let mut ekf = CentroidEkf::birth(&PARAMS, 0.0, truth(0.0));
    // A bad centroid first: it starts the wrong way.
    for n in 1..60 {
        let t = n as f64 * 0.1;
        ekf.predict(&PARAMS, t);
        let [x, y, z] = truth(t);
        let wrong = if n < 2 { -1.5 } else { 0.05 * random.normal() };
        ekf.update(&PARAMS, [x + wrong, y + 0.05 * random.normal(), z]);
        if n == 28 {
            let s = ekf.state();
            assert!(off(s.heading, 0.0) < 0.2 && (s.speed - 4.0).abs() < 0.5, "{s:?}");
        }
    }
    let s = ekf.state();
    let velocity = ekf.velocity().0;
    assert!((velocity[0] + 4.0).abs() < 1.0 && velocity[1].abs() < 1.0, "{s:?}");
}

#[test]
fn the_covariance_opens_in_a_gap_and_time_never_runs_back() {
    let mut ekf = CentroidEkf::birth(&PARAMS, 0.0, [0.0; 3]);
    let near = ekf.distance2(&PARAMS, [1.0, 0.0, 0.0]);
    ekf.predict(&PARAMS, 0.3);
    assert!(ekf.distance2(&PARAMS, [1.0, 0.0, 0.0]) < near);
    // Equally far in any direction while nothing of its motion is known.
    let apart = |c| ekf.distance2(&PARAMS, c);
    assert!((apart([1.0, 0.0, 0.0]) - apart([0.0, 1.0, 0.0])).abs() < 1e-12);
    let before = ekf;
    for t in [0.3, 0.1, -5.0, f64::NAN] {
        ekf.predict(&PARAMS, t);
        assert_eq!(ekf, before);
    }
}
