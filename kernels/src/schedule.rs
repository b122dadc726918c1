//! Figure 3.1 for the device: one line per step. Barriers follow from what the kernels read and
//! write.

use raywake_core::layout::{
    BUFFERS, Buffer, GROUPS_DISTINCT, GROUPS_FOREGROUND, GROUPS_ROWS, Heap, Row,
};
use raywake_core::params::{POINTS_MAX, Profile, TILE, WORKGROUP};
use raywake_core::record::NONE;
use raywake_gpu::{self as gpu, Groups, Kernel, Op, Program};

use crate::kernel::*;

/// The flow pipeline from rays to flow, for a profile's sizes.
pub fn flow(profile: &Profile) -> Program {
    use Buffer::*;
    let columns = profile.columns();
    let mut ops = vec![copy(StepIn, StepNow), copy(OriginsIn, Origins), copy(RaysIn, Rays)];
    ops.extend([Slots, Counters, LogOdds, State].map(|b| fill(b, 0)));
    ops.push(fill(TargetEnergy, NONE));
    ops.extend([
        threads("shift", &SHIFT, &[StepNow, Now, Before], columns),
        threads(
            "ray_merge", &RAY_MERGE, &[StepNow, Rays, Slots, Distinct, Counters],
            POINTS_MAX,
        ),
        threads("plan", &PLAN, &[Counters], 1),
        indirect(
            "ray_trace", &RAY_TRACE,
            &[StepNow, Origins, Rays, Slots, Distinct, Counters, LogOdds],
            GROUPS_DISTINCT,
        ),
        threads("columns", &COLUMNS, &[StepNow, LogOdds, Now], columns),
        threads("background_filter", &BACKGROUND_FILTER, &[StepNow, Filter, Before, Marks], columns),
        groups("compact", &REDUCE, &[Marks, Tiles, Rank], columns.div_ceil(TILE)),
        groups("compact", &SPINE, &[Marks, Tiles, Rank], 1),
        groups("compact", &SCAN, &[Marks, Tiles, Rank], columns.div_ceil(TILE)),
        threads("compact", &COMPACT, &[Marks, Rank, Foreground, Counters], columns),
        threads("plan", &PLAN, &[Counters], 1),
        indirect(
            "occupancy_constancy", &OCCUPANCY_CONSTANCY,
            &[StepNow, Weights, Costs, Foreground, Before, Now, Cost],
            GROUPS_ROWS,
        ),
        indirect("window", &WINDOW, &[StepNow, Foreground, Rank, Cost, Matching], GROUPS_ROWS),
    ]);
    let maximisation =
        [StepNow, Counters, Foreground, Proposal, TargetEnergy, TargetRank, State];
    for _ in 0..profile.em_rounds {
        ops.extend([
            indirect(
                "expectation", &EXPECTATION,
                &[StepNow, Counters, Foreground, Matching, State, TargetEnergy, Bound, Proposal],
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
        copy(Before, BeforeOut),
        copy(Foreground, ForegroundOut),
        copy(State, StateOut),
        copy(Proposal, ProposalOut),
    ]);
    Program { name: "flow", ops }
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

fn copy(from: Buffer, to: Buffer) -> Op {
    Op::Copy { from: from as usize, to: to as usize }
}

fn fill(buffer: Buffer, value: u32) -> Op {
    Op::Fill { buffer: buffer as usize, value }
}

/// A dispatch with a thread per item.
fn threads(name: &'static str, kernel: &'static Kernel, buffers: &[Buffer], items: usize) -> Op {
    groups(name, kernel, buffers, items.div_ceil(kernel.workgroup[0] as usize))
}

/// A dispatch of a number of workgroups.
fn groups(name: &'static str, kernel: &'static Kernel, buffers: &[Buffer], count: usize) -> Op {
    dispatch(name, kernel, buffers, Groups::Fixed([count as u32, 1, 1]))
}

/// A dispatch whose group count stands in the counters.
fn indirect(name: &'static str, kernel: &'static Kernel, buffers: &[Buffer], word: usize) -> Op {
    let at = Groups::Indirect { buffer: Buffer::Counters as usize, offset_bytes: 4 * word as u64 };
    dispatch(name, kernel, buffers, at)
}

fn dispatch(
    name: &'static str,
    kernel: &'static Kernel,
    buffers: &[Buffer],
    groups: Groups,
) -> Op {
    check_names(kernel, buffers);
    Op::Dispatch { name, kernel, buffers: buffers.iter().map(|b| *b as usize).collect(), groups }
}

/// A kernel's variables carry the names of the buffers bound to them, but for the prefix sum, which
/// serves several.
fn check_names(kernel: &Kernel, buffers: &[Buffer]) {
    for (binding, buffer) in kernel.bindings.iter().zip(buffers) {
        let name = BUFFERS[*buffer as usize].name;
        let general = ["values", "sums"].contains(&binding.name);
        assert!(general || binding.name == name, "{}: {name} at {}", kernel.name, binding.name);
    }
}

const _: () = assert!(WORKGROUP <= 256);
