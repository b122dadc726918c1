//! What happens to tracklets from step to step.

extern crate std;
use super::*;
use crate::random::Random;
use std::boxed::Box;
use std::collections::BTreeSet;
use std::vec::Vec;

const SIDE: i32 = 31;
const DT: f32 = 0.1;

fn profile() -> Profile {
    Profile { side: SIDE as u32, ..Profile::hdl64() }
}

fn step(side: i32, shift: [i32; 2]) -> SweepUniform {
    SweepUniform { side, shift_x: shift[0], shift_y: shift[1], ..SweepUniform::default() }
}

/// An observed column and its displacement, cells.
fn seen(column: i32, by: [f32; 2]) -> Observation {
    let variance = 0.03 * 0.03;
    Observation {
        column: column as u32,
        moved: by.map(|v| v * 0.3),
        covariance: [variance, 0.0, variance],
        cues: Cues::NONE,
        probability: 1.0,
        slot: NONE,
    }
}

/// One step in a window that moved; also returns how many tracklets it left behind.
fn advance(
    tracklets: &mut Tracklets,
    profile: &Profile,
    shift: [i32; 2],
    observed: &mut [Observation],
) -> (TrackletTurnover, u32) {
    let step = step(profile.side as i32, shift);
    let left = tracklets.place(&step);
    (tracklets.update(profile, &step, DT, 0.0, left, observed), left)
}

fn new() -> Box<Tracklets> {
    raywake_alloc_guard::boxed!(Tracklets, Tracklets::new())
}

fn cell(i: i32, j: i32) -> i32 {
    i * SIDE + j
}

#[test]
fn an_adjacent_column_takes_over_the_tracklet() {
    for (takes_over, age) in [(true, 1), (false, 0)] {
        let mut profile = profile();
        profile.tracklet.takes_over = takes_over;
        profile.tracklet.coast_sweeps = 0;
        // It goes on from the middle or the edge of the column it takes.
        for (by, to) in [([0, 1], 14), ([-1, -1], 14), ([1, 0], 15)] {
            let mut tracklets = new();
            advance(&mut tracklets, &profile, [0, 0], &mut [seen(cell(10, 10), [2.0, 0.0])]);
            let mut observed = [seen(cell(12 + by[0], 10 + by[1]), [2.4, 0.0])];
            let (turnover, _) = advance(&mut tracklets, &profile, [0, 0], &mut observed);
            assert_eq!((turnover.updated, turnover.born), (age.into(), u64::from(1 - age)));
            assert_eq!(tracklets.all().len(), 1);
            assert_eq!((tracklets.all()[0].age, observed[0].slot), (age, 0));
            let to = if takes_over { to } else { 14 + by[0] };
            assert_eq!(tracklets.all()[0].column as i32, cell(to, 10 + by[1]));
        }
        // Two cells off is not adjacent.
        let mut tracklets = new();
        advance(&mut tracklets, &profile, [0, 0], &mut [seen(cell(10, 10), [2.0, 0.0])]);
        let far = &mut [seen(cell(14, 10), [2.0, 0.0])];
        assert_eq!(advance(&mut tracklets, &profile, [0, 0], far).0.born, 1);
    }
}

#[test]
fn the_nearest_of_several_adjacent_columns_is_taken() {
    let mut tracklets = new();
    // The point it follows ends up at the upper edge of cell (12, 10) along y.
    let (first, second) = ([2.0, 0.4], [2.0, 0.0]);
    advance(&mut tracklets, &profile(), [0, 0], &mut [seen(cell(10, 10), first)]);
    let mut observed = [seen(cell(12, 9), second), seen(cell(12, 11), second)];
    let (turnover, _) = advance(&mut tracklets, &profile(), [0, 0], &mut observed);
    assert_eq!((turnover.updated, turnover.born), (1, 1));
    let ages = observed.map(|o| tracklets.all()[o.slot as usize].age);
    assert_eq!(ages, [0, 1]);
}

