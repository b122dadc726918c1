//! Rejects schedules that contradict themselves or the device's limits, before anything is created.

use crate::{Buffer, GpuError, Groups, Heap, Kernel, Limits, Op, Program};

const SPIRV_MAGIC: u32 = 0x0723_0203;
const INDIRECT_BYTES: u64 = 12;

/// Returns `Ok` if every program can be recorded as it is.
pub(crate) fn schedule(
    limits: &Limits,
    table: &[Buffer],
    programs: &[Program],
) -> Result<(), GpuError> {
    for row in table {
        whole(row).map_err(at("the buffer table", row.name))?;
    }
    for program in programs {
        for op in &program.ops {
            step(limits, table, op).map_err(at(program.name, op.name()))?;
        }
    }
    Ok(())
}

fn at(program: &'static str, dispatch: &'static str) -> impl Fn(String) -> GpuError {
    move |what| GpuError::Schedule { program, dispatch, what }
}

fn ensure(holds: bool, otherwise: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(otherwise()) }
}

fn whole(row: &Buffer) -> Result<(), String> {
    let words = row.bytes > 0 && row.bytes.is_multiple_of(4);
    ensure(words, || format!("{} bytes is not a whole number of words", row.bytes))
}

fn step(limits: &Limits, table: &[Buffer], op: &Op) -> Result<(), String> {
    match op {
        Op::Fill { buffer, .. } => written(find(table, *buffer)?),
        Op::Copy { from, to } => {
            let (source, target) = (find(table, *from)?, find(table, *to)?);
            ensure(from != to, || format!("copies {} onto itself", source.name))?;
            ensure(source.bytes == target.bytes, || {
                let (from, to) = (source.name, target.name);
                format!("{from} has {} bytes, {to} {}", source.bytes, target.bytes)
            })?;
            written(target)
        }
        Op::Dispatch { kernel, buffers, groups, .. } => {
            shader(limits, kernel)?;
            bound(limits, table, kernel, buffers)?;
            counts(limits, table, groups)
        }
    }
}

fn find(table: &[Buffer], index: usize) -> Result<&Buffer, String> {
    let missing = || format!("there is no buffer {index}, the table has {}", table.len());
    table.get(index).ok_or_else(missing)
}

/// The host may hold a mutable borrow of an upload buffer's contents, so the device must not write.
fn written(buffer: &Buffer) -> Result<(), String> {
    ensure(buffer.heap != Heap::Upload, || format!("writes to the upload buffer {}", buffer.name))
}

fn shader(limits: &Limits, kernel: &Kernel) -> Result<(), String> {
    let name = kernel.name;
    let spirv = kernel.spirv.words().first() == Some(&SPIRV_MAGIC);
    ensure(spirv, || format!("kernel {name} is not SPIR-V"))?;
    ensure(!name.contains('\0'), || format!("kernel {name:?} has a zero in its name"))?;
    let invocations: u64 = kernel.workgroup.iter().map(|&n| u64::from(n)).product();
    let axes = kernel.workgroup.iter().zip(&limits.workgroup);
    let fits = axes.into_iter().all(|(n, max)| n <= max);
    ensure(fits && invocations <= limits.invocations.into(), || {
        let (size, most) = (kernel.workgroup, limits.invocations);
        format!("kernel {name} has workgroups of {size:?}, the device allows {most} invocations")
    })
}

/// Size of a uniform buffer that every Vulkan device can bind.
const UNIFORM_BYTES: u64 = 16 << 10;

fn bound(
    limits: &Limits,
    table: &[Buffer],
    kernel: &Kernel,
    buffers: &[usize],
) -> Result<(), String> {
    let (name, given, expected) = (kernel.name, buffers.len(), kernel.bindings.len());
    ensure(given == expected, || {
        format!("kernel {name} has {expected} bindings, {given} buffers are given")
    })?;
    let storage = kernel.bindings.iter().filter(|b| !b.uniform).count();
    let most = limits.storage_buffers;
    ensure(storage <= most as usize, || {
        format!("binds {storage} storage buffers, the device allows {most}")
    })?;
    for (i, (&buffer, binding)) in buffers.iter().zip(kernel.bindings).enumerate() {
        let row = find(table, buffer)?;
        let most = if binding.uniform { UNIFORM_BYTES } else { limits.storage_buffer_bytes };
        let text = || format!("{} has {} bytes, at most {most} can be bound", row.name, row.bytes);
        ensure(row.bytes <= most, text)?;
        if binding.writes {
            written(row)?;
            // Shaders may assume that what they write is not aliased.
            let mut others = (0..given).filter(|&j| j != i);
            let alone = others.all(|j| buffers[j] != buffer);
            ensure(alone, || format!("{} is bound twice and written to", row.name))?;
        }
    }
    Ok(())
}

fn counts(limits: &Limits, table: &[Buffer], groups: &Groups) -> Result<(), String> {
    match *groups {
        Groups::Fixed(counts) => {
            let fits = counts.iter().zip(&limits.workgroups).all(|(n, max)| n <= max);
            ensure(fits, || format!("{counts:?} groups, the device allows {:?}", limits.workgroups))
        }
        Groups::Indirect { buffer, offset_bytes: offset } => {
            let row = find(table, buffer)?;
            let inside = offset.checked_add(INDIRECT_BYTES);
            let inside = inside.is_some_and(|end| end <= row.bytes);
            let place = || format!("no group counts at byte {offset} of {}", row.name);
            ensure(offset.is_multiple_of(4) && inside, place)
        }
    }
}

#[cfg(test)]
mod tests;
