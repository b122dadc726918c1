//! What the guard sees, and which step returns it. One test, because the note is process-wide.

#![forbid(unsafe_code)]

use raywake_alloc_guard::{Allocation, Guard, Sealed, watch};
use std::hint::black_box;

#[global_allocator]
static ALLOCATOR: Guard<std::alloc::System> = Guard(std::alloc::System);

/// The section and size that a step of `section` returns.
fn reported(section: &'static str, work: impl FnOnce()) -> Option<(&'static str, usize)> {
    report(&mut Sealed::new(section, ()), work)
}

fn report(sealed: &mut Sealed<()>, work: impl FnOnce()) -> Option<(&'static str, usize)> {
    let step = sealed.step(|()| {
        work();
        Ok::<_, Allocation>(())
    });
    step.err().map(|e| (e.section, e.bytes))
}

fn allocate(bytes: usize) {
    drop(black_box(vec![1u8; bytes]));
}

#[test]
fn a_step_returns_the_first_allocation_in_it() {
    allocate(3);
    assert_eq!(reported("a", || ()), None);
    assert_eq!(reported("a", || allocate(5)), Some(("a", 5)));
    let mut grown = Vec::with_capacity(1);
    let both = || {
        grown.extend([1u64, 2]);
        allocate(5);
    };
    assert_eq!(reported("grows", both), Some(("grows", 32)));
    assert_eq!(reported("zeroes", || drop(black_box(vec![0u8; 6]))), Some(("zeroes", 6)));
    assert_eq!(reported("frees", || drop(grown)), None);

    let inner = || {
        watch("inner", || ());
        allocate(7);
    };
    assert_eq!(reported("outer", || watch("inner", || allocate(7))), Some(("inner", 7)));
    assert_eq!(reported("outer", inner), Some(("outer", 7)));

    let unwound =
        std::panic::catch_unwind(|| watch("w", || std::panic::resume_unwind(Box::new(0))));
    assert!(unwound.is_err());
    allocate(8);
    assert_eq!(reported("after unwinding", || ()), None);

    let help = || std::thread::spawn(|| watch("helper", || allocate(9))).join().expect("no panic");
    help();
    let mut sealed = Sealed::new("a", ());
    assert_eq!(report(&mut sealed, || ()), None, "set-up");
    help();
    assert_eq!(report(&mut sealed, || ()), Some(("helper", 9)));
    assert_eq!(report(&mut sealed, || ()), None);

    let mut sealed = Sealed::new("a", 1);
    let failed = sealed.step(|value| {
        *value = 2;
        allocate(4);
        Err::<(), _>(Failed::OfItself)
    });
    assert!(matches!(failed, Err(Failed::OfItself)) && *sealed == 2);
    assert!(sealed.step(|_| Ok::<_, Failed>(())).is_ok());
    assert_eq!(sealed.finish(), 2);
    let reported = Sealed::new("b", ()).step(|()| {
        allocate(4);
        Ok(())
    });
    let Err(Failed::Allocation(e)) = reported else { panic!("not reported") };
    let text = e.to_string();
    assert!(text.starts_with("4 bytes allocated in the section `b`"), "{text}");
}

enum Failed {
    OfItself,
    Allocation(Allocation),
}

impl From<Allocation> for Failed {
    fn from(e: Allocation) -> Failed {
        Failed::Allocation(e)
    }
}
