//! Every stage from rays to flow and from rays to the sparse map: the table of buffers, the stages
//! and the order in which they run, declared here and nowhere else.
//!
//! A stage is a function in this module's tree, its *twin*, and the kernel of the same name at the
//! same path below `kernels/wgsl`. The twin is the formula; if the scalar backend needs a faster
//! one, that is next to it and tested to be equal. The order below drives the scalar backend, the
//! device's schedule, the sparse map and the lab.

mod declare;

pub mod background_filter;
pub mod compact;
pub mod flow {
    //! Energy minimisation (section 3.5.2) as expectation-maximisation.
    //!
    //! Every foreground column seeks the displacement of minimum energy (3.14), in whole cells and
    //! thousandths of a nat; then every target keeps its best claimant. Both steps are strict: all
    //! columns of a round see the flow left by the previous round (Jacobi), ties go to the first
    //! candidate in scan order and to the first column, and the energies of the targets are rebuilt
    //! each round from their winners.
    pub mod expectation;
    pub mod expectation_by_rings;
    pub mod maximisation;
    #[cfg(test)]
    mod tests;
}
pub mod grid {
    //! Occupancy grid (section 3.4.1, appendix B): rays, log-odds, columns.
    //!
    //! Voxel `(i, j, k)` of a window is centred on `(i, j, k) * voxel_m` from the window's corner
    //! and lies at index `(i * side + j) * levels + k`; column `(i, j)` at `i * side + j`. `i` runs
    //! along +x, `j` along +y, `k` upwards.
    pub mod columns;
    pub mod ray_merge;
    pub mod ray_trace;
    pub mod shift;
    pub mod walk;
}
pub mod map {
    //! Update list, radix sort and reduce-by-key of the sparse map (B.2).
    pub mod emit;
    pub mod radix_sort;
    pub mod reduce_by_key;
}
mod by_rows;
pub mod occupancy_constancy;
pub mod prefix_sum;
mod program;
pub mod window;

pub use declare::{Argument, BufferElement, BufferRow, GroupCount, List, Stage, View};
pub use program::{Runner, StageOp, StageProgram, needed, run, walk};

use crate::params::*;
use crate::record::{
    Column, Flow, MinCost, NO_END, NONE, Proposal, Ray, SweepUniform, Update, VALID,
};
use background_filter::{FILTER_TABLE, TABLE_WORDS};
use declare::{argument, buffers, constants, passed, stage};
use occupancy_constancy::{SCORES_MAX, WEIGHT_WORDS};
use program::words_of;

