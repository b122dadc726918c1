//! Input of the network: probabilities of occupancy (4.3)-(4.5) in the vehicle's frame.

use super::network::LEVELS;
use crate::grid::Grid;
use crate::learning::FeatureMap;
use raywake_core::frame::Window;
use raywake_core::params::Profile;
use raywake_core::sweep::{Rig, Sweep};

/// Cells of the flow's window along one axis: 50 m.
pub const SIDE: usize = 167;
/// Cells around it that the network also sees: the encoding of a cell at the rim, and its class,
/// need 12 on each side.
pub const BORDER: usize = 12;
/// Cells kept along one axis.
pub const WIDE: usize = SIDE + 2 * BORDER;
/// Log-odds are clipped here, tenths (table B.1).
const CLIP: i32 = 30;

/// Log-odds of a sweep, tenths, clipped: `WIDE` x `WIDE` cells of `LEVELS`.
#[derive(Clone, Debug, PartialEq)]
pub struct OccupancyMap(Vec<i8>);

/// A grid in the vehicle's frame as wide as the network needs.
pub fn wide_grid() -> Grid {
    let profile = Profile { side: WIDE as u32, ..Profile::dissertation() };
    assert_eq!(profile.levels as usize, LEVELS, "the network is for so many levels");
    Grid::new(profile)
}

impl OccupancyMap {
    /// Traces a sweep, after which the grid also has its columns. Also returns the position of the
    /// window.
    pub fn of(grid: &mut Grid, rig: &Rig, sweep: &Sweep) -> (OccupancyMap, Window) {
        let window = grid.sweep(rig, sweep);
        let clipped = |l: &i32| (*l).clamp(-CLIP, CLIP) as i8;
        (OccupancyMap(grid.log_odds().iter().map(clipped).collect()), window)
    }

    /// From log-odds, for tests.
    #[cfg(test)]
    pub fn from_tenths(tenths: Vec<i8>) -> OccupancyMap {
        assert_eq!(tenths.len(), WIDE * WIDE * LEVELS);
        OccupancyMap(tenths)
    }

    /// The square of `side` cells whose first cell is `from`, rotated or mirrored; whatever lies
    /// beyond the map is unknown.
    pub fn square(&self, from: [i32; 2], side: usize, symmetry: Symmetry) -> FeatureMap {
        let values: [f32; 2 * CLIP as usize + 1] =
            std::array::from_fn(|n| centred((n as i32 - CLIP) as f32 / 10.0));
        let mut map = FeatureMap::zeros(side, side, LEVELS);
        for (n, cell) in map.values.chunks_exact_mut(LEVELS).enumerate() {
            let at = symmetry.of([n / side, n % side], side);
            let [i, j] = [0, 1].map(|a| usize::try_from(from[a] + at[a] as i32));
            let (Ok(i), Ok(j)) = (i, j) else { continue };
            if i < WIDE && j < WIDE {
                let tenths = &self.0[(i * WIDE + j) * LEVELS..][..LEVELS];
                let value = |l: &i8| values[(i32::from(*l) + CLIP) as usize];
                cell.iter_mut().zip(tenths).for_each(|(v, l)| *v = value(l));
            }
        }
        map
    }

    /// The whole map.
    pub fn whole(&self) -> FeatureMap {
        self.square([0, 0], WIDE, Symmetry(0))
    }
}

/// The probability of a log-odds value, minus a half.
fn centred(log_odds: f32) -> f32 {
    1.0 / (1.0 + libm::expf(-log_odds)) - 0.5
}

/// One of the square's eight symmetries (section 4.4.3.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Symmetry(pub u8);

impl Symmetry {
    /// The cell that is mapped to a place of a square.
    pub fn of(self, [i, j]: [usize; 2], side: usize) -> [usize; 2] {
        let i = if self.0 & 1 == 0 { i } else { side - 1 - i };
        let j = if self.0 & 2 == 0 { j } else { side - 1 - j };
        if self.0 & 4 == 0 { [i, j] } else { [j, i] }
    }
}
