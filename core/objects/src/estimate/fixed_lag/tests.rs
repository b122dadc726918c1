//! Drives, sweep by sweep.

extern crate std;

use super::*;
use crate::estimate::synthetic::{self, Drive, Errors, drive, errors};
use crate::random::Random;
use std::vec::Vec;

/// Pushes a drive sweep by sweep: returns the resulting states and the iterations that each took.
fn pushed(estimator: &mut Estimator, drive: &Drive) -> Vec<(ObjectState, usize)> {
    let mut lag = raywake_alloc_guard::boxed!(FixedLag, FixedLag::new());
    let mut states = Vec::new();
    let mut from = 0;
    let mut history = drive.history.iter();
    for &until in drive.until.iter() {
        if until > from {
            let returns = &drive.returns[from..until];
            let state = history.next().unwrap();
            let state = lag.push(estimator, &EstimateParams::DEFAULT, returns, state);
            states.push((state, lag.iterations()));
            from = until;
        }
    }
    assert_eq!(lag.restarts(), 0);
    // No jump by a whole turn, whichever way it is found to face.
    let turns = |pair: &[(ObjectState, usize)]| (pair[1].0.heading - pair[0].0.heading).abs() > 4.0;
    assert!(!states.windows(2).any(turns), "{states:?}");
    states
}

/// Errors of the resulting states, except for the first few.
fn streamed(estimator: &mut Estimator, drive: &Drive, without: usize) -> Errors {
    let states = pushed(estimator, drive);
    let states: Vec<ObjectState> = states[without..].iter().map(|(state, _)| *state).collect();
    let leaps = |pair: &[ObjectState]| (pair[1].heading - pair[0].heading).abs() > 1.0;
    assert!(!states.windows(2).any(leaps), "{states:?}");
    assert!(states.iter().map(|state| state.speed).sum::<f64>() > -0.1 * states.len() as f64);
    let truth: Vec<ObjectState> = states.iter().map(|s| drive.truth_at(s.time_s)).collect();
    errors(&truth, |time| *states.iter().find(|state| state.time_s == time).unwrap())
}

#[test]
fn the_window_follows_sweep_by_sweep() {
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    for seed in [1, 4] {
        let parked = drive(synthetic::parked(seed));
        // It is static, in its place, from the first state on.
        let ours = streamed(&mut estimator, &parked, 0);
        assert!(ours[0] < 0.2 && ours[1] < 0.1 && ours[2] < 0.05, "{ours:?}");
        let ours = streamed(&mut estimator, &parked, 15);
        assert!(ours[0] < 0.1 && ours[1] < 0.2 && ours[2] < 0.05 && ours[3] < 0.02, "{ours:?}");
        let ours = streamed(&mut estimator, &drive(synthetic::moving(seed)), 15);
        assert!(ours[0] < 0.2 && ours[1] < 0.4 && ours[2] < 0.05, "{ours:?}");
    }
}

/// Holds from the first sweep on, in which many objects may appear at once.
#[test]
fn work_per_sweep_is_bounded() {
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    for plan in [synthetic::parked(1), synthetic::moving(2), synthetic::tram(1, 7.0)] {
        let drive = drive(plan);
        let taken = pushed(&mut estimator, &drive);
        let most = |all: &[(ObjectState, usize)]| all.iter().map(|(_, n)| *n).max().unwrap();
        let (young, old) = taken.split_at(16);
        assert_eq!((young[0].1, most(old)), (FixedLag::ITERATIONS_MAX / 2, 2));
        assert_eq!(most(young), FixedLag::ITERATIONS_MAX);
        let unseen = taken.iter().find(|(_, n)| *n == 0);
        assert!(unseen.is_none(), "{unseen:?}");
    }
}

/// One end of it comes into view while the middle of the visible part hardly moves.
#[test]
fn the_window_reveals_that_a_long_side_moves() {
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    for (seed, speed) in [(1, 5.0), (2, 7.0), (3, 9.0)] {
        let drive = drive(synthetic::tram(seed, speed));
        let ours = streamed(&mut estimator, &drive, 8);
        assert!(ours[0] < 0.5 && ours[1] < 0.5, "{speed}: {ours:?}");
    }
}

#[test]
fn a_window_survives_bad_input() {
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    let params = EstimateParams::DEFAULT;
    let mut lag = raywake_alloc_guard::boxed!(FixedLag, FixedLag::new());
    let mut random = Random(8);
    let mut push = |lag: &mut FixedLag, time_s: f64, count: usize, scale: f32| {
        let returns: Vec<ObjectReturn> = (0..count)
            .map(|i| ObjectReturn {
                position: [0, 1, 2].map(|_| scale * random.between(-1.0, 1.0)),
                time_s: if i % 5 == 4 {
                    f32::NAN
                } else {
                    time_s as f32 - 0.1 * random.between(0.0, 1.0)
                },
                ..Default::default()
            })
            .collect();
        let state = lag.push(
            &mut estimator,
            &params,
            &returns,
            &ObjectState { time_s, ..Default::default() },
        );
        assert!(is_valid(&state), "{state:?}");
        state
    };
    // Nothing, one return, many, very many, nothing again.
    for (i, count) in [0, 1, 1, 40, 4000, 0, 0, 7, 5, 300].into_iter().enumerate() {
        push(&mut lag, 0.1 * i as f64, count, 2.0);
    }
    // Back in time; a gap of a second; one longer than the window.
    push(&mut lag, -3.0, 50, 2.0);
    push(&mut lag, 2.0, 50, 2.0);
    assert_eq!(lag.restarts(), 0);
    push(&mut lag, 8.0, 50, 2.0);
    assert_eq!(lag.restarts(), 1);
    // Larger than the prior, so that the model has no room, and for a long time.
    for i in 0..60 {
        push(&mut lag, 8.0 + 0.1 * f64::from(i), 400, 12.0);
    }
    // Not a number at all.
    let state = ObjectState { heading: f64::NAN, ..Default::default() };
    lag.clear();
    assert!(lag.push(&mut estimator, &params, &[ObjectReturn::default()], &state).heading == 0.0);
}
