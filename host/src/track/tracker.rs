//! A sweep through the front end, preceded by the flow if wanted; a track through the estimate at
//! its end. Once created, nothing in here allocates.

use std::time::Instant;

use raywake_alloc_guard::Sealed;
use raywake_core::sweep::Rig;
use raywake_core::team::Team as _;
use raywake_objects::estimate::{EstimateParams, EstimateReport, Estimator, FixedLag};
use raywake_objects::front_end::{
    Flows, FrontEnd, HISTORY_MAX, TRACKS_MAX, Thinned, Track, TrackStatus, TrackingCounts,
};
use raywake_objects::object_box::ObjectBox;

use raywake_objects::params::TrackingParams;
use raywake_objects::tracked::TrackedObject;
use raywake_objects::{ObjectReturn, ObjectState};

use super::Ground;
use crate::config::Settings;
use crate::console::interrupted;
use crate::drive::Drive;
use crate::error::RunError;
use crate::memory;
use crate::team::ThreadTeam;
use raywake_io::source::SweepData;

/// Number of ended tracks estimated at the same time, each on a thread; 3.9 MB per track.
const SOLVERS: usize = 4;

/// The front end with its tracks, and the estimate. Once created, it allocates nothing.
pub struct Tracker {
    rig: Rig,
    params: TrackingParams,
    drive: Option<Drive>,
    reach_m: f64,
    ground: Option<Ground>,
    parts: Sealed<TrackerParts>,
    /// Slots of the tracks that ended.
    ended: Vec<usize>,
    /// Whether tracks other than those of objects are shown too; without flow and encoder they
    /// cannot be distinguished.
    pub all: bool,
}

struct TrackerParts {
    front_end: Box<FrontEnd>,
    tracks: Vec<Track>,
    /// Fixed lags use the first one.
    solvers: Vec<Solver>,
    /// One per track, or none.
    lags: Vec<Lag>,
}

/// Memory for the estimate of a track, and its report.
struct Solver {
    estimator: Box<Estimator>,
    report: EstimateReport,
    milliseconds: f64,
}

impl Solver {
    fn new() -> Solver {
        Solver {
            estimator: raywake_alloc_guard::boxed!(Estimator, Estimator::new()),
            report: EstimateReport::default(),
            milliseconds: 0.0,
        }
    }

    fn solve(&mut self, params: &EstimateParams, track: &Track) {
        let clock = Instant::now();
        self.report = self.estimator.solve(params, track.returns(), track.history());
        self.milliseconds = clock.elapsed().as_secs_f64() * 1e3;
    }
}

/// Estimates some of the tracks, each with its own solver.
fn solve(params: &EstimateParams, solvers: &mut [Solver], tracks: &[Track], slots: &[usize]) {
    match (solvers, slots) {
        ([], _) | (_, []) => {}
        ([solver, ..], [slot]) => solver.solve(params, &tracks[*slot]),
        (solvers, slots) => {
            let half = slots.len() / 2;
            let ((a, b), (c, d)) = (solvers.split_at_mut(half), slots.split_at(half));
            ThreadTeam::new(None)
                .join(|| solve(params, a, tracks, c), || solve(params, b, tracks, d));
        }
    }
}

/// The sliding-window estimate of a track, sweep by sweep.
struct Lag {
    filter: Box<FixedLag>,
    /// One per update of the track, thinned like its history.
    states: Thinned<ObjectState, HISTORY_MAX>,
}

impl Lag {
    fn new() -> Lag {
        Lag {
            filter: raywake_alloc_guard::boxed!(FixedLag, FixedLag::new()),
            states: Thinned::default(),
        }
    }

    /// Adds the observation of a track in the last step.
    fn update(&mut self, params: &EstimateParams, track: &Track, estimator: &mut Estimator) {
        let Some(state) = track.state().filter(|_| track.status == TrackStatus::Live) else {
            return;
        };
        if track.observations == 1 {
            self.filter.clear();
            self.states.clear();
        }
        if self.states.seen() < u64::from(track.observations) {
            self.states.push(self.filter.push(estimator, params, track.latest(), &state));
        }
    }
}

