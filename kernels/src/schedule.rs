//! Figure 3.1 for the device: one line per step. Barriers follow from what the kernels read and
//! write.

use raywake_core::layout::{
    BUFFERS, Buffer, GROUPS_DISTINCT, GROUPS_FOREGROUND, GROUPS_ROWS, Heap, MAP_BUFFERS, MapBuffer,
    Row,
};
use raywake_core::params::{BAND_UPDATES, POINTS_MAX, Profile, RADIX, TILE};
use raywake_core::record::NONE;
use raywake_gpu::{self as gpu, Groups, Kernel, Op, Program};

use crate::kernel::*;

/// The flow pipeline from rays to flow, for a profile's sizes.
pub fn flow(profile: &Profile) -> Program {
    use Buffer::*;
    let columns = profile.columns();
    let mut ops = vec![copy(StepIn, StepNow), copy(OriginsIn, Origins), copy(RaysIn, Rays)];
    ops.extend([Slots, Counters, LogOdds, State].map(|b| fill(b, 0)));
    ops.extend([TargetEnergy, Least].map(|b| fill(b, NONE)));
    ops.extend([
        threads("shift", &SHIFT, &[StepNow, Now, Before], columns),
        threads("ray_merge", &RAY_MERGE, &[StepNow, Rays, Slots, Distinct, Counters], POINTS_MAX),
        threads("plan", &PLAN, &[Counters], 1),
        indirect(
            "ray_trace",
            &RAY_TRACE,
            &[StepNow, Origins, Rays, Slots, Distinct, Counters, LogOdds],
            GROUPS_DISTINCT,
        ),
        threads("columns", &COLUMNS, &[StepNow, LogOdds, Now], columns),
        groups(
            "background_filter",
            &BACKGROUND_FILTER,
            &[StepNow, Filter, Before, Marks],
            columns.div_ceil(TILE),
        ),
    ]);
    ops.extend(prefix_sum("compact", Marks, Tiles, Rank, columns));
    ops.extend([
        threads("compact", &COMPACT, &[Marks, Rank, Foreground, Counters], columns),
        threads("plan", &PLAN, &[Counters], 1),
        indirect(
            "occupancy_constancy",
            &OCCUPANCY_CONSTANCY,
            &[StepNow, Weights, Costs, Foreground, Before, Now, Cost],
            GROUPS_ROWS,
        ),
        indirect("window", &WINDOW, &[StepNow, Foreground, Rank, Cost, Matching], GROUPS_ROWS),
    ]);
    let maximisation = [StepNow, Counters, Foreground, Proposal, TargetEnergy, TargetRank, State];
    for _ in 0..profile.em_rounds {
        ops.extend([
            indirect(
                "expectation",
                &EXPECTATION,
                &[StepNow, Counters, Foreground, Matching, State, TargetEnergy, Least, Proposal],
                GROUPS_FOREGROUND,
            ),
            fill(TargetEnergy, NONE),
            fill(TargetRank, NONE),
            indirect("maximisation", &CLAIM, &maximisation, GROUPS_FOREGROUND),
            indirect("maximisation", &RANK, &maximisation, GROUPS_FOREGROUND),
            indirect("maximisation", &SETTLE, &maximisation, GROUPS_FOREGROUND),
        ]);
    }
    ops.extend([
        copy(Counters, CountersOut),
        copy(Now, NowOut),
        copy(Before, BeforeOut),
        copy(Foreground, ForegroundOut),
        copy(State, StateOut),
        copy(Proposal, ProposalOut),
    ]);
    Program { name: "flow", ops }
}

/// Sparse map: distinct rays of a sweep. Then, band after band, [`map_count`] and [`map_band`].
pub fn map_rays() -> Program {
    use MapBuffer::*;
    let ops = vec![
        copy(StepIn, StepNow),
        copy(OriginsIn, Origins),
        copy(RaysIn, Rays),
        fill(Slots, 0),
        fill(Counters, 0),
        threads("ray_merge", &RAY_MERGE, &[StepNow, Rays, Slots, Distinct, Counters], POINTS_MAX),
    ];
    Program { name: "map rays", ops }
}

/// Sparse map: counts the updates of a band; [`MapBuffer::CountOut`] ends with their number.
pub fn map_count() -> Program {
    use MapBuffer::*;
    let mut ops = vec![
        copy(StepIn, StepNow),
        threads(
            "count",
            &COUNT,
            &[StepNow, Origins, Rays, Slots, Distinct, Counters, Counts, Updates],
            POINTS_MAX,
        ),
    ];
    ops.extend(prefix_sum("count", Counts, CountTiles, Offsets, POINTS_MAX));
    ops.push(copy(CountTiles, CountOut));
    Program { name: "map count", ops }
}

