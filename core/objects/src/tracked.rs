//! Objects as they are known while their tracks live, sweep by sweep.

use glam::DVec3;
use raywake_core::encoder::ColumnClass;
use raywake_core::sweep::{Rig, Sweep};

use crate::ObjectState;
use crate::front_end::{Flows, FrontEnd, Life, StateVariances, TRACKS_MAX, Track, TrackingCounts};
use crate::object_box::ObjectBox;
use crate::params::TrackingParams;

/// Without the flow: what is slower, or has come less far, is shown as static; m/s and m.
const MOVING_MPS: f64 = 1.0;
const MOVED_M: f64 = 1.0;
/// Updates before a track is shown, and, without the flow, before it is shown as moving: filters
/// begin with any velocity.
const UPDATES_MIN: u32 = 3;
const MOVING_UPDATES_MIN: u32 = 6;

/// An object at one of its sweeps: a box with a velocity, in the world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrackedObject {
    /// Number of its track.
    pub id: u32,
    /// Updates of its track.
    pub observations: u32,
    /// Time of the last one, s: earlier than the sweep where it was not seen.
    pub time_s: f64,
    /// Middle of the box around the returns of that update, m.
    pub centre: [f64; 3],
    /// Direction of its length about +z, rad. Of what stands either end may be the front.
    pub heading: f64,
    /// Length, width and height, m.
    pub size: [f32; 3],
    /// Along x and y, m/s; none where it stands.
    pub velocity: Option<[f64; 2]>,
    /// About +z, rad/s.
    pub turn_rate: f64,
    /// How sure the filter is of it.
    pub variances: StateVariances,
    /// Mean P(moves) of its returns; none where the flow does not tell.
    pub p_moves: Option<f32>,
    /// What the encoder takes most of its returns for, and the share of them, 0 to 1.
    pub class: Option<(ColumnClass, f32)>,
}

impl<const RETURNS: usize, const HISTORY: usize> Track<RETURNS, HISTORY> {
    /// A state of it, in the world.
    pub fn in_world(&self, at: [f64; 3]) -> [f64; 3] {
        (DVec3::from(self.anchor) + DVec3::from(at)).to_array()
    }

    /// The object, of a track that lives and is old enough to be shown.
    pub fn object(&self, params: &TrackingParams) -> Option<TrackedObject> {
        let shown = self.life == Life::Live && self.observations >= UPDATES_MIN;
        let state = self.state().filter(|_| shown)?;
        let places = self.latest().iter().map(|seen| state.local(seen.position));
        let around = ObjectBox::around(&params.boxes, places, self.moved_m())?;
        let (sin, cos) = libm::sincos(state.heading);
        let velocity = [cos * state.speed, sin * state.speed];
        Some(TrackedObject {
            id: self.id,
            observations: self.observations,
            time_s: self.last_s(),
            centre: self.in_world(state.placed(around.centre)),
            heading: state.heading + f64::from(around.turn),
            size: around.size,
            velocity: self.moves(params, &state).then_some(velocity),
            turn_rate: state.turn_rate,
            variances: self.variances_now()?,
            p_moves: self.p_moves_now(),
            class: self.class().map(|class| (class, self.class_share())),
        })
    }

    /// Whether it moves: as the flow tells, where it does.
    fn moves(&self, params: &TrackingParams, state: &ObjectState) -> bool {
        match self.p_moves_now() {
            Some(p) => p >= params.front_end.track_moves_min,
            None => {
                self.observations >= MOVING_UPDATES_MIN
                    && state.speed.abs() >= MOVING_MPS
                    && self.moved_m() >= MOVED_M
            }
        }
    }
}

/// A track without what an estimate at its end takes.
type ShortTrack = Track<2, 2>;

/// Objects on board: the front end with tracks that keep nothing of the past. Large: keep it where
/// it is made.
pub struct ObjectTracker {
    front_end: FrontEnd,
    tracks: [ShortTrack; TRACKS_MAX],
}

impl Default for ObjectTracker {
    fn default() -> Self {
        ObjectTracker::new()
    }
}

impl ObjectTracker {
    /// No tracks yet.
    pub const fn new() -> ObjectTracker {
        ObjectTracker {
            front_end: FrontEnd::new(),
            tracks: [const { ShortTrack::new() }; TRACKS_MAX],
        }
    }

    /// Continues the tracks with a sweep and the flow of its returns, where there is one.
    pub fn step(
        &mut self,
        params: &TrackingParams,
        rig: &Rig,
        sweep: &Sweep,
        flows: Option<Flows>,
    ) -> TrackingCounts {
        self.front_end.take(&params.front_end, rig, sweep, flows);
        self.front_end.step(&params.front_end, None, &mut self.tracks)
    }

    /// The objects of the last step's sweep: of tracks that were seen to move and came somewhere,
    /// or that the encoder takes for vehicles, people or two-wheelers. At most [`TRACKS_MAX`].
    pub fn objects(&self, params: &TrackingParams) -> impl Iterator<Item = TrackedObject> {
        let shown = self.tracks.iter().filter(|track| track.is_object(&params.front_end));
        shown.filter_map(|track| track.object(params))
    }
}
