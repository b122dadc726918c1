//! Programs do what they say, and nothing is created after set-up.

mod common;

use common::{CHANGE, READ, UNIFORM, WRITE, dispatch, executor, kernel, present, row};
use raywake_gpu::{Executor, GpuError, Groups, Heap, Kernel, Op, Options, Program, devices};

const WORDS: u64 = 1000;

/// `to[i] = 2 * from[i] + 1`, for as many groups as it gets.
fn double() -> &'static Kernel {
    kernel(
        "double",
        "
@group(0) @binding(0) var<storage, read> from_: Words;
@group(0) @binding(1) var<storage, read_write> to: Words;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&to.d) { to.d[id.x] = 2u * from_.d[id.x] + 1u; }
}",
        &[READ, WRITE],
    )
}

#[test]
fn upload_copy_dispatch_readback() {
    let table = [
        row("in", Heap::Upload, WORDS),
        row("a", Heap::Device, WORDS),
        row("b", Heap::Device, WORDS),
        row("out", Heap::Readback, WORDS),
    ];
    let ops = vec![
        Op::Copy { from: 0, to: 1 },
        dispatch(double(), &[1, 2], 16),
        dispatch(double(), &[2, 1], 16),
        Op::Copy { from: 1, to: 3 },
    ];
    let Some(mut gpu) = executor(&Options::default(), &table, ops) else {
        return;
    };
    assert_eq!(gpu.times(0).count(), 0);
    for run in 0..3 {
        for (i, word) in gpu.upload(0).unwrap().iter_mut().enumerate() {
            *word = i as u32 + run;
        }
        gpu.run(0).unwrap();
        let expected = (0..WORDS as u32).map(|i| 4 * (i + run) + 3);
        assert!(gpu.readback(3).iter().copied().eq(expected));
    }
    if gpu.info().limits.timestamp_bits > 0 {
        let names: Vec<_> = gpu.times(0).map(|(name, _)| name).collect();
        assert_eq!(names, ["copy", "double", "double", "copy"]);
        assert!(gpu.times(0).all(|(_, ms)| (0.0..10_000.0).contains(&ms)));
    }
}

/// The device is waited for before its objects are destroyed, and what it is still writing cannot
/// be read.
#[test]
fn work_that_panics_beside_the_device() {
    let table = [
        row("in", Heap::Upload, WORDS),
        row("a", Heap::Device, WORDS),
        row("out", Heap::Readback, WORDS),
    ];
    let ops = vec![Op::Copy { from: 0, to: 1 }, Op::Copy { from: 1, to: 2 }];
    let Some(mut gpu) = executor(&Options::default(), &table, ops) else {
        return;
    };
    let beside = || gpu.run_alongside(0, || panic!("in the test"));
    assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(beside)).is_err());
    let abandoned = GpuError::Abandoned { program: "test" };
    assert_eq!(gpu.run(0), Err(abandoned.clone()));
    assert_eq!(gpu.upload(0).map(|_| ()), Err(abandoned));
    assert!(gpu.readback(2).is_empty());
}

#[test]
fn uniforms_are_of_their_run() {
    let scaled = kernel(
        "scaled",
        "
struct Scale { factor: u32, offset: u32 }
@group(0) @binding(0) var<uniform> scale: Scale;
@group(0) @binding(1) var<storage, read_write> to: Words;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    to.d[id.x] = scale.factor * id.x + scale.offset;
}",
        &[UNIFORM, WRITE],
    );
    let table = [
        row("in", Heap::Upload, 2),
        row("scale", Heap::Device, 2),
        row("words", Heap::Device, 64),
        row("out", Heap::Readback, 64),
    ];
    let ops = vec![
        Op::Copy { from: 0, to: 1 },
        dispatch(scaled, &[1, 2], 1),
        Op::Copy { from: 2, to: 3 },
    ];
    let Some(mut gpu) = executor(&Options::default(), &table, ops) else {
        return;
    };
    for scale in [[3, 5], [7, 0]] {
        gpu.upload(0).unwrap().copy_from_slice(&scale);
        gpu.run(0).unwrap();
        assert!((0..64).map(|n| scale[0] * n + scale[1]).eq(gpu.readback(3).iter().copied()));
    }
}

