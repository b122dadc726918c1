//! `raywake live`: flow from a sensor's packets as they arrive, at sensor rate.
//!
//! | thread | does | passes on |
//! |---|---|---|
//! | receiver | packets to returns, returns to sweeps ([`receiver`]) | the newest sweep |
//! | poses | keeps the latest poses ([`poses`]) | the pose at a stamp |
//! | worker, with its team | locates, computes flow, tracks objects, sends ([`worker`]) | a pair |
//! | recorder | writes messages to a file and to viewers ([`recorder`]) | |
//! | replay | sends a capture's packets in place of a sensor | |
//!
//! Values are passed on through a queue of one ([`handover`]), where the newest replaces one not
//! yet fetched: nothing grows, and no thread waits for a slower one. After the start, receiver,
//! poses and worker allocate nothing; recorder and replay do.

mod handover;
mod locating;
mod objects;
mod outlets;
pub mod poses;
mod receiver;
mod recorder;
mod stream;
mod summary;
mod worker;

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use raywake_core::digest::Digest;
use raywake_core::params::Profile;
use raywake_io::Error;
use raywake_io::sink::bag::BagSink;
use raywake_io::sink::streams::{Content, Pace, StreamTargets};
use raywake_io::source::capture::assembly::LiveSweep;
use raywake_io::source::capture::live::{LiveRig, LiveSensor};
use raywake_io::source::capture::replay::Replay;
use raywake_objects::params::TrackingParams;

use crate::args::{BackendChoice, LiveArgs, PosesFrom};
use crate::budget;
use crate::choose::{self, Chosen};
use crate::config::{self, Settings};
use crate::console::{bytes, interrupted, listen, note, say};
use crate::error::RunError;
use crate::figures::FiguresFile;
use crate::weight_files::WeightFiles;
use handover::{Fetched, Handover};
use objects::LiveObjects;
use outlets::Outlets;
use poses::PoseReceiver;
use receiver::Receiver;
use recorder::{RecordedPair, RecordingOutcome, record};
use stream::FlowStream;
use summary::LiveSummary;
use worker::{LiveEnd, Worker};

/// Default port: the one Velodyne sensors send to.
const PORT: u16 = 2368;
/// Wait after the last packet of a replay, for packets still on their way.
const REPLAY_TAIL: Duration = Duration::from_millis(300);
/// How often to check for the first sweep, and how long until a message says that there is none.
const POLL: Duration = Duration::from_millis(100);
const PATIENCE: Duration = Duration::from_secs(5);
/// A device has this many deadlines to answer.
const DEVICE_DEADLINES: u32 = 10;

/// What a run needs, checked before any socket or file is opened.
struct Plan<'a> {
    args: &'a LiveArgs,
    profile: Profile,
    tracking: TrackingParams,
    weights: WeightFiles,
    streams: StreamTargets,
}

/// Runs until a signal, or the end of a replay.
pub fn live(args: &LiveArgs) -> Result<(), RunError> {
    args.replay.check()?;
    listen();
    let Settings { profile, objects: tracking } = config::settings(&args.flow.profile)?;
    let weights = WeightFiles::read(&args.flow.learned, &profile)?;
    let streams = args.results.streams.sinks(Pace::AtOnce);
    let plan = Plan { args, profile, tracking, weights, streams };
    let replay = &args.replay;
    let open = |path| Replay::open(path, replay.topic.as_deref());
    let replay = replay.replay.as_deref().map(open).transpose()?;
    let sensor = match (&replay, args.model) {
        (Some(replay), _) => replay.sensor().clone(),
        (None, Some(model)) => LiveSensor::of(model, args.metadata.as_deref())?,
        (None, None) => unreachable!("the command line has one of them"),
    };
    let port = if replay.is_some() { 0 } else { PORT };
    let address = args.listen.unwrap_or_else(|| ([127, 0, 0, 1], port).into());
    let receiver = Receiver::bind(address, sensor)?;
    let poses = match args.poses_from {
        PosesFrom::Register => None,
        PosesFrom::Address(address) => Some(PoseReceiver::bind(address)?),
    };
    say(args.quiet, &format!("{} at {}\n", receiver.sensor().name(), receiver.address()))?;
    note(args.quiet, &receiver.note())?;
    let (sweeps, stop) = (Handover::new(LiveSweep::of(receiver.sensor())), AtomicBool::new(false));
    thread::scope(|scope| {
        scope.spawn(|| receiver.run(&sweeps, &stop));
        if let Some(poses) = &poses {
            scope.spawn(|| poses.run(&stop));
        }
        let replaying = replay.as_ref().map(|replay| {
            scope.spawn(|| {
                let over = || stop.load(Ordering::Relaxed);
                let sent = replay.send(receiver.address(), args.replay.speed.unwrap_or(1.0), over);
                thread::sleep(REPLAY_TAIL);
                stop.store(true, Ordering::Relaxed);
                sent
            })
        });
        let result = plan.work(&receiver, &sweeps, poses.as_ref());
        stop.store(true, Ordering::Relaxed);
        let sent = replaying.map(|thread| thread.join().expect("a replay does not panic"));
        // If a replay could not be sent, that is why no sweep came.
        sent.transpose().map_err(RunError::from).and(result)
    })
}

