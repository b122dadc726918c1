extern crate std;

use super::state::is_valid;
use super::synthetic::{self, Drive, Errors, Plan, drive, errors, history_errors};
use super::*;
use crate::RETURNS_MAX;
use crate::noise::ProcessNoise;
use crate::random::Random;
use std::vec::Vec;

fn root_mean(all: &[Errors]) -> Errors {
    core::array::from_fn(|i| {
        (all.iter().map(|e| e[i] * e[i]).sum::<f64>() / all.len() as f64).sqrt()
    })
}

fn estimated(estimator: &mut Estimator, params: &EstimateParams, drive: &Drive) -> Errors {
    estimator.solve(params, &drive.returns, &drive.history);
    errors(&drive.truth, |time| estimator.state(time))
}

/// A point that moves at constant speed and climb.
fn point() -> (Vec<ObjectReturn>, Vec<ObjectState>) {
    let returns = (0..600).map(|i| {
        let time_s = 0.005 * i as f32;
        ObjectReturn { position: [3.0 * time_s, 0.0, 0.5 * time_s], time_s, ..Default::default() }
    });
    let history = (0..30).map(|i| {
        let time_s = 0.1 * f64::from(i);
        let off = 0.2 * libm::sin(9.0 * time_s);
        ObjectState {
            time_s,
            position: [3.0 * time_s + off, -off, 0.5 * time_s + off],
            heading: 0.3 * off,
            speed: 3.0 - off,
            climb: 0.5,
            turn_rate: off,
        }
    });
    (returns.collect(), history.collect())
}

/// The optimum has zero cost: the model point at the origin, the trajectory a straight line.
#[test]
fn finds_the_optimum_of_a_point_in_uniform_motion() {
    let (returns, history) = point();
    let params = EstimateParams { model_points: 1, ..EstimateParams::DISSERTATION };
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    let report = estimator.solve(&params, &returns, &history);
    assert!(report.costs.last().unwrap().total() < 1e-4 * report.costs[0].total(), "{report:?}");
    for time_s in [0.0, 0.7, 1.5, 2.9] {
        let state = estimator.state(time_s);
        let expected = [3.0 * time_s, 0.0, 0.5 * time_s];
        for (value, expected) in state.position.iter().zip(expected) {
            assert!((value - expected).abs() < 0.01, "{state:?}");
        }
        assert!((state.speed - 3.0).abs() < 0.01 && (state.climb - 0.5).abs() < 0.01, "{state:?}");
        assert!(state.heading.abs() < 0.01 && state.turn_rate.abs() < 0.01, "{state:?}");
    }
    for value in estimator.model()[0] {
        assert!(value.abs() < 0.01);
    }
}

#[test]
fn continues_as_at_the_end() {
    let (returns, history) = point();
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    estimator.solve(&EstimateParams::DISSERTATION, &returns, &history);
    let (last, later) = (estimator.state(2.99), estimator.state(4.99));
    assert_eq!(later.time_s, 4.99);
    assert!((later.position[0] - last.position[0] - 6.0).abs() < 0.1, "{later:?}");
}

#[test]
fn parked_cars_are_static() {
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    let drives: Vec<Drive> = (0..4).map(|seed| drive(synthetic::parked(seed))).collect();
    let all: Vec<_> =
        drives.iter().map(|d| estimated(&mut estimator, &EstimateParams::DEFAULT, d)).collect();
    let [position, velocity, heading, turn_rate] = root_mean(&all);
    assert!(position < 0.1 && velocity < 0.2, "{all:?}");
    assert!(heading < 0.05 && turn_rate < 0.02, "{all:?}");
    // The plain method is better than the history it starts from.
    let params = EstimateParams::DISSERTATION;
    let plain: Vec<_> = drives.iter().map(|d| estimated(&mut estimator, &params, d)).collect();
    let before: Vec<_> = drives.iter().map(history_errors).collect();
    assert!(root_mean(&plain)[0] < root_mean(&before)[0], "{plain:?}");
}

#[test]
fn moving_cars_are_followed() {
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    for seed in 0..5 {
        let drive = drive(synthetic::moving(seed));
        let ours = estimated(&mut estimator, &EstimateParams::DEFAULT, &drive);
        let before = history_errors(&drive);
        assert!(ours[0] < 0.15 && ours[1] < 0.2, "{seed}: {ours:?}");
        assert!(ours[2] < 0.05 && ours[0] < 0.5 * before[0], "{seed}: {ours:?} {before:?}");
    }
}

