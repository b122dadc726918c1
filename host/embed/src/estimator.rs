//! The pipeline and everything it works in, in the caller's memory.

use raywake_core::digest::Digest;
use raywake_core::encoder::{self, EncoderWeights};
use raywake_core::output::{ColumnFlow, KeptPoints, Output, PointFlows, ReturnFlow, TrackletState};
use raywake_core::params::{Profile, SOLID_MAX};
use raywake_core::perceive::{ScalarBackend, StepContext};
use raywake_core::pipeline::Pipeline;
use raywake_core::pose::{Pose, Twist};
use raywake_core::prepare::{Preparation, Setup};
use raywake_core::refinement::forest::{self, MovesForest};
use raywake_core::sweep::{Point, Sweep};
use raywake_core::team::Team;
use raywake_core::weights::WeightsError;
use raywake_objects::params::TrackingParams;
use raywake_objects::tracked::{ObjectTracker, TrackedObject};
use raywake_registration::Odometry;
use raywake_registration::odometry::{EXPECTED_WITHIN_M, PoseStatus};

use crate::memory::{AtRest, Memory, array, bytes_of, state};
use crate::options::{CreateError, EstimatorOptions};
use crate::place::{SweepError, SweepPlace, normalised};
use crate::returns::ReturnSource;
use crate::summary::StepSummary;

impl AtRest for Pipeline {
    const REST: Pipeline = Pipeline::new();
}

impl AtRest for Odometry {
    const REST: Odometry = Odometry::new();
}

impl AtRest for ObjectTracker {
    const REST: ObjectTracker = ObjectTracker::new();
}

/// A pair's flow without its slices.
#[derive(Clone, Copy)]
struct KeptPair {
    columns: usize,
    points: KeptPoints,
}

/// The flow of chapter 3, refined, computed on the CPU a sweep at a time: a pipeline, storage for
/// its results and the two sweeps it works on.
pub struct FlowEstimator {
    setup: Setup,
    pipeline: &'static mut Pipeline,
    odometry: Option<&'static mut Odometry>,
    objects: Option<&'static mut ObjectTracker>,
    backend: ScalarBackend<&'static mut [u32]>,
    columns: &'static mut [ColumnFlow],
    taken: &'static mut [ReturnFlow],
    /// Returns of the last sweep, and of the previous one.
    sweeps: [SweepBuffers; 2],
    pair: Option<KeptPair>,
    before: Option<LastSweep>,
}

/// When, where and how fast the last sweep was.
#[derive(Clone, Copy)]
struct LastSweep {
    stamp_s: f64,
    pose: Pose,
    twist: Twist,
}

/// Returns of a sweep.
struct SweepBuffers {
    points: &'static mut [Point],
    count: usize,
}

/// Number of output columns to make room for.
fn solid(profile: &Profile) -> usize {
    profile.columns().min(SOLID_MAX)
}

/// Number of words that perception works in.
fn words(profile: &Profile) -> usize {
    ScalarBackend::<&mut [u32]>::words(profile)
}

impl EstimatorOptions {
    /// Number of bytes an estimator needs, at any alignment: what [`FlowEstimator::new`] takes.
    pub fn bytes(&self) -> Result<usize, CreateError> {
        self.check()?;
        let EstimatorOptions { profile, points_max, registers, objects, .. } = self;
        Ok(bytes_of::<Pipeline>(1)
            + bytes_of::<Odometry>(usize::from(*registers))
            + bytes_of::<ObjectTracker>(usize::from(*objects))
            + bytes_of::<u32>(words(profile))
            + bytes_of::<ColumnFlow>(solid(profile))
            + bytes_of::<ReturnFlow>(profile.returns())
            + 2 * bytes_of::<Point>(*points_max))
    }
}

impl SweepBuffers {
    fn new(memory: &mut Memory, most: usize) -> Option<SweepBuffers> {
        Some(SweepBuffers { points: array(memory, most, Point::default())?, count: 0 })
    }