buffers! {
    uniform sweep: SweepUniform, "sizes, shift and costs of the sweep";
    origins: [i32; 4] [|_| ORIGINS_MAX] "voxels of the ray origins";
    rays: Ray [Profile::returns] "rays of the sweep";
    filter_table: i32 [|_| TABLE_WORDS] "background filter by mask byte";
    constancy_weights: i32 [|_| WEIGHT_WORDS] "constancy weights by level";
    constancy_costs: u32 [|_| SCORES_MAX] "cost of each score, 1/1000 nat";
    slots: [u32; 2] [|_| MERGE_SLOTS] "distinct rays: 1 + index of one, and how many";
    distinct: u32 [Profile::returns] "used slots";
    counters: u32 [|_| COUNTERS] "counts and indirect group counts";
    log_odds: i32 [Profile::voxels] "log-odds of every voxel, tenths";
    columns_now: Column [Profile::columns] "columns of this sweep";
    columns_before: Column [Profile::columns] "columns of the previous sweep, in this window";
    foreground_marks: u32 [Profile::columns] "1 if a column is foreground";
    tiles: u32 [|_| TILE + 1] "sums of the tiles of the prefix sum, then of all";
    foreground_index: u32 [Profile::columns] "position of a column in the foreground";
    foreground: u32 [|_| FOREGROUND_MAX] "foreground columns, ascending";
    pair_cost: u16 [|_| FOREGROUND_MAX * ROW] "costs of pairs of columns";
    flow: Flow [Profile::columns] "flow of every column";
    target_energy: u32 [Profile::columns] "energy of the winner at every target";
    target_index: u32 [Profile::columns] "foreground index of the winner at every target";
    proposal: Proposal [|_| FOREGROUND_MAX] "flow and energy each foreground column proposes";
    min_cost: MinCost [|_| FOREGROUND_MAX] "minimum energy of a foreground column, and where";
    counts: u32 [Profile::returns] "updates of each distinct ray in the band";
    offsets: u32 [Profile::returns] "where its updates start";
    count_tiles: u32 [|_| TILE + 1] "tiles of their prefix sum, updates of the band";
    updates: Update [|_| BAND_UPDATES] "updates (key, log-odds), then sorted";
    scratch: Update [|_| BAND_UPDATES] "the other side of a radix pass, then voxels";
    histograms: u32 [|_| HISTOGRAMS] "digits of each tile";
    digit_offsets: u32 [|_| HISTOGRAMS] "where they go";
    digit_tiles: u32 [|_| TILE + 1] "tiles of their prefix sum";
    heads: u32 [|_| BAND_UPDATES] "1 if a key is new";
    runs: u32 [|_| BAND_UPDATES] "voxels before";
    run_tiles: u32 [|_| TILE + 1] "tiles of their prefix sum, voxels of the band";
}

/// Words of the counters: distinct rays, foreground listed, foreground marked, shift of the radix
/// digit; then three group counts and a spare for each indirect dispatch.
pub const COUNTERS: usize = 16;
/// Word of the number of distinct rays.
pub const DISTINCT_COUNT: usize = 0;
/// Word of the number of foreground columns listed.
pub const FOREGROUND_COUNT: usize = 1;
/// Word of the number of foreground columns marked.
pub const FOREGROUND_MARKED: usize = 2;
/// Word of the shift of the radix pass.
pub const DIGIT_SHIFT: usize = 3;
/// First word of the group counts, one thread per distinct ray.
pub const GROUPS_DISTINCT: usize = 4;
/// First word of the group counts, one thread per foreground column.
pub const GROUPS_FOREGROUND: usize = 8;
/// First word of the group counts, one group per foreground column.
pub const GROUPS_ROWS: usize = 12;
/// Counts of all digits in all tiles of a band.
const HISTOGRAMS: usize = RADIX * BAND_UPDATES / TILE;

constants! {
    POINTS_MAX, LEVELS_MAX, FOREGROUND_MAX, SIDE, LINE, ROW, ROW_WORDS, MERGE_SLOTS, MERGE_PROBES,
    WORKGROUP, ROW_WORKGROUP, TILE, RADIX, COST_UNKNOWN, FILTER_TABLE, DISTINCT_COUNT,
    FOREGROUND_COUNT, FOREGROUND_MARKED, GROUPS_DISTINCT, GROUPS_FOREGROUND, GROUPS_ROWS,
    DIGIT_SHIFT, NO_END, VALID, NONE;
    REACH, RANGE_STEPS_MAX, LOG_ODDS_FREE, LOG_ODDS_OCCUPIED, LOG_ODDS_SOLID
}

use GroupCount::{GroupPerColumn, One, ThreadPer, Threads, Tiles};
use List::{Distinct, Foreground};
use StageOp::{Fill, Fused, Part, ReadBack, Repeat, Rounds, Run, Upload};

/// The programs of the flow pipeline: one at start, and one for every sweep.
pub const FLOW_PROGRAMS: &[StageProgram] = &[
    StageProgram { name: "load", ops: LOAD },
    StageProgram { name: "flow", ops: &[Part(GRID), Part(FLOW)] },
];

/// The programs of the sparse map: one for every sweep, then two for every band.
pub const MAP_PROGRAMS: &[StageProgram] = &[
    StageProgram { name: "map rays", ops: MAP_RAYS },
    StageProgram { name: "map count", ops: MAP_COUNT },
    StageProgram { name: "map band", ops: MAP_BAND },
];

