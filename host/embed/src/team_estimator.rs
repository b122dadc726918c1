//! An estimator with its own threads.
//!
//! Threads that share work allocate when an outside thread hands them some. So one of the team
//! leads it: it waits for sweeps, and whoever gives one waits for it.

use std::fmt;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

use rayon_core::{ThreadPool, ThreadPoolBuilder};
use raywake_team::ThreadTeam;

use crate::memory::HeapMemory;
use crate::{
    CreateError, EstimatorOptions, FlowEstimator, ReturnSource, StepSummary, SweepError, SweepPlace,
};

/// Why a step has no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepError {
    /// The sweep was refused.
    Sweep(SweepError),
    /// A defect of this library: the step did not finish, and no later one will.
    Failed,
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            StepError::Sweep(e) => e.fmt(f),
            StepError::Failed => write!(f, "internal error: a sweep was not finished"),
        }
    }
}

impl std::error::Error for StepError {}

/// An estimator and the threads that share its work. Any thread may give it sweeps.
pub struct TeamEstimator {
    exchange: Arc<Exchange>,
    threads: Vec<JoinHandle<()>>,
    pool: Option<ThreadPool>,
    /// The estimator's memory, unless it is the caller's. Dropped last.
    memory: Option<HeapMemory>,
}

/// Why an estimator with threads cannot be created.
#[derive(Debug)]
pub enum TeamError {
    /// The estimator itself cannot be created.
    Create(CreateError),
    /// The system has no more threads.
    Threads(io::Error),
}

/// A step whose returns have been copied. It is completed when this is dropped, at the latest.
#[must_use = "dropping it does the rest of the step, and loses its result"]
pub struct ReceivedStep<'a> {
    team: &'a TeamEstimator,
    rest: Option<SweepPlace>,
}

/// Where the caller and the team's leader meet.
struct Exchange {
    work: Mutex<Work>,
    changed: Condvar,
}

struct Work {
    estimator: FlowEstimator,
    order: StepOrder,
    /// Something panicked.
    failed: bool,
}

enum StepOrder {
    None,
    /// The returns are in place.
    Step(SweepPlace),
    Done(Result<StepSummary, StepError>),
    Quit,
}

impl fmt::Display for TeamError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            TeamError::Create(e) => e.fmt(f),
            TeamError::Threads(e) => e.fmt(f),
        }
    }
}

impl TeamEstimator {
    /// Gives an estimator this many threads, not counting the caller's, which waits meanwhile; 0:
    /// as many as pay off. With one, the calling thread does the work.
    ///
    /// # Errors
    /// The system has no more threads.
    pub fn new(estimator: FlowEstimator, threads: usize) -> io::Result<TeamEstimator> {
        let threads = worthwhile_threads(threads);
        let work = Work { estimator, order: StepOrder::None, failed: false };
        let exchange = Arc::new(Exchange { work: Mutex::new(work), changed: Condvar::new() });
        let mut made = TeamEstimator { exchange, threads: Vec::new(), pool: None, memory: None };
        if threads > 1 {
            made.gather(threads)?;
        }
        Ok(made)
    }

    /// The same, in its own heap memory.
    ///
    /// # Errors
    /// As for [`FlowEstimator::new`] and [`TeamEstimator::new`].
    pub fn on_heap(options: &EstimatorOptions, threads: usize) -> Result<TeamEstimator, TeamError> {
        let bytes = options.bytes().map_err(TeamError::Create)?;
        // SAFETY: it is kept until after the estimator is dropped.
        let housed = unsafe { HeapMemory::new(bytes) };
        let (memory, place) = housed.ok_or(TeamError::Create(CreateError::Memory(bytes)))?;
        let estimator = FlowEstimator::new(options, place).map_err(TeamError::Create)?;
        let mut made = TeamEstimator::new(estimator, threads).map_err(TeamError::Threads)?;
        made.memory = Some(memory);
        Ok(made)
    }

    fn gather(&mut self, threads: usize) -> io::Result<()> {
        let running = &mut self.threads;
        let pool = ThreadPoolBuilder::new().num_threads(threads).spawn_handler(|member| {
            let name = format!("raywake {}", member.index());
            running.push(thread::Builder::new().name(name).spawn(|| member.run())?);
            Ok(())
        });
        let pool = pool.build().map_err(io::Error::other)?;
        // Triggers what a thread allocates when it first looks for work.
        pool.broadcast(|_| ());
        let exchange = self.exchange.clone();
        pool.spawn(move || exchange.lead());
        self.pool = Some(pool);
        Ok(())
    }

