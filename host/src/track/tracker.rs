//! A sweep through the front end, and through the flow before it where that is wanted; a track
//! through the estimate at its end. Nothing in here allocates once made.

use std::time::Instant;

use raywake_alloc_guard::Sealed;
use raywake_core::sweep::Rig;
use raywake_core::team::Team as _;
use raywake_objects::estimate::{EstimateParams, EstimateReport, Estimator, FixedLag};
use raywake_objects::front_end::{
    Flows, FrontEnd, HISTORY_MAX, Life, TRACKS_MAX, Thinned, Track, TrackingCounts,
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

/// Tracks that have ended and are estimated at the same time, each on a thread; 3.9 MB a track.
const SOLVERS: usize = 4;

/// The front end with its tracks, and the estimate. Nothing is allocated once it is made.
pub struct Tracker {
    rig: Rig,
    params: TrackingParams,
    drive: Option<Drive>,
    reach_m: f64,
    ground: Option<Ground>,
    parts: Sealed<TrackerParts>,
    /// Rooms of the tracks that ended.
    ended: Vec<usize>,
    /// Tracks of what is no object are shown, too; without flow and encoder nobody tells.
    pub all: bool,
}

struct TrackerParts {
    front_end: Box<FrontEnd>,
    tracks: Vec<Track>,
    /// Fixed lags use the first.
    solvers: Vec<Solver>,
    /// One for each track, or none.
    lags: Vec<Lag>,
}

/// Room for the estimate of a track, and how it went.
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

/// Solves some of the tracks, each in a room of its own.
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

/// The estimate of a track over its last seconds, sweep by sweep.
struct Lag {
    filter: Box<FixedLag>,
    /// One for each update of the track, thinned as its history is.
    states: Thinned<ObjectState, HISTORY_MAX>,
}

impl Lag {
    fn new() -> Lag {
        Lag {
            filter: raywake_alloc_guard::boxed!(FixedLag, FixedLag::new()),
            states: Thinned::default(),
        }
    }

    /// Takes in what the last step saw of a track.
    fn update(&mut self, params: &EstimateParams, track: &Track, estimator: &mut Estimator) {
        let Some(state) = track.state().filter(|_| track.life == Life::Live) else { return };
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
    /// Tracks of a rig's sweeps, with the flow of a profile where there is a drive to find it, with
    /// a map of the ground where there is one, and with the estimate of every sweep where
    /// `fixed_lag` says so. Call it on a thread with 64 MiB of stack, as [`Drive::new`].
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
        memory::ask_for(Tracker::bytes(fixed_lag))?;
        let all = drive.as_ref().is_none_or(|d| !d.tells_classes());
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

    /// The parts of the host's memory held: name, type and bytes, those of the flow apart.
    pub fn parts() -> [(&'static str, &'static str, usize); 4] {
        let solver = size_of::<Solver>() + size_of::<Estimator>();
        let lag = size_of::<Lag>() + size_of::<FixedLag>();
        [
            ("front end", "FrontEnd", size_of::<FrontEnd>()),
            ("tracks", "Track", TRACKS_MAX * size_of::<Track>()),
            ("estimates at the same time", "Solver", SOLVERS * solver),
            ("estimates of every sweep, with `--fixed-lag`", "Lag", TRACKS_MAX * lag),
        ]
    }

    /// Bytes of all parts, of those of every sweep's estimate only where they are wanted.
    fn bytes(fixed_lag: bool) -> u64 {
        let [front_end, tracks, solvers, lags] = Tracker::parts().map(|part| part.2 as u64);
        front_end + tracks + solvers + if fixed_lag { lags } else { 0 }
    }

    /// A sweep, and the one before it if there is one. With the flow it is that one whose tracks
    /// come next, as its flow is then known; nothing comes back where there is none.
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

    /// The last sweep, where it still waits for its flow, which will not come.
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

    /// Room for tracks, with those that live.
    pub fn tracks(&self) -> &[Track] {
        &self.parts.tracks
    }

    /// Whether the tracks are those of the sweep before the last.
    pub fn lags(&self) -> bool {
        self.drive.is_some()
    }

    /// The tracks that ended in the last step, in the order of their room.
    pub fn ended_tracks(&self) -> impl Iterator<Item = &Track> {
        self.parts.tracks.iter().filter(|t| t.life == Life::Ended)
    }

    /// Of the returns of the last step's sweep those of a track: which one, and the track's number.
    pub fn members(&self) -> impl Iterator<Item = (usize, u32)> {
        self.parts.front_end.members().map(|(n, slot)| (n, self.parts.tracks[slot].id))
    }

    /// The objects of the last step's sweep, with their tracks: those that are put out.
    pub fn objects(&self) -> impl Iterator<Item = (TrackedObject, &Track)> {
        let shown = self.parts.tracks.iter().filter(|t| self.shows(t));
        shown.filter_map(|track| Some((track.object(&self.params)?, track)))
    }

    /// Whether a track is put out: that of an object, or any.
    fn shows(&self, track: &Track) -> bool {
        self.all || track.is_object(&self.params.front_end)
    }

    /// How many of the tracks that ended in the last step are to be shown.
    pub fn ended_objects(&self) -> usize {
        self.parts.tracks.iter().filter(|t| self.is_shown_at_its_end(t)).count()
    }

    fn is_shown_at_its_end(&self, track: &Track) -> bool {
        let sure = track.observations >= self.params.front_end.observations_min;
        track.life == Life::Ended && sure && self.shows(track)
    }

    /// Shows the tracks that ended in the last step, in the order of their room, each with the
    /// estimate of its trajectory and shape: those of objects, unless all are asked for. Those that
    /// ended before they were sure are left out: there is little to estimate. After a signal no
    /// further track is estimated, as that may take seconds each; returns how many are left.
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

/// The box around all returns of a track, each where its time puts it.
fn shape(params: &TrackingParams, track: &Track, estimator: &Estimator) -> ObjectBox {
    let place = |seen: &ObjectReturn| estimator.state(f64::from(seen.time_s)).local(seen.position);
    let moved_m = moved_m(track, estimator);
    let places = track.returns().iter().map(place);
    ObjectBox::around(&params.boxes, places, moved_m).unwrap_or_default()
}

/// From the first place of the estimate of a track to its last one, along the ground, m.
pub fn moved_m(track: &Track, estimator: &Estimator) -> f64 {
    let [first, last] = [0.0, track.last_s() - track.start_s].map(|t| estimator.state(t).position);
    libm::hypot(last[0] - first[0], last[1] - first[1])
}

/// A track at its end.
pub struct Ended<'a> {
    /// The track.
    pub track: &'a Track,
    /// With its trajectory and shape.
    pub estimator: &'a Estimator,
    /// The box around its returns in its frame; without one it has no size.
    pub shape: ObjectBox,
    /// How these were found.
    pub report: &'a EstimateReport,
    /// The estimates of every sweep where there are any, one for each state of its history.
    pub lag: Option<&'a [ObjectState]>,
    /// How long the estimate at its end took, ms.
    pub milliseconds: f64,
}
