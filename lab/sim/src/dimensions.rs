//! Dimensions of the street, m, in the street frame: x along the main road, y left.

use crate::rng::Rng;

/// Half the width of a lane: how far the inner one's centre is from the centre line of a road
/// without a median.
pub(crate) const LANE: f64 = 1.75;
/// Length, width and height of the vehicle that carries the sensors.
pub(crate) const VEHICLE: [f64; 3] = [4.6, 1.9, 2.2];
/// Half width of the crossing road.
pub(crate) const CROSS_HALF: f64 = 4.5;

/// Cross-section of the main road, the same on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Section {
    /// Lanes each way.
    pub(crate) lanes: u32,
    /// Half width of the median, which separates the two directions; 0 without one.
    pub(crate) median_half: f64,
    /// Half width of the road.
    pub(crate) road_half: f64,
    /// Width of a sidewalk.
    pub(crate) sidewalk: f64,
}

impl Section {
    /// A lane and a parking strip on either side, and broad sidewalks.
    pub(crate) const WIDE: Section =
        Section { lanes: 1, median_half: 0.0, road_half: 5.7, sidewalk: 4.3 };

    /// A lane each way without parking strips; sidewalks on which one or two people fit.
    pub(crate) fn narrow(rng: &mut Rng) -> Section {
        let (road_half, sidewalk) = (rng.range(3.1, 4.6), rng.range(1.2, 3.0));
        Section { road_half, sidewalk, ..Section::WIDE }
    }

    /// Two or three lanes each way, a shoulder as wide as a parking strip, and perhaps a median.
    pub(crate) fn broad(rng: &mut Rng) -> Section {
        let lanes = if rng.chance(0.5) { 2 } else { 3 };
        let median_half = if rng.chance(0.6) { rng.range(0.8, 2.0) } else { 0.0 };
        let section = Section { lanes, median_half, ..Section::WIDE };
        let road_half = section.outer_lane() + LANE + rng.range(2.2, 3.4);
        Section { road_half, sidewalk: rng.range(2.4, 4.3), ..section }
    }

    /// Distance of a lane's centre from the road's centre line; lane 0 is the inner one.
    pub(crate) fn lane(self, lane: u32) -> f64 {
        self.median_half + LANE + 2.0 * LANE * f64::from(lane)
    }

    /// That of the outer lane.
    pub(crate) fn outer_lane(self) -> f64 {
        self.lane(self.lanes - 1)
    }

    /// That of any lane. Where there is only one nothing is drawn.
    pub(crate) fn drawn_lane(self, rng: &mut Rng) -> f64 {
        match self.lanes {
            1 => self.lane(0),
            lanes => self.lane((rng.unit() * f64::from(lanes)) as u32),
        }
    }

    /// Distance from the road's centre line of what is this far from the kerb on a wide sidewalk.
    pub(crate) fn on_sidewalk(self, aside: f64) -> f64 {
        self.road_half + self.sidewalk / Section::WIDE.sidewalk * aside
    }

    /// Distance of a sidewalk's far edge from the road's centre line.
    pub(crate) fn edge(self) -> f64 {
        self.road_half + self.sidewalk
    }
}
