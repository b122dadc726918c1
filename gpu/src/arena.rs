//! The buffer table in memory: one block per heap and one Vulkan buffer per row.

use crate::error::failed;
use crate::owner::Gpu;
use crate::{Buffer, GpuError, Heap};
use ash::vk;
use std::ptr::NonNull;

/// A buffer placed in memory.
pub(crate) struct Slot {
    pub row: Buffer,
    pub handle: vk::Buffer,
    mapped: Option<NonNull<u32>>,
}

// SAFETY: the mapping belongs to this slot alone and may be used from any one thread.
unsafe impl Send for Slot {}

impl Slot {
    fn words(&self) -> usize {
        (self.row.bytes / 4) as usize
    }

    /// The words; `None` in `Heap::Device`. The device must not be writing to the buffer.
    pub fn mapped(&self) -> Option<&[u32]> {
        // SAFETY: `allocate` mapped and zeroed this many words, which no other slot overlaps; they
        // stay mapped as long as the executor that owns the slot lives, and borrow from it.
        self.mapped.map(|p| unsafe { std::slice::from_raw_parts(p.as_ptr(), self.words()) })
    }

    /// The words; `None` in `Heap::Device`. The device must not be using the buffer.
    pub fn mapped_mut(&mut self) -> Option<&mut [u32]> {
        // SAFETY: as in `mapped`, and the borrow is exclusive.
        self.mapped.map(|p| unsafe { std::slice::from_raw_parts_mut(p.as_ptr(), self.words()) })
    }
}

/// Creates and places all buffers, in at most three allocations. Mapped ones are zeroed.
pub(crate) fn allocate(gpu: &mut Gpu, table: &[Buffer]) -> Result<Vec<Slot>, GpuError> {
    let mut slots: Vec<Option<Slot>> = table.iter().map(|_| None).collect();
    for heap in [Heap::Upload, Heap::Device, Heap::Readback] {
        let rows: Vec<usize> = (0..table.len()).filter(|&i| table[i].heap == heap).collect();
        if !rows.is_empty() {
            allocate_heap(gpu, heap, table, &rows, &mut slots)?;
        }
    }
    // Every row has one of the three heaps.
    Ok(slots.into_iter().flatten().collect())
}

fn allocate_heap(
    gpu: &mut Gpu,
    heap: Heap,
    table: &[Buffer],
    rows: &[usize],
    slots: &mut [Option<Slot>],
) -> Result<(), GpuError> {
    let least = rows.iter().fold(0u64, |sum, &row| sum.saturating_add(table[row].bytes));
    let properties = gpu.memory_properties();
    let largest = properties.memory_heaps_as_slice().iter().map(|h| h.size);
    fits(gpu, heap, least, largest.max().unwrap_or(0))?;

    let handles = rows.iter().map(|&row| gpu.buffer(table[row].bytes));
    let handles: Vec<_> =
        handles.collect::<Result<_, _>>().map_err(exhausted("vkCreateBuffer", heap, least))?;
    let need = |(&row, &handle): (&usize, &vk::Buffer)| {
        let need = gpu.requirements(handle);
        // Never less, even if a driver says so: buffers would overlap or exceed the block.
        vk::MemoryRequirements { size: need.size.max(table[row].bytes), ..need }
    };
    let needs: Vec<_> = rows.iter().zip(&handles).map(need).collect();
    let (offsets, bytes) = place(&needs, gpu.info().limits.storage_alignment_bytes);
    let usable = needs.iter().fold(!0, |bits, n| bits & n.memory_type_bits);
    let kind = memory_type(&properties, usable, heap).ok_or_else(|| GpuError::Unsupported {
        device: gpu.info().name.clone(),
        what: format!("memory for the {heap:?} heap"),
    })?;
    let heap_index = properties.memory_types[kind as usize].heap_index;
    let available = properties.memory_heaps[heap_index as usize].size;
    fits(gpu, heap, bytes, available)?;

    let memory =
        gpu.memory(heap, bytes, kind).map_err(exhausted("vkAllocateMemory", heap, bytes))?;
    let base = match heap {
        Heap::Device => None,
        Heap::Upload | Heap::Readback => Some(mapped_zeros(gpu, memory, bytes)?),
    };
    for ((&row, &handle), &offset) in rows.iter().zip(&handles).zip(&offsets) {
        gpu.bind(handle, memory, offset)?;
        // SAFETY: `place` keeps every buffer within the block, at a multiple of four.
        let mapped = base.map(|base| unsafe { base.add(offset as usize).cast() });
        slots[row] = Some(Slot { row: table[row], handle, mapped });
    }
    Ok(())
}

