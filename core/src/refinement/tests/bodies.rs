//! What goes with a moving cluster, and what does not.

use super::motion::side;
use super::*;

#[test]
fn immovable_columns_are_dropped() {
    let mut random = Random(9);
    let of = |n: usize| Car { centre: [25.0 + 2.0 * n as f32, 31.0], yaw: 0.3 };
    let sweeps: Vec<Returns> = (0..3).map(|n| sweep_of(&of(n), &mut random)).collect();
    let flows = vec![pack_flow([2, 0]); SIDE * SIDE];
    // Columns beyond a line could not move.
    let stays = |c: usize| c / SIDE < 26;
    let found = |scores: &[ColumnScores]| found_with_scores(&sweeps, &flows, scores);
    let scores: Vec<ColumnScores> =
        (0..SIDE * SIDE).map(|c| [if stays(c) { -127 } else { 0 }; SCORES]).collect();
    let (all, some) = (found(&[]), found(&scores));
    let moved = |found: &[Moved], part: &dyn Fn(usize) -> bool| {
        (0..found.len()).filter(|c| part(*c) && found[*c].is_some()).count()
    };
    assert!(moved(&all, &stays) > 5 && moved(&all, &|c| !stays(c)) > 5);
    assert_eq!(moved(&some, &stays), 0);
    // The rest moves as before, except for ground below the whole.
    assert!(moved(&some, &|c| !stays(c)) > 20);
    assert!((0..all.len()).all(|c| some[c].is_none() || all[c].is_some()));
}

/// How many columns of a `part` move at the end, given the encoder's scores of the part and of the
/// rest.
fn moving_in(
    sweeps: &[Returns],
    part: impl Fn(usize) -> bool,
    [of_part, of_rest]: [i8; 2],
) -> usize {
    let score = |c| [if part(c) { of_part } else { of_rest }; SCORES];
    let scores: Vec<ColumnScores> = (0..SIDE * SIDE).map(score).collect();
    let mut refinement = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
    for (n, returns) in sweeps.iter().enumerate() {
        give(&mut refinement, returns, n);
        run_with_scores(&mut refinement, &no_flow(), None, &scores);
    }
    let found = motions(&refinement);
    (0..found.len()).filter(|c| part(*c) && found[*c].is_some()).count()
}

#[test]
fn parts_are_not_left_behind_without_earlier_hits() {
    // The middle of a side that slides along itself: nothing is known of what was there before.
    let mut random = Random(12);
    let all: Vec<Returns> = (0..3).map(|n| side(31.5 + n as f32 * 5.3, &mut random)).collect();
    let middle = |c: usize| (30..42).contains(&(c / SIDE)) && c % SIDE == 31;
    let [whole, doubted] = [1, -1].map(|score| moving_in(&all, middle, [score, 1]));
    assert!(whole > 10 && doubted == whole, "{whole} {doubted}");
}

#[test]
fn parts_with_evidence_of_their_own_are_not_left_behind() {
    // A car comes to where another stood until a moment ago.
    let mut random = Random(9);
    let sweep = |n: usize| {
        let at = |x| Car { centre: [x, 31.0], yaw: 0.0 };
        let mut returns = sweep_of(&at(21.0 + 2.0 * n as f32), &mut random);
        if n < 3 {
            at(42.0).add_to(&mut returns, &mut random);
        }
        returns
    };
    let all: Vec<Returns> = (0..8).map(sweep).collect();
    // Its near side, without the ground below it.
    let front = |c: usize| c / SIDE > 34 && c % SIDE == 28;
    let [whole, doubted] = [1, -1].map(|score| moving_in(&all, front, [score, 1]));
    assert!(whole > 5 && doubted == whole, "{whole} {doubted}");
}

/// A pedestrian, a column away from a wall that is in the same cluster.
fn beside_a_wall(at: f32, random: &mut Random) -> Returns {
    let mut returns = Returns::flat();
    for k in 0..200 {
        let along = 10.0 + 0.2 * k as f32;
        (0..5).for_each(|z| returns.add([along, 30.8, GROUND + 1.0 + z as f32], 0));
    }
    for k in 0..150 {
        let (along, aside) = match k % 3 {
            0 => (random.between(-0.8, 0.8), 0.0),
            _ => (0.8, random.between(0.0, 1.6)),
        };
        let z = GROUND + random.between(0.7, 5.5);
        returns.add([at + along, 28.3 + aside, z], 0);
    }
    returns
}

