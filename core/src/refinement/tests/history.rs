//! What was there before a cluster came.

use super::*;
use crate::refinement::cues::Looks;
use crate::refinement::history::History;

/// Length of a block, columns, and number of sweeps that see it.
const LENGTH: usize = 4;
const SWEEPS: usize = 5;

/// A sweep that sees a block of columns, starting at column `from` along x, in a window whose
/// corner is at column `corner`.
fn cloud(from: i32, corner: i32, n: usize) -> Kept {
    let mut returns = Returns::flat();
    for i in 0..LENGTH {
        let x = (from - corner) as f32 + i as f32 + 0.5;
        returns.add([x, 20.5, GROUND + 2.5], 0);
        returns.add([x, 20.5, GROUND + 3.5], 0);
    }
    let mut kept = returns.cloud();
    (kept.cloud.corner, kept.cloud.stamp_s) = ([corner, 0, 0], n as f64 * 0.1);
    kept
}

/// The looks at a block that is claimed to move by `by` columns per sweep and was seen at `at(n)`.
fn looks(by: f32, at: impl Fn(i32) -> i32, corner: impl Fn(i32) -> i32) -> Looks {
    looks_if_started(Some(0.0), by, at, corner)
}

/// The same if it may have sped up by `acceleration` columns per sweep²; `None` if it cannot have
/// started.
fn looks_if_started(
    acceleration: Option<f32>,
    by: f32,
    at: impl Fn(i32) -> i32,
    corner: impl Fn(i32) -> i32,
) -> Looks {
    let mut history = raywake_alloc_guard::boxed!(History, History::new());
    for n in 0..SWEEPS {
        history.push(cloud(at(n as i32), corner(n as i32), n).all(), |_| false);
    }
    let (last, corner) = (at(SWEEPS as i32), corner(SWEEPS as i32));
    let first = cloud(last, corner, SWEEPS);
    let mut of_column = vec![NONE; SIDE * SIDE];
    for i in 0..LENGTH {
        of_column[((last - corner) as usize + i) * SIDE + 20] = 0;
    }
    looks_of(&history, first.all(), &of_column, by, acceleration)
}

/// The looks at all columns of a cluster that moves by `by` columns over a pair of 0.1 s.
fn looks_of(
    history: &History,
    first: DetailedCloud,
    of_column: &[u32],
    by: f32,
    acceleration: Option<f32>,
) -> Looks {
    let mut looks = Looks::default();
    let is_part = |c: usize| of_column[c] == 0;
    for c in (0..of_column.len()).filter(|c| is_part(*c)) {
        looks += history.looks(first, c, [by, 0.0], 0.1, acceleration, is_part);
    }
    looks
}

#[test]
fn arrivals_are_fresh_and_static_structure_is_worn() {
    // Nothing was hit in front of the block before it came: in one column one sweep back, in two
    // columns two sweeps back, and so on up to all four.
    let mover = looks(1.0, |n| 10 + n, |_| 0);
    assert_eq!(mover.worn(), 0.0);
    let made = 2.0 * (1 + 2 + 3 + 4 + 4) as f32;
    assert!((mover.fresh() - made / (made + 8.0)).abs() < 1e-6, "{}", mover.fresh());
    let standing = looks(1.0, |_| 10, |_| 0);
    assert_eq!((standing.worn(), standing.fresh()), (mover.fresh(), 0.0));
}

#[test]
fn the_window_follows_the_vehicle() {
    let moving_window = |n| 2 * n - 5;
    assert_eq!(looks(1.0, |n| 15 + n, moving_window), looks(1.0, |n| 15 + n, |_| 0));
    assert_eq!(looks(1.0, |_| 15, moving_window), looks(1.0, |_| 15, |_| 0));
}

#[test]
fn nothing_is_known_where_hidden_or_without_a_sweep() {
    // Slower than a column over all sweeps: each place may have been its own.
    assert_eq!(looks(0.05, |_| 10, |_| 0), Looks::default());
    assert_eq!((Looks::default().worn(), Looks::default().fresh()), (0.0, 0.0));
}