fn mapped_zeros(gpu: &Gpu, memory: vk::DeviceMemory, bytes: u64) -> Result<NonNull<u8>, GpuError> {
    let base = NonNull::new(gpu.map(memory)?).ok_or(GpuError::Vulkan {
        call: "vkMapMemory",
        result: vk::Result::ERROR_MEMORY_MAP_FAILED,
    })?;
    // SAFETY: the whole block was just mapped, and nothing else has access to it yet.
    unsafe { base.write_bytes(0, bytes as usize) };
    Ok(base)
}

fn fits(gpu: &Gpu, heap: Heap, bytes: u64, available: u64) -> Result<(), GpuError> {
    if bytes <= available.min(gpu.info().limits.allocation_bytes) {
        return Ok(());
    }
    Err(GpuError::OutOfMemory { heap, bytes })
}

fn exhausted(call: &'static str, heap: Heap, bytes: u64) -> impl Fn(vk::Result) -> GpuError {
    move |result| match result {
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
            GpuError::OutOfMemory { heap, bytes }
        }
        _ => failed(call)(result),
    }
}

/// Places one buffer after another: their offsets and the size of the block, `u64::MAX` if it
/// overflows.
fn place(needs: &[vk::MemoryRequirements], alignment: u64) -> (Vec<u64>, u64) {
    let mut end = 0u64;
    let place_one = |need: &vk::MemoryRequirements| {
        let offset = end.checked_next_multiple_of(need.alignment.max(alignment).max(4));
        let offset = offset.unwrap_or(u64::MAX);
        end = offset.saturating_add(need.size);
        offset
    };
    (needs.iter().map(place_one).collect(), end)
}

/// The first memory type that suits the heap best. Drivers list the faster of equal ones first.
fn memory_type(
    properties: &vk::PhysicalDeviceMemoryProperties,
    usable: u32,
    heap: Heap,
) -> Option<u32> {
    use vk::MemoryPropertyFlags as Flags;
    // Always coherent, so that a run needs no flush or invalidation.
    let host = Flags::HOST_VISIBLE | Flags::HOST_COHERENT;
    let wanted: &[Flags] = match heap {
        Heap::Upload => &[host],
        Heap::Device => &[Flags::DEVICE_LOCAL],
        Heap::Readback => &[host | Flags::HOST_CACHED, host],
    };
    let types = properties.memory_types_as_slice();
    let first = |wanted: &Flags| {
        let suits = |&i: &usize| usable >> i & 1 == 1 && types[i].property_flags.contains(*wanted);
        (0..types.len()).find(suits).map(|i| i as u32)
    };
    wanted.iter().find_map(first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use vk::MemoryPropertyFlags as Flags;

    fn need(size: u64, alignment: u64) -> vk::MemoryRequirements {
        vk::MemoryRequirements { size, alignment, memory_type_bits: 1 }
    }

    #[test]
    fn buffers_are_placed_aligned_and_apart() {
        let needs = [need(20, 4), need(100, 64), need(4, 1)];
        assert_eq!(place(&needs, 16), (vec![0, 64, 176], 180));
        assert_eq!(place(&needs, 256), (vec![0, 256, 512], 516));
        assert_eq!(place(&[], 16), (vec![], 0));
        // From a driver that reports nonsense.
        assert_eq!(place(&[need(u64::MAX - 7, 4), need(20, 4)], 16).1, u64::MAX);
        assert_eq!(place(&[need(20, 4), need(20, 1 << 63), need(20, 1 << 63)], 16).1, u64::MAX);
    }

    #[test]
    fn readback_prefers_cached_memory() {
        let mut properties =
            vk::PhysicalDeviceMemoryProperties { memory_type_count: 3, ..Default::default() };
        let host = Flags::HOST_VISIBLE | Flags::HOST_COHERENT;
        let kinds = [Flags::DEVICE_LOCAL, host, host | Flags::HOST_CACHED];
        for (to, flags) in properties.memory_types.iter_mut().zip(kinds) {
            to.property_flags = flags;
        }
        let choose = |usable, heap| memory_type(&properties, usable, heap);
        assert_eq!(choose(0b111, Heap::Device), Some(0));
        assert_eq!(choose(0b111, Heap::Upload), Some(1));
        assert_eq!(choose(0b111, Heap::Readback), Some(2));
        assert_eq!(choose(0b011, Heap::Readback), Some(1));
        assert_eq!(choose(0b110, Heap::Device), None);
    }
}
