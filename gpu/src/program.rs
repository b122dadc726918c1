//! Pipelines and descriptor sets: one pipeline per kernel, one set per kernel and buffer list.

use crate::arena::Slot;
use crate::owner::Gpu;
use crate::{Binding, GpuError, Kernel, Op, Program};
use ash::vk;
use std::ffi::CString;
use std::ptr;

struct KernelPipeline {
    kernel: &'static Kernel,
    set_layout: vk::DescriptorSetLayout,
    layout: vk::PipelineLayout,
    handle: vk::Pipeline,
}

struct Set {
    pipeline: usize,
    buffers: Vec<usize>,
    handle: vk::DescriptorSet,
}

/// What a dispatch binds before it starts.
#[derive(Clone, Copy)]
pub(crate) struct Bindings {
    pub pipeline: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub set: vk::DescriptorSet,
}

/// Everything that the dispatches of all programs bind.
pub(crate) struct Pipelines {
    pipelines: Vec<KernelPipeline>,
    sets: Vec<Set>,
}

impl Pipelines {
    pub fn new(gpu: &mut Gpu, slots: &[Slot], programs: &[Program]) -> Result<Self, GpuError> {
        let mut all = Self { pipelines: Vec::new(), sets: Vec::new() };
        let mut wanted: Vec<(usize, &[usize])> = Vec::new();
        for (kernel, buffers) in dispatches(programs) {
            let pipeline = all.pipeline(gpu, kernel)?;
            if !wanted.contains(&(pipeline, buffers)) {
                wanted.push((pipeline, buffers));
            }
        }
        let bindings = wanted.iter().flat_map(|(p, _)| all.pipelines[*p].kernel.bindings);
        let descriptors: Vec<_> = bindings.map(Binding::descriptor).collect();
        let pool = gpu.descriptor_pool(wanted.len() as u32, &descriptors)?;
        for (pipeline, buffers) in wanted {
            let handles = buffers.iter().map(|&b| slots[b].handle);
            let kinds = all.pipelines[pipeline].kernel.bindings.iter().map(Binding::descriptor);
            let handles: Vec<_> = handles.zip(kinds).collect();
            let layout = all.pipelines[pipeline].set_layout;
            all.sets.push(Set {
                pipeline,
                buffers: buffers.to_vec(),
                handle: gpu.descriptor_set(pool, layout, &handles)?,
            });
        }
        Ok(all)
    }

    /// The bindings of a dispatch in one of the programs given to `new`.
    pub fn bound(&self, kernel: &Kernel, buffers: &[usize]) -> Option<Bindings> {
        let set = self
            .sets
            .iter()
            .find(|s| ptr::eq(self.pipelines[s.pipeline].kernel, kernel) && s.buffers == buffers)?;
        let pipeline = &self.pipelines[set.pipeline];
        Some(Bindings { pipeline: pipeline.handle, layout: pipeline.layout, set: set.handle })
    }

    /// Index of the kernel's pipeline, created if there is none yet.
    fn pipeline(&mut self, gpu: &mut Gpu, kernel: &'static Kernel) -> Result<usize, GpuError> {
        let known = self.pipelines.iter().position(|p| ptr::eq(p.kernel, kernel));
        if let Some(known) = known {
            return Ok(known);
        }
        let bindings = (0..).zip(kernel.bindings).map(|(n, binding)| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(n)
                .descriptor_type(binding.descriptor())
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
        });
        let set_layout = gpu.set_layout(&bindings.collect::<Vec<_>>())?;
        let layout = gpu.pipeline_layout(set_layout)?;
        let entry = CString::new(kernel.name).expect("the check saw no zero");
        self.pipelines.push(KernelPipeline {
            kernel,
            set_layout,
            layout,
            handle: gpu.pipeline(kernel.spirv.words(), &entry, layout)?,
        });
        Ok(self.pipelines.len() - 1)
    }
}

fn dispatches(programs: &[Program]) -> impl Iterator<Item = (&'static Kernel, &[usize])> {
    let ops = programs.iter().flat_map(|program| &program.ops);
    ops.filter_map(|op| match op {
        Op::Dispatch { kernel, buffers, .. } => Some((*kernel, buffers.as_slice())),
        _ => None,
    })
}