impl Tracker {
    /// Creates a tracker for a rig's sweeps: with flow if there is a drive to compute it, with a
    /// map of the ground if there is one, and with an estimate at every sweep if `fixed_lag` is
    /// set.
    ///
    /// # Errors
    /// [`RunError::NoMemory`].
    pub fn new(
        rig: &Rig,
        settings: &Settings,
        drive: Option<Drive>,
        ground: Option<Ground>,
        fixed_lag: bool,
    ) -> Result<Tracker, RunError> {
        memory::probe_memory(Tracker::bytes(fixed_lag))?;
        let all = drive.as_ref().is_none_or(|d| !d.has_classes());
        let parts = TrackerParts {
            front_end: raywake_alloc_guard::boxed!(FrontEnd, FrontEnd::new()),
            tracks: vec![Track::new(); TRACKS_MAX],
            solvers: (0..SOLVERS).map(|_| Solver::new()).collect(),
            lags: (0..if fixed_lag { TRACKS_MAX } else { 0 }).map(|_| Lag::new()).collect(),
        };
        Ok(Tracker {
            rig: rig.clone(),
            params: settings.objects,
            drive,
            reach_m: Flows::reach_m(&settings.profile),
            ground,
            parts: Sealed::new("tracks", parts),
            ended: Vec::with_capacity(TRACKS_MAX),
            all,
        })
    }

    /// The parts of the host's memory held, without the flow's: name, type and bytes.
    pub fn parts() -> [(&'static str, &'static str, usize); 4] {
        let solver = size_of::<Solver>() + size_of::<Estimator>();
        let lag = size_of::<Lag>() + size_of::<FixedLag>();
        [
            ("front end", "FrontEnd", size_of::<FrontEnd>()),
            ("tracks", "Track", TRACKS_MAX * size_of::<Track>()),
            ("concurrent estimates", "Solver", SOLVERS * solver),
            ("estimates at every sweep, with `--fixed-lag`", "Lag", TRACKS_MAX * lag),
        ]
    }

    /// Bytes of all parts; those of the estimates at every sweep only if wanted.
    fn bytes(fixed_lag: bool) -> u64 {
        let [front_end, tracks, solvers, lags] = Tracker::parts().map(|part| part.2 as u64);
        front_end + tracks + solvers + if fixed_lag { lags } else { 0 }
    }

    /// Processes a sweep, given the one before it, if any. With flow, it is the sweep before whose
    /// tracks are updated, as its flow is then known; returns `None` if there is none.
    pub fn sweep(
        &mut self,
        now: &SweepData,
        before: Option<&SweepData>,
    ) -> Result<Option<TrackingCounts>, RunError> {
        let Tracker { rig, params, drive, reach_m, ground, parts, .. } = self;
        let map = ground.as_ref().map(Ground::map);
        let mut step = |sweep: &SweepData, flows: Option<Flows>| {
            parts.step(|TrackerParts { front_end, tracks, solvers, lags }| {
                front_end.take(&params.front_end, rig, &sweep.sweep(), flows);
                let counts = front_end.step(&params.front_end, map.as_ref(), tracks);
                let estimator = &mut solvers[0].estimator;
                for (lag, track) in lags.iter_mut().zip(&*tracks) {
                    lag.update(&params.estimate, track, estimator);
                }
                Ok(counts)
            })
        };
        let Some(drive) = drive else { return step(now, None).map(Some) };
        let points = before.map_or(&[][..], |b| &b.points);
        let flows = drive.step(&now.sweep(), points)?.output.flows;
        let flows = flows.map(|f| Flows { of: f.points, reach_m: *reach_m });
        before.map(|before| step(before, flows)).transpose()
    }

    /// Processes the last sweep if it is still waiting for its flow, which will not come.
    pub fn last(&mut self, sweep: &SweepData) -> Result<Option<TrackingCounts>, RunError> {
        match self.drive.take() {
            Some(_) => self.sweep(sweep, None),
            None => Ok(None),
        }
    }

    /// Ends all tracks. Returns how many there were.
    pub fn finish(&mut self) -> Result<u64, RunError> {
        self.parts.step(|parts| Ok(parts.front_end.finish(&mut parts.tracks)))
    }

    /// All track slots, including the live ones.
    pub fn tracks(&self) -> &[Track] {
        &self.parts.tracks
    }

    /// Whether the tracks are those of the second to last sweep.
    pub fn lags(&self) -> bool {
        self.drive.is_some()
    }

