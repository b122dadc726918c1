//! Pictures of the distance between a cell's features and those around it one sweep later (figures
//! 4.6 and 4.7).

use super::matching::{Encoded, Features, place};
use super::occupancy::SIDE;
use super::pairs::{CellOwner, FlowPair};
use crate::labels::Kind;
use raywake_core::params::{REACH, SIDE as SEARCH};
use raywake_io::Error;
use raywake_render::canvas::{Align, Canvas, Pen};
use raywake_render::{Colour, colours};

/// Cells shown in a picture.
const CELLS: usize = 3;
/// Side of a cell, and space around and between squares, units.
const CELL: f32 = 7.0;
const GAP: f32 = 16.0;
/// Space above the squares, units.
const TITLE: f32 = 24.0;
/// Distances are drawn up to this, as in the dissertation's figure 4.6; beyond it in [`FAR`].
const SHOWN: f32 = 2.0;
/// From near to far.
const NEAR_TO_FAR: &[Colour] = &[[53, 42, 135], [15, 118, 200], [55, 184, 157], [250, 220, 30]];
const FAR: Colour = [192, 24, 43];

/// One cell and its surroundings.
struct Neighbourhood {
    /// Whether there is a return in each cell of the second sweep.
    solid: Vec<bool>,
    /// Feature distance of each, by row and column; `None` beyond the window.
    distances: Vec<Option<f32>>,
    /// Where the cell went.
    step: [i32; 2],
}

/// Some cells of a kind in one pair.
pub struct Distances {
    /// Number of moving solid cells of the kind: the pair with the most is drawn.
    pub cells: usize,
    around: Vec<Neighbourhood>,
}

/// Solid cells of moving objects of a kind.
pub fn moving(pair: &FlowPair, kind: Kind) -> Vec<usize> {
    let moves = |n: &usize| match pair.cells[*n].owner {
        CellOwner::Object(object) => {
            let object = pair.objects[usize::from(object)];
            object.kind == kind && object.speed_mps.is_some_and(|v| v > 0.5)
        }
        _ => false,
    };
    pair.sources().into_iter().filter(moves).collect()
}

impl Distances {
    /// For the first, middle and last of some cells.
    pub fn of(
        pair: &FlowPair,
        cells: &[usize],
        features: &Features,
        both: [&Encoded; 2],
    ) -> Distances {
        let chosen = (0..CELLS).map(|n| cells[n * (cells.len() - 1) / (CELLS - 1)]);
        let around = chosen.map(|cell| Neighbourhood::of(pair, cell, features, both)).collect();
        Distances { cells: cells.len(), around }
    }

    /// Draws them side by side and returns a PNG file.
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        let wide = SEARCH as f32 * CELL + GAP;
        let page = [GAP + self.around.len() as f32 * wide, TITLE + GAP + wide];
        let mut canvas = Canvas::new(page, 2.0, colours::PAPER)
            .map_err(|e| Error::Usage(format!("distances: {e}")))?;
        for (n, around) in self.around.iter().enumerate() {
            let left = GAP + n as f32 * wide;
            let title = format!("cell {}: distance from 0 to {SHOWN}, red beyond", n + 1);
            canvas.text([left, GAP + 10.0], &title, 12.0, Align::Start, colours::INK);
            around.draw(&mut canvas, [left, GAP + TITLE]);
        }
        Ok(canvas.png())
    }
}

impl Neighbourhood {
    fn of(pair: &FlowPair, cell: usize, features: &Features, both: [&Encoded; 2]) -> Neighbourhood {
        let row = features.costs(both, &[cell as u32])[0];
        let steps =
            (0..SEARCH * SEARCH).map(|n| [n / SEARCH, n % SEARCH].map(|d| d as i32 - REACH));
        let index = |step: [i32; 2]| {
            let [i, j] = [cell / SIDE, cell % SIDE].map(|n| n as i32);
            let [i, j] = [i + step[0], j + step[1]];
            let inside = |n: i32| (0..SIDE as i32).contains(&n);
            (inside(i) && inside(j)).then_some(i as usize * SIDE + j as usize)
        };
        Neighbourhood {
            solid: steps
                .clone()
                .map(|s| index(s).is_some_and(|n| pair.columns[1][n][1] != 0))
                .collect(),
            distances: steps.map(|s| index(s).map(|_| f32::from(row[place(s)]) / 1000.0)).collect(),
            step: pair.step(cell).unwrap_or_default(),
        }
    }

    fn draw(&self, canvas: &mut Canvas, [left, top]: [f32; 2]) {
        // Forward is up, left is left.
        let corner = |[u, v]: [i32; 2]| {
            let [up, across] = [u + REACH, v + REACH].map(|n| (SEARCH as i32 - 1 - n) as f32);
            [left + across * CELL, top + up * CELL]
        };
        for (n, distance) in self.distances.iter().enumerate() {
            let at = corner([n / SEARCH, n % SEARCH].map(|d| d as i32 - REACH));
            let colour = match distance {
                Some(d) if *d <= SHOWN => colours::ramp(NEAR_TO_FAR, d / SHOWN),
                Some(_) => FAR,
                None => colours::GROUND,
            };
            canvas.rect(at, [CELL; 2], colour, 1.0);
            if self.solid[n] {
                let dot = at.map(|c| c + 0.35 * CELL);
                canvas.rect(dot, [0.3 * CELL; 2], colours::INK, 1.0);
            }
        }
        let [x, y] = corner(self.step);
        let ends = [[x, y], [x + CELL, y], [x + CELL, y + CELL], [x, y + CELL]];
        let pen = Pen::new(colours::PAPER, 1.6);
        canvas.line(&ends, true, pen);
    }
}
