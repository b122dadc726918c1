//! Clusters with known motion.

use super::super::cluster::Cluster;
use super::super::hypothesis::{self, Hypothesis};
use super::super::motion::Motion;
use super::*;
use crate::column_set::ColumnSet;

/// What is found about a car that moves steadily, over some sweeps: the number of its columns that
/// move, and the median and the largest error of their motion, voxels.
fn error_of_steady(sweeps: u32, by: [f32; 2], turn: f32, seed: u64) -> (usize, f32, f32) {
    let mut random = Random(seed);
    let start = [0; 2].map(|_| random.between(27.0, 36.0));
    let yaw = random.between(-3.0, 3.0);
    let at = |n: f32| Car { centre: [0, 1].map(|a| start[a] + n * by[a]), yaw: yaw + n * turn };
    let profile = Profile { refinement_sweeps: sweeps, ..profile() };
    let all: Vec<Returns> = (0..3).map(|n| sweep_of(&at(n as f32 - 1.0), &mut random)).collect();
    let mut refinement = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
    all.iter().enumerate().for_each(|(n, r)| give_with(&mut refinement, &profile, r, n));
    run(&mut refinement, &no_flow());
    let found = motions(&refinement);
    check_sane(&found);
    let mut errors = Vec::new();
    for (c, found) in found.iter().enumerate() {
        let Some((moved, _)) = found else { continue };
        let [x, y] = [(c / SIDE) as f32 + 0.5 - start[0], (c % SIDE) as f32 + 0.5 - start[1]];
        let truth = [
            by[0] + turn.cos() * x - turn.sin() * y - x,
            by[1] + turn.sin() * x + turn.cos() * y - y,
        ];
        errors.push((moved[0] - truth[0]).hypot(moved[1] - truth[1]));
    }
    errors.sort_by(f32::total_cmp);
    match errors.len() {
        0 => (0, f32::INFINITY, f32::INFINITY),
        n => (n, errors[n / 2], errors[n - 1]),
    }
}

#[test]
fn cars_move_by_fractions_of_a_voxel() {
    // Measured: at most 0.015 and 0.02 voxels, 5 mm.
    for sweeps in [2, 3] {
        for n in 0..16 {
            let direction = n as f32 * std::f32::consts::TAU / 16.0;
            for distance in [0.4, 0.9, 2.6, 5.3] {
                for turn in [0.0, 0.02] {
                    let by = [distance * direction.cos(), distance * direction.sin()];
                    let (count, median, most) = error_of_steady(sweeps, by, turn, n + 100);
                    let case = std::format!("{sweeps} sweeps, {by:?}, {turn} rad");
                    assert!(count >= 15, "{case}: {count} columns move");
                    assert!(median < 0.03 && most < 0.04, "{case}: {median} {most}");
                }
            }
        }
    }
}

/// A wall of 40 voxels along x, sampled anew in every sweep.
pub fn side(centre: f32, random: &mut Random) -> Returns {
    let mut returns = Returns::flat();
    for _ in 0..800 {
        let [along, height] = [random.between(-20.0, 20.0), random.between(0.7, 8.0)];
        returns.add([centre + along, 31.5, GROUND + height], 0);
    }
    returns
}

#[test]
fn ends_determine_how_far_a_side_slid() {
    // Registration alone leaves all of them at rest: any displacement along the side fits it.
    for by in [5.3, -4.1, 3.2] {
        let mut random = Random(12);
        let all: Vec<Returns> = (0..3).map(|n| side(31.5 + n as f32 * by, &mut random)).collect();
        let found = found_in(&all, &no_flow());
        let moved: Vec<[f32; 2]> = found.iter().flatten().map(|m| m.0).collect();
        // Measured: at most 0.25.
        let right = |m: &&[f32; 2]| (m[0] - by).abs() < 0.3 && m[1].abs() < 0.05;
        let count = moved.iter().filter(right).count();
        assert!(count > 35 && count == moved.len(), "{by}: {count} of {}", moved.len());
    }
    let mut random = Random(13);
    let still: Vec<Returns> = (0..3).map(|_| side(31.5, &mut random)).collect();
    assert!(found_in(&still, &no_flow()).iter().all(Option::is_none));
}

