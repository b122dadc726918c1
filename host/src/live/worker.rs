//! The thread that computes the flow: the run loop of live input.

use std::time::{Duration, Instant};

use raywake_alloc_guard::watch;
use raywake_core::digest::Digest;
use raywake_core::params::Profile;
use raywake_core::sweep::Rig;
use raywake_gpu::GpuError;
use raywake_io::source::capture::assembly::LiveSweep;
use raywake_objects::front_end::TrackingCounts;
use sd_notify::NotifyState;

use super::handover::{Fetched, Handover};
use super::locating::{LiveLocator, LocatedCounts};
use super::objects::LiveObjects;
use super::outlets::{Outlets, SentFlow, sent_sweep};
use super::receiver::Receiver;
use super::stream::SweepFacts;
use super::summary::{LiveStatistics, LiveSummary};
use crate::console::{interrupted, say, warn};
use crate::drive::Drive;
use crate::error::RunError;
use crate::team;

/// How often to check for the end when no sweep arrives.
const POLL: Duration = Duration::from_millis(100);
/// The user is warned after this time without a sweep.
const PAUSE: Duration = Duration::from_secs(1);
/// Intervals of status lines to the user and of watchdog notifications to systemd.
const STATUS: Duration = Duration::from_secs(5);
const ALIVE: Duration = Duration::from_secs(1);

/// Everything a run needs, allocated.
pub struct Worker<'a> {
    pub profile: &'a Profile,
    pub rig: &'a Rig,
    pub period: Duration,
    pub deadline: Duration,
    pub drive: Drive,
    pub objects: Option<LiveObjects<'a>>,
    pub locator: LiveLocator<'a>,
    pub outlets: Outlets<'a>,
    pub quiet: bool,
    /// Number of sweeps after which the run ends.
    pub most: u64,
}

/// A run that has ended.
pub struct LiveEnd {
    statistics: LiveStatistics,
    drive: Drive,
    located: LocatedCounts,
    frames: Option<[u64; 2]>,
    digest: Option<Digest>,
    tracking: Option<TrackingCounts>,
    seconds: f64,
    times: [Duration; 2],
}

/// A run in progress.
struct LiveRun<'a> {
    worker: Worker<'a>,
    statistics: LiveStatistics,
    now: LiveSweep,
    /// The sweep processed before, and whether there is one.
    last: LiveSweep,
    paired: bool,
    frames: Option<[u64; 2]>,
}

impl Worker<'_> {
    /// Sends the moving tracklets of a sweep, then the sweep's record.
    fn send(&mut self, sweep: &LiveSweep, mut facts: SweepFacts) {
        let Some(stream) = &mut self.outlets.stream else { return };
        let moves_min = self.profile.moves.moves_min;
        let moving = self.drive.tracklets().filter(|t| t.probability >= moves_min);
        let sweep = sent_sweep(sweep);
        facts.sent[1] = stream.tracklets(&sweep, moving);
        stream.sweep(&sweep, &facts);
    }

    /// Processes sweeps until a signal, the last one, or the maximum number. The content of `spare`
    /// is irrelevant.
    ///
    /// # Errors
    /// [`RunError::Device`] without a spare backend.
    pub fn run(
        self,
        receiver: &Receiver,
        sweeps: &Handover<LiveSweep>,
        spare: LiveSweep,
    ) -> Result<LiveEnd, RunError> {
        let (times, most) = ([self.period, self.deadline], self.most);
        let mut running = LiveRun {
            statistics: LiveStatistics::new(),
            now: LiveSweep::of(receiver.sensor()),
            last: spare,
            paired: false,
            frames: None,
            worker: self,
        };
        running.statistics.counts.before_start = sweeps.replaced();
        // Ignored: there may be no service manager.
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
                // Failure to write the log is no reason to stop.
                let _ = say(running.worker.quiet, &running.status(receiver, began));
            }
        }
        let _ = sd_notify::notify(&[NotifyState::Stopping]);
        let LiveRun { worker, mut statistics, frames, .. } = running;
        let counts = &mut statistics.counts;
        counts.unsent_datagrams = worker.outlets.unsent();
        counts.unrecorded = worker.outlets.unrecorded();
        Ok(LiveEnd {
            statistics,
            drive: worker.drive,
            located: worker.locator.counts(),
            frames,
            digest: worker.outlets.digest,
            tracking: worker.objects.as_ref().map(LiveObjects::counts),
            seconds: began.elapsed().as_secs_f64(),
            times,
        })
    }
}

