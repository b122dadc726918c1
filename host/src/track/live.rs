//! An object as it is known while its track lives: for pictures and messages.

use glam::DVec3;
use raywake_io::sink::objects::TrackedObject;
use raywake_objects::ObjectState;
use raywake_objects::front_end::{Life, Track};
use raywake_objects::object_box::ObjectBox;
use raywake_objects::params::TrackingParams;

/// Without the flow: what is slower, or has come less far, is shown as static; m/s and m.
const MOVING_MPS: f64 = 1.0;
const MOVED_M: f64 = 1.0;
/// Updates before a track is shown, and, without the flow, before it is shown as moving: filters
/// begin with any velocity.
const UPDATES_MIN: u32 = 3;
const MOVING_UPDATES_MIN: u32 = 6;

/// Of a track that lives and is old enough to be shown.
pub fn seen(params: &TrackingParams, track: &Track) -> Option<TrackedObject> {
    let shown = track.life == Life::Live && track.observations >= UPDATES_MIN;
    let state = track.state().filter(|_| shown)?;
    let places = track.latest().iter().map(|seen| state.local(seen.position));
    let around = ObjectBox::around(&params.boxes, places, track.moved_m())?;
    let (sin, cos) = libm::sincos(state.heading);
    let velocity = [cos * state.speed, sin * state.speed];
    let world = |at: [f64; 3]| (DVec3::from(track.anchor) + DVec3::from(at)).to_array();
    Some(TrackedObject {
        id: track.id,
        centre: world(state.placed(around.centre)),
        heading: state.heading + f64::from(around.turn),
        size: around.size,
        velocity: moves(params, track, &state).then_some(velocity),
        turn_rate: state.turn_rate,
        variances: track.variances().last().copied().unwrap_or_default(),
        p_moves: track.p_moves().last().copied().filter(|p| !p.is_nan()),
        class: track.class().map(|class| (class, track.class_share())),
        way: track.history().iter().map(|s| world(s.position)).collect(),
    })
}

/// Whether it moves: as the flow tells, where it does.
fn moves(params: &TrackingParams, track: &Track, state: &ObjectState) -> bool {
    match track.p_moves().last() {
        Some(p) if !p.is_nan() => *p >= params.front_end.track_moves_min,
        _ => {
            track.observations >= MOVING_UPDATES_MIN
                && state.speed.abs() >= MOVING_MPS
                && track.moved_m() >= MOVED_M
        }
    }
}
