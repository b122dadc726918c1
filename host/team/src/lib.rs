#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! The threads that share the work within a sweep.
//!
//! The program's working thread leads a team of one thread per core, at most [`THREADS_MAX`]. Every
//! other thread works alone.

use std::num::NonZero;
use std::thread;

use rayon_core::ThreadPoolBuilder;
use raywake_alloc_guard::watch;
use raywake_core::team::Team;
use raywake_simd::Simd;

/// Threads at most. A sweep of `kitti_raw_0005` beside a GPU takes 39, 28, 19 and 16 ms on 1, 2, 4
/// and 8 cores of a machine of 16, and 13 to 17 on all of them: the rest is left to others.
pub const THREADS_MAX: usize = 8;

/// Whoever belongs to the thread that asks.
#[derive(Clone, Copy)]
pub struct ThreadTeam {
    simd: Simd,
}

impl ThreadTeam {
    /// With these instructions, the widest that there are if none are given.
    pub fn new(simd: Option<Simd>) -> ThreadTeam {
        ThreadTeam { simd: simd.unwrap_or_else(Simd::widest) }
    }
}

impl Team for ThreadTeam {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        if threads() > 1 {
            rayon_core::join(a, b);
        } else {
            raywake_core::team::Alone.join(a, b);
        }
    }

    fn simd(&self) -> Simd {
        self.simd
    }
}

/// How many threads share the work of this one, itself among them.
pub fn threads() -> usize {
    // A pool takes in the work of other threads too, but allocates for that.
    rayon_core::current_thread_index().map_or(1, |_| rayon_core::current_num_threads())
}

/// As many threads as pay on this machine.
pub fn available() -> usize {
    thread::available_parallelism().map_or(1, NonZero::get).min(THREADS_MAX)
}

/// Does `work` on this thread, with so many less one others that share it: they are watched for
/// allocations all their life, and sleep where there is nothing to do. Once a thread: there is no
/// other team for it.
pub fn lead<R>(threads: usize, work: impl FnOnce() -> R) -> R {
    if threads < 2 {
        return work();
    }
    let pool = ThreadPoolBuilder::new().num_threads(threads).use_current_thread();
    let pool = pool.spawn_handler(|other| {
        thread::Builder::new().spawn(|| watch("helper thread", || other.run()))?;
        Ok(())
    });
    let pool = pool.build().expect("the system has threads");
    // What a thread allocates when it first looks for work.
    pool.broadcast(|_| ());
    work()
}
