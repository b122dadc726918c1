use super::*;
use crate::{Binding, Spirv};

const LIMITS: Limits = Limits {
    storage_buffer_bytes: 1 << 27,
    storage_buffers: 8,
    storage_alignment_bytes: 16,
    allocation_bytes: 1 << 31,
    invocations: 256,
    workgroup: [256, 256, 64],
    workgroups: [65535; 3],
    shared_bytes: 16384,
    timestamp_ns: 1.0,
    timestamp_bits: 64,
};

const TABLE: [Buffer; 5] = [
    row("up", Heap::Upload, 64),
    row("a", Heap::Device, 64),
    row("b", Heap::Device, 64),
    row("small", Heap::Device, 16),
    row("huge", Heap::Device, 1 << 28),
];

const fn row(name: &'static str, heap: Heap, bytes: u64) -> Buffer {
    Buffer { name, heap, bytes }
}

const IN_AND_OUT: [Binding; 2] =
    [Binding::storage("in", true, false), Binding::storage("out", false, true)];

const fn kernel(name: &'static str, spirv: &'static [u32], workgroup: [u32; 3]) -> Kernel {
    // SAFETY: none of them is ever run.
    let spirv = unsafe { Spirv::new(spirv) };
    Kernel { name, spirv, workgroup, bindings: &IN_AND_OUT }
}

static GOOD: Kernel = kernel("k", &[SPIRV_MAGIC], [64, 1, 1]);
static LARGE: Kernel = kernel("k", &[SPIRV_MAGIC], [64, 8, 1]);
static GARBAGE: Kernel = kernel("k", &[1], [64, 1, 1]);
static ZERO: Kernel = kernel("k\0", &[SPIRV_MAGIC], [64, 1, 1]);

fn dispatch(kernel: &'static Kernel, buffers: &[usize], groups: Groups) -> Op {
    Op::Dispatch { name: "d", kernel, buffers: buffers.to_vec(), groups }
}

/// The objection to a program of these steps; empty if they are fine.
fn objection(ops: &[Op]) -> String {
    let program = Program { name: "p", ops: ops.to_vec() };
    match schedule(&LIMITS, &TABLE, &[program]) {
        Ok(()) => String::new(),
        Err(GpuError::Schedule { program, what, .. }) => {
            assert_eq!(program, "p");
            what
        }
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn sound_programs_pass() {
    let one = Groups::Fixed([1; 3]);
    let indirect = Groups::Indirect { buffer: 3, offset_bytes: 4 };
    let ops = [
        Op::Fill { buffer: 4, value: 7 },
        Op::Copy { from: 0, to: 1 },
        dispatch(&GOOD, &[1, 2], one),
        dispatch(&GOOD, &[0, 1], indirect),
    ];
    assert_eq!(objection(&ops), "");
}

#[test]
fn unsound_programs_are_refused_with_the_reason() {
    let one = Groups::Fixed([1; 3]);
    let indirect = |offset_bytes| Groups::Indirect { buffer: 3, offset_bytes };
    let cases = [
        (Op::Copy { from: 0, to: 9 }, "no buffer 9"),
        (Op::Copy { from: 1, to: 1 }, "onto itself"),
        (Op::Copy { from: 1, to: 3 }, "a has 64 bytes, small 16"),
        (Op::Copy { from: 1, to: 0 }, "upload buffer up"),
        (dispatch(&GOOD, &[1], one), "2 bindings, 1 buffers"),
        (dispatch(&GOOD, &[1, 1], one), "a is bound twice"),
        (dispatch(&GOOD, &[1, 0], one), "upload buffer up"),
        (dispatch(&GOOD, &[4, 1], one), "huge has 268435456 bytes"),
        (dispatch(&LARGE, &[1, 2], one), "workgroups of [64, 8, 1]"),
        (dispatch(&GARBAGE, &[1, 2], one), "not SPIR-V"),
        (dispatch(&ZERO, &[1, 2], one), "zero in its name"),
        (dispatch(&GOOD, &[1, 2], Groups::Fixed([65536, 1, 1])), "groups"),
        (dispatch(&GOOD, &[1, 2], indirect(8)), "at byte 8 of small"),
        (dispatch(&GOOD, &[1, 2], indirect(2)), "at byte 2 of small"),
        (dispatch(&GOOD, &[1, 2], indirect(u64::MAX - 3)), "of small"),
    ];
    for (op, reason) in cases {
        let objection = objection(std::slice::from_ref(&op));
        assert!(objection.contains(reason), "{op:?}: {objection:?}");
    }
}

#[test]
fn buffers_are_whole_words() {
    for bytes in [0, 6] {
        let table = [row("odd", Heap::Device, bytes)];
        assert!(matches!(
            schedule(&LIMITS, &table, &[]),
            Err(GpuError::Schedule { dispatch: "odd", .. })
        ));
    }
}
