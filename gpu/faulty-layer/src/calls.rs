//! The functions that may fail.

use crate::{BUSY, FAULT, GARBAGE, NULL};
use ash::vk::{self, Handle};
use std::collections::BTreeMap;
use std::ffi::c_void;
use std::ptr;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Sizes of allocations in bytes, and the addresses of those that are mapped, by handle.
static ALLOCATED: Mutex<BTreeMap<u64, u64>> = Mutex::new(BTreeMap::new());
static MAPPED: Mutex<BTreeMap<u64, usize>> = Mutex::new(BTreeMap::new());

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What [`FAULT`] says.
struct FaultyCalls {
    function: String,
    /// The number of the first call that fails.
    from: u64,
    /// Whether only its multiples fail, not all calls after it.
    each: bool,
    /// What a failing call returns.
    result: i32,
}

impl FaultyCalls {
    fn read() -> Option<FaultyCalls> {
        let text = std::env::var(FAULT).ok()?;
        let (text, each) = text.strip_suffix(" each").map_or((&*text, false), |text| (text, true));
        let [function, from, result] = *text.split(' ').collect::<Vec<_>>() else { return None };
        let (from, result) = (from.parse().ok()?, result.parse().ok()?);
        Some(FaultyCalls { function: function.into(), from, each, result })
    }

    fn fails(&self, call: u64) -> bool {
        if self.each { call.is_multiple_of(self.from) } else { call >= self.from }
    }
}

/// Counts a call of a function. Returns what the call is to return instead, if it is to fail.
pub fn fault(name: &str) -> Option<i32> {
    static CALLS: Mutex<u64> = Mutex::new(0);
    let wanted = FaultyCalls::read().filter(|wanted| wanted.function == name)?;
    let mut calls = locked(&CALLS);
    *calls += 1;
    wanted.fails(*calls).then_some(wanted.result)
}

/// Performs a call of a function, or fails it; `next` performs it.
fn call(name: &str, next: impl FnOnce() -> vk::Result) -> vk::Result {
    match fault(name) {
        None => next(),
        Some(NULL) => vk::Result::SUCCESS,
        Some(BUSY) => vk::Result::ERROR_DEVICE_LOST,
        Some(GARBAGE) => littered(next()),
        Some(result) => {
            let _ = (name == "vkWaitForFences").then(next);
            vk::Result::from_raw(result)
        }
    }
}

/// A function as it is handed out.
pub fn handed_out(function: *const c_void) -> vk::PFN_vkVoidFunction {
    // SAFETY: whoever asks for a function by name casts it to the type of that name.
    unsafe { std::mem::transmute::<*const c_void, vk::PFN_vkVoidFunction>(function) }
}

/// Fills a mapped allocation with ones.
fn litter(memory: u64, address: usize) {
    let bytes = locked(&ALLOCATED).get(&memory).copied().unwrap_or(0) as usize;
    // SAFETY: the memory is mapped there as a whole, and the device has been waited for.
    unsafe { (address as *mut u8).write_bytes(0xff, bytes) };
}

/// Fills all mapped memory with ones.
fn littered(result: vk::Result) -> vk::Result {
    locked(&MAPPED).iter().for_each(|(&memory, &address)| litter(memory, address));
    result
}

/// The function whose address is stored in `at`.
///
/// # Safety
/// The address is that of a function of this type.
pub unsafe fn kept<F: Copy>(at: &AtomicUsize) -> F {
    // SAFETY: the caller's promise; function pointers have the size of addresses.
    unsafe { std::mem::transmute_copy(&at.load(Relaxed)) }
}

macro_rules! calls {
    ($(
        $name:ident($($arg:ident: $type:ty),*) $(before $before:block)? $(after $after:block)?;
    )*) => {
        /// Names of the functions that may fail, except those that create the instance and device.
        pub const NAMES: &[&str] = &[$(stringify!($name)),*];

        $(#[allow(non_snake_case)]
        mod $name {
            use super::*;

            /// Address of the next function of this name.
            pub static NEXT: AtomicUsize = AtomicUsize::new(0);
            type Next = unsafe extern "system" fn($($type),*) -> vk::Result;

            /// # Safety
            /// As the function of that name.
            pub unsafe extern "system" fn call($($arg: $type),*) -> vk::Result {
                $($before)?
                let result = super::call(stringify!($name), || {
                    // SAFETY: `take` has put the address there.
                    let next: Next = unsafe { kept(&NEXT) };
                    // SAFETY: with the arguments of this call.
                    unsafe { next($($arg),*) }
                });
                $(if result == vk::Result::SUCCESS $after)?
                result
            }
        })*

        /// This layer's function of a name, keeping the next one's address, or else the next one's.
        pub fn take(name: &[u8], next: vk::PFN_vkVoidFunction) -> vk::PFN_vkVoidFunction {
            $(if name == stringify!($name).as_bytes() {
                $name::NEXT.store(next? as usize, Relaxed);
                return handed_out($name::call as *const c_void);
            })*
            next
        }
    };
}

