//! Training samples: squares around a cell of an object, with pairs drawn from them.
//!
//! The text draws one pair of cells at a time. All encodings of a square cost little more than one,
//! so a sample takes all pairs of a square as wide as the search: each solid cell of an object with
//! the cell it went to and with one other, and one in a hundred of the background's cells likewise.

use super::network::{CellPair, SEEN, TrainingSample};
use super::occupancy::{BORDER, SIDE, Symmetry};
use super::pairs::{CellOwner, FlowPair};
use raywake_core::params::SIDE as SEARCH;
use raywake_sim::Rng;

/// Share of the background's cells from which pairs are drawn (4.4.3.1).
const OF_BACKGROUND: f64 = 0.01;

impl FlowPair {
    /// A sample around one of the pair's `sources`.
    pub fn sample(&self, source: usize, rng: &mut Rng) -> TrainingSample {
        let symmetry = Symmetry((rng.bits() & 7) as u8);
        let half = (SEARCH / 2) as i32;
        let first = [source / SIDE, source % SIDE].map(|n| n as i32 - half);
        let from = first.map(|n| n + (BORDER - SEEN) as i32);
        let wide = SEARCH + 2 * SEEN;
        let maps = self.maps.each_ref().map(|map| map.square(from, wide, symmetry));
        // Cells of the window by their place in the square, and the inverse.
        let mut cells = vec![None; SEARCH * SEARCH];
        let mut places = vec![0; SEARCH * SEARCH];
        for (n, cell) in cells.iter_mut().enumerate() {
            let at = symmetry.of([n / SEARCH, n % SEARCH], SEARCH);
            places[at[0] * SEARCH + at[1]] = n;
            *cell = within([0, 1].map(|a| first[a] + at[a] as i32), SIDE, SIDE);
        }
        let place = |cell: usize, step: [i32; 2]| {
            let at = [cell / SIDE, cell % SIDE];
            let at = [0, 1].map(|a| at[a] as i32 + step[a] - first[a]);
            within(at, SEARCH, SEARCH).map(|n| places[n])
        };
        let mut pairs = Vec::new();
        for (n, cell) in cells.iter().enumerate() {
            let Some(cell) = cell.filter(|c| self.taken(*c, rng)) else { continue };
            if let Some(second) = self.step(cell).and_then(|step| place(cell, step)) {
                pairs.push(CellPair { first: n, second, matching: true });
                let by = 1 + rng.bits() as usize % (SEARCH * SEARCH - 1);
                let second = (second + by) % (SEARCH * SEARCH);
                pairs.push(CellPair { first: n, second, matching: false });
            }
        }
        TrainingSample { maps, pairs, classes: self.classes(&cells) }
    }

    /// Whether pairs are drawn from a cell.
    fn taken(&self, cell: usize, rng: &mut Rng) -> bool {
        match self.cells[cell].owner {
            CellOwner::Object(_) => self.cells[cell].solid,
            CellOwner::Background => rng.chance(OF_BACKGROUND),
            CellOwner::Unknown => false,
        }
    }

    /// Classes of the square's inner cells, which remain after the classifier's kernel.
    fn classes(&self, cells: &[Option<usize>]) -> Vec<Option<bool>> {
        let class = |n: usize| match self.cells[cells[n]?].owner {
            CellOwner::Object(_) => Some(true),
            CellOwner::Background => Some(false),
            CellOwner::Unknown => None,
        };
        let inner = 1..SEARCH - 1;
        inner.clone().flat_map(|i| inner.clone().map(move |j| i * SEARCH + j)).map(class).collect()
    }
}

/// Index of a place in a square of `side` cells whose rows are `row` long; `None` outside it.
fn within([i, j]: [i32; 2], side: usize, row: usize) -> Option<usize> {
    let inside = |n: &usize| *n < side;
    let i = usize::try_from(i).ok().filter(inside)?;
    Some(i * row + usize::try_from(j).ok().filter(inside)?)
}