    fn points(&self) -> &[Point] {
        &self.points[..self.count]
    }
}

/// Loads the encoder if there is refinement; nothing else uses it.
fn load_encoder(pipeline: &mut Pipeline, profile: &Profile) -> Result<(), WeightsError> {
    if profile.refinement_sweeps == 0 {
        return Ok(());
    }
    let load = |to: &mut EncoderWeights| to.load(encoder::SHIPPED, profile.levels as usize);
    pipeline.encoder.load_weights(load)
}

impl FlowEstimator {
    /// Creates an estimator in memory of at least [`EstimatorOptions::bytes`]. It allocates
    /// nothing, here or later.
    pub fn new(
        options: &EstimatorOptions,
        mut memory: Memory,
    ) -> Result<FlowEstimator, CreateError> {
        let EstimatorOptions { profile, rig, points_max, registers, objects } = options;
        let bytes = options.bytes()?;
        let lacking = || CreateError::Memory(bytes);
        if memory.len() < bytes {
            return Err(lacking());
        }
        let rest = &mut memory;
        let pipeline = state::<Pipeline>(rest).ok_or_else(lacking)?;
        let odometry =
            registers.then(|| state::<Odometry>(rest).ok_or_else(lacking)).transpose()?;
        let objects =
            objects.then(|| state::<ObjectTracker>(rest).ok_or_else(lacking)).transpose()?;
        let words = array(rest, words(profile), 0).ok_or_else(lacking)?;
        let columns = array(rest, solid(profile), ColumnFlow::default()).ok_or_else(lacking)?;
        let taken = array(rest, profile.returns(), ReturnFlow::default()).ok_or_else(lacking)?;
        let mut room = || SweepBuffers::new(rest, *points_max).ok_or_else(lacking);
        let sweeps = [room()?, room()?];
        let (backend, scores) =
            ScalarBackend::shipped(words, profile).map_err(CreateError::Weights)?;
        load_encoder(pipeline, profile).map_err(CreateError::Weights)?;
        let setup = Setup {
            profile: profile.clone(),
            rig: rig.clone(),
            scores,
            moves: MovesForest::load(forest::SHIPPED).map_err(CreateError::Weights)?,
            unfiltered: false,
            preparation: Preparation::new(),
        };
        let (pair, before) = (None, None);
        Ok(FlowEstimator {
            setup,
            pipeline,
            odometry,
            objects,
            backend,
            columns,
            taken,
            sweeps,
            pair,
            before,
        })
    }

    /// Processes one sweep. Results of the previous pair can no longer be read.
    ///
    /// # Errors
    /// The sweep is invalid; the state is as if it had not been given.
    pub fn step(
        &mut self,
        team: &impl Team,
        place: &SweepPlace,
        points: impl ReturnSource,
    ) -> Result<StepSummary, SweepError> {
        self.receive(place, points)?;
        Ok(self.advance(team, place))
    }

    /// Copies the returns of a sweep.
    pub(crate) fn receive(
        &mut self,
        place: &SweepPlace,
        points: impl ReturnSource,
    ) -> Result<(), SweepError> {
        let count = points.count();
        self.admit(place, count)?;
        self.pair = None;
        self.sweeps.swap(0, 1);
        let now = &mut self.sweeps[0];
        now.count = count;
        points.copy(&mut now.points[..count]);
        Ok(())
    }