#[test]
fn later_returns_have_moved_for_longer() {
    // Seen 4 ms later in each successive sweep, like a car being overtaken.
    let late = 0.004;
    for n in 0..16 {
        let mut random = Random(300 + n);
        let direction = n as f32 * std::f32::consts::TAU / 16.0;
        let by = [4.0 * direction.cos(), 4.0 * direction.sin()];
        let sweep = |n: usize| {
            let shown = (n as f32 - 1.0) * (1.0 + late / 0.1);
            let at = [0, 1].map(|a| 31.0 + shown * by[a]);
            let mut returns = sweep_of(&Car { centre: at, yaw: direction }, &mut random);
            returns.placed.iter_mut().for_each(|p| p.offset_s = n as f32 * late);
            returns
        };
        let sweeps: Vec<Returns> = (0..3).map(sweep).collect();
        let found = found_in(&sweeps, &vec![pack_flow(by.map(|v| v.round() as i32)); SIDE * SIDE]);
        check_sane(&found);
        let moved: Vec<_> = found.iter().flatten().map(|m| m.0).collect();
        assert!(moved.len() >= 15, "{n}: {}", moved.len());
        for m in moved {
            // Without allowing for the delay it would be 0.16.
            assert!((m[0] - by[0]).hypot(m[1] - by[1]) < 0.04, "{n}: {m:?}, not {by:?}");
        }
    }
}

#[test]
fn static_structure_is_exactly_static() {
    let mut random = Random(5);
    for n in 0..30 {
        let car = Car { centre: [30.0 + 0.1 * n as f32, 31.0], yaw: 0.2 * n as f32 };
        let all: Vec<Returns> = (0..3).map(|_| sweep_of(&car, &mut random)).collect();
        let mut refinement = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
        all.iter().enumerate().for_each(|(n, r)| give(&mut refinement, r, n));
        // Whatever energy minimisation found for it.
        let wrong = vec![pack_flow([random.below(7) as i32 - 3, 1]); SIDE * SIDE];
        run(&mut refinement, &wrong);
        assert!(motions(&refinement).iter().all(Option::is_none), "{n}");
    }
}

#[test]
fn few_returns_alone_move_nothing() {
    for count in 0..5 {
        let cluster = |n: usize| {
            let mut returns = Returns::flat();
            for k in 0..count {
                let x = 20.5 + 1.1 * n as f32;
                returns.add([x, 30.1 + 0.4 * k as f32, GROUND + 1.2], 0);
            }
            returns
        };
        let sweeps: Vec<Returns> = (0..3).map(cluster).collect();
        let flows = vec![pack_flow([1, 0]); SIDE * SIDE];
        assert!(found_in(&sweeps, &flows).iter().all(Option::is_none), "{count}");
    }
}

#[test]
fn a_wall_that_seems_to_move_is_static() {
    // Longer than anything that moves, with a moving pattern.
    let big = Profile { side: 167, ..Profile::hdl64() };
    let wall = |n: usize| {
        let mut returns = Returns::default();
        for k in 0..4 * 160 {
            let along = 2.0 + 0.25 * k as f32;
            if (k / 40 + n).is_multiple_of(2) {
                returns.add([along, 40.3, GROUND + 1.5], 0);
            }
            returns.add([along, 40.3, GROUND + 3.0], 0);
        }
        for placed in &returns.placed {
            assert!(placed.at[0] < 167.0);
        }
        let column = |placed: &Placed| placed.at[0] as u32 * 167 + placed.at[1] as u32;
        returns.columns = returns.placed.iter().map(column).collect();
        for c in 0..167 * 167 {
            let [x, y] = [(c / 167) as f32 + 0.5, (c % 167) as f32 + 0.5];
            returns.points.push(Point::default());
            returns.placed.push(Placed { at: [x, y, GROUND], offset_s: 0.0 });
            returns.columns.push(c);
        }
        returns
    };
    let mut refinement = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
    let sweeps: Vec<Returns> = (0..3).map(wall).collect();
    sweeps.iter().enumerate().for_each(|(n, r)| give_with(&mut refinement, &big, r, n));
    let flows = vec![pack_flow([10, 0]); 167 * 167];
    let step = SweepUniform { side: 167, ..SweepUniform::default() };
    refinement.run(&SingleThread, &step, &flows, &[], |_| {
        Some(Prediction { by: [10.0, 0.0], certainty: 3.0, probability: 1.0 })
    });
    let extent_max = scaled().extent_max;
    let longest = refinement.clusters.found().iter().map(|f| f.extent).fold(0.0, f32::max);
    assert!(longest > extent_max, "{longest}");
    let moves = |f: &Hypothesis| f.extent > extent_max && f.is_dynamic;
    assert!(!refinement.clusters.found().iter().any(moves));
}

