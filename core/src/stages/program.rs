//! Stages in the order they run: the programs, and the walk through them.

use super::{Buffer, Stage, Storage};
use crate::params::Profile;
use crate::team::Workers;

/// A step of a program.
#[derive(Clone, Copy, Debug)]
pub enum StageOp {
    /// Copies a buffer from the host to the device.
    Upload(Buffer),
    /// Sets every word of a buffer.
    Fill(Buffer, u32),
    /// Runs a stage.
    Run(&'static Stage),
    /// One stage of the scalar backend that is several steps on a device.
    Fused(&'static Stage, &'static [StageOp]),
    /// A list of steps declared separately.
    Part(&'static [StageOp]),
    /// Steps repeated for every round of the energy minimisation.
    Rounds(&'static [StageOp]),
    /// Steps repeated a fixed number of times.
    Repeat(u32, &'static [StageOp]),
    /// Copies a buffer from the device to the host.
    ReadBack(Buffer),
}

/// Steps that run as a whole.
#[derive(Clone, Copy, Debug)]
pub struct StageProgram {
    /// Name, for messages and documents.
    pub name: &'static str,
    /// The steps, in order.
    pub ops: &'static [StageOp],
}

/// What runs a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Runner {
    /// The twins.
    Scalar,
    /// The kernels.
    Device,
}

/// Calls `each` with every upload, fill, stage and readback in the order they run.
pub fn walk(ops: &[StageOp], runner: Runner, rounds: u32, each: &mut dyn FnMut(StageOp)) {
    for op in ops {
        let (times, inner) = match *op {
            StageOp::Fused(stage, _) if runner == Runner::Scalar => {
                each(StageOp::Run(stage));
                continue;
            }
            StageOp::Fused(_, inner) | StageOp::Part(inner) => (1, inner),
            StageOp::Rounds(inner) => (rounds, inner),
            StageOp::Repeat(times, inner) => (times, inner),
            leaf => {
                each(leaf);
                continue;
            }
        };
        (0..times).for_each(|_| walk(inner, runner, rounds, each));
    }
}

/// Runs steps on the CPU. `lap` is called with the name of each stage when it is done.
pub fn run(
    ops: &[StageOp],
    storage: &mut Storage,
    rounds: u32,
    workers: &dyn Workers,
    lap: &mut dyn FnMut(&'static str),
) {
    walk(ops, Runner::Scalar, rounds, &mut |op| match op {
        StageOp::Fill(buffer, word) => storage.fill(buffer, word),
        StageOp::Run(stage) => {
            (stage.scalar)(storage, workers);
            lap(stage.name);
        }
        // The storage is the host's own memory.
        _ => {}
    });
}

impl StageOp {
    /// Whether this step, as passed on by [`walk`], touches a buffer.
    pub fn touches(&self, buffer: Buffer) -> bool {
        match *self {
            StageOp::Upload(b) | StageOp::ReadBack(b) | StageOp::Fill(b, _) => b == buffer,
            StageOp::Run(stage) => stage.bindings().any(|a| a.buffer == buffer),
            _ => false,
        }
    }
}

/// Whether any of the programs needs a buffer.
pub fn needed(programs: &[StageProgram], runner: Runner, buffer: Buffer) -> bool {
    let mut found = false;
    for program in programs {
        walk(program.ops, runner, 1, &mut |op| found |= op.touches(buffer));
    }
    found
}

impl Storage<'_> {
    /// Number of 32-bit words that the buffers of some programs take.
    pub fn words(programs: &[StageProgram], profile: &Profile) -> usize {
        Buffer::ALL.iter().map(|b| words_of(*b, programs, profile)).sum()
    }
}

/// Words of a buffer in the scalar backend's storage; the uniform is a field of its own.
pub(super) fn words_of(buffer: Buffer, programs: &[StageProgram], profile: &Profile) -> usize {
    let stored = buffer != Buffer::sweep && needed(programs, Runner::Scalar, buffer);
    if stored { buffer.row().bytes(profile).div_ceil(4) } else { 0 }
}
