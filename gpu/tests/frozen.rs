//! A run allocates nothing outside the driver.

mod common;

use common::{CHANGE, dispatch, executor, kernel, row};
use raywake_alloc_guard::{Allocation, Guard, Sealed};
use raywake_gpu::{Executor, Heap, Op, Options};

#[global_allocator]
static ALLOCATOR: Guard<std::alloc::System> = Guard(std::alloc::System);

#[test]
fn a_frame_allocates_nothing() {
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
    let Some(gpu) = executor(&Options::default(), &table, ops) else {
        return;
    };
    let frame = |gpu: &mut Executor, value: u32| {
        gpu.upload(0).unwrap().fill(value);
        gpu.run(0).unwrap();
        assert_eq!(gpu.readback(2)[63], value + 63);
        gpu.times(0).map(|(_, ms)| ms).sum::<f64>()
    };
    let mut sealed = Sealed::new("frames", gpu);
    let milliseconds = sealed
        .step(|gpu| Ok::<_, Allocation>((0..100).map(|value| frame(gpu, value)).sum::<f64>()));
    assert!(milliseconds.unwrap() >= 0.0);
}
