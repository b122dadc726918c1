//! The encoder (after chapter 4): classifies a column from about 24 m around it.
//!
//! A pyramid of small convolutions over free and occupied voxels. Its cells are pairs, quads and
//! octets of the *world's* columns, so that static structure has the same phase in every sweep.
//! Chapter 4's network takes 41.9 billion products per sweep; this one takes 80 million, which a
//! CPU can do.
//!
//! Integers throughout: activations of 0 to 127, weights of -127 to 127, 32-bit sums, and a shift
//! per channel that scales a sum back to an activation. The result is the same on every machine and
//! for any number of threads. It runs on the CPU alongside whatever device perceives.

mod forward;
pub mod layers;
mod load;
mod rows;
#[cfg(test)]
mod tests;

pub use load::EncoderWeights;

use crate::params::{COLUMNS_MAX, SIDE_MAX};
use crate::record::Column;
use crate::team::Team;
#[cfg(test)]
use crate::weights::WeightsError;
use layers::*;
use rows::{Plane, each_row};

/// The class of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum ColumnClass {
    /// Nothing but ground.
    Ground = 0,
    /// Buildings, walls, fences and other permanent structures.
    Structure = 1,
    /// Trees, hedges and bushes.
    Vegetation = 2,
    /// Posts, signs and trunks.
    Pole = 3,
    /// Cars and vans.
    Car = 4,
    /// Trucks, buses and trams.
    LargeVehicle = 5,
    /// People on foot.
    Person = 6,
    /// Bicycles and motorcycles.
    TwoWheeler = 7,
}

impl ColumnClass {
    /// All classes, in order.
    pub const ALL: [ColumnClass; 8] = [
        ColumnClass::Ground,
        ColumnClass::Structure,
        ColumnClass::Vegetation,
        ColumnClass::Pole,
        ColumnClass::Car,
        ColumnClass::LargeVehicle,
        ColumnClass::Person,
        ColumnClass::TwoWheeler,
    ];

    /// The number that represents no class.
    pub const NONE: u8 = u8::MAX;

    /// The number of a class, or [`ColumnClass::NONE`].
    pub fn number(of: Option<ColumnClass>) -> u8 {
        of.map_or(ColumnClass::NONE, |class| class as u8)
    }

    /// The name in words.
    pub const fn name(self) -> &'static str {
        match self {
            ColumnClass::Ground => "ground",
            ColumnClass::Structure => "structure",
            ColumnClass::Vegetation => "vegetation",
            ColumnClass::Pole => "pole",
            ColumnClass::Car => "car",
            ColumnClass::LargeVehicle => "large vehicle",
            ColumnClass::Person => "person",
            ColumnClass::TwoWheeler => "two-wheeler",
        }
    }

    /// Whether the class takes part in traffic.
    pub const fn could_move(self) -> bool {
        self as u8 >= ColumnClass::Car as u8
    }
}

/// Scores of a column in units of 1/16 nat, -127 to 127: one for each of [`ColumnClass::ALL`], then
/// that of classes that could move (cars to two-wheelers) against those that could not.
pub type ColumnScores = [i8; SCORES];

/// The score, in nats, of classes that could move against those that could not.
pub fn could_move(scores: &ColumnScores) -> f32 {
    f32::from(scores[SCORES - 1]) / ONE as f32
}

/// The class with the highest score; the first one if equal.
pub fn class_of(scores: &ColumnScores) -> ColumnClass {
    let mut best = ColumnClass::Ground;
    for class in ColumnClass::ALL {
        if scores[class as usize] > scores[best as usize] {
            best = class;
        }
    }
    best
}

/// The weights shipped with the program: see the file's provenance.
pub const SHIPPED: &str = include_str!("../../weights/encoder.txt");

/// Cells along an axis of the finest level.
const FINE: usize = (SIDE_MAX + OCTET - 1).next_multiple_of(OCTET) / 2;