#[test]
fn tracklets_meeting_in_a_cell_merge_into_the_older() {
    let mut tracklets = new();
    advance(&mut tracklets, &profile(), [0, 0], &mut [seen(cell(10, 10), [1.0, 0.0])]);
    // The first goes on to (12, 10); the second comes there from the side.
    let mut observed = [seen(cell(11, 10), [1.0, 0.0]), seen(cell(12, 9), [0.0, 1.0])];
    let (turnover, _) = advance(&mut tracklets, &profile(), [0, 0], &mut observed);
    assert_eq!((turnover.born, turnover.updated, turnover.merged), (1, 1, 1));
    assert_eq!(observed[0].slot, observed[1].slot);
    assert_eq!(tracklets.all().len(), 1);
    assert_eq!(tracklets.all()[0].age, 1);
}

#[test]
fn a_mover_reaching_a_stationary_object_keeps_moving() {
    // Inserted before the one at rest, and after it.
    for (from, by) in [(10, 2.0), (14, -2.0)] {
        let standing = seen(cell(12, 10), [0.0, 0.0]);
        let mut tracklets = new();
        advance(&mut tracklets, &profile(), [0, 0], &mut [standing]);
        let mut observed = [standing, seen(cell(from, 10), [by, 0.0])];
        observed.sort_by_key(|o| o.column);
        let (turnover, _) = advance(&mut tracklets, &profile(), [0, 0], &mut observed);
        assert_eq!((turnover.born, turnover.updated, turnover.merged), (1, 1, 1));
        assert_eq!(observed.map(|o| o.slot), [0, 0]);
        let [kept] = tracklets.all() else { panic!("{}", tracklets.all().len()) };
        assert!(!kept.ekf.at_rest() && kept.age == 0, "{kept:?}");
    }
}

#[test]
fn unobserved_tracklets_wait_ever_less_sure() {
    for coast_sweeps in [0, 1, 2, 5] {
        let mut profile = profile();
        profile.tracklet.coast_sweeps = coast_sweeps;
        let mut tracklets = new();
        for n in 0..8 {
            advance(&mut tracklets, &profile, [0, 0], &mut [seen(cell(4 + n, 10), [1.0, 0.0])]);
        }
        assert_eq!(tracklets.all()[0].age, 7);
        let (mut last, mut column) = (tracklets.all()[0].ekf, tracklets.all()[0].column);
        for n in 1..=coast_sweeps {
            let (turnover, _) = advance(&mut tracklets, &profile, [0, 0], &mut []);
            assert_eq!(turnover, TrackletTurnover { waiting: 1, ..TrackletTurnover::default() });
            let t = tracklets.all()[0];
            assert_eq!((t.missed, t.age), (n, 7));
            for k in 0..5 {
                assert!(t.ekf.covariance[(k, k)] >= last.covariance[(k, k)], "{n}: {k}");
            }
            assert!(t.ekf.covariance[(0, 0)] > last.covariance[(0, 0)]);
            // It goes on at its speed.
            assert_eq!(t.column, column + SIDE as u32);
            (last, column) = (t.ekf, t.column);
        }
        let (turnover, _) = advance(&mut tracklets, &profile, [0, 0], &mut []);
        assert_eq!(turnover, TrackletTurnover { lost: 1, ..TrackletTurnover::default() });
        assert!(tracklets.all().is_empty());
    }
}

#[test]
fn new_tracklets_do_not_coast() {
    let mut tracklets = new();
    advance(&mut tracklets, &profile(), [0, 0], &mut [seen(cell(10, 10), [1.0, 0.0])]);
    assert_eq!(advance(&mut tracklets, &profile(), [0, 0], &mut []).0.lost, 1);
}

#[test]
fn tracklets_leaving_the_window_are_counted() {
    // By its own motion.
    let mut tracklets = new();
    let outwards = &mut [seen(cell(0, 10), [-1.0, 0.0]), seen(cell(10, 30), [0.0, 0.8])];
    let (turnover, _) = advance(&mut tracklets, &profile(), [0, 0], outwards);
    assert_eq!((turnover.born, turnover.left), (2, 2));
    assert!(tracklets.all().is_empty() && outwards.iter().all(|o| o.slot == NONE));
    // By the motion of the window.
    advance(&mut tracklets, &profile(), [0, 0], &mut [seen(cell(2, 10), [0.0, 0.0])]);
    let (turnover, left) = advance(&mut tracklets, &profile(), [3, 0], &mut []);
    assert_eq!((turnover, left), (TrackletTurnover { left: 1, ..TrackletTurnover::default() }, 1));
    assert!(tracklets.all().is_empty());
}

