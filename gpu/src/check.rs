//! Refuses schedules that contradict themselves or the device's limits, before anything is made.

use crate::{Buffer, GpuError, Groups, Heap, Kernel, Limits, Op, Program};

const SPIRV_MAGIC: u32 = 0x0723_0203;
const INDIRECT_BYTES: u64 = 12;

/// Ok if every program can be recorded as it stands.
pub(crate) fn schedule(
    limits: &Limits,
    table: &[Buffer],
    programs: &[Program],
) -> Result<(), GpuError> {
    for row in table {
        let whole = row.bytes > 0 && row.bytes % 4 == 0;
        whole
            .or_else(|| format!("{} bytes are not whole words", row.bytes))
            .map_err(at("the buffer table", row.name))?;
    }
    for program in programs {
        for op in &program.ops {
            step(limits, table, op).map_err(at(program.name, op.name()))?;
        }
    }
    distinct(programs)
}

fn at(program: &'static str, dispatch: &'static str) -> impl Fn(String) -> GpuError {
    move |what| GpuError::Schedule { program, dispatch, what }
}

/// Reads as: this holds, or else here is what is wrong.
trait OrElse {
    fn or_else(self, what: impl FnOnce() -> String) -> Result<(), String>;
}

impl OrElse for bool {
    fn or_else(self, what: impl FnOnce() -> String) -> Result<(), String> {
        if self { Ok(()) } else { Err(what()) }
    }
}

fn step(limits: &Limits, table: &[Buffer], op: &Op) -> Result<(), String> {
    match op {
        Op::Fill { buffer, .. } => written(find(table, *buffer)?),
        Op::Copy { from, to } => {
            let (source, target) = (find(table, *from)?, find(table, *to)?);
            (from != to).or_else(|| format!("copies {} onto itself", source.name))?;
            (source.bytes == target.bytes).or_else(|| {
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
    let missing = || format!("there is no buffer {index}, only {}", table.len());
    table.get(index).ok_or_else(missing)
}

/// The host may hold a mutable borrow of an upload buffer's contents, so nobody else writes there.
fn written(buffer: &Buffer) -> Result<(), String> {
    (buffer.heap != Heap::Upload).or_else(|| format!("writes the upload buffer {}", buffer.name))
}

fn shader(limits: &Limits, kernel: &Kernel) -> Result<(), String> {
    let name = kernel.name;
    (kernel.spirv.first() == Some(&SPIRV_MAGIC))
        .or_else(|| format!("kernel {name} is not SPIR-V"))?;
    (!kernel.entry.contains('\0')).or_else(|| format!("kernel {name} has a zero in its entry"))?;
    let invocations: u64 = kernel.workgroup.iter().map(|&n| u64::from(n)).product();
    let axes = kernel.workgroup.iter().zip(&limits.workgroup);
    let fits = axes.into_iter().all(|(n, max)| n <= max);
    (fits && invocations <= limits.invocations.into()).or_else(|| {
        let (size, most) = (kernel.workgroup, limits.invocations);
        format!("kernel {name} has workgroups of {size:?}, the device allows {most} invocations")
    })
}

fn bound(
    limits: &Limits,
    table: &[Buffer],
    kernel: &Kernel,
    buffers: &[usize],
) -> Result<(), String> {
    let (name, given, expected) = (kernel.name, buffers.len(), kernel.bindings.len());
    (given == expected)
        .or_else(|| format!("kernel {name} has {expected} bindings, {given} buffers are given"))?;
    (expected <= limits.storage_buffers as usize)
        .or_else(|| format!("binds {expected} buffers of {} allowed", limits.storage_buffers))?;
    for (i, (&buffer, binding)) in buffers.iter().zip(kernel.bindings).enumerate() {
        let row = find(table, buffer)?;
        let most = limits.storage_buffer_bytes;
        (row.bytes <= most)
            .or_else(|| format!("{} has {} bytes of {most} bindable", row.name, row.bytes))?;
        if binding.writes {
            written(row)?;
            // Shaders may take what they write for not aliased.
            let mut others = (0..given).filter(|&j| j != i);
            let alone = others.all(|j| buffers[j] != buffer);
            alone.or_else(|| format!("{} is bound twice and written", row.name))?;
        }
    }
    Ok(())
}

fn counts(limits: &Limits, table: &[Buffer], groups: &Groups) -> Result<(), String> {
    match *groups {
        Groups::Fixed(counts) => {
            let fits = counts.iter().zip(&limits.workgroups).all(|(n, max)| n <= max);
            fits.or_else(|| format!("{counts:?} groups of {:?} allowed", limits.workgroups))
        }
        Groups::Indirect { buffer, offset_bytes: offset } => {
            let row = find(table, buffer)?;
            let inside = offset.checked_add(INDIRECT_BYTES);
            let inside = inside.is_some_and(|end| end <= row.bytes);
            (offset % 4 == 0 && inside)
                .or_else(|| format!("no group counts at byte {offset} of {}", row.name))
        }
    }
}

/// Kernels are told apart by name and entry, so equal ones have to be equal throughout.
fn distinct(programs: &[Program]) -> Result<(), GpuError> {
    let mut seen: Vec<&Kernel> = Vec::new();
    for program in programs {
        for op in &program.ops {
            let Op::Dispatch { kernel, .. } = op else {
                continue;
            };
            let namesake = |k: &&&Kernel| (k.name, k.entry) == (kernel.name, kernel.entry);
            match seen.iter().find(namesake) {
                None => seen.push(kernel),
                Some(first) => (first.spirv == kernel.spirv
                    && first.bindings.len() == kernel.bindings.len())
                .or_else(|| format!("two different kernels are called {}", kernel.name))
                .map_err(at(program.name, op.name()))?,
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
