//! Labelled columns for the background filter.

use super::drives::{Labelled, LabelledSweep};
use super::features::{Features, features};
use super::owner::{Owner, owners};
use crate::grid::Grid;
use raywake::error::Error;
use raywake_sim::Rng;

/// Share of the background columns that is kept.
pub const BACKGROUND_KEPT: f64 = 0.2;

/// One column.
#[derive(Clone, Copy)]
pub struct Sample {
    /// What the classifier sees.
    pub features: Features,
    /// Whether it belongs to something that could move, even if it does not.
    pub foreground: bool,
    /// Distance from the vehicle, m.
    pub range_m: f32,
}

/// Samples of one sweep of a drive.
pub fn of_sweep(
    grid: &mut Grid,
    drive: &mut dyn Labelled,
    index: usize,
    sweep: &mut LabelledSweep,
    rng: &mut Rng,
    samples: &mut Vec<Sample>,
) -> Result<(), Error> {
    drive.read(index, sweep)?;
    let window = grid.sweep(drive.rig(), &sweep.data.sweep());
    for (column, owner) in owners(grid, &window, drive, sweep) {
        let foreground = match owner {
            Owner::Object(_) => true,
            Owner::Background if rng.chance(BACKGROUND_KEPT) => false,
            _ => continue,
        };
        let features = features(&grid.step, &grid.columns, column);
        let range_m = grid.centre(&window, column).truncate().length() as f32;
        samples.push(Sample { features, foreground, range_m });
    }
    Ok(())
}