/// A side says nothing about motion along it: where it ends does (figure 2.9), and the rays that
/// pass show that it ends there.
#[test]
fn long_sides_move_with_their_ends() {
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    let params = EstimateParams::DEFAULT;
    let without = EstimateParams { passing: false, ..params };
    let mut worst: f64 = 0.0;
    for (seed, speed) in [(1, 5.0), (2, 7.0), (3, 9.0)] {
        let drive = drive(synthetic::tram(seed, speed));
        let with = estimated(&mut estimator, &params, &drive);
        assert!(with[0] < 0.3, "{speed}: {with:?}");
        worst = worst.max(estimated(&mut estimator, &without, &drive)[0]);
    }
    assert!(worst > 1.0, "{worst}");
}

/// For braking and turning, a start is found that is steady for a second at a time.
#[test]
fn unsteady_motion_has_a_start() {
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    let plan = Plan { acceleration: -1.2, turn_rate: 0.1, speed: 9.0, ..synthetic::moving(2) };
    let drive = drive(plan);
    let params = EstimateParams::DEFAULT;
    let still = EstimateParams { iterations: 0, ..params };
    estimator.solve(&still, &drive.returns, &[]);
    assert!(estimator.start(InitialGuess::Unsteady, &params));
    estimator.best.copy(&estimator.problem.solution);
    let found = errors(&drive.truth, |time| estimator.state(time));
    assert!(estimator.start(InitialGuess::Steady, &params));
    estimator.best.copy(&estimator.problem.solution);
    let steady = errors(&drive.truth, |time| estimator.state(time));
    assert!(found[0] < 0.5 && found[1] < 1.0, "{found:?}");
    assert!(found[0] < 0.5 * steady[0] && found[1] < 0.7 * steady[1], "{found:?} {steady:?}");
    // A track too short for two such parts has no start.
    let short = &drive.returns[..drive.returns.partition_point(|seen| seen.time_s < 1.5)];
    estimator.solve(&EstimateParams::DEFAULT, short, &[]);
    assert!(!estimator.start(InitialGuess::Unsteady, &params));
}

/// The same optimum from histories that are off in different ways.
#[test]
fn perturbed_starts_converge() {
    let drive = drive(synthetic::moving(3));
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    let mut random = Random(11);
    for _ in 0..3 {
        let [x, y, turned] = [0.4, 0.3, 0.1].map(|scale| scale * random.normal());
        let mut history = drive.history.clone();
        for state in &mut history {
            state.position[0] += x * state.time_s / 3.0;
            state.position[1] += y;
            // Wraps make no difference.
            state.heading += turned + core::f64::consts::TAU * random.below(3) as f64;
        }
        estimator.solve(&EstimateParams::DEFAULT, &drive.returns, &history);
        let ours = errors(&drive.truth, |time| estimator.state(time));
        assert!(ours[0] < 0.1 && ours[2] < 0.05, "{ours:?}");
    }
}

/// Two versions of the same problem, as is and with all precisions a hundred times as large, agree:
/// no significant digit is lost between precisions of 4 and 1e6.
#[test]
fn conditioning_leaves_the_step_exact() {
    let (returns, history) = point();
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    let params = EstimateParams { iterations: 1, model_points: 40, ..EstimateParams::DISSERTATION };
    let one = estimator.solve(&params, &returns, &history).costs[1].total();
    let state = estimator.state(1.3);
    let noise = ProcessNoise {
        position_sigma_m: 0.001,
        heading_sigma_rad: 0.0001,
        speed_sigma_mps: 0.09,
        climb_sigma_mps: 0.01,
        turn_rate_sigma_radps: 0.008165,
    };
    let params = EstimateParams { noise, shape_sigma_m: 1.0, return_sigma_m: 0.05, ..params };
    let hundred = estimator.solve(&params, &returns, &history).costs[1].total();
    let heavy = estimator.state(1.3);
    assert!((hundred / one / 100.0 - 1.0).abs() < 1e-5, "{one} {hundred}");
    for (a, b) in state.position.iter().zip(heavy.position) {
        assert!((a - b).abs() < 1e-6, "{state:?} {heavy:?}");
    }
}

