//! The validation layer finds nothing in what the recorder makes of correct declarations, and does
//! find something in false ones.

mod common;

use common::{CHANGE, READ, WRITE, dispatch, executor, kernel, present, row};
use raywake_gpu::{Binding, Executor, GpuError, Groups, Heap, Kernel, Op, Options, Validation};

const WORDS: u64 = 256;

fn options(validation: Validation) -> Options {
    Options { validation: Some(validation), ..Options::default() }
}

/// Whether the layer is available.
fn layer(validation: Validation) -> bool {
    let Some(probe) = present(Executor::new(&options(validation), &[], &[])) else {
        return false;
    };
    match probe {
        Err(GpuError::Unsupported { what, .. }) => {
            eprintln!("skipped: no {what}");
            false
        }
        probe => probe.is_ok() || panic!("{:?}", probe.err()),
    }
}

/// A copy that reads `beyond` words ahead.
fn shift(name: &'static str, beyond: u32, bindings: &'static [Binding]) -> &'static Kernel {
    let wgsl = format!(
        "
@group(0) @binding(0) var<storage, read> from_: Words;
@group(0) @binding(1) var<storage, read_write> to: Words;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {{
    to.d[id.x] = from_.d[id.x + {beyond}u];
}}"
    );
    kernel(name, &wgsl, bindings)
}

/// Every kind of step and conflict.
fn everything(copy: &'static Kernel) -> Vec<Op> {
    let fill = |buffer, value| Op::Fill { buffer, value };
    let indirect = Op::Dispatch {
        name: "indirect",
        kernel: copy,
        buffers: vec![1, 2],
        groups: Groups::Indirect { buffer: 4, offset_bytes: 0 },
    };
    vec![
        Op::Copy { from: 0, to: 1 },
        fill(4, 1),
        dispatch(copy, &[1, 2], 4),
        dispatch(copy, &[2, 1], 4),
        indirect,
        fill(4, 2),
        dispatch(copy, &[0, 1], 4),
        Op::Copy { from: 2, to: 3 },
        fill(2, 0),
    ]
}

fn table() -> [raywake_gpu::Buffer; 5] {
    [
        row("in", Heap::Upload, WORDS),
        row("a", Heap::Device, WORDS),
        row("b", Heap::Device, WORDS),
        row("out", Heap::Readback, WORDS),
        row("counts", Heap::Device, 3),
    ]
}

/// Runs twice and returns the layer's messages.
fn messages(validation: Validation, ops: Vec<Op>) -> Vec<String> {
    let mut gpu = executor(&options(validation), &table(), ops).expect("there is a device");
    for _ in 0..2 {
        gpu.run(0).unwrap();
    }
    assert_eq!(gpu.messages() > 0, !gpu.message_texts().is_empty());
    gpu.message_texts()
}

#[test]
fn correct_programs_have_no_findings() {
    for validation in [Validation::Sync, Validation::GpuAssisted] {
        if layer(validation) {
            let ops = everything(shift("copy", 0, &[READ, WRITE]));
            assert_eq!(messages(validation, ops), [""; 0], "{validation:?}");
        }
    }
}

#[test]
fn an_undeclared_write_is_a_hazard() {
    if layer(Validation::Sync) {
        let liar = shift("liar", 0, &[READ, READ]);
        let reader = shift("reader", 0, &[READ, WRITE]);
        let ops = vec![dispatch(liar, &[1, 2], 4), dispatch(reader, &[2, 3], 4)];
        let messages = messages(Validation::Sync, ops);
        assert!(messages.iter().any(|text| text.contains("HAZARD")), "{messages:?}");
    }
}

#[test]
fn an_access_out_of_bounds_is_found() {
    if layer(Validation::GpuAssisted) {
        let beyond = shift("beyond", 1 << 20, &[READ, CHANGE]);
        let messages = messages(Validation::GpuAssisted, vec![dispatch(beyond, &[1, 2], 4)]);
        assert!(messages.iter().any(|text| text.contains("out of bounds")), "{messages:?}");
    }
}