#[test]
fn group_counts_may_come_from_a_kernel() {
    let plan = kernel(
        "plan",
        "
@group(0) @binding(0) var<storage, read_write> counts: Words;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x < 3u { counts.d[1u + id.x] = select(1u, 5u, id.x == 0u); }
}",
        &[WRITE],
    );
    let table = [
        row("counts", Heap::Device, 4),
        row("from", Heap::Device, WORDS),
        row("out", Heap::Readback, WORDS),
    ];
    let indirect = Op::Dispatch {
        name: "indirect",
        kernel: double(),
        buffers: vec![1, 2],
        groups: Groups::Indirect { buffer: 0, offset_bytes: 4 },
    };
    let fill = |buffer, value| Op::Fill { buffer, value };
    let ops = vec![fill(1, 20), fill(2, 7), dispatch(plan, &[0], 1), indirect];
    let Some(mut gpu) = executor(&Options::default(), &table, ops) else {
        return;
    };
    gpu.run(0).unwrap();
    let (reached, rest) = gpu.readback(2).split_at(5 * 64);
    assert!(reached.iter().all(|&word| word == 41));
    assert!(rest.iter().all(|&word| word == 7));
}

fn movable(_: &impl Send) {}

/// Two programs share buffers, and one finds what the other left. The only barriers are for the
/// conflicts over the counter within the second program.
#[test]
fn contents_persist_and_runs_allocate_nothing() {
    let count = kernel(
        "count",
        "
@group(0) @binding(0) var<storage, read_write> counts: Counts;
@compute @workgroup_size(64)
fn main() { atomicAdd(&counts.d[0], 1u); }",
        &[CHANGE],
    );
    let table = [
        row("count", Heap::Device, 1),
        row("out", Heap::Readback, 1),
        row("unused", Heap::Upload, 3),
    ];
    let clear = Op::Fill { buffer: 0, value: 5 };
    let add = dispatch(count, &[0], 10);
    let programs = [
        Program { name: "clear", ops: vec![clear] },
        Program { name: "add", ops: vec![add.clone(), add, Op::Copy { from: 0, to: 1 }] },
    ];
    let Some(gpu) = present(Executor::new(&Options::default(), &table, &programs)) else {
        return;
    };
    let mut gpu = gpu.unwrap();
    movable(&gpu);
    let before = gpu.census();
    assert_eq!(before.memory_allocations, 3);
    assert_eq!(before.barriers, 2);
    assert!(before.upload_bytes >= 12 && before.device_bytes >= 4 && before.readback_bytes >= 4);
    gpu.run(0).unwrap();
    for run in 1..=10 {
        gpu.run(1).unwrap();
        assert_eq!(gpu.readback(1), [5 + run * 2 * 640]);
    }
    assert_eq!(gpu.census(), before);
}

#[test]
fn wrong_schedules_are_refused() {
    let table = [row("a", Heap::Device, 4), row("b", Heap::Device, 5)];
    let copy = Op::Copy { from: 0, to: 1 };
    let program = Program { name: "wrong", ops: vec![copy] };
    let Some(result) = present(Executor::new(&Options::default(), &table, &[program])) else {
        return;
    };
    let error = result.err().unwrap();
    assert_eq!(error.to_string(), "`copy` of `wrong`: a has 16 bytes, b 20");
}

#[test]
fn too_much_memory_is_refused_with_the_bytes() {
    for heap in [Heap::Upload, Heap::Device, Heap::Readback] {
        let half = 1 << 47;
        let table = [row("one", heap, half), row("two", heap, half)];
        let Some(result) = present(Executor::new(&Options::default(), &table, &[])) else {
            return;
        };
        let bytes = 1 << 50;
        assert_eq!(result.err(), Some(GpuError::OutOfMemory { heap, bytes }));
    }
}

#[test]
fn devices_are_listed_and_chosen_by_index() {
    let Some(listed) = present(devices()) else {
        return;
    };
    let listed = listed.unwrap();
    for (i, device) in listed.iter().enumerate() {
        assert_eq!(device.index, i);
        let options = Options { device: Some(i), ..Options::default() };
        match Executor::new(&options, &[], &[]) {
            Ok(gpu) => assert_eq!(gpu.info(), device),
            Err(error) => assert!(matches!(error, GpuError::Unsupported { .. }), "{error}"),
        }
    }
    let options = Options { device: Some(listed.len()), ..Options::default() };
    let beyond = Executor::new(&options, &[], &[]);
    assert_eq!(beyond.err(), Some(GpuError::NoDevice));
}
