//! Creation of device objects. Each call is counted, each object remembered.

use super::{Gpu, Object};
use crate::error::failed;
use crate::{GpuError, Heap};
use ash::vk;
use std::ffi::CStr;

impl Gpu {
    pub fn buffer(&mut self, bytes: u64) -> Result<vk::Buffer, vk::Result> {
        use vk::BufferUsageFlags as Usage;
        let info = vk::BufferCreateInfo::default().size(bytes).usage(
            Usage::STORAGE_BUFFER
                | Usage::UNIFORM_BUFFER
                | Usage::TRANSFER_SRC
                | Usage::TRANSFER_DST
                | Usage::INDIRECT_BUFFER,
        );
        // SAFETY: the create info is valid; `bytes` was checked to be non-zero.
        let buffer = unsafe { self.raw.create_buffer(&info, None) }?;
        Ok(self.own(buffer, Object::Buffer))
    }

    pub fn requirements(&self, buffer: vk::Buffer) -> vk::MemoryRequirements {
        // SAFETY: a live buffer of this device.
        unsafe { self.raw.get_buffer_memory_requirements(buffer) }
    }

    pub fn memory_properties(&self) -> vk::PhysicalDeviceMemoryProperties {
        let instance = self.instance.raw();
        // SAFETY: the physical device belongs to this instance.
        unsafe { instance.get_physical_device_memory_properties(self.physical.handle) }
    }

    pub fn memory(
        &mut self,
        heap: Heap,
        bytes: u64,
        kind: u32,
    ) -> Result<vk::DeviceMemory, vk::Result> {
        let info = vk::MemoryAllocateInfo::default().allocation_size(bytes).memory_type_index(kind);
        // SAFETY: `kind` is a memory type of this device, and `bytes` fits in its heap.
        let memory = unsafe { self.raw.allocate_memory(&info, None) }?;
        self.census.memory_allocations += 1;
        *match heap {
            Heap::Upload => &mut self.census.upload_bytes,
            Heap::Device => &mut self.census.device_bytes,
            Heap::Readback => &mut self.census.readback_bytes,
        } += bytes;
        Ok(self.own(memory, Object::Memory))
    }

    /// Binds an unbound buffer to memory. `offset` satisfies its requirements.
    pub fn bind(
        &self,
        buffer: vk::Buffer,
        memory: vk::DeviceMemory,
        offset: u64,
    ) -> Result<(), GpuError> {
        // SAFETY: both belong to this device; the arena computed the offset from the requirements.
        unsafe { self.raw.bind_buffer_memory(buffer, memory, offset) }
            .map_err(failed("vkBindBufferMemory"))
    }

    /// Maps a whole host-visible memory block, for as long as it lives.
    pub fn map(&self, memory: vk::DeviceMemory) -> Result<*mut u8, GpuError> {
        let flags = vk::MemoryMapFlags::empty();
        // SAFETY: the arena maps each host-visible block once.
        let base = unsafe { self.raw.map_memory(memory, 0, vk::WHOLE_SIZE, flags) };
        base.map(|p| p.cast()).map_err(failed("vkMapMemory"))
    }

    pub fn set_layout(
        &mut self,
        bindings: &[vk::DescriptorSetLayoutBinding],
    ) -> Result<vk::DescriptorSetLayout, GpuError> {
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(bindings);
        // SAFETY: the create info is valid and lives through the call.
        let layout = unsafe { self.raw.create_descriptor_set_layout(&info, None) }
            .map_err(failed("vkCreateDescriptorSetLayout"))?;
        Ok(self.own(layout, Object::SetLayout))
    }

    pub fn pipeline_layout(
        &mut self,
        set: vk::DescriptorSetLayout,
    ) -> Result<vk::PipelineLayout, GpuError> {
        let sets = [set];
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
        // SAFETY: the set layout belongs to this device.
        let layout = unsafe { self.raw.create_pipeline_layout(&info, None) }
            .map_err(failed("vkCreatePipelineLayout"))?;
        Ok(self.own(layout, Object::PipelineLayout))
    }