#[test]
fn is_reproducible() {
    let drive = drive(Plan { seconds: 2.0, ..synthetic::moving(2) });
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    let mut bits = || {
        estimator.solve(&EstimateParams::DEFAULT, &drive.returns, &drive.history);
        let state = estimator.state(1.0);
        (state.position.map(f64::to_bits), state.heading.to_bits(), estimator.model().to_vec())
    };
    assert_eq!(bits(), bits());
}

fn sane(estimator: &Estimator) {
    for time_s in [-10.0, 0.0, 0.3, 5.0, 100.0] {
        assert!(is_valid(&estimator.state(time_s)), "{:?}", estimator.state(time_s));
    }
    assert!(estimator.model().as_flattened().iter().all(|value| value.is_finite()));
}

#[test]
fn bad_input_is_bounded_and_reported() {
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    let whole = drive(Plan { seconds: 4.0, ..synthetic::moving(3) });
    let between = |from: f32, to: f32| -> Vec<ObjectReturn> {
        whole.returns.iter().filter(|seen| (from..to).contains(&seen.time_s)).copied().collect()
    };
    for params in [EstimateParams::DISSERTATION, EstimateParams::DEFAULT] {
        let mut solve = |returns: &[ObjectReturn], history: &[ObjectState]| {
            let report = estimator.solve(&params, returns, history);
            sane(&estimator);
            report
        };
        assert_eq!(solve(&[], &whole.history).termination, Termination::NoReturns);
        let one = solve(&whole.returns[..1], &whole.history);
        assert_eq!((one.returns, one.thinned), (1, 0));
        // All at one time.
        let mut at_once = whole.returns[..300].to_vec();
        for seen in &mut at_once {
            seen.time_s = 1.0;
        }
        assert_eq!(solve(&at_once, &whole.history).returns, 300);
        assert!(solve(&between(1.0, 1.4), &whole.history[8..14]).returns > 0);
        // No history.
        assert!(solve(&whole.returns, &[]).returns > 0);
        // A gap.
        let gap = [between(0.0, 1.0), between(3.0, 4.0)].concat();
        assert!(solve(&gap, &whole.history).returns > 0);
        // No numbers.
        let mut broken = whole.returns.clone();
        for (i, seen) in broken.iter_mut().enumerate().take(90) {
            match i % 3 {
                0 => seen.position[1] = f32::NAN,
                1 => seen.time_s = f32::INFINITY,
                _ => seen.position[2] = 1e30,
            }
        }
        let mut history = whole.history.clone();
        history[3].heading = f64::NAN;
        history[4].position[0] = f64::INFINITY;
        assert_eq!(solve(&broken, &history).unsound, 90);
        assert_eq!(solve(&broken[..1], &history).termination, Termination::NoReturns);
        // Longer than the knots reach.
        let mut long: Vec<_> = whole.returns.iter().step_by(50).copied().collect();
        for seen in &mut long {
            seen.time_s *= 100.0;
        }
        assert_eq!(solve(&long, &whole.history).returns, long.len());
        // Larger than the prior.
        let mut large = whole.returns.clone();
        for seen in &mut large {
            seen.position = seen.position.map(|value| 20.0 * value);
        }
        assert!(solve(&large, &whole.history).returns > 0);
        // All in one place.
        let point = [ObjectReturn::default(); 50];
        assert_eq!(solve(&point, &whole.history).returns, 50);
    }
}

