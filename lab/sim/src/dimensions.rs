//! Dimensions of the street, m, in the street frame: x along the main road, y left.

use crate::rng::Rng;

/// Half width of the crossing road.
pub(crate) const CROSS_HALF: f64 = 4.5;

/// Cross-section of the main road, the same on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Section {
    /// Half width of the road.
    pub(crate) road_half: f64,
    /// Width of a sidewalk.
    pub(crate) sidewalk: f64,
}

impl Section {
    /// A lane and a parking strip on either side, and broad sidewalks.
    pub(crate) const WIDE: Section = Section { road_half: 5.7, sidewalk: 4.3 };

    /// Two lanes without parking strips; sidewalks on which one or two people fit.
    pub(crate) fn narrow(rng: &mut Rng) -> Section {
        Section { road_half: rng.range(3.1, 4.6), sidewalk: rng.range(1.2, 3.0) }
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