    /// The tracks that ended in the last step, in slot order.
    pub fn ended_tracks(&self) -> impl Iterator<Item = &Track> {
        self.parts.tracks.iter().filter(|t| t.status == TrackStatus::Ended)
    }

    /// The returns of the last step's sweep that belong to a track: index and track number.
    pub fn members(&self) -> impl Iterator<Item = (usize, u32)> {
        self.parts.front_end.members().map(|(n, slot)| (n, self.parts.tracks[slot].id))
    }

    /// The output objects of the last step's sweep, with their tracks.
    pub fn objects(&self) -> impl Iterator<Item = (TrackedObject, &Track)> {
        let shown = self.parts.tracks.iter().filter(|t| self.shows(t));
        shown.filter_map(|track| Some((track.object(&self.params)?, track)))
    }

    /// Whether a track is output: that of an object, or any.
    fn shows(&self, track: &Track) -> bool {
        self.all || track.is_object(&self.params.front_end)
    }

    /// Number of tracks that ended in the last step and are to be shown.
    pub fn ended_objects(&self) -> usize {
        self.parts.tracks.iter().filter(|t| self.is_shown_at_its_end(t)).count()
    }

    fn is_shown_at_its_end(&self, track: &Track) -> bool {
        let sure = track.observations >= self.params.front_end.observations_min;
        track.status == TrackStatus::Ended && sure && self.shows(track)
    }

    /// Shows the tracks that ended in the last step, in slot order, each with the estimate of its
    /// trajectory and shape: those of objects, unless all are asked for. Tracks that ended before
    /// they were confirmed are left out: there is little to estimate. After a signal no further
    /// track is estimated, as each may take seconds; returns how many are left.
    pub fn ended(
        &mut self,
        mut show: impl FnMut(&Ended) -> Result<(), raywake_io::Error>,
    ) -> Result<u64, RunError> {
        self.ended.clear();
        for slot in 0..self.parts.tracks.len() {
            if self.is_shown_at_its_end(&self.parts.tracks[slot]) {
                self.ended.push(slot);
            }
        }
        let Tracker { parts, ended, params, .. } = self;
        let mut left = ended.len() as u64;
        for group in ended.chunks(parts.solvers.len()) {
            if interrupted() {
                break;
            }
            parts.step(|TrackerParts { solvers, tracks, .. }| {
                solve(&params.estimate, solvers, tracks, group);
                Ok::<_, RunError>(())
            })?;
            let TrackerParts { tracks, solvers, lags, .. } = &**parts;
            for (&slot, Solver { estimator, report, milliseconds }) in group.iter().zip(solvers) {
                let lag = lags.get(slot).map(|lag| lag.states.kept());
                let (track, milliseconds) = (&tracks[slot], *milliseconds);
                let shape = shape(params, track, estimator);
                show(&Ended { track, estimator, shape, report, lag, milliseconds })?;
                left -= 1;
            }
        }
        Ok(left)
    }
}

/// The box around all returns of a track, each placed according to its time.
fn shape(params: &TrackingParams, track: &Track, estimator: &Estimator) -> ObjectBox {
    let place = |seen: &ObjectReturn| estimator.state(f64::from(seen.time_s)).local(seen.position);
    let moved_m = moved_m(track, estimator);
    let places = track.returns().iter().map(place);
    ObjectBox::around(&params.boxes, places, moved_m).unwrap_or_default()
}

/// Distance from the first to the last position of the estimate of a track, along the ground, m.
pub fn moved_m(track: &Track, estimator: &Estimator) -> f64 {
    let [first, last] = [0.0, track.last_s() - track.start_s].map(|t| estimator.state(t).position);
    libm::hypot(last[0] - first[0], last[1] - first[1])
}

/// A track at its end.
pub struct Ended<'a> {
    /// The track.
    pub track: &'a Track,
    /// The estimator with its trajectory and shape.
    pub estimator: &'a Estimator,
    /// The box around its returns in its frame; size 0 if there is none.
    pub shape: ObjectBox,
    /// Report of the estimate.
    pub report: &'a EstimateReport,
    /// The estimates at every sweep, if any, one for each state of its history.
    pub lag: Option<&'a [ObjectState]>,
    /// Duration of the estimate at its end, ms.
    pub milliseconds: f64,
}