    /// Does the work for the sweep received.
    pub(crate) fn advance(&mut self, team: &impl Team, place: &SweepPlace) -> StepSummary {
        let (pose, twist, pose_status) = self.locate(place);
        let [now, before] = &self.sweeps;
        let sweep =
            Sweep { stamp_s: place.stamp_s, points: now.points(), world_from_vehicle: pose, twist };
        let context = StepContext { backend: &mut self.backend, team, timer: &mut () };
        let room = Output { columns: self.columns, points: self.taken };
        let step = self.pipeline.step(&self.setup, context, &sweep, before.points(), room);
        let output = step.unwrap_or_else(|never| match never {});
        if let (Some(objects), Some(last)) = (&mut self.objects, self.before) {
            let LastSweep { stamp_s, pose: world_from_vehicle, twist } = last;
            let sweep = Sweep { stamp_s, points: before.points(), world_from_vehicle, twist };
            let flows = output.flows.as_ref().map(|flows| (flows.points, &self.setup.profile));
            objects.step(&TrackingParams::DEFAULT, &self.setup.rig, &sweep, flows);
        }
        let objects = self.objects.as_ref().map_or(0, |objects| objects.objects().len());
        let summary = StepSummary::new(&output, pose, pose_status, objects);
        self.pair = output
            .flows
            .map(|flows| KeptPair { columns: flows.columns.len(), points: flows.points.keep() });
        self.before = Some(LastSweep { stamp_s: place.stamp_s, pose, twist });
        summary
    }

    fn admit(&self, place: &SweepPlace, points: usize) -> Result<(), SweepError> {
        let most = self.sweeps[0].points.len();
        if points > most {
            return Err(SweepError::Points(most));
        }
        if place.pose.is_some() == self.odometry.is_some() {
            return Err(SweepError::Pose);
        }
        if place.is_valid() { Ok(()) } else { Err(SweepError::Implausible) }
    }

    /// Pose and twist of the sweep just received.
    fn locate(&mut self, place: &SweepPlace) -> (Pose, Twist, Option<PoseStatus>) {
        let stamp_s = place.stamp_s;
        if let Some(odometry) = &mut self.odometry {
            let twist = place.twist.into_iter();
            twist.for_each(|twist| odometry.expect(twist, EXPECTED_WITHIN_M));
            let found = odometry.locate(stamp_s, self.sweeps[0].points(), &self.setup.rig);
            return (found.world_from_vehicle, found.twist, Some(found.pose_status));
        }
        let pose = normalised(place.pose.unwrap_or(Pose::IDENTITY));
        let steady = self.before.filter(|before| {
            let elapsed_s = stamp_s - before.stamp_s;
            self.setup.profile.limits.broken(&before.pose, &pose, elapsed_s).is_none()
        });
        let from_poses = steady.map_or(Twist::ZERO, |before| {
            (pose.inverse() * before.pose).twist(before.stamp_s - stamp_s)
        });
        (pose, place.twist.unwrap_or(from_poses), None)
    }

    /// Flow of the solid columns of the pair's first sweep; empty if the last sweep made no pair.
    pub fn columns(&self) -> &[ColumnFlow] {
        self.pair.map_or(&[], |pair| &self.columns[..pair.columns])
    }

    /// Flow of the returns of the pair's first sweep, in their order.
    pub fn points(&self) -> Option<PointFlows<'_>> {
        let pair = self.pair.as_ref()?;
        Some(pair.points.over(self.columns, self.taken, self.sweeps[1].points()))
    }

    /// Number of tracklets.
    pub fn tracklet_count(&self) -> usize {
        self.pipeline.tracklet_count()
    }

    /// Tracklets after the last sweep, at its time.
    pub fn tracklets(&self) -> impl Iterator<Item = TrackletState> {
        self.pipeline.tracklets(&self.setup.profile)
    }

    /// Objects in the pair's first sweep, if they are tracked.
    pub fn objects(&self) -> &[TrackedObject] {
        self.objects.as_ref().map_or(&[], |tracker| tracker.objects())
    }

    /// Adds everything that can be read now, except objects, to a digest. Called after every sweep,
    /// it gives the program's digest.
    pub fn add_to(&self, digest: &mut Digest) {
        self.columns().iter().for_each(|c| digest.column(c));
        self.points().into_iter().flat_map(PointFlows::iter).for_each(|p| digest.point(&p));
        self.tracklets().for_each(|t| digest.tracklet(&t));
    }
}
