//! A run that takes too long is given up, permanently, and without a crash.

mod common;

use common::{CHANGE, dispatch, executor, kernel, row};
use raywake_gpu::{DeviceKind, Executor, GpuError, Heap, Options};
use std::time::{Duration, Instant};

/// A dispatch that keeps two processor cores busy for about 0.1 ms per group.
fn slow(groups: u32) -> Option<Executor> {
    let spin = kernel(
        "spin",
        "
@group(0) @binding(0) var<storage, read_write> words: Words;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    var x = words.d[id.x];
    for (var i = 0u; i < 50000u; i++) { x = x * 1664525u + (x >> 7u) + 1u; }
    words.d[id.x] = x;
}",
        &[CHANGE],
    );
    let table = [
        row("words", Heap::Device, u64::from(groups) * 64),
        row("out", Heap::Readback, 16),
        row("in", Heap::Upload, 16),
    ];
    let options = Options { timeout: Duration::from_micros(100), ..Options::default() };
    executor(&options, &table, vec![dispatch(spin, &[0], groups)])
}

/// Misses the deadline, and returns how long it takes to notice that and drop everything.
fn give_up(groups: u32) -> Option<Duration> {
    let mut gpu = slow(groups)?;
    if gpu.info().kind != DeviceKind::Cpu {
        eprintln!("skipped: the device is too fast to be sure of missing the deadline");
        return None;
    }
    let begin = Instant::now();
    let error = gpu.run(0).unwrap_err();
    let GpuError::Timeout { during, after } = &error else { panic!("{error}") };
    assert_eq!((during.program, after.as_micros()), ("test", 100));
    assert_eq!(gpu.run(0), Err(error));
    assert!(gpu.readback(1).is_empty());
    assert_eq!(gpu.upload(2).map(|_| ()), gpu.run(0));
    drop(gpu);
    Some(begin.elapsed())
}

#[test]
fn a_missed_deadline_is_final_and_dropping_never_hangs() {
    // Ends soon after: everything is destroyed.
    let Some(late) = give_up(500) else { return };
    // Ends long after: what still runs is leaked.
    let never = give_up(30_000).expect("the same device");
    eprintln!("dropped after {late:?} and {never:?}");
    assert!(never < Duration::from_secs(3));
}