/// The network's working memory.
pub struct Activations {
    /// For pairs of columns, quads and octets: the level, and the intermediate result of a block.
    fine: [[u8; FINE * FINE * FINE_CHANNELS]; 2],
    middle: [[u8; FINE * FINE / 4 * MIDDLE_CHANNELS]; 2],
    coarse: [[u8; FINE * FINE / 16 * COARSE_CHANNELS]; 2],
}

/// One sweep's columns, their scores, and the working memory.
pub struct Encoder {
    weights: EncoderWeights,
    has_weights: bool,
    columns: [Column; COLUMNS_MAX],
    /// Columns of the window along an axis; 0 if none are kept.
    side: usize,
    /// The world column that is the window's first.
    corner: [i32; 2],
    activations: Activations,
    scores: [ColumnScores; COLUMNS_MAX],
}

impl Default for Encoder {
    fn default() -> Encoder {
        Encoder::new()
    }
}

impl Encoder {
    /// An encoder before the first sweep: all zeros.
    pub const fn new() -> Encoder {
        Encoder {
            weights: EncoderWeights::new(),
            has_weights: false,
            columns: [[0; 2]; COLUMNS_MAX],
            side: 0,
            corner: [0; 2],
            activations: Activations {
                fine: [[0; FINE * FINE * FINE_CHANNELS]; 2],
                middle: [[0; FINE * FINE / 4 * MIDDLE_CHANNELS]; 2],
                coarse: [[0; FINE * FINE / 16 * COARSE_CHANNELS]; 2],
            },
            scores: [[0; SCORES]; COLUMNS_MAX],
        }
    }

    /// Encodes with these weights from now on; `None` turns encoding off.
    pub fn set_weights(&mut self, weights: Option<&EncoderWeights>) {
        self.clear();
        self.has_weights = weights.is_some();
        self.weights = weights.cloned().unwrap_or_default();
    }

    /// Encodes from now on with the weights that `load` reads in place; turns encoding off if it
    /// fails.
    pub fn load_weights<E>(
        &mut self,
        load: impl FnOnce(&mut EncoderWeights) -> Result<(), E>,
    ) -> Result<(), E> {
        self.clear();
        let loaded = load(&mut self.weights);
        self.has_weights = loaded.is_ok();
        loaded
    }

    /// Whether it has weights.
    pub fn has_weights(&self) -> bool {
        self.has_weights
    }

    /// Keeps the columns of a square window whose first is world column `corner`.
    pub fn keep(&mut self, columns: &[Column], side: usize, corner: [i32; 2]) {
        if !self.has_weights {
            return;
        }
        (self.side, self.corner) = (side, corner);
        self.columns[..side * side].copy_from_slice(&columns[..side * side]);
    }

    /// Discards the columns kept.
    pub fn clear(&mut self) {
        self.side = 0;
    }

    /// Scores of the columns kept, once encoded: zeros for a column that is not solid; empty if
    /// nothing is encoded.
    pub fn scores(&self) -> &[ColumnScores] {
        &self.scores[..self.side * self.side]
    }

    /// Encodes the columns kept, if there are any.
    pub fn encode(&mut self, team: &impl Team) {
        let Encoder { side, corner, .. } = *self;
        if side == 0 {
            return;
        }
        let (columns, weights) = (&self.columns, &self.weights);
        let phase = corner.map(|c| c.rem_euclid(OCTET as i32) as usize);
        let window = PaddedWindow { columns, side, phase };
        let mut levels = self.activations.levels((side + OCTET - 1).next_multiple_of(OCTET) / 2);
        levels.fill(team, weights, &window);
        let around = levels.around_columns(team, weights);
        each_row(
            team,
            &mut self.scores[..side * side],
            side,
            #[inline(always)]
            move |simd, i, out| {
                let row = &columns[i * side..][..side];
                out.fill([0; SCORES]);
                let (mut solid, mut count) = ([0u16; SIDE_MAX], 0);
                for (j, _) in row.iter().enumerate().filter(|(_, [_, solid])| *solid != 0) {
                    solid[count] = j as u16;
                    count += 1;
                }
                let at = |n: usize| usize::from(solid[n]);
                let around = |n| around.at((i + phase[0]) / 2, (at(n) + phase[1]) / 2);
                let done = |n, scores| out[at(n)] = scores;
                weights.head(simd, count, |n| row[at(n)][0], around, done);
            },
        );
    }
}