impl Plan<'_> {
    /// Processes everything from the first sweep to the end.
    fn work(
        &self,
        receiver: &Receiver,
        sweeps: &Handover<LiveSweep>,
        poses: Option<&PoseReceiver>,
    ) -> Result<(), RunError> {
        let (args, sensor) = (self.args, receiver.sensor());
        let figures = FiguresFile::create(args.results.summary.as_deref(), None)?;
        let content = if args.objects { Content::FlowAndObjects } else { Content::Flow };
        let mut sink = BagSink::create(&self.streams, 0, content)?;
        let mut first = LiveSweep::of(sensor);
        if !self.first_sweep(receiver, sweeps, &mut first)? {
            return Ok(());
        }
        let LiveRig { rig, notes } = sensor.learn(&first.data, &args.place.options())?;
        note(args.quiet, &notes)?;
        let period = Duration::from_nanos(first.period_ns as u64);
        let deadline = args.deadline.unwrap_or(period);
        let backend = &args.flow.backend;
        let timeout = backend.timeout.min(deadline * DEVICE_DEADLINES);
        let backend = BackendChoice { timeout, ..backend.clone() };
        let Chosen { drive, filter, note: lacking } =
            choose::drive(&backend, &self.weights, &self.profile, &rig)?;
        note(args.quiet, &lacking)?;
        say(args.quiet, &budget::paragraph(&self.profile, &drive, &filter))?;
        sink.iter_mut().for_each(|sink| sink.since(receiver.state().epoch_ns));
        let pairs = sink.is_some().then(|| {
            let spare = || RecordedPair::of(sensor, &self.profile);
            (Handover::new(spare()), spare())
        });
        let spare = pairs.as_ref().map(|_| RecordedPair::of(sensor, &self.profile));
        let (pairs, kept) = pairs.unzip();
        let worker = Worker {
            profile: &self.profile,
            rig: &rig,
            period,
            deadline,
            drive,
            objects: self.objects()?,
            locator: locating::LiveLocator::new(poses, args.trust_poses)?,
            outlets: Outlets {
                stream: args.results.send.map(FlowStream::to).transpose()?,
                recording: pairs.as_ref().zip(kept),
                digest: args.replay.replay.as_ref().map(|_| Digest::default()),
            },
            quiet: args.quiet,
            most: args.count.map_or(u64::MAX, |count| count as u64),
        };
        thread::scope(|scope| {
            let recorder = sink
                .zip(pairs.as_ref())
                .zip(spare)
                .map(|((sink, pairs), spare)| scope.spawn(move || record(sink, pairs, spare)));
            let ended = worker.run(receiver, sweeps, first);
            pairs.iter().for_each(Handover::close);
            let recorded = recorder.map(|thread| thread.join().expect("a recorder does not panic"));
            self.finish(&figures, receiver, poses, ended?, recorded.unwrap_or_default())
        })
    }

    /// The object tracker, if asked for.
    fn objects(&self) -> Result<Option<LiveObjects<'_>>, RunError> {
        if !self.args.objects {
            return Ok(None);
        }
        let held = bytes(LiveObjects::BYTES as u64);
        say(self.args.quiet, &format!("memory for objects: {held}\n"))?;
        LiveObjects::new(self.tracking, &self.profile).map(Some)
    }

    /// Waits for the first sweep. Returns whether one arrived: a signal may come first. Fails if a
    /// replay ends without one.
    fn first_sweep(
        &self,
        receiver: &Receiver,
        sweeps: &Handover<LiveSweep>,
        into: &mut LiveSweep,
    ) -> Result<bool, RunError> {
        let (began, mut notified) = (Instant::now(), false);
        loop {
            match sweeps.fetch(into, POLL) {
                Fetched::Value => return Ok(true),
                Fetched::Nothing if !interrupted() => {}
                Fetched::Nothing | Fetched::Closed => break,
            }
            if !notified && began.elapsed() > PATIENCE {
                notified = true;
                let counts = receiver.state().counts;
                let what = format!(
                    "no complete sweep yet: {} packets from a {}, {} other datagrams",
                    counts.packets,
                    receiver.sensor().name(),
                    counts.foreign
                );
                note(self.args.quiet, &[what])?;
            }
        }
        match &self.args.replay.replay {
            // Somebody who ends it early knows.
            Some(path) if !interrupted() => {
                Err(Error::input(path, "", "has no complete sweep").into())
            }
            _ => {
                say(self.args.quiet, "no complete sweep arrived\n")?;
                Ok(false)
            }
        }
    }

    /// Prints and writes the summary. Fails if recording did.
    fn finish(
        &self,
        figures: &FiguresFile,
        receiver: &Receiver,
        poses: Option<&PoseReceiver>,
        ended: LiveEnd,
        recorded: RecordingOutcome,
    ) -> Result<(), RunError> {
        let failure = recorded.failure.as_ref().map(ToString::to_string);
        let mut summary = LiveSummary {
            poses: poses.map(PoseReceiver::counts),
            recording_failure: failure,
            ..ended.summary(&self.profile, receiver)
        };
        summary.sweeps.recorded = recorded.pairs;
        say(self.args.quiet, &summary.text())?;
        figures.write(&summary)?;
        recorded.failure.map_or(Ok(()), |e| Err(e.into()))
    }
}