#[test]
fn who_walks_slowly_is_found_in_the_earliest_sweep() {
    // 0.6 m/s, a fifth of a voxel per sweep; nothing is known of the sweeps before these.
    let mut random = Random(11);
    let sweep = |n: usize| beside_a_wall(22.0 + 0.2 * n as f32, &mut random);
    let sweeps: Vec<Returns> = (0..7).map(sweep).collect();
    let matched = vec![pack_flow([0, 0]); SIDE * SIDE];
    let count = |flows: &[Flow]| found_in(&sweeps, flows).iter().flatten().count();
    assert!(count(&no_flow()) == 0 && count(&matched) >= 4, "{}", count(&matched));
}

#[test]
fn pedestrians_along_a_wall_are_found() {
    // 1 m/s, a third of a voxel per sweep.
    let mut random = Random(11);
    let mut sweep = |n: usize| beside_a_wall(22.0 + n as f32 / 3.0, &mut random);
    let sweeps: Vec<Returns> = (0..7).map(&mut sweep).collect();
    let mut refinement = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
    let mut moving = Vec::new();
    for (n, now) in sweeps.iter().enumerate() {
        give(&mut refinement, now, n);
        if n > 0 {
            run(&mut refinement, &no_flow());
            moving.push(motions(&refinement));
        }
    }
    let count = |n: usize| moving[n].iter().flatten().count();
    assert!(count(1) == 0 && count(5) >= 4, "{:?}", (0..6).map(count).collect::<Vec<_>>());
    // The pedestrian alone, to within 3 mm.
    for (c, (by, _)) in moving[5].iter().enumerate().filter_map(|(c, m)| Some((c, (*m)?))) {
        let right = (by[0] - 1.0 / 3.0).abs() < 0.01 && by[1].abs() < 0.01;
        assert!(right && (22..27).contains(&(c / SIDE)), "{c} {by:?}");
    }
    // The wall stays whatever the encoder thinks of it: it would have come to where it was before.
    let wall = |c: usize| c % SIDE == 30;
    for scores in [[127, 127], [1, 1], [-1, 1], [-1, -1]] {
        assert_eq!(moving_in(&sweeps, wall, scores), 0, "{scores:?}");
    }
}

#[test]
fn what_a_car_passes_is_left_behind() {
    // A low wall along the road is in the car's cluster and fits its motion as well as rest.
    let mut random = Random(9);
    let sweep = |n: usize| {
        let mut returns =
            sweep_of(&Car { centre: [21.0 + 2.0 * n as f32, 31.0], yaw: 0.0 }, &mut random);
        for k in 0..200 {
            returns.add([10.0 + 0.2 * k as f32, 27.5, GROUND + 1.0], 0);
        }
        returns
    };
    let sweeps: Vec<Returns> = (0..7).map(sweep).collect();
    let wall = |c: usize| c % SIDE == 27;
    // It is, if the encoder thinks that it could not move, but the car could.
    let [whole, left, doubted] =
        [[1, 1], [-1, 1], [-1, -1]].map(|scores| moving_in(&sweeps, wall, scores));
    assert!(whole > 0 && left == 0 && doubted == whole, "{whole} {left} {doubted}");
}

#[test]
fn fragments_follow_those_that_joined_before() {
    // Two bits ahead of a car, too small to move by themselves; only the nearer is near the car.
    let foremost = |between: bool| {
        let mut random = Random(9);
        let sweep = |n: usize| {
            let x = 21.5 + 2.0 * n as f32;
            let mut returns = sweep_of(&Car { centre: [x, 31.0], yaw: 0.0 }, &mut random);
            for ahead in [10.0, 14.0].into_iter().skip(usize::from(!between)) {
                (1..4).for_each(|z| returns.add([x + ahead, 28.5, GROUND + z as f32], 0));
            }
            returns
        };
        let sweeps: Vec<Returns> = (0..3).map(sweep).collect();
        let found = found_with_scores(&sweeps, &vec![pack_flow([2, 0]); SIDE * SIDE], &[]);
        found[37 * SIDE + 28].is_some()
    };
    assert!(foremost(true) && !foremost(false));
}