#[test]
fn takes_the_maximum_number_evenly_in_time() {
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    // A tenth of the returns in nine tenths of the time, unordered.
    let mut random = Random(5);
    let returns: Vec<ObjectReturn> = (0..40_000)
        .map(|i| {
            let time_s =
                if i % 10 == 0 { random.between(0.0, 9.0) } else { random.between(9.0, 10.0) };
            ObjectReturn {
                position: [random.between(0.0, 4.0), 0.0, 0.0],
                time_s,
                ..Default::default()
            }
        })
        .collect();
    let params = EstimateParams { iterations: 1, ..EstimateParams::DISSERTATION };
    for (asked, least, most) in [(5000, 4800, 5000), (1_000_000, 6000, RETURNS_MAX), (1, 1, 128)] {
        let params = EstimateParams { returns: asked, model_points: MODEL_MAX + 1, ..params };
        let report = estimator.solve(&params, &returns, &[]);
        assert!((least..=most).contains(&report.returns), "{}", report.returns);
        assert_eq!(report.returns + report.thinned, returns.len());
        assert!(estimator.model().len() <= MODEL_MAX);
        let samples = estimator.problem.samples.all();
        assert!(samples.windows(2).all(|pair| pair[0].time_s <= pair[1].time_s));
        if asked == 5000 {
            let early = samples.iter().filter(|one| one.time_s < 9.0).count();
            assert!(early > 3500, "{early}");
        }
    }
}

/// The count is that of the start that led to the estimate, not of all starts tried.
#[test]
fn carved_points_are_the_missing_ones() {
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    let params = EstimateParams::DEFAULT;
    let mut carved = 0;
    for seed in 0..4 {
        let drive = drive(synthetic::parked(seed));
        let report = estimator.solve(&params, &drive.returns, &drive.history);
        assert_eq!(
            report.carved + estimator.model().len(),
            params.model_points,
            "{seed}: {report:?}"
        );
        carved += report.carved;
    }
    assert!(carved > 0);
}

/// A crumb has no heading that returns could show, but it does not spin either.
#[test]
fn whole_revolutions_are_undone() {
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    let mut random = Random(2);
    for _ in 0..20 {
        let returns: Vec<ObjectReturn> = (0..40)
            .map(|i| ObjectReturn {
                position: [0.2, 0.2, 0.3].map(|size| size * random.normal() as f32),
                origin: [20.0, 3.0, 1.0],
                time_s: 0.1 * (i / 10) as f32 + 0.001 * (i % 10) as f32,
                ..Default::default()
            })
            .collect();
        let history: Vec<ObjectState> = (0..4)
            .map(|i| ObjectState {
                time_s: 0.1 * f64::from(i),
                position: [0, 1, 2].map(|_| 0.1 * random.normal()),
                ..Default::default()
            })
            .collect();
        estimator.solve(&EstimateParams::DEFAULT, &returns, &history);
        let state = estimator.state(0.0);
        assert!(state.heading.abs() <= core::f64::consts::PI, "{state:?}");
    }
}

/// Returns of something else, in the middle of a track.
#[test]
fn a_wrong_association_does_not_break_a_track() {
    let mut drive = drive(synthetic::moving(3));
    let wrong: Vec<ObjectReturn> = drive
        .returns
        .iter()
        .filter(|seen| (3.0..3.3).contains(&seen.time_s))
        .map(|seen| {
            let [x, y, z] = seen.position;
            ObjectReturn { position: [x + 1.0, y + 3.0, z], ..*seen }
        })
        .collect();
    drive.returns.extend(wrong);
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    let ours = estimated(&mut estimator, &EstimateParams::DEFAULT, &drive);
    assert!(ours[0] < 0.2 && ours[2] < 0.05, "{ours:?}");
}

#[test]
fn long_objects_are_sluggish() {
    let ours = EstimateParams::DEFAULT;
    let by = |length_m: f32| {
        let of = ours.for_length(length_m);
        let noise = of.noise.sigmas().into_iter().zip(ours.noise.sigmas()).map(|(a, b)| a / b);
        let ratios = [of.tangential_sigma_m / ours.tangential_sigma_m, of.basis_s / ours.basis_s];
        (noise.collect::<Vec<f64>>(), ratios, of.shape_sigma_m)
    };
    let all = |speed, turn| [1.0, 1.0, 1.0, 1.0, speed, 1.0, turn].to_vec();
    assert_eq!(by(9.0), (all(0.5, 0.5), [1.0; 2], 9.0));
    assert_eq!(by(2.25), (all(1.0, 2.0), [0.5, 2.0 / 3.0], 2.25));
    assert_eq!(by(500.0), by(30.0));
    assert_eq!(by(30.0).2, ours.shape_sigma_m);
    // The length is unknown, or does not matter.
    assert_eq!(ours.for_length(0.0), ours);
    let plain = EstimateParams::DISSERTATION;
    assert_eq!(plain.for_length(9.0), plain);
}
