//! The thread that computes the flow: the run loop of live input.

use std::time::{Duration, Instant};

use raywake_alloc_guard::watch;
use raywake_core::output::ColumnFlow;
use raywake_core::params::Profile;
use raywake_core::sweep::Rig;
use raywake_gpu::GpuError;
use raywake_io::source::capture::assembly::LiveSweep;
use sd_notify::NotifyState;

use super::handover::{Fetched, Handover};
use super::locating::{LiveLocator, LocatedCounts};
use super::receiver::Receiver;
use super::recorder::RecordedPair;
use super::stream::{FlowStream, SentSweep, SweepFacts};
use super::summary::{LiveStatistics, LiveSummary};
use crate::console::{interrupted, say, warn};
use crate::drive::Drive;
use crate::error::RunError;
use crate::team;

/// How often is asked whether it is over, where no sweep comes.
const POLL: Duration = Duration::from_millis(100);
/// Without a sweep for so long the user is told.
const PAUSE: Duration = Duration::from_secs(1);
/// How often the user is told how it goes, and whoever watches the process that it is alive.
const STATUS: Duration = Duration::from_secs(5);
const ALIVE: Duration = Duration::from_secs(1);

/// All that a run needs, allocated.
pub struct Worker<'a> {
    pub profile: &'a Profile,
    pub rig: &'a Rig,
    pub turn: Duration,
    pub deadline: Duration,
    pub drive: Drive,
    pub locator: LiveLocator<'a>,
    pub stream: Option<FlowStream>,
    /// Where pairs go that are recorded, and the next one.
    pub recording: Option<(&'a Handover<RecordedPair>, RecordedPair)>,
    /// Whether results are digested.
    pub digests: bool,
    pub quiet: bool,
    /// Sweeps after which it ends.
    pub most: u64,
}

/// A run that has ended.
pub struct LiveEnd {
    statistics: LiveStatistics,
    drive: Drive,
    located: LocatedCounts,
    frames: Option<[u64; 2]>,
    digests: bool,
    seconds: f64,
    times: [Duration; 2],
}

/// A run under way.
struct LiveRun<'a> {
    worker: Worker<'a>,
    statistics: LiveStatistics,
    now: LiveSweep,
    /// The sweep done before, and whether there is one.
    last: LiveSweep,
    paired: bool,
    frames: Option<[u64; 2]>,
}

impl Worker<'_> {
    /// Sends what moves in a sweep, and the sweep.
    fn send(&mut self, sweep: &LiveSweep, mut facts: SweepFacts) {
        let Some(stream) = &mut self.stream else { return };
        let moves_min = self.profile.moves.moves_min;
        let moving = self.drive.tracklets().filter(|t| t.probability >= moves_min);
        let sweep = sent_sweep(sweep);
        facts.sent[1] = stream.tracklets(&sweep, moving);
        stream.sweep(&sweep, &facts);
    }

    /// Hands on a pair whose flow is kept, for another sweep of no meaning in place of its first.
    fn record(&mut self, first: &mut LiveSweep) {
        let Some((pairs, kept)) = &mut self.recording else { return };
        kept.take_first(first);
        pairs.put(kept);
    }

    /// Works on sweeps until a signal, the last one, or so many. `spare` is of no meaning.
    ///
    /// # Errors
    /// [`RunError::Device`] without a spare backend.
    pub fn run(
        self,
        receiver: &Receiver,
        sweeps: &Handover<LiveSweep>,
        spare: LiveSweep,
    ) -> Result<LiveEnd, RunError> {
        let (digests, times, most) = (self.digests, [self.turn, self.deadline], self.most);
        let mut running = LiveRun {
            statistics: LiveStatistics::new(),
            now: LiveSweep::of(receiver.sensor()),
            last: spare,
            paired: false,
            frames: None,
            worker: self,
        };
        running.statistics.counts.before_start = sweeps.replaced();
        // Nobody may watch.
        let _ = sd_notify::notify(&[NotifyState::Ready]);
        let began = Instant::now();
        let (mut status, mut alive, mut came) = (began, began, began);
        let mut pausing = false;
        while !interrupted() && running.statistics.counts.done < most {
            match watch("live", || sweeps.fetch(&mut running.now, POLL)) {
                Fetched::Value => {
                    (came, pausing) = (Instant::now(), false);
                    running.take(sweeps)?;
                }
                Fetched::Nothing if came.elapsed() > PAUSE && !pausing => {
                    pausing = true;
                    running.pause(receiver);
                }
                Fetched::Nothing => {}
                Fetched::Closed => break,
            }
            if alive.elapsed() > ALIVE {
                alive = Instant::now();
                let _ = sd_notify::notify(&[NotifyState::Watchdog]);
            }
            if status.elapsed() > STATUS {
                status = Instant::now();
                // A log that cannot be written is no reason to stop.
                let _ = say(running.worker.quiet, &running.status(receiver, began));
            }
        }
        let _ = sd_notify::notify(&[NotifyState::Stopping]);
        let LiveRun { worker, mut statistics, frames, .. } = running;
        let counts = &mut statistics.counts;
        counts.unsent_datagrams = worker.stream.as_ref().map_or(0, FlowStream::unsent);
        counts.unrecorded = worker.recording.as_ref().map_or(0, |(pairs, _)| pairs.replaced());
        let (located, drive) = (worker.locator.counts(), worker.drive);
        let seconds = began.elapsed().as_secs_f64();
        Ok(LiveEnd { statistics, drive, located, frames, digests, seconds, times })
    }
}