/// Uploads the learned tables, once at start.
pub const LOAD: &[StageOp] = &[
    Upload(Buffer::filter_table),
    Upload(Buffer::constancy_weights),
    Upload(Buffer::constancy_costs),
];

const RAY_MERGE: &Stage = stage!(
    ray_merge in grid::ray_merge,
    (sweep, rays, mut atomic slots, mut distinct, mut atomic counters),
    Threads(Profile::returns)
);

/// Group counts of the indirect dispatches.
const PLAN: &Stage = stage!(device plan, (mut counters), One);

/// Exclusive prefix sum of a whole buffer.
macro_rules! prefix_sum {
    ($values:ident, $tiles:ident, $sums:ident, $count:expr) => {
        stage!(
            prefix_sum in prefix_sum,
            (values is $values, mut tiles is $tiles, mut sums is $sums),
            [reduce: Tiles($count), spine: One, scan: Tiles($count)]
        )
    };
}

/// From rays to the columns of a sweep: the occupancy grid.
pub const GRID: &[StageOp] = &[
    Upload(Buffer::sweep),
    Upload(Buffer::origins),
    Upload(Buffer::rays),
    Fill(Buffer::slots, 0),
    Fill(Buffer::counters, 0),
    Fill(Buffer::log_odds, 0),
    Run(stage!(
        shift in grid::shift,
        (sweep, columns_now, mut columns_before),
        Threads(Profile::columns)
    )),
    Run(RAY_MERGE),
    Run(PLAN),
    Run(stage!(
        ray_trace in grid::ray_trace,
        (sweep, origins, rays, slots, list distinct, mut atomic log_odds),
        ThreadPer(Distinct)
    )),
    Run(stage!(
        columns in grid::columns,
        (sweep, log_odds, mut columns_now),
        Threads(Profile::columns)
    )),
];

/// A thread per foreground column.
const PER_COLUMN: GroupCount = ThreadPer(Foreground);

/// From the columns of two sweeps to flow.
pub const FLOW: &[StageOp] = &[
    Run(stage!(
        background_filter in background_filter,
        (sweep, filter_table, columns_before, mut foreground_marks),
        scalar: by_rows::background_filter,
        Tiles(Profile::columns)
    )),
    Run(prefix_sum!(foreground_marks, tiles, foreground_index, Profile::columns)),
    Run(stage!(
        compact in compact,
        (foreground_marks, mut foreground_index, mut foreground, mut counters),
        Threads(Profile::columns)
    )),
    Run(PLAN),
    Run(stage!(
        occupancy_constancy in occupancy_constancy,
        (sweep, constancy_weights, constancy_costs, list foreground, columns_before, columns_now,
            mut pair_cost),
        scalar: by_rows::occupancy_constancy,
        GroupPerColumn
    )),
    Run(stage!(
        window in window,
        (sweep, list foreground, foreground_index, quads pair_cost, mut min_cost),
        scalar: by_rows::window_minima,
        GroupPerColumn
    )),
    Fill(Buffer::flow, 0),
    Fill(Buffer::target_energy, NONE),
    Rounds(&[
        Run(stage!(
            expectation in flow::expectation,
            (sweep, list foreground, foreground_index, quads pair_cost, flow, target_energy,
                min_cost, mut proposal),
            scalar: by_rows::expectation,
            GroupPerColumn,
            on_cpus: (expectation_by_rings, ThreadPer(Foreground))
        )),
        Fill(Buffer::target_energy, NONE),
        Fill(Buffer::target_index, NONE),
        Run(stage!(
            maximisation in flow::maximisation,
            (sweep, list foreground, proposal, mut atomic target_energy, mut atomic target_index,
                mut flow),
            [claim: PER_COLUMN, elect: PER_COLUMN, settle: PER_COLUMN]
        )),
    ]),
    ReadBack(Buffer::counters),
    ReadBack(Buffer::columns_now),
    ReadBack(Buffer::columns_before),
    ReadBack(Buffer::foreground),
    ReadBack(Buffer::flow),
    ReadBack(Buffer::proposal),
];