impl Activations {
    /// The part needed by a window whose finest level has `side` cells along an axis.
    fn levels(&mut self, side: usize) -> Levels<'_> {
        let cells = side * side;
        Levels {
            side,
            fine: self.fine.each_mut().map(|l| &mut l[..cells * FINE_CHANNELS]),
            middle: self.middle.each_mut().map(|l| &mut l[..cells / 4 * MIDDLE_CHANNELS]),
            coarse: self.coarse.each_mut().map(|l| &mut l[..cells / 16 * COARSE_CHANNELS]),
        }
    }
}

/// The pyramid of one window: each level, and room for the intermediate result of a block.
struct Levels<'a> {
    /// Cells of the finest level along an axis.
    side: usize,
    fine: [&'a mut [u8]; 2],
    middle: [&'a mut [u8]; 2],
    coarse: [&'a mut [u8]; 2],
}

impl Levels<'_> {
    /// Computes all levels, down to the coarsest and back up.
    fn fill(&mut self, team: &impl Team, weights: &EncoderWeights, window: &PaddedWindow) {
        let n = self.side;
        let [fine, beside_fine] = &mut self.fine;
        let [middle, beside_middle] = &mut self.middle;
        let [coarse, beside_coarse] = &mut self.coarse;
        weights.down_from_columns(team, window, n, fine);
        for first in BLOCKS_FINE {
            weights.block::<FINE_CHANNELS>(team, first, n, fine, beside_fine);
        }
        let from = Plane { side: n, cells: fine };
        weights.down::<FINE_CHANNELS, { 4 * FINE_CHANNELS }, MIDDLE_CHANNELS>(
            team,
            DOWN_MIDDLE,
            from,
            middle,
        );
        for first in BLOCKS_MIDDLE {
            weights.block::<MIDDLE_CHANNELS>(team, first, n / 2, middle, beside_middle);
        }
        let from = Plane { side: n / 2, cells: middle };
        weights.down::<MIDDLE_CHANNELS, { 4 * MIDDLE_CHANNELS }, COARSE_CHANNELS>(
            team,
            DOWN_COARSE,
            from,
            coarse,
        );
        for first in BLOCKS_COARSE {
            weights.block::<COARSE_CHANNELS>(team, first, n / 4, coarse, beside_coarse);
        }
        let from = Plane { side: n / 4, cells: coarse };
        weights.up::<COARSE_CHANNELS, MIDDLE_CHANNELS>(team, UP_MIDDLE, from, middle);
        let from = Plane { side: n / 2, cells: middle };
        weights.up::<MIDDLE_CHANNELS, FINE_CHANNELS>(team, UP_FINE, from, fine);
        weights.block::<FINE_CHANNELS>(team, BLOCK_AFTER, n, fine, beside_fine);
    }

    /// Computes the features around the columns of each pair.
    fn around_columns(
        &mut self,
        team: &impl Team,
        weights: &EncoderWeights,
    ) -> Plane<'_, COLUMN_CHANNELS> {
        let side = self.side;
        let [fine, beside] = &mut self.fine;
        let around = &mut beside[..side * side * COLUMN_CHANNELS];
        weights.around_columns(team, Plane { side, cells: fine }, around);
        Plane { side, cells: around }
    }
}

/// The columns that the network sees.
struct PaddedWindow<'a> {
    columns: &'a [Column],
    side: usize,
    /// Columns of the first octet that lie before the window, along each axis.
    phase: [usize; 2],
}

impl PaddedWindow<'_> {
    /// Masks of the column at a position in the padded window; unknown outside.
    fn masks(&self, i: usize, j: usize) -> u32 {
        let [i, j] = [i.wrapping_sub(self.phase[0]), j.wrapping_sub(self.phase[1])];
        if i < self.side && j < self.side { self.columns[i * self.side + j][0] } else { 0 }
    }
}