/// A long side that slides along itself, and a few returns in front of it that show how it moved.
fn long_side(moved: f32) -> Returns {
    let mut returns = Returns::flat();
    for k in 0..100 {
        let along = 12.0 + 0.4 * k as f32;
        returns.add([along, 30.3, GROUND + 1.5], 0);
        returns.add([along, 30.3, GROUND + 2.5], 0);
    }
    for k in 0..5 {
        for n in 0..2 {
            let (beside, height) = (29.4 - 0.35 * n as f32, GROUND + 1.2 + 0.4 * k as f32);
            returns.add([30.2 + moved, beside, height], 0);
        }
    }
    returns
}

#[test]
fn recent_movers_need_less_evidence() {
    let moving = |sweeps: &[Returns; 3], expected| {
        let mut refinement = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
        sweeps.iter().enumerate().for_each(|(n, r)| give(&mut refinement, r, n));
        run_with_scores(&mut refinement, &no_flow(), expected, &[]);
        motions(&refinement).iter().flatten().count()
    };
    let steady = [0.0, 1.2, 2.4].map(long_side);
    let still = [0.0; 3].map(long_side);
    assert_eq!(moving(&steady, None), 0);
    assert!(moving(&steady, Some([1.2, 0.0])) > 40);
    assert_eq!(moving(&still, Some([1.2, 0.0])), 0);
}

/// The same scores for every column: 127 for what could certainly move, 0 for unknown.
fn scored(score: i8) -> Vec<ColumnScores> {
    vec![[score; SCORES]; SIDE * SIDE]
}

#[test]
fn the_rest_of_a_body_follows_its_moving_part() {
    let moving = |sweeps: &[Returns; 3], scores: &[ColumnScores]| {
        // Only what lies in front of the side has a match.
        let flow = |c: usize| if c % SIDE < 30 { pack_flow([1, 0]) } else { 0 };
        let flows: Vec<Flow> = (0..SIDE * SIDE).map(flow).collect();
        let mut refinement = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
        sweeps.iter().enumerate().for_each(|(n, r)| give(&mut refinement, r, n));
        run_with_scores(&mut refinement, &flows, None, scores);
        motions(&refinement).iter().flatten().count()
    };
    let steady = [0.0, 1.2, 2.4].map(long_side);
    let still = [0.0; 3].map(long_side);
    let part = moving(&steady, &[]);
    assert!((1..20).contains(&part), "{part}");
    let whole = moving(&steady, &scored(127));
    // The side has 40 columns.
    assert!(whole >= 40, "{whole}, {part} of them by themselves");
    assert!(moving(&steady, &scored(0)) == part);
    assert_eq!(moving(&still, &scored(127)), 0);
}

fn columns_with_returns(cloud: DetailedCloud) -> Vec<u32> {
    (0..(SIDE * SIDE) as u32).filter(|c| cloud.levels(*c as usize) != 0).collect()
}

/// A cluster of some columns of the first sweep; there is neither traffic nor history.
fn cluster_of<'a>(
    scaled: &'a Scaled,
    first: DetailedCloud<'a>,
    targets: &'a [Target<'a>],
    detail: &'a CloudDetail,
    scores: &'a [ColumnScores],
    part: &'a [u32],
) -> Cluster<'a> {
    let (traffic, history) = (&[], &NO_HISTORY);
    let scans = Scans { scaled, first, targets, detail, scores, traffic, span_s: 0.1, history };
    Cluster::new(scans, part)
}

/// The residual of a motion; checks that a limit only decides whether it is returned.
fn residual_of(cluster: &Cluster, motion: &Motion) -> f32 {
    let residual = |limit| cluster.residual_below(limit, motion, &mut ColumnSet::new());
    let whole = residual(f32::INFINITY).unwrap();
    for limit in [0.01, 0.1, 0.5 * whole, whole, 1.01 * whole] {
        assert_eq!(residual(limit), Some(whole).filter(|r| *r < limit), "{limit}");
    }
    whole
}

