//! A run allocates nothing on this side of the driver.

mod common;

use common::{CHANGE, dispatch, executor, kernel, row};
use raywake_gpu::guard::{self, Guard};
use raywake_gpu::{Heap, Op, Options};

#[global_allocator]
static ALLOCATOR: Guard<std::alloc::System> = Guard(std::alloc::System);

/// One test, because the count is the process's.
#[test]
fn a_frame_allocates_nothing() {
    let seen = |f: &mut dyn FnMut()| {
        let before = guard::allocations();
        guard::guarded(f);
        guard::allocations() - before
    };
    assert_eq!(seen(&mut || drop(Box::new(1))), 1);
    let mut grown = Vec::with_capacity(1);
    assert_eq!(seen(&mut || grown.extend([1, 2, 3])), 1);
    let caught =
        std::panic::catch_unwind(|| guard::guarded(|| std::panic::resume_unwind(Box::new(()))));
    assert!(caught.is_err());
    let before = guard::allocations();
    drop(vec![0; 9]);
    assert_eq!(guard::allocations(), before);

    let add = kernel(
        "add",
        "
@group(0) @binding(0) var<storage, read_write> words: Words;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) { words.d[id.x] += id.x; }",
        &[CHANGE],
    );
    let table = [
        row("in", Heap::Upload, 64),
        row("words", Heap::Device, 64),
        row("out", Heap::Readback, 64),
    ];
    let ops =
        vec![Op::Copy { from: 0, to: 1 }, dispatch(add, &[1], 1), Op::Copy { from: 1, to: 2 }];
    let Some(mut gpu) = executor(&Options::default(), &table, ops) else {
        return;
    };
    gpu.seal();
    let mut frame = |value: u32| {
        gpu.upload(0).fill(value);
        gpu.run(0).unwrap();
        assert_eq!(gpu.readback(2)[63], value + 63);
        gpu.times(0).map(|(_, ms)| ms).sum::<f64>()
    };
    guard::abort_on_allocation(true);
    let allocated = seen(&mut || {
        for value in 0..100 {
            std::hint::black_box(frame(value));
        }
    });
    guard::abort_on_allocation(false);
    assert_eq!(allocated, 0);
}