impl LiveRun<'_> {
    /// One sweep. Memory allocated in it is a defect that is counted, and told once: a vehicle goes
    /// on.
    fn take(&mut self, sweeps: &Handover<LiveSweep>) -> Result<(), RunError> {
        let counts = &mut self.statistics.counts;
        counts.left_out = sweeps.replaced() - counts.before_start;
        match watch("live", || self.sweep()) {
            Err(RunError::Allocation(allocation)) => {
                let counts = &mut self.statistics.counts;
                counts.allocating += 1;
                if counts.allocating == 1 {
                    warn(&format!("a defect of this program: {allocation}"));
                }
                Ok(())
            }
            result => result,
        }
    }

    /// One sweep, from its returns to what is sent.
    fn sweep(&mut self) -> Result<(), RunError> {
        let LiveRun { worker, statistics, now, last, paired, frames, .. } = self;
        let turn_ns = worker.turn.as_nanos() as u64;
        let counts = &mut statistics.counts;
        counts.incomplete += u64::from(now.lost_packets > 0);
        counts.missing += now.data.dropped.sweeps_before;
        if !worker.locator.locate(worker.rig, now, turn_ns)? {
            return Ok(());
        }
        let before = if *paired { &last.data.points[..] } else { &[] };
        let stepped = worker.drive.step(&now.data.sweep(), before)?;
        let output = &stepped.output;
        statistics.sweep(output);
        let (mut sent, mut aside) = ([0; 2], Duration::ZERO);
        if let Some(flows) = &output.flows {
            let moves = |column: &&ColumnFlow| column.velocity_world_mps != [0.0; 2];
            let columns = flows.columns.iter().filter(moves);
            statistics.counts.moving_columns += columns.clone().count() as u64;
            if let Some(stream) = &mut worker.stream {
                sent[0] = stream.columns(&sent_sweep(last), columns);
            }
            // What nobody waits for, done now as the next borrow of the drive ends the flow.
            let clock = Instant::now();
            if let Some((_, kept)) = &mut worker.recording {
                kept.keep(flows);
            }
            if worker.digests {
                flows.columns.iter().for_each(|c| statistics.digest.column(c));
                flows.points.iter().for_each(|p| statistics.digest.point(&p));
            }
            aside = clock.elapsed();
        }
        let dt_s = output.flows.map(|flows| flows.dt_s);
        let facts = SweepFacts {
            dt_s: dt_s.unwrap_or(0.0),
            latency_ms: latency_ms(now, aside),
            left_out: statistics.counts.left_out,
            sent,
            before_ns: last.stamp_ns,
        };
        worker.send(now, facts);
        // With the first pair the run has started: registration tries several motions there.
        if statistics.counts.pairs > 1 {
            let deadline_ms = worker.deadline.as_secs_f64() * 1e3;
            statistics.latency(latency_ms(now, aside), deadline_ms);
        }
        if worker.digests {
            worker.drive.tracklets().for_each(|t| statistics.digest.tracklet(&t));
        }
        if dt_s.is_some() {
            worker.record(last);
        }
        let frame = now.data.frame;
        *frames = Some(frames.map_or([frame; 2], |[first, _]| [first, frame]));
        std::mem::swap(now, last);
        *paired = true;
        Ok(())
    }

    /// No sweep has come for a while.
    fn pause(&mut self, receiver: &Receiver) {
        let counts = &mut self.statistics.counts;
        counts.pauses += 1;
        let packets = receiver.state().counts.packets;
        warn(&format!("no sweep for {} s; {packets} packets so far", PAUSE.as_secs()));
    }

    /// How it goes, for people.
    fn status(&self, receiver: &Receiver, began: Instant) -> String {
        let (counts, latencies) = (&self.statistics.counts, &self.statistics.latencies);
        let latency = latencies.figures().map_or(String::new(), |l| format!(", {}", l.line()));
        let missing = receiver.state().counts.missing;
        format!(
            "{:.0} s: {} sweeps{latency}; {} left out, {} late; {missing} packets missing\n",
            began.elapsed().as_secs_f64(),
            counts.done,
            counts.left_out,
            counts.late,
        )
    }
}

/// Since a sweep's last packet came, ms, but for what was done aside.
fn latency_ms(sweep: &LiveSweep, aside: Duration) -> f64 {
    sweep.arrived.elapsed().saturating_sub(aside).as_secs_f64() * 1e3
}

fn sent_sweep(sweep: &LiveSweep) -> SentSweep {
    let LiveSweep { data, stamp_ns, .. } = sweep;
    SentSweep { number: data.frame, stamp_ns: *stamp_ns, pose: data.world_from_vehicle }
}

impl LiveEnd {
    /// What it was and what came of it; poses and recording apart.
    pub fn summary(&self, profile: &Profile, receiver: &Receiver) -> LiveSummary {
        let (drive, state) = (&self.drive, receiver.state());
        let [turn_ms, deadline_ms] = self.times.map(|time| time.as_secs_f64() * 1e3);
        let digest = format!("{:016x}", self.statistics.digest.value());
        LiveSummary {
            version: env!("CARGO_PKG_VERSION"),
            sensor: receiver.sensor().name().to_owned(),
            sender: state.sender.map(|sender| sender.to_string()),
            profile: profile.name.to_string(),
            backend: drive.backend().name(),
            device: drive.backend().device().to_owned(),
            threads: team::threads(),
            simd: drive.simd().name(),
            turn_ms,
            deadline_ms,
            seconds: self.seconds,
            packets: state.counts,
            overflowed: receiver.overflowed(),
            held_bytes: receiver.held(),
            sweeps: self.statistics.counts,
            frames: self.frames,
            dropped_returns: self.statistics.dropped,
            located: self.located,
            poses: None,
            latency_ms: self.statistics.latencies.figures(),
            device_failure: drive.failure().map(GpuError::to_string),
            recording_failure: None,
            digest: self.digests.then_some(digest),
        }
    }
}
