//! Missing, too small or too slow devices produce an error that says so.

#![forbid(unsafe_code)]

use raywake::backend::Backend;
use raywake::backend::device::Device;
use raywake::error::RunError;
use raywake_core::params::Profile;
use raywake_core::stages::FLOW_PROGRAMS;
use raywake_gpu::{Buffer, DeviceKind, Executor, GpuError, Heap, Options, devices};
use raywake_kernels::schedule::Schedule;
use raywake_tests::drives::{Setup, street, sweep};
use raywake_tests::vulkan;
use std::time::{Duration, Instant};

/// Upper bound on the time any error may take to be returned, apart from compiling kernels.
const SOON: Duration = Duration::from_secs(5);

#[test]
fn a_missing_device() {
    if !vulkan::available() {
        return;
    }
    let setup = Setup::new(Profile::hdl64(), None);
    let beyond = devices().expect("a list").len();
    for index in [beyond, usize::MAX] {
        let options = Options { device: Some(index), ..Options::default() };
        let found = Device::new(&setup.profile, &setup.tables(), &options);
        assert_eq!(found.err(), Some(GpuError::NoDevice), "device {index}");
    }
}

#[test]
fn buffers_that_do_not_fit() {
    if !vulkan::available() {
        return;
    }
    let exabyte = 1 << 60;
    for heap in [Heap::Upload, Heap::Device, Heap::Readback] {
        let profile = Profile::hdl64();
        let mut table = Schedule::new(FLOW_PROGRAMS, &profile).buffers(&profile);
        table.push(Buffer { name: "too much", heap, bytes: exabyte });
        let Err(error) = Executor::new(&Options::default(), &table, &[]) else {
            panic!("{heap:?}: an exabyte");
        };
        let GpuError::OutOfMemory { heap: found, bytes } = error else {
            panic!("{heap:?}: {error}");
        };
        assert!(found == heap && bytes >= exabyte, "{error}");
    }
}

#[test]
fn a_backend_that_cannot_be_set_up_in_time() {
    let setup = Setup::new(Profile::hdl64(), None);
    // Compiles the kernels first: including that, the error once took 6 s on two busy cores.
    if setup.device(&Options::default()).is_none() {
        return;
    }
    let options = Options { timeout: Duration::from_nanos(1), ..Options::default() };
    let begin = Instant::now();
    let device = Device::new(&setup.profile, &setup.tables(), &options);
    match vulkan::present(device.map(|_| ())) {
        None => {}
        Some(Err(GpuError::Timeout { during, after })) => {
            assert!(["load", "flow"].contains(&during.program), "{during}");
            assert_eq!(after, options.timeout);
            assert!(begin.elapsed() < SOON, "{:?}", begin.elapsed());
        }
        Some(Err(error)) => panic!("{error}"),
        Some(Ok(())) => eprintln!("skipped: too fast a device to be late for sure"),
    }
}

/// A window so wide and so many rounds that a sweep of a street takes long, and so does its set-up.
fn slow() -> Setup {
    Setup::new(Profile { side: 337, em_rounds: 100, ..Profile::wide() }, None)
}

/// How long set-up without rays takes once kernels are compiled; `None` without a software device.
fn set_up_time(setup: &Setup) -> Option<Duration> {
    let mut time = Duration::ZERO;
    for _ in 0..2 {
        let begin = Instant::now();
        let Backend::Device(device) = setup.device(&Options::default())? else {
            unreachable!("a device was asked for")
        };
        time = begin.elapsed();
        let kind = devices().expect("a list").into_iter().find(|d| d.name == device.name());
        if kind.is_none_or(|d| d.kind != DeviceKind::Cpu) {
            eprintln!("skipped: too fast a device to be late for sure");
            return None;
        }
    }
    Some(time)
}

#[test]
fn a_missed_deadline_is_reported_from_then_on() {
    let setup = slow();
    let Some(enough) = set_up_time(&setup) else { return };
    let options = Options { timeout: enough, ..Options::default() };
    let Some(Ok(device)) = vulkan::present(Device::new(&setup.profile, &setup.tables(), &options))
    else {
        eprintln!("skipped: the machine is busy");
        return;
    };
    let mut drive = setup.drive(Backend::Device(Box::new(device)));
    let [first, second] = [&street()[0], &street()[1]];
    let mut fails = |now, before: &[_]| match drive.step(&sweep(now), before) {
        Ok(_) => None,
        Err(RunError::Device(error)) => Some(error),
        Err(other) => panic!("{other}"),
    };
    let errors = [(first, &[][..]), (second, &first.points), (second, &first.points)]
        .map(|(now, before)| fails(now, before));
    let Some(error) = errors[1].clone() else {
        eprintln!("skipped: {enough:?} were enough for a sweep");
        return;
    };
    let GpuError::Timeout { during, after } = &error else { panic!("{error}") };
    assert_eq!((during.program, *after), ("flow", enough));
    let begin = Instant::now();
    for _ in 0..10 {
        assert_eq!(fails(second, &first.points).as_ref(), Some(&error));
    }
    assert_eq!(errors[2], errors[1]);
    assert!(begin.elapsed() < SOON, "at once, not after {:?}", begin.elapsed());
    drop(drive);
    assert!(begin.elapsed() < 2 * SOON, "dropped after {:?}", begin.elapsed());
}
