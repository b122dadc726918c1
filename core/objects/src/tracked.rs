//! Objects as known while their tracks live, sweep by sweep.

use glam::DVec3;
use raywake_core::encoder::ColumnClass;
use raywake_core::output::PointFlows;
use raywake_core::params::Profile;
use raywake_core::sweep::{Rig, Sweep};

use crate::ObjectState;
use crate::front_end::{
    Flows, FrontEnd, StateVariances, TRACKS_MAX, Track, TrackStatus, TrackingCounts,
};
use crate::object_box::ObjectBox;
use crate::params::TrackingParams;

/// Without the flow, whatever is slower or has moved less than this is shown as static; m/s and m.
const MOVING_MPS: f64 = 1.0;
const MOVED_M: f64 = 1.0;
/// Updates before a track is shown and, without the flow, before it is shown as moving: a filter
/// may start with any velocity.
const UPDATES_MIN: u32 = 3;
const MOVING_UPDATES_MIN: u32 = 6;

/// An object at one of its sweeps: a box with a velocity, in the world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrackedObject {
    /// Number of its track.
    pub id: u32,
    /// Updates of its track.
    pub observations: u32,
    /// Time of the last one, s: earlier than the sweep if it was not seen in it.
    pub time_s: f64,
    /// Centre of the box around the returns of that update, m.
    pub centre: [f64; 3],
    /// Direction of its length about +z, rad. If it is static, either end may be the front.
    pub heading: f64,
    /// Length, width and height, m.
    pub size: [f32; 3],
    /// Along x and y, m/s; none if it is static.
    pub velocity: Option<[f64; 2]>,
    /// About +z, rad/s.
    pub turn_rate: f64,
    /// The filter's uncertainty.
    pub variances: StateVariances,
    /// Mean P(moves) of its returns; none if the flow does not give it.
    pub p_moves: Option<f32>,
    /// The class that the encoder assigns to most of its returns, and their share, 0 to 1.
    pub class: Option<(ColumnClass, f32)>,
}

impl<const RETURNS: usize, const HISTORY: usize> Track<RETURNS, HISTORY> {
    /// Converts a position relative to its anchor to the world, m.
    pub fn in_world(&self, at: [f64; 3]) -> [f64; 3] {
        (DVec3::from(self.anchor) + DVec3::from(at)).to_array()
    }

    /// Returns the object, if the track lives and is old enough to be shown.
    pub fn object(&self, params: &TrackingParams) -> Option<TrackedObject> {
        let shown = self.status == TrackStatus::Live && self.observations >= UPDATES_MIN;
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

    /// Whether it moves: by the flow if that gives a probability.
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

/// A track without the data that an estimate at its end needs: of its states it keeps the first.
type ShortTrack = Track<0, 2>;

/// Online object tracking: the front end with tracks that keep nothing of the past. Large: keep it
/// where it is made.
pub struct ObjectTracker {
    front_end: FrontEnd,
    tracks: [ShortTrack; TRACKS_MAX],
    seen: heapless::Vec<TrackedObject, TRACKS_MAX>,
}

impl Default for ObjectTracker {
    fn default() -> Self {
        ObjectTracker::new()
    }
}

impl ObjectTracker {
    /// A tracker without tracks.
    pub const fn new() -> ObjectTracker {
        ObjectTracker {
            front_end: FrontEnd::new(),
            tracks: [const { ShortTrack::new() }; TRACKS_MAX],
            seen: heapless::Vec::new(),
        }
    }

    /// Continues the tracks with a sweep and, if there is one, the flow of its returns under a
    /// profile.
    pub fn step(
        &mut self,
        params: &TrackingParams,
        rig: &Rig,
        sweep: &Sweep,
        flows: Option<(PointFlows, &Profile)>,
    ) -> TrackingCounts {
        let flows = flows.map(|(of, profile)| Flows { of, reach_m: Flows::reach_m(profile) });
        let ObjectTracker { front_end, tracks, seen } = self;
        front_end.take(&params.front_end, rig, sweep, flows);
        let counts = front_end.step(&params.front_end, None, tracks);
        let shown = tracks.iter().filter(|track| track.is_object(&params.front_end));
        seen.clear();
        seen.extend(shown.filter_map(|track| track.object(params)));
        counts
    }

    /// The objects of the last step's sweep: those whose tracks were seen to move and to get
    /// somewhere, or that the encoder classifies as vehicles, people or two-wheelers. At most
    /// [`TRACKS_MAX`].
    pub fn objects(&self) -> &[TrackedObject] {
        &self.seen
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::front_end::scene::{OFFSETS, SceneBox, rig, seen};
    use raywake_core::pose::{Pose, Twist};
    use std::vec::Vec;

    const PARAMS: TrackingParams = TrackingParams::DEFAULT;

    /// Without the flow, a moving and a parked car: what is kept of the past makes no difference.
    #[test]
    fn number_of_kept_returns_does_not_matter() {
        let mut short = raywake_alloc_guard::boxed!(ObjectTracker, ObjectTracker::new());
        let mut front_end = raywake_alloc_guard::boxed!(FrontEnd, FrontEnd::new());
        let mut tracks = std::vec![Track::<8, 16>::new(); TRACKS_MAX];
        let things = [SceneBox::car(-20.0, 6.0, [12.0, 0.0]), SceneBox::car(8.0, -5.0, [0.0; 2])];
        let rig = rig(1, OFFSETS);
        let mut last = Vec::new();
        for n in 0..30 {
            let stamp_s = 100.0 + 0.1 * f64::from(n);
            let moved = things.map(|thing| {
                let [u, v] = thing.velocity;
                let at = [0.1 * f64::from(n) * u, 0.1 * f64::from(n) * v];
                SceneBox { at: [thing.at[0] + at[0], thing.at[1] + at[1]], ..thing }
            });
            let points = seen(&moved, 0.0, 0.0, 0);
            let (world_from_vehicle, twist) = (Pose::IDENTITY, Twist::ZERO);
            let sweep = Sweep { stamp_s, points: &points, world_from_vehicle, twist };
            let counts = short.step(&PARAMS, &rig, &sweep, None);
            front_end.take(&PARAMS.front_end, &rig, &sweep, None);
            assert_eq!(front_end.step(&PARAMS.front_end, None, &mut tracks), counts);
            let all = short.tracks.iter().filter_map(|track| track.object(&PARAMS));
            last = all.collect::<Vec<_>>();
            let other: Vec<_> = tracks.iter().filter_map(|track| track.object(&PARAMS)).collect();
            assert_eq!(last, other, "sweep {n}");
            assert_eq!(last.len(), if n < 2 { 0 } else { 2 }, "sweep {n}");
            assert!(last.iter().all(|object| object.time_s == stamp_s));
        }
        let [moving, standing] = [Some(true), None].map(|moves| {
            last.iter().find(|o| o.velocity.map(|_| true) == moves).expect("one of each")
        });
        let velocity = moving.velocity.unwrap();
        assert!((velocity[0] - 12.0).abs() < 0.3 && velocity[1].abs() < 0.3, "{velocity:?}");
        assert!((moving.centre[0] - (-20.0 + 2.9 * 12.0)).abs() < 0.3, "{moving:?}");
        assert!((standing.centre[0] - 8.0).abs() < 0.2 && standing.observations == 30);
        assert!((standing.size[0] - 4.0).abs() < 0.4, "{standing:?}");
        // Nothing says what they are.
        assert_eq!(short.objects(), []);
    }
}
