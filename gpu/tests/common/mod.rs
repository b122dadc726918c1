//! Tiny kernels, compiled at run time, and what to do without a device.

// No test uses everything in it.
#![allow(dead_code)]

use naga::back::spv;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use raywake_gpu::{
    Binding, Buffer, Executor, GpuError, Groups, Heap, Kernel, Op, Options, Program, Spirv,
};

pub const READ: Binding = Binding::storage("d", true, false);
pub const WRITE: Binding = Binding::storage("d", false, true);
pub const CHANGE: Binding = Binding::storage("d", true, true);
pub const UNIFORM: Binding = Binding::uniform("u");

/// What the kernels below are written in terms of.
const PRELUDE: &str = "
struct Words { d: array<u32> }
struct Counts { d: array<atomic<u32>> }
";

/// A kernel of 64 invocations from a module whose entry point is `main`.
pub fn kernel(name: &'static str, wgsl: &str, bindings: &'static [Binding]) -> &'static Kernel {
    let mut module = naga::front::wgsl::parse_str(&format!("{PRELUDE}{wgsl}")).expect(name);
    module.entry_points[0].name = name.to_string();
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    let info = validator.validate(&module).expect(name);
    let options = spv::Options {
        lang_version: (1, 3),
        flags: spv::WriterFlags::empty(),
        fake_missing_bindings: true,
        zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
        force_loop_bounding: false,
        bounds_check_policies: Default::default(),
        ..Default::default()
    };
    let spirv = spv::write_vec(&module, &info, &options, None).expect(name);
    // SAFETY: naga has validated the module; out-of-bounds accesses only occur in tests about them,
    // which run under the validation layer that checks every access.
    let spirv = unsafe { Spirv::new(spirv.leak()) };
    Box::leak(Box::new(Kernel { name, spirv, workgroup: [64, 1, 1], bindings }))
}

pub fn row(name: &'static str, heap: Heap, words: u64) -> Buffer {
    let bytes = words * 4;
    Buffer { name, heap, bytes }
}

pub fn dispatch(kernel: &'static Kernel, buffers: &[usize], groups: u32) -> Op {
    Op::Dispatch {
        name: kernel.name,
        kernel,
        buffers: buffers.to_vec(),
        groups: Groups::Fixed([groups, 1, 1]),
    }
}

/// `None`, with a remark, if there is no device; `RAYWAKE_VULKAN=required` makes that a failure.
pub fn executor(options: &Options, table: &[Buffer], ops: Vec<Op>) -> Option<Executor> {
    let program = Program { name: "test", ops };
    present(Executor::new(options, table, &[program])).map(|e| e.expect("set-up"))
}

/// The result, or `None` if it says that there is nothing to run on.
pub fn present<T>(result: Result<T, GpuError>) -> Option<Result<T, GpuError>> {
    let required = std::env::var("RAYWAKE_VULKAN").is_ok_and(|v| v == "required");
    match result {
        Err(GpuError::NoLoader | GpuError::NoDevice) if !required => {
            eprintln!("skipped: no Vulkan device");
            None
        }
        other => Some(other),
    }
}
