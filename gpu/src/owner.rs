//! The logical device and everything created from it.
//!
//! Every create, allocate, record and update call of the crate goes through [`Gpu`], which counts
//! what it creates and remembers what has to be destroyed: the census and the clean-up are complete
//! because there is no other way to the device. All these calls take `&mut Gpu`, which is gone
//! after set-up: from then on the executor has only shared access ([`ReadyDevice`]), so that code
//! that creates something during a run does not compile.

mod create;

use crate::GpuError;
use crate::device::{DeviceInfo, Physical};
use crate::error::failed;
use crate::instance::Instance;
use ash::vk;
use std::mem::ManuallyDrop;
use std::ops::Deref;
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

/// What an executor has created so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Census {
    /// Number of calls to `vkAllocateMemory`; at most three.
    pub memory_allocations: u64,
    /// Bytes allocated in [`crate::Heap::Upload`].
    pub upload_bytes: u64,
    /// Bytes allocated in [`crate::Heap::Device`].
    pub device_bytes: u64,
    /// Bytes allocated in [`crate::Heap::Readback`].
    pub readback_bytes: u64,
    /// Number of Vulkan objects created, including memory.
    pub objects: u64,
    /// Number of barriers recorded between the steps of all programs.
    pub barriers: u64,
}

enum Object {
    Buffer(vk::Buffer),
    Memory(vk::DeviceMemory),
    Shader(vk::ShaderModule),
    SetLayout(vk::DescriptorSetLayout),
    PipelineLayout(vk::PipelineLayout),
    Pipeline(vk::Pipeline),
    DescriptorPool(vk::DescriptorPool),
    CommandPool(vk::CommandPool),
    QueryPool(vk::QueryPool),
    Fence(vk::Fence),
}

/// A logical device with one queue. Dropping it destroys everything it created, so nothing may
/// still be running.
pub(crate) struct Gpu {
    raw: ash::Device,
    queue: vk::Queue,
    owned: Vec<Object>,
    pub census: Census,
    pub physical: Physical,
    // Last, because fields are dropped in order.
    pub instance: Instance,
}

impl Gpu {
    pub fn new(instance: Instance, physical: Physical) -> Result<Self, GpuError> {
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(physical.queue_family)
            .queue_priorities(&[1.0])];
        let features = match instance.messages() {
            Some(_) => instrumentation(&instance, &physical),
            None => vk::PhysicalDeviceFeatures::default(),
        };
        let info =
            vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_features(&features);
        // SAFETY: the physical device belongs to this instance and offers the family and features.
        let raw = unsafe { instance.raw().create_device(physical.handle, &info, None) }
            .map_err(failed("vkCreateDevice"))?;
        // SAFETY: one queue of this family was just requested.
        let queue = unsafe { raw.get_device_queue(physical.queue_family, 0) };
        Ok(Self { raw, queue, owned: Vec::new(), census: Census::default(), physical, instance })
    }

    pub fn info(&self) -> &DeviceInfo {
        &self.physical.info
    }

    fn own<T: Copy>(&mut self, handle: T, object: fn(T) -> Object) -> T {
        self.census.objects += 1;
        self.owned.push(object(handle));
        handle
    }

    /// Begins `commands`, has `record` fill it, and ends it.
    pub fn record<R>(
        &mut self,
        commands: vk::CommandBuffer,
        record: impl FnOnce(&ash::Device) -> R,
    ) -> Result<R, GpuError> {
        // SAFETY: the command buffer belongs to this device and was not begun before.
        unsafe { self.raw.begin_command_buffer(commands, &Default::default()) }
            .map_err(failed("vkBeginCommandBuffer"))?;
        let result = record(&self.raw);
        // SAFETY: it is in the recording state.
        unsafe { self.raw.end_command_buffer(commands) }.map_err(failed("vkEndCommandBuffer"))?;
        Ok(result)
    }

    /// Starts recorded commands; nothing else may be running. An error names the call that failed.
    pub fn submit(
        &self,
        commands: vk::CommandBuffer,
        fence: vk::Fence,
    ) -> Result<(), (&'static str, vk::Result)> {
        let commands = [commands];
        let submit = [vk::SubmitInfo::default().command_buffers(&commands)];
        // SAFETY: the executor runs one program at a time, so fence and commands are idle;
        // everything the commands refer to lives as long as `self`.
        unsafe {
            self.raw.reset_fences(&[fence]).map_err(|result| ("vkResetFences", result))?;
            let submitted = self.raw.queue_submit(self.queue, &submit, fence);
            submitted.map_err(|result| ("vkQueueSubmit", result))
        }
    }

    /// Whether the submitted commands finished in time.
    pub fn wait(&self, fence: vk::Fence, timeout: Duration) -> Result<bool, vk::Result> {
        let ns = u64::try_from(timeout.as_nanos()).unwrap_or(u64::MAX);
        // SAFETY: the fence belongs to this device.
        match unsafe { self.raw.wait_for_fences(&[fence], true, ns) } {
            Ok(()) => Ok(true),
            Err(vk::Result::TIMEOUT) => Ok(false),
            Err(result) => Err(result),
        }
    }

    /// Whether the device becomes idle in time. The call that waits for this has no limit of its
    /// own; if it does not return, neither does its thread.
    pub fn is_idle_within(&self, timeout: Duration) -> bool {
        let (device, (idle, found)) = (self.raw.clone(), mpsc::channel());
        let wait = move || {
            // SAFETY: the device is destroyed only after this has returned, and nobody submits. A
            // lost device is idle, too.
            let _ = unsafe { device.device_wait_idle() };
            // Nobody is listening any more if this took too long.
            let _ = idle.send(());
        };
        let started = thread::Builder::new().spawn(wait);
        started.is_ok() && found.recv_timeout(timeout).is_ok()
    }

    /// Reads timestamps as (ticks, available), without waiting for any. Those that cannot be read
    /// are marked as not available.
    pub fn timestamps(&self, pool: vk::QueryPool, ticks: &mut [[u64; 2]]) {
        ticks.fill([0; 2]);
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        // SAFETY: `ticks` has one element per query of the pool, of the size the flags imply.
        // An error shows in the elements.
        let _ = unsafe { self.raw.get_query_pool_results(pool, 0, ticks, flags) };
    }
}