/// Half a pass of the radix sort over 4-bit digits.
macro_rules! radix_pass {
    (histogram, $from:ident) => {
        stage!(
            device histogram,
            (count_tiles, counters, unsorted is $from, mut histograms),
            Tiles(|_| BAND_UPDATES)
        )
    };
    (scatter, $from:ident, $to:ident) => {
        stage!(
            device scatter,
            (count_tiles, counters, unsorted is $from, mut sorted is $to, digit_offsets),
            Tiles(|_| BAND_UPDATES)
        )
    };
}

const DIGIT_SUM: &Stage = prefix_sum!(histograms, digit_tiles, digit_offsets, |_| HISTOGRAMS);
const NEXT_DIGIT: &Stage = stage!(device next_digit, (mut counters), One);

/// Sparse map: distinct rays of a sweep. Then, band after band, [`MAP_COUNT`] and [`MAP_BAND`].
pub const MAP_RAYS: &[StageOp] = &[
    Upload(Buffer::sweep),
    Upload(Buffer::origins),
    Upload(Buffer::rays),
    Fill(Buffer::slots, 0),
    Fill(Buffer::counters, 0),
    Run(RAY_MERGE),
];

/// Sparse map: counts the updates of a band; `count_tiles` ends with their number.
pub const MAP_COUNT: &[StageOp] = &[
    Upload(Buffer::sweep),
    Run(stage!(
        count in map::emit,
        (sweep, origins, rays, slots, list distinct, mut counts),
        Threads(Profile::returns)
    )),
    Run(prefix_sum!(counts, count_tiles, offsets, Profile::returns)),
    ReadBack(Buffer::count_tiles),
];

/// Sparse map: emits, sorts and reduces the updates of the band just counted, which must not exceed
/// [`BAND_UPDATES`]. `run_tiles` ends with the number of voxels, `scratch` holds them.
pub const MAP_BAND: &[StageOp] = &[
    Run(stage!(
        emit in map::emit,
        (sweep, origins, rays, slots, list distinct, offsets, mut updates),
        Threads(Profile::returns)
    )),
    Fused(
        stage!(radix_sort in map::radix_sort, (count_tiles, mut updates, mut scratch), []),
        &[
            // The counters also hold the digit's shift; a full sort leaves it at 32, where no shift
            // is defined, so it is reset.
            Run(stage!(device first_digit, (mut counters), One)),
            Repeat(
                4,
                &[
                    Run(radix_pass!(histogram, updates)),
                    Run(DIGIT_SUM),
                    Run(radix_pass!(scatter, updates, scratch)),
                    Run(NEXT_DIGIT),
                    Run(radix_pass!(histogram, scratch)),
                    Run(DIGIT_SUM),
                    Run(radix_pass!(scatter, scratch, updates)),
                    Run(NEXT_DIGIT),
                ],
            ),
        ],
    ),
    Fused(
        stage!(
            reduce_by_key in map::reduce_by_key,
            (count_tiles, updates, mut voxels is scratch, mut run_tiles),
            []
        ),
        &[
            Run(stage!(
                device mark_heads,
                (count_tiles, updates, mut heads),
                Threads(|_| BAND_UPDATES)
            )),
            Run(prefix_sum!(heads, run_tiles, runs, |_| BAND_UPDATES)),
            Fill(Buffer::scratch, 0),
            Run(stage!(
                device fold,
                (count_tiles, updates, heads, runs, mut atomic voxels is scratch),
                Threads(|_| BAND_UPDATES)
            )),
        ],
    ),
    ReadBack(Buffer::scratch),
    ReadBack(Buffer::run_tiles),
];