#[test]
fn what_has_just_started_is_not_worn_by_itself() {
    // It stood at column 10, and moved by one column in the last sweep.
    let start = |a| looks_if_started(a, 1.0, |n| 10 + n / 5, |_| 0);
    let (steady, started) = (start(Some(0.0)), start(Some(1.0)));
    assert!(steady.worn() > 0.3, "{}", steady.worn());
    assert_eq!((started.worn(), started.fresh()), (0.0, steady.fresh()));
    // At a tenth of that it cannot have been at rest, and a wall does not start.
    assert_eq!([start(Some(0.1)), start(None)], [steady; 2]);
    // Too fast: it cannot have been where it is now.
    let standing = looks_if_started(Some(1.0), 5.0, |_| 10, |_| 0);
    assert_eq!(standing, looks(5.0, |_| 10, |_| 0));
    // Stamps as if far apart: cut to what lies in the window, or beyond it.
    let far = looks_if_started(Some(1e10), 1e6, |_| 10, |_| 0);
    assert_eq!((far.hits, far.empty), (far.made, 0));
}

#[test]
fn arrivals_are_new() {
    let mut history = raywake_alloc_guard::boxed!(History, History::new());
    let first = cloud(13, 0, SWEEPS);
    let new = |history: &History, since_s| -> Vec<usize> {
        (0..SIDE).filter(|i| history.is_new(first.all(), i * SIDE + 20, since_s)).collect()
    };
    assert!(new(&history, 0.0).is_empty());
    // A column every second sweep: 10, 10, 11, 11, 12, then 13.
    (0..SWEEPS).for_each(|n| history.push(cloud(10 + n as i32 / 2, 0, n).all(), |_| false));
    assert_eq!(new(&history, 0.0), [16]);
    assert_eq!(new(&history, 0.15), [15, 16]);
    assert_eq!(new(&history, 0.35), [14, 15, 16]);
    assert!(new(&history, 0.55).is_empty());
    // Nothing is known where it was out of view.
    history.clear();
    history.push(cloud(10, 15, 0).all(), |_| false);
    assert_eq!(new(&history, 0.0), [15, 16]);
}

#[test]
fn arrivals_leave_no_earlier_trace() {
    let mut history = raywake_alloc_guard::boxed!(History, History::new());
    (0..SWEEPS).for_each(|n| history.push(cloud(10, 0, n).all(), |column| column % SIDE == 20));
    let mut of_column = vec![NONE; SIDE * SIDE];
    (10..10 + LENGTH).for_each(|i| of_column[i * SIDE + 20] = 0);
    let looks = looks_of(&history, cloud(10, 0, SWEEPS).all(), &of_column, 1.0, None);
    assert!(looks.worn() == 0.0 && looks.fresh() > 0.5);
}

/// Whether the columns of a car say that there was no history; it moves with every sweep, and
/// another stands.
fn without_history(refinement: &mut Refinement, n: usize, random: &mut Random) -> Vec<bool> {
    let car = Car { centre: [24.0 + 3.0 * n as f32, 30.0], yaw: 0.0 };
    let mut returns = sweep_of(&car, random);
    Car { centre: [40.0, 50.0], yaw: 0.5 }.add_to(&mut returns, random);
    give(refinement, &returns, n);
    run(refinement, &vec![pack_flow([3, 0]); SIDE * SIDE]);
    let still = (0..SIDE * SIDE).filter(|c| refinement.at(*c as u32).is_none());
    assert!(still.map(|c| refinement.clusters.cues(c)).all(|cues| !cues.no_history));
    let found = (0..SIDE * SIDE).filter_map(|c| refinement.at(c as u32));
    found.map(|found| found.cues.no_history).collect()
}

#[test]
fn the_first_two_pairs_have_no_history() {
    let mut refinement = raywake_alloc_guard::boxed!(Refinement, Refinement::new());
    let random = &mut Random(8);
    for _ in 0..2 {
        assert!(without_history(&mut refinement, 0, random).is_empty());
        for n in 1..5 {
            let found = without_history(&mut refinement, n, random);
            assert!(
                found.len() > 10 && found.iter().all(|none| *none == (n < 3)),
                "{n}: {found:?}"
            );
        }
        refinement.clear();
    }
}