/// A device whose set-up is over.
pub(crate) struct ReadyDevice(ManuallyDrop<Gpu>);

impl ReadyDevice {
    pub fn new(gpu: Gpu) -> Self {
        Self(ManuallyDrop::new(gpu))
    }

    /// Destroys everything. If this is never called, all of it is leaked.
    ///
    /// # Safety
    /// Nothing may be running, and `self` must not be used again.
    pub unsafe fn destroy(&mut self) {
        // SAFETY: the caller's promise.
        unsafe { ManuallyDrop::drop(&mut self.0) }
    }
}

impl Deref for ReadyDevice {
    type Target = Gpu;

    fn deref(&self) -> &Gpu {
        &self.0
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        while let Some(object) = self.owned.pop() {
            // SAFETY: nothing runs any more, and what was created later is already destroyed.
            unsafe { destroy(&self.raw, object) };
        }
        // SAFETY: everything created from the device is destroyed.
        unsafe { self.raw.destroy_device(None) };
    }
}

/// # Safety
/// The object must belong to this device, not be in use, and not be used again.
unsafe fn destroy(device: &ash::Device, object: Object) {
    // SAFETY: the caller's promise.
    unsafe {
        match object {
            Object::Buffer(it) => device.destroy_buffer(it, None),
            Object::Memory(it) => device.free_memory(it, None),
            Object::Shader(it) => device.destroy_shader_module(it, None),
            Object::SetLayout(it) => device.destroy_descriptor_set_layout(it, None),
            Object::PipelineLayout(it) => device.destroy_pipeline_layout(it, None),
            Object::Pipeline(it) => device.destroy_pipeline(it, None),
            Object::DescriptorPool(it) => device.destroy_descriptor_pool(it, None),
            Object::CommandPool(it) => device.destroy_command_pool(it, None),
            Object::QueryPool(it) => device.destroy_query_pool(it, None),
            Object::Fence(it) => device.destroy_fence(it, None),
        }
    }
}

/// The features with which shader instrumentation writes its findings, if the device has them.
fn instrumentation(instance: &Instance, physical: &Physical) -> vk::PhysicalDeviceFeatures {
    // SAFETY: the physical device belongs to this instance.
    let offered = unsafe { instance.raw().get_physical_device_features(physical.handle) };
    vk::PhysicalDeviceFeatures {
        fragment_stores_and_atomics: offered.fragment_stores_and_atomics,
        vertex_pipeline_stores_and_atomics: offered.vertex_pipeline_stores_and_atomics,
        ..Default::default()
    }
}
