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

/// Maximum number of threads. A sweep of `kitti_raw_0005` alongside a GPU takes 39, 28, 19 and 16
/// ms on 1, 2, 4 and 8 cores of a 16-core machine, and 13 to 17 on all of them: the rest is left to
/// other programs.
pub const THREADS_MAX: usize = 8;

/// The team of the calling thread.
#[derive(Clone, Copy)]
pub struct ThreadTeam {
    simd: Simd,
}

impl ThreadTeam {
    /// A team that uses these instructions, or the widest available if none are given.
    pub fn new(simd: Option<Simd>) -> ThreadTeam {
        ThreadTeam { simd: simd.unwrap_or_else(Simd::widest) }
    }
}

impl Team for ThreadTeam {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        if threads() > 1 {
            rayon_core::join(a, b);
        } else {
            raywake_core::team::SingleThread.join(a, b);
        }
    }

    fn simd(&self) -> Simd {
        self.simd
    }
}

/// Number of threads that share the work of the calling one, itself included.
pub fn threads() -> usize {
    // A pool accepts work from other threads too, but allocates for that.
    rayon_core::current_thread_index().map_or(1, |_| rayon_core::current_num_threads())
}

/// Number of threads that pay off on this machine.
pub fn available() -> usize {
    thread::available_parallelism().map_or(1, NonZero::get).min(THREADS_MAX)
}

/// Does `work` on this thread, with `threads - 1` others that share it: they are watched for
/// allocations all their life, and sleep while there is nothing to do. Once per thread: it cannot
/// lead another team.
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
    // Triggers what a thread allocates when it first looks for work.
    pool.broadcast(|_| ());
    work()
}