    pub fn pipeline(
        &mut self,
        spirv: &[u32],
        entry: &CStr,
        layout: vk::PipelineLayout,
    ) -> Result<vk::Pipeline, GpuError> {
        let info = vk::ShaderModuleCreateInfo::default().code(spirv);
        // SAFETY: by the crate's contract the words are a valid module.
        let module = unsafe { self.raw.create_shader_module(&info, None) }
            .map_err(failed("vkCreateShaderModule"))?;
        self.own(module, Object::Shader);
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(entry);
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout)];
        let cache = vk::PipelineCache::null();
        // SAFETY: module and layout belong to this device; the kernel's bindings match the module.
        let made = unsafe { self.raw.create_compute_pipelines(cache, &info, None) };
        let made = made.map_err(|(_, result)| failed("vkCreateComputePipelines")(result))?;
        Ok(self.own(made[0], Object::Pipeline))
    }

    /// A pool for exactly `sets` sets with these descriptors in total.
    pub fn descriptor_pool(
        &mut self,
        sets: u32,
        descriptors: &[vk::DescriptorType],
    ) -> Result<vk::DescriptorPool, GpuError> {
        let of = |kind: vk::DescriptorType| {
            let count = descriptors.iter().filter(|d| **d == kind).count() as u32;
            // Vulkan has no empty pools.
            vk::DescriptorPoolSize::default().ty(kind).descriptor_count(count.max(1))
        };
        let sizes =
            [of(vk::DescriptorType::STORAGE_BUFFER), of(vk::DescriptorType::UNIFORM_BUFFER)];
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(sets.max(1)).pool_sizes(&sizes);
        // SAFETY: the create info is valid and lives through the call.
        let pool = unsafe { self.raw.create_descriptor_pool(&info, None) }
            .map_err(failed("vkCreateDescriptorPool"))?;
        Ok(self.own(pool, Object::DescriptorPool))
    }

    /// A set whose binding `i` is the whole buffer `buffers[i]`, bound as its kind. It lives as
    /// long as its pool.
    pub fn descriptor_set(
        &mut self,
        pool: vk::DescriptorPool,
        layout: vk::DescriptorSetLayout,
        buffers: &[(vk::Buffer, vk::DescriptorType)],
    ) -> Result<vk::DescriptorSet, GpuError> {
        let layouts = [layout];
        let info =
            vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        // SAFETY: pool and layout belong to this device, and only this thread uses the pool.
        let set = unsafe { self.raw.allocate_descriptor_sets(&info) }
            .map_err(failed("vkAllocateDescriptorSets"))?[0];
        let whole = |(buffer, _): &(vk::Buffer, _)| {
            [vk::DescriptorBufferInfo::default().buffer(*buffer).range(vk::WHOLE_SIZE)]
        };
        let infos: Vec<_> = buffers.iter().map(whole).collect();
        let mut writes: Vec<_> = infos
            .iter()
            .map(|info| vk::WriteDescriptorSet::default().dst_set(set).buffer_info(info))
            .collect();
        for (write, (n, (_, kind))) in writes.iter_mut().zip((0..).zip(buffers)) {
            *write = write.dst_binding(n).descriptor_type(*kind);
        }
        // SAFETY: the set is new and in no command buffer yet; the buffers belong to this device.
        unsafe { self.raw.update_descriptor_sets(&writes, &[]) };
        Ok(set)
    }

    pub fn query_pool(&mut self, queries: u32) -> Result<vk::QueryPool, GpuError> {
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(queries);
        // SAFETY: the create info is valid; callers ask for at least one query.
        let pool = unsafe { self.raw.create_query_pool(&info, None) }
            .map_err(failed("vkCreateQueryPool"))?;
        Ok(self.own(pool, Object::QueryPool))
    }

    pub fn fence(&mut self) -> Result<vk::Fence, GpuError> {
        // SAFETY: the default create info is valid.
        let fence = unsafe { self.raw.create_fence(&Default::default(), None) }
            .map_err(failed("vkCreateFence"))?;
        Ok(self.own(fence, Object::Fence))
    }

    /// One command buffer per program, each to be recorded once.
    pub fn command_buffers(&mut self, count: u32) -> Result<Vec<vk::CommandBuffer>, GpuError> {
        if count == 0 {
            return Ok(Vec::new());
        }
        let info =
            vk::CommandPoolCreateInfo::default().queue_family_index(self.physical.queue_family);
        // SAFETY: the device was created with this queue family.
        let pool = unsafe { self.raw.create_command_pool(&info, None) }
            .map_err(failed("vkCreateCommandPool"))?;
        self.own(pool, Object::CommandPool);
        let info =
            vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(count);
        // SAFETY: the pool belongs to this device, and only this thread uses it.
        let buffers = unsafe { self.raw.allocate_command_buffers(&info) }
            .map_err(failed("vkAllocateCommandBuffers"))?;
        Ok(buffers)
    }
}