/// Checks that every tracklet is accounted for: where it went, and where those present came from.
fn check_counts(before: usize, after: usize, turnover: &TrackletTurnover, left_behind: u32) {
    let t = turnover;
    let left_behind = u64::from(left_behind);
    let ends = left_behind + t.updated + t.gated + t.waiting + t.lost;
    assert_eq!(before as u64, ends, "{t:?}");
    let went_out = t.left - left_behind;
    assert_eq!(after as u64, t.born + t.updated + t.waiting - t.merged - went_out, "{t:?}");
}

#[test]
fn counts_add_up_and_no_two_share_a_cell() {
    let late_start = Profile { side: SIDE as u32, ..Profile::dissertation() };
    for profile in [profile(), late_start] {
        let mut random = Random(11);
        let mut tracklets = new();
        let mut total = TrackletTurnover::default();
        for _ in 0..300 {
            let share = random.between(0.0, 0.4) as f64;
            let mut observed: Vec<Observation> = (0..SIDE * SIDE)
                .filter(|_| random.uniform() < share)
                .collect::<Vec<_>>()
                .into_iter()
                .map(|c| seen(c, [0; 2].map(|_| random.between(-2.0, 2.0))))
                .collect();
            let shift = [0; 2].map(|_| random.below(3) as i32 - 1);
            let before = tracklets.all().len();
            let (turnover, left) = advance(&mut tracklets, &profile, shift, &mut observed);
            check_counts(before, tracklets.all().len(), &turnover, left);
            let cells: BTreeSet<u32> = tracklets.all().iter().map(|t| t.column).collect();
            assert_eq!(cells.len(), tracklets.all().len());
            assert!(cells.iter().all(|c| *c < (SIDE * SIDE) as u32));
            for t in tracklets.all() {
                assert!(t.place.iter().all(|v| (0.0..1.0).contains(v)), "{:?}", t.place);
                assert!(t.ekf.mean.iter().chain(&t.ekf.covariance).all(|v| v.is_finite()));
            }
            for o in observed.iter().filter(|o| o.slot != NONE) {
                assert!((o.slot as usize) < tracklets.all().len());
            }
            total += turnover;
        }
        let t = total;
        let waits = profile.tracklet.coast_sweeps > 0;
        assert!(t.gated > 0 && t.merged > 0 && t.lost > 0 && t.left > 0, "{t:?}");
        assert_eq!(t.waiting > 0, waits, "{t:?}");
    }
}

#[test]
fn no_tracks_are_born_beyond_the_capacity() {
    let side = 255;
    let profile = Profile { side, ..Profile::hdl64() };
    let mut tracklets = new();
    let of_half = |half: i32| -> Vec<Observation> {
        let columns = (0..FOREGROUND_MAX as i32).map(|n| half * 30_000 + 2 * n);
        columns.map(|c| seen(c, [0.0; 2])).collect()
    };
    for half in [0, 0, 1] {
        let mut observed = of_half(half);
        advance(&mut tracklets, &profile, [0, 0], &mut observed);
        assert_eq!(tracklets.all().len(), FOREGROUND_MAX);
        assert!(observed.iter().all(|o| o.slot != NONE));
    }
    // The old ones, coasting, found no room next to as many new ones.
    assert!(tracklets.all().iter().all(|t| t.age == 0));
}

#[test]
fn speeds_beyond_all_cells_leave_the_window() {
    let profile = profile();
    let mut tracklets = new();
    let mut step_over = |dt: f32, observed: &mut [Observation]| {
        let step = step(SIDE, [0, 0]);
        let left = tracklets.place(&step);
        tracklets.update(&profile, &step, dt, 0.0, left, observed)
    };
    // Stamps a nanosecond apart, then nothing is seen for half a second.
    step_over(1e-9, &mut [seen(cell(1, 10), [14.0, 0.0])]);
    assert_eq!(step_over(1e-9, &mut [seen(cell(15, 10), [14.0, 0.0])]).updated, 1);
    let turnover = step_over(0.5, &mut []);
    assert_eq!((turnover.waiting, turnover.left), (1, 1));
}
