//! Dimensions of the street, m, in the street frame: x along the main road, y left.

/// Half width of the main road (a lane and a parking strip on either side).
pub(crate) const ROAD_HALF: f64 = 5.7;
/// Half width of the crossing road.
pub(crate) const CROSS_HALF: f64 = 4.5;
/// Width of a sidewalk.
pub(crate) const SIDEWALK: f64 = 4.3;
/// Distance of a sidewalk's far edge from the main road's centre line.
pub(crate) const EDGE: f64 = ROAD_HALF + SIDEWALK;