    /// Number of threads that share the work.
    pub fn threads(&self) -> usize {
        self.threads.len().max(1)
    }

    /// Processes one sweep. See [`FlowEstimator::step`].
    ///
    /// # Errors
    /// The sweep was refused, or this step or an earlier one failed.
    pub fn step(
        &mut self,
        place: &SweepPlace,
        points: impl ReturnSource,
    ) -> Result<StepSummary, StepError> {
        self.receive(place, points)?.complete()
    }

    /// The first part of a step: copies the returns.
    ///
    /// # Errors
    /// As for [`TeamEstimator::step`].
    pub fn receive(
        &mut self,
        place: &SweepPlace,
        points: impl ReturnSource,
    ) -> Result<ReceivedStep<'_>, StepError> {
        let received = self.exchange.work().contain(|e| e.receive(place, points));
        received?.map_err(StepError::Sweep)?;
        Ok(ReceivedStep { team: self, rest: Some(*place) })
    }

    /// Reads the results of the last sweep.
    ///
    /// # Errors
    /// A step failed, or `read` panics: then all later steps fail.
    pub fn read<R>(&self, read: impl FnOnce(&FlowEstimator) -> R) -> Result<R, StepError> {
        self.exchange.work().contain(|estimator| read(estimator))
    }
}

/// The number asked for, or as many as pay off; at most `THREADS_MAX`.
fn worthwhile_threads(asked: usize) -> usize {
    match asked {
        0 => raywake_team::available(),
        n => n.min(raywake_team::THREADS_MAX),
    }
}

impl Exchange {
    fn work(&self) -> MutexGuard<'_, Work> {
        self.work.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'a>(&self, work: MutexGuard<'a, Work>) -> MutexGuard<'a, Work> {
        self.changed.wait(work).unwrap_or_else(PoisonError::into_inner)
    }

    /// Has the leader do a step, and waits for it.
    fn order(
        &self,
        mut work: MutexGuard<Work>,
        place: &SweepPlace,
    ) -> Result<StepSummary, StepError> {
        work.order = StepOrder::Step(*place);
        self.changed.notify_all();
        loop {
            if let StepOrder::Done(result) = work.order {
                work.order = StepOrder::None;
                return result;
            }
            work = self.wait(work);
        }
    }

    /// The leader's loop.
    fn lead(&self) {
        let mut work = self.work();
        loop {
            match work.order {
                StepOrder::Step(place) => {
                    let result = work.step(&place);
                    work.order = StepOrder::Done(result);
                    self.changed.notify_all();
                }
                StepOrder::Quit => return,
                StepOrder::None | StepOrder::Done(_) => work = self.wait(work),
            }
        }
    }
}

impl Work {
    fn step(&mut self, place: &SweepPlace) -> Result<StepSummary, StepError> {
        self.contain(|estimator| estimator.advance(&ThreadTeam::new(None), place))
    }

    /// Lets nothing unwind into the caller, who may not be written in Rust. What panicked may have
    /// left the estimator in any state: it is not used again.
    fn contain<R>(&mut self, work: impl FnOnce(&mut FlowEstimator) -> R) -> Result<R, StepError> {
        if !self.failed {
            let contained = catch_unwind(AssertUnwindSafe(|| work(&mut self.estimator)));
            self.failed = contained.is_err();
            return contained.map_err(|_| StepError::Failed);
        }
        Err(StepError::Failed)
    }
}

impl ReceivedStep<'_> {
    /// Does the rest of the step.
    ///
    /// # Errors
    /// This step failed.
    pub fn complete(mut self) -> Result<StepSummary, StepError> {
        // Nothing takes it but this and the drop after it.
        self.rest.take().map_or(Err(StepError::Failed), |place| self.advance(&place))
    }

    fn advance(&self, place: &SweepPlace) -> Result<StepSummary, StepError> {
        let mut work = self.team.exchange.work();
        match self.team.pool {
            None => work.step(place),
            Some(_) => self.team.exchange.order(work, place),
        }
    }
}

impl Drop for ReceivedStep<'_> {
    fn drop(&mut self) {
        // A failure is reported by every later call.
        let _ = self.rest.take().map(|place| self.advance(&place));
    }
}

impl Drop for TeamEstimator {
    /// Waits for all threads to end: the code they run may be unloaded next.
    fn drop(&mut self) {
        self.exchange.work().order = StepOrder::Quit;
        self.exchange.changed.notify_all();
        self.pool = None;
        // A thread that panicked has ended, too.
        self.threads.drain(..).for_each(|thread| drop(thread.join()));
    }
}
