//! The state of an object (2.2) as seven splines: their elements and their unknowns.

use crate::spline::Knots;
use crate::{ObjectState, wrap_angle};

/// A control point of the seven splines: x, y, z (m), heading (rad), speed, climb (m/s), turn rate
/// (rad/s).
pub(super) type ControlPoint = [f64; 7];

pub(super) const Z: usize = 2;
pub(super) const HEADING: usize = 3;
pub(super) const SPEED: usize = 4;
pub(super) const CLIMB: usize = 5;
pub(super) const TURN_RATE: usize = 6;

/// No state has an element beyond this, in any of their units.
const ELEMENT_MAX: f64 = 1e5;

/// Whether an element belongs to the height: no derivative couples it to those of the plane.
pub(super) fn is_vertical(element: usize) -> bool {
    element == Z || element == CLIMB
}

/// Unknown of the plane: poses (x, y, heading) by basis function, then rates (speed, turn rate).
pub(super) fn planar(bases: usize, basis: usize, element: usize) -> usize {
    match element {
        0 | 1 => 3 * basis + element,
        HEADING => 3 * basis + 2,
        SPEED => 3 * bases + 2 * basis,
        _ => 3 * bases + 2 * basis + 1,
    }
}

/// Unknown of the height: z by basis function, then climb.
pub(super) fn vertical(bases: usize, basis: usize, element: usize) -> usize {
    if element == Z { basis } else { bases + basis }
}

/// The elements of a state.
pub(super) fn elements(state: &ObjectState) -> ControlPoint {
    let [x, y, z] = state.position;
    [x, y, z, state.heading, state.speed, state.climb, state.turn_rate]
}

/// Whether all elements are finite and within the range of a track.
pub(super) fn is_valid(state: &ObjectState) -> bool {
    elements(state).iter().chain(&[state.time_s]).all(|value| value.abs() <= ELEMENT_MAX)
}

/// The sound states of a history, their heading unwrapped.
pub(super) fn unwrapped(history: &[ObjectState]) -> impl Iterator<Item = ObjectState> {
    let mut last: Option<f64> = None;
    history.iter().filter(|state| is_valid(state)).map(move |state| {
        let heading = match last {
            Some(last) => last + wrap_angle(state.heading - last),
            None => wrap_angle(state.heading),
        };
        last = Some(heading);
        ObjectState { heading, ..*state }
    })
}

/// State at `time_s`, extrapolated at constant velocity from `inside`, a time in the splines'
/// domain.
pub(super) fn state_at(
    knots: &Knots,
    control_points: &[ControlPoint],
    inside: f64,
    time_s: f64,
) -> ObjectState {
    let [x, y, z, heading, speed, climb, turn_rate] = knots.value(control_points, inside);
    let beyond = time_s - inside;
    let (sin, cos) = libm::sincos(heading);
    let position = [x + beyond * speed * cos, y + beyond * speed * sin, z + beyond * climb];
    ObjectState { time_s, position, heading, speed, climb, turn_rate }
}

/// The same motion with the object facing the other way.
pub(super) fn reverse(control_point: &mut ControlPoint) {
    control_point[HEADING] += core::f64::consts::PI;
    control_point[SPEED] = -control_point[SPEED];
}