type Allocator = *const vk::AllocationCallbacks<'static>;

calls! {
    vkEnumeratePhysicalDevices(
        instance: vk::Instance, count: *mut u32, devices: *mut vk::PhysicalDevice
    );
    vkAllocateMemory(
        device: vk::Device, info: *const vk::MemoryAllocateInfo<'static>, allocator: Allocator,
        memory: *mut vk::DeviceMemory
    ) after {
        // SAFETY: both are valid, and the latter has been written.
        let (bytes, memory) = unsafe { ((*info).allocation_size, *memory) };
        locked(&ALLOCATED).insert(memory.as_raw(), bytes);
    };
    vkMapMemory(
        device: vk::Device, memory: vk::DeviceMemory, offset: u64, size: u64,
        flags: vk::MemoryMapFlags, data: *mut *mut c_void
    ) before {
        // SAFETY: the caller's place for the address.
        unsafe { *data = ptr::null_mut() };
    } after {
        // SAFETY: the same.
        let address = unsafe { *data } as usize;
        if address != 0 {
            locked(&MAPPED).insert(memory.as_raw(), address);
        }
    };
    vkBindBufferMemory(
        device: vk::Device, buffer: vk::Buffer, memory: vk::DeviceMemory, offset: u64
    );
    vkCreateBuffer(
        device: vk::Device, info: *const vk::BufferCreateInfo<'static>, allocator: Allocator,
        buffer: *mut vk::Buffer
    );
    vkCreateShaderModule(
        device: vk::Device, info: *const vk::ShaderModuleCreateInfo<'static>, allocator: Allocator,
        module: *mut vk::ShaderModule
    );
    vkCreateDescriptorSetLayout(
        device: vk::Device, info: *const vk::DescriptorSetLayoutCreateInfo<'static>,
        allocator: Allocator, layout: *mut vk::DescriptorSetLayout
    );
    vkCreatePipelineLayout(
        device: vk::Device, info: *const vk::PipelineLayoutCreateInfo<'static>,
        allocator: Allocator, layout: *mut vk::PipelineLayout
    );
    vkCreateComputePipelines(
        device: vk::Device, cache: vk::PipelineCache, count: u32,
        infos: *const vk::ComputePipelineCreateInfo<'static>, allocator: Allocator,
        pipelines: *mut vk::Pipeline
    );
    vkCreateDescriptorPool(
        device: vk::Device, info: *const vk::DescriptorPoolCreateInfo<'static>,
        allocator: Allocator, pool: *mut vk::DescriptorPool
    );
    vkAllocateDescriptorSets(
        device: vk::Device, info: *const vk::DescriptorSetAllocateInfo<'static>,
        sets: *mut vk::DescriptorSet
    );
    vkCreateCommandPool(
        device: vk::Device, info: *const vk::CommandPoolCreateInfo<'static>, allocator: Allocator,
        pool: *mut vk::CommandPool
    );
    vkAllocateCommandBuffers(
        device: vk::Device, info: *const vk::CommandBufferAllocateInfo<'static>,
        buffers: *mut vk::CommandBuffer
    );
    vkBeginCommandBuffer(
        commands: vk::CommandBuffer, info: *const vk::CommandBufferBeginInfo<'static>
    );
    vkEndCommandBuffer(commands: vk::CommandBuffer);
    vkCreateQueryPool(
        device: vk::Device, info: *const vk::QueryPoolCreateInfo<'static>, allocator: Allocator,
        pool: *mut vk::QueryPool
    );
    vkCreateFence(
        device: vk::Device, info: *const vk::FenceCreateInfo<'static>, allocator: Allocator,
        fence: *mut vk::Fence
    );
    vkResetFences(device: vk::Device, count: u32, fences: *const vk::Fence);
    vkQueueSubmit(
        queue: vk::Queue, count: u32, submits: *const vk::SubmitInfo<'static>, fence: vk::Fence
    );
    vkWaitForFences(
        device: vk::Device, count: u32, fences: *const vk::Fence, all: vk::Bool32, timeout: u64
    );
    vkGetQueryPoolResults(
        device: vk::Device, pool: vk::QueryPool, first: u32, count: u32, bytes: usize,
        data: *mut c_void, stride: u64, flags: vk::QueryResultFlags
    );
}