impl LiveRun<'_> {
    /// Processes one sweep. Memory allocated in it is a bug, counted and reported once: the vehicle
    /// keeps moving.
    fn take(&mut self, sweeps: &Handover<LiveSweep>) -> Result<(), RunError> {
        let counts = &mut self.statistics.counts;
        counts.left_out = sweeps.replaced() - counts.before_start;
        match watch("live", || self.sweep()) {
            Err(RunError::Allocation(allocation)) => {
                let counts = &mut self.statistics.counts;
                counts.allocating += 1;
                if counts.allocating == 1 {
                    warn(&format!("internal error: {allocation}"));
                }
                Ok(())
            }
            result => result,
        }
    }

    /// Processes one sweep, from its returns to the datagrams.
    fn sweep(&mut self) -> Result<(), RunError> {
        let LiveRun { worker, statistics, now, last, paired, frames, .. } = self;
        let period_ns = worker.period.as_nanos() as u64;
        let counts = &mut statistics.counts;
        counts.incomplete += u64::from(now.lost_packets > 0);
        counts.missing += now.data.dropped.sweeps_before;
        if !worker.locator.locate(worker.rig, now, period_ns)? {
            return Ok(());
        }
        let before = if *paired { &last.data.points[..] } else { &[] };
        let stepped = worker.drive.step(&now.data.sweep(), before)?;
        let output = &stepped.output;
        statistics.sweep(output);
        let flows = output.flows.as_ref();
        let gone = flows.map(|flows| worker.outlets.flow(last, flows)).unwrap_or_default();
        let SentFlow { moving, aside } = gone;
        statistics.counts.moving_columns += moving as u64;
        let mut objects = 0;
        if let Some(tracker) = worker.objects.as_mut().filter(|_| *paired) {
            let seen = tracker.step(worker.rig, &last.data.sweep(), flows.map(|f| f.points))?;
            objects = seen.len();
            statistics.objects(seen);
            worker.outlets.objects(last, seen);
        }
        let dt_s = output.flows.map(|flows| flows.dt_s);
        let facts = SweepFacts {
            dt_s: dt_s.unwrap_or(0.0),
            latency_ms: latency_ms(now, aside),
            left_out: statistics.counts.left_out,
            sent: [moving, 0, objects],
            before_ns: last.stamp_ns,
        };
        worker.send(now, facts);
        // Without the first pair, on which registration tries several motions.
        if statistics.counts.pairs > 1 {
            let deadline_ms = worker.deadline.as_secs_f64() * 1e3;
            statistics.latency(latency_ms(now, aside), deadline_ms);
        }
        if let Some(digest) = &mut worker.outlets.digest {
            worker.drive.tracklets().for_each(|t| digest.tracklet(&t));
        }
        if dt_s.is_some() {
            worker.outlets.record(last);
        }
        let frame = now.data.frame;
        *frames = Some(frames.map_or([frame; 2], |[first, _]| [first, frame]));
        std::mem::swap(now, last);
        *paired = true;
        Ok(())
    }

    /// Warns that no sweep has arrived for a while.
    fn pause(&mut self, receiver: &Receiver) {
        let counts = &mut self.statistics.counts;
        counts.pauses += 1;
        let packets = receiver.state().counts.packets;
        warn(&format!("no sweep for {} s; {packets} packets so far", PAUSE.as_secs()));
    }

    /// The status line for the user.
    fn status(&self, receiver: &Receiver, began: Instant) -> String {
        let (counts, latencies) = (&self.statistics.counts, &self.statistics.latencies);
        let latency = latencies.figures().map_or(String::new(), |l| format!(", {}", l.line()));
        let missing = receiver.state().counts.missing;
        format!(
            "{:.0} s: {} sweeps{latency}; {} dropped, {} late; {missing} packets missing\n",
            began.elapsed().as_secs_f64(),
            counts.done,
            counts.left_out,
            counts.late,
        )
    }
}

/// Time since a sweep's last packet arrived, excluding the time spent on other output, ms.
fn latency_ms(sweep: &LiveSweep, aside: Duration) -> f64 {
    sweep.arrived.elapsed().saturating_sub(aside).as_secs_f64() * 1e3
}

impl LiveEnd {
    /// The summary of the run, without poses and recording.
    pub fn summary(&self, profile: &Profile, receiver: &Receiver) -> LiveSummary {
        let (drive, state) = (&self.drive, receiver.state());
        let [turn_ms, deadline_ms] = self.times.map(|time| time.as_secs_f64() * 1e3);
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
            tracking: self.tracking,
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
            digest: self.digest.map(|digest| format!("{:016x}", digest.value())),
        }
    }
}
