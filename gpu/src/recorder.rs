//! Turns a program into a command buffer, with a barrier exactly where accesses conflict.

use crate::arena::Slot;
use crate::order::{Access, accesses, barriers};
use crate::owner::Gpu;
use crate::program::{Bindings, Pipelines};
use crate::timer::Timer;
use crate::{GpuError, Groups, Heap, Op, Program};
use ash::vk;
use vk::{AccessFlags as Touch, PipelineStageFlags as Stage};

/// A program ready to run.
pub(crate) struct Recorded {
    pub name: &'static str,
    pub commands: vk::CommandBuffer,
    pub timer: Timer,
}

/// Records `program`.
pub(crate) fn record(
    gpu: &mut Gpu,
    commands: vk::CommandBuffer,
    program: &Program,
    slots: &[Slot],
    pipelines: &Pipelines,
) -> Result<Recorded, GpuError> {
    let timer = Timer::new(gpu, program.ops.iter().map(Op::name).collect())?;
    let steps: Vec<_> = program.ops.iter().map(accesses).collect();
    let barriers = barriers(&steps, slots.len());
    gpu.census.barriers += barriers.iter().filter(|&&b| b).count() as u64;
    let read_by_host = |a: &Access| a.writes && slots[a.buffer].row.heap == Heap::Readback;
    let to_host = steps.iter().flatten().any(read_by_host);
    gpu.record(commands, |device| {
        let recorder = Recorder { device, commands, slots, pipelines };
        recorder.program(program, &barriers, timer.pool);
        if to_host {
            recorder.make_visible_to_host();
        }
    })?;
    Ok(Recorded { name: program.name, commands, timer })
}

struct Recorder<'a> {
    device: &'a ash::Device,
    commands: vk::CommandBuffer,
    slots: &'a [Slot],
    pipelines: &'a Pipelines,
}

impl Recorder<'_> {
    fn program(&self, program: &Program, barriers: &[bool], queries: Option<vk::QueryPool>) {
        if let Some(pool) = queries {
            let count = program.ops.len() as u32 + 1;
            // SAFETY: recording; the pool has this many queries.
            unsafe { self.device.cmd_reset_query_pool(self.commands, pool, 0, count) };
            self.timestamp(pool, 0);
        }
        for (i, (op, &barrier)) in program.ops.iter().zip(barriers).enumerate() {
            if barrier {
                self.barrier();
            }
            self.op(op);
            if let Some(pool) = queries {
                self.timestamp(pool, i as u32 + 1);
            }
        }
    }

    fn op(&self, op: &Op) {
        match op {
            &Op::Fill { buffer, value } => {
                let (whole, to) = (vk::WHOLE_SIZE, self.slots[buffer].handle);
                // SAFETY: recording; the buffer is a transfer target of whole words.
                unsafe { self.device.cmd_fill_buffer(self.commands, to, 0, whole, value) }
            }
            &Op::Copy { from, to } => {
                let (from, to) = (&self.slots[from], &self.slots[to]);
                let whole = [vk::BufferCopy::default().size(from.row.bytes)];
                let (from, to) = (from.handle, to.handle);
                // SAFETY: recording; the check made sure of two different buffers of equal size.
                unsafe { self.device.cmd_copy_buffer(self.commands, from, to, &whole) }
            }
            Op::Dispatch { kernel, buffers, groups, .. } => {
                let bound = self.pipelines.bound(kernel, buffers);
                self.dispatch(bound.expect("made from the same programs"), *groups);
            }
        }
    }

    fn dispatch(&self, bound: Bindings, groups: Groups) {
        let (device, commands) = (self.device, self.commands);
        let compute = vk::PipelineBindPoint::COMPUTE;
        let sets = [bound.set];
        // SAFETY: recording; the set was allocated with the layout the pipeline was created with,
        // and the check made sure that the counts are within limits or their place in the buffer.
        unsafe {
            device.cmd_bind_pipeline(commands, compute, bound.pipeline);
            device.cmd_bind_descriptor_sets(commands, compute, bound.layout, 0, &sets, &[]);
            match groups {
                Groups::Fixed([x, y, z]) => device.cmd_dispatch(commands, x, y, z),
                Groups::Indirect { buffer, offset_bytes } => {
                    let counts = self.slots[buffer].handle;
                    device.cmd_dispatch_indirect(commands, counts, offset_bytes);
                }
            }
        }
    }

    /// Orders everything before it against everything after it.
    fn barrier(&self) {
        let stages = Stage::TRANSFER | Stage::COMPUTE_SHADER | Stage::DRAW_INDIRECT;
        let written = Touch::TRANSFER_WRITE | Touch::SHADER_WRITE;
        let read = Touch::TRANSFER_READ
            | Touch::SHADER_READ
            | Touch::UNIFORM_READ
            | Touch::INDIRECT_COMMAND_READ;
        self.memory_barrier(stages, written, stages, read | written);
    }

    /// Makes writes visible through the host's mappings once the fence is signalled.
    fn make_visible_to_host(&self) {
        let stages = Stage::TRANSFER | Stage::COMPUTE_SHADER;
        let written = Touch::TRANSFER_WRITE | Touch::SHADER_WRITE;
        self.memory_barrier(stages, written, Stage::HOST, Touch::HOST_READ);
    }

    fn memory_barrier(&self, from: Stage, written: Touch, to: Stage, touched: Touch) {
        let barriers =
            [vk::MemoryBarrier::default().src_access_mask(written).dst_access_mask(touched)];
        let none = vk::DependencyFlags::empty();
        // SAFETY: recording; the stages exist on a compute queue and match the accesses.
        unsafe {
            self.device.cmd_pipeline_barrier(self.commands, from, to, none, &barriers, &[], &[]);
        }
    }

    /// Records a timestamp, taken when everything recorded so far has finished.
    fn timestamp(&self, pool: vk::QueryPool, query: u32) {
        let stage = Stage::BOTTOM_OF_PIPE;
        // SAFETY: recording; the query is in the pool and was reset at the start.
        unsafe { self.device.cmd_write_timestamp(self.commands, stage, pool, query) };
    }
}