#[test]
fn potential_movers_may_go_where_nothing_is_seen() {
    let mut random = Random(10);
    let [first, second] =
        [25.0, 27.0].map(|x| sweep_of(&Car { centre: [x, 31.0], yaw: 0.0 }, &mut random));
    // The second sweep sees nothing beyond a line: rays that would pass there are missing.
    let hidden = 28.0;
    let mut seen = Returns::default();
    for placed in second.placed.iter().filter(|p| p.at[0] < hidden) {
        seen.add(placed.at, 0);
    }
    let at_car = |end: [f32; 3]| EYE[0] + (end[0] - EYE[0]) * (31.0 - EYE[1]) / (end[1] - EYE[1]);
    let [of, target] = [first.in_sight(|_| true), seen.in_sight(|end| at_car(end) < hidden)];
    let [of, target] = [of, target].map(|returns| returns.cloud());
    let scaled = scaled();
    let (first, detail) = (of.all(), target.all().detail);
    let targets = [Target { index: 0, cloud: &target, offset: [0.0; 3], share: 1.0 }];
    let part = columns_with_returns(first);
    let (scaled, targets, could) = (&scaled, &targets, scored(127));
    let cluster = |scores| cluster_of(scaled, first, targets, detail, scores, &part);
    let residual = |cluster: Cluster| {
        let motion = Motion::around(cluster.centre).displaced([2.0, 0.0]);
        residual_of(&cluster, &motion)
    };
    let [unknown, known] = [cluster(&[]), cluster(&could)].map(residual);
    assert!(unknown > 0.12 && known < 0.05, "{unknown} {known}");
    // What moved before can also move.
    let moved = |_| Some(Prediction { by: [2.0, 0.0], certainty: 3.0, probability: 1.0 });
    let found = hypothesis::test(cluster(&[]), |_| 0, moved, &mut ColumnSet::new());
    assert!(found.is_dynamic && found.cues.residual < 0.05, "{}", found.cues.residual);
}

#[test]
fn objects_entering_the_window_were_outside() {
    let mut random = Random(12);
    // A third of the car was outside the window in the sweep before the pair.
    let [earlier, first, second] = [61.0, 53.0, 45.0]
        .map(|x| sweep_of(&Car { centre: [x, 31.0], yaw: 0.0 }, &mut random).cloud());
    let target = |index, cloud, share| Target { index, cloud, offset: [0.0; 3], share };
    let targets = [target(0, &second, 1.0), target(1, &earlier, -1.0)];
    let first = first.all();
    let part = columns_with_returns(first);
    let (scaled, detail) = (&scaled(), second.all().detail);
    let cluster = cluster_of(scaled, first, &targets, detail, &[], &part);
    let moved = |by| residual_of(&cluster, &Motion::around(cluster.centre).displaced([by, 0.0]));
    assert!(moved(-8.0) < 0.05 && moved(-7.0) > 0.1, "{} {}", moved(-8.0), moved(-7.0));
}

#[test]
fn a_limit_ends_no_sum_too_early() {
    let mut random = Random(14);
    let car = Car { centre: [25.0, 31.0], yaw: 0.0 };
    let [first, before, earlier] =
        [(); 3].map(|()| sweep_of(&car, &mut random).in_sight(|_| true).cloud());
    // Seen through in the second sweep: the first third of the residuals is 1.
    let second = Returns::flat().in_sight(|_| true).cloud();
    let target = |index, cloud, share| Target { index, cloud, offset: [0.0; 3], share };
    let targets = [target(0, &second, 1.0), target(1, &before, -1.0), target(2, &earlier, -3.0)];
    let first = first.all();
    let (part, scaled, detail) = (columns_with_returns(first), &scaled(), second.all().detail);
    for scores in [&[][..], &scored(127)] {
        let cluster = cluster_of(scaled, first, &targets, detail, scores, &part);
        let residual = residual_of(&cluster, &Motion::around(cluster.centre));
        assert!((residual - 1.0 / 3.0).abs() < 0.02, "{residual}");
    }
}
