//! Stages of the scalar backend whose rows are shared among the threads of a team.
//!
//! A row is a foreground column with its costs, or a line of the window. Each is written by one
//! thread and reads only what no thread writes, so how they are shared makes no difference.

use super::background_filter::mark_by_bytes;
use super::flow::expectation_by_rings::expectation_by_rings;
use super::occupancy_constancy::occupancy_constancy_by_lines;
use super::window::window;
use super::{FOREGROUND_COUNT, Storage};
use crate::params::ROW;
use crate::team::{Workers, share};

/// Rows that are not split further: up to 50 microseconds of work. Not measured in isolation.
const PIECE_ROWS_MAX: usize = 32;

/// See [`super::background_filter::background_filter`].
pub fn background_filter(s: &mut Storage, workers: &dyn Workers) {
    let Storage { sweep, filter_table, columns_before, foreground_marks, .. } = s;
    let side = sweep.side as usize;
    let marks = &mut foreground_marks[..side * side];
    share(workers, PIECE_ROWS_MAX, 0..side, marks, side, &|rows, marks| {
        mark_by_bytes(sweep, filter_table, columns_before, rows.start * side, marks);
    });
}

/// See [`super::occupancy_constancy::occupancy_constancy`].
pub fn occupancy_constancy(s: &mut Storage, workers: &dyn Workers) {
    let count = s.counters[FOREGROUND_COUNT] as usize;
    let (sweep, weights, costs) = (&s.sweep, &*s.constancy_weights, &*s.constancy_costs);
    let (foreground, before, now) = (&*s.foreground, &*s.columns_before, &*s.columns_now);
    let simd = workers.simd();
    share(
        workers,
        PIECE_ROWS_MAX,
        0..count,
        &mut s.pair_cost[..count * ROW],
        ROW,
        &move |rows, pairs| {
            let foreground = &foreground[rows];
            simd.run(
                #[inline(always)]
                move |_| {
                    occupancy_constancy_by_lines(
                        sweep, weights, costs, foreground, before, now, pairs,
                    );
                },
            );
        },
    );
}

/// See [`super::window::window`].
pub fn window_minima(s: &mut Storage, workers: &dyn Workers) {
    let count = s.counters[FOREGROUND_COUNT] as usize;
    let (sweep, foreground, index) = (&s.sweep, &*s.foreground, &*s.foreground_index);
    let (pairs, simd) = (&*s.pair_cost, workers.simd());
    share(workers, PIECE_ROWS_MAX, 0..count, &mut s.min_cost[..count], 1, &move |rows, least| {
        simd.run(
            #[inline(always)]
            move |_| window(sweep, &foreground[rows], index, pairs, least),
        );
    });
}

/// See [`super::flow::expectation::expectation`].
pub fn expectation(s: &mut Storage, workers: &dyn Workers) {
    let count = s.counters[FOREGROUND_COUNT] as usize;
    let (sweep, foreground, index) = (&s.sweep, &*s.foreground, &*s.foreground_index);
    let (pairs, flow, targets) = (&*s.pair_cost, &*s.flow, &*s.target_energy);
    let (least, simd) = (&*s.min_cost, workers.simd());
    share(
        workers,
        PIECE_ROWS_MAX,
        0..count,
        &mut s.proposal[..count],
        1,
        &move |rows, proposal| {
            let (of_rows, least) = (&foreground[rows.clone()], &least[rows]);
            simd.run(
                #[inline(always)]
                move |_| {
                    expectation_by_rings(
                        sweep, of_rows, index, pairs, flow, targets, least, proposal,
                    );
                },
            );
        },
    );
}