/// Sparse map: emits, sorts and reduces the updates of the band just counted, which must not be
/// more than [`BAND_UPDATES`].
pub fn map_band() -> Program {
    use MapBuffer::*;
    let tiles = BAND_UPDATES / TILE;
    let mut ops = vec![threads(
        "emit",
        &EMIT,
        &[StepNow, Origins, Rays, Slots, Distinct, Counters, Offsets, Updates],
        POINTS_MAX,
    )];
    // The counters hold the shift of the digit too; a full sort leaves it at 32, where no shift is
    // defined, so it starts anew.
    ops.push(groups(
        "histogram",
        &FIRST_DIGIT,
        &[CountTiles, Counters, Updates, Scratch, Histograms],
        1,
    ));
    let sides = [(Updates, Scratch), (Scratch, Updates)];
    for (from, to) in sides.into_iter().cycle().take(8) {
        let counted = [CountTiles, Counters, from, to, Histograms];
        let placed = [CountTiles, Counters, from, to, DigitOffsets];
        ops.push(groups("histogram", &HISTOGRAM, &counted, tiles));
        ops.extend(prefix_sum("histogram", Histograms, DigitTiles, DigitOffsets, RADIX * tiles));
        ops.push(groups("scatter", &SCATTER, &placed, tiles));
        ops.push(groups("scatter", &NEXT_DIGIT, &placed, 1));
    }
    let reduction = [CountTiles, Updates, Heads, Runs, Scratch];
    ops.push(threads("mark_heads", &MARK_HEADS, &reduction, BAND_UPDATES));
    ops.extend(prefix_sum("mark_heads", Heads, RunTiles, Runs, BAND_UPDATES));
    ops.push(fill(Scratch, 0));
    ops.push(threads("fold", &FOLD, &reduction, BAND_UPDATES));
    ops.extend([copy(Scratch, VoxelsOut), copy(RunTiles, RunsOut)]);
    Program { name: "map band", ops }
}

/// Copies of the learned tables, once at start.
pub fn load() -> Program {
    use Buffer::*;
    let ops = vec![copy(FilterIn, Filter), copy(WeightsIn, Weights), copy(CostsIn, Costs)];
    Program { name: "load", ops }
}

/// The buffer table as the executor takes it.
pub fn buffers(rows: &'static [Row], profile: &Profile) -> Vec<gpu::Buffer> {
    let heap = |h: Heap| match h {
        Heap::Upload => gpu::Heap::Upload,
        Heap::Device => gpu::Heap::Device,
        Heap::Readback => gpu::Heap::Readback,
    };
    rows.iter()
        .map(|r| gpu::Buffer { name: r.name, heap: heap(r.heap), bytes: r.bytes(profile) as u64 })
        .collect()
}

/// A row of either buffer table.
trait Rowed: Copy {
    const TABLE: &'static [Row];
    fn index(self) -> usize;
}

impl Rowed for Buffer {
    const TABLE: &'static [Row] = BUFFERS;
    fn index(self) -> usize {
        self as usize
    }
}

impl Rowed for MapBuffer {
    const TABLE: &'static [Row] = MAP_BUFFERS;
    fn index(self) -> usize {
        self as usize
    }
}

fn copy<B: Rowed>(from: B, to: B) -> Op {
    Op::Copy { from: from.index(), to: to.index() }
}

fn fill<B: Rowed>(buffer: B, value: u32) -> Op {
    Op::Fill { buffer: buffer.index(), value }
}

/// Prefix sum of a whole buffer of `count` words.
fn prefix_sum<B: Rowed>(name: &'static str, values: B, tiles: B, sums: B, count: usize) -> [Op; 3] {
    let buffers = [values, tiles, sums];
    [
        groups(name, &REDUCE, &buffers, count.div_ceil(TILE)),
        groups(name, &SPINE, &buffers, 1),
        groups(name, &SCAN, &buffers, count.div_ceil(TILE)),
    ]
}

/// A dispatch with a thread per item.
fn threads<B: Rowed>(
    name: &'static str,
    kernel: &'static Kernel,
    buffers: &[B],
    items: usize,
) -> Op {
    groups(name, kernel, buffers, items.div_ceil(kernel.workgroup[0] as usize))
}

/// A dispatch of a number of workgroups.
fn groups<B: Rowed>(
    name: &'static str,
    kernel: &'static Kernel,
    buffers: &[B],
    count: usize,
) -> Op {
    dispatch(name, kernel, buffers, Groups::Fixed([count as u32, 1, 1]))
}

/// A dispatch whose group count stands in the counters.
fn indirect(name: &'static str, kernel: &'static Kernel, buffers: &[Buffer], word: usize) -> Op {
    let at = Groups::Indirect { buffer: Buffer::Counters as usize, offset_bytes: 4 * word as u64 };
    dispatch(name, kernel, buffers, at)
}

fn dispatch<B: Rowed>(
    name: &'static str,
    kernel: &'static Kernel,
    buffers: &[B],
    groups: Groups,
) -> Op {
    check_names(kernel, buffers);
    Op::Dispatch { name, kernel, buffers: buffers.iter().map(|b| b.index()).collect(), groups }
}

/// Names of variables that stand for different buffers in different dispatches.
const GENERAL: [&str; 8] =
    ["values", "tiles", "sums", "counts", "unsorted", "sorted", "histograms", "voxels"];

/// Else a kernel's variables carry the names of the buffers bound to them.
fn check_names<B: Rowed>(kernel: &Kernel, buffers: &[B]) {
    for (binding, buffer) in kernel.bindings.iter().zip(buffers) {
        let name = B::TABLE[buffer.index()].name;
        let general = GENERAL.contains(&binding.name);
        assert!(general || binding.name == name, "{}: {name} at {}", kernel.name, binding.name);
    }
}
