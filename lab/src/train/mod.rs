//! `raywake-lab train`: the learned numbers of chapter 3.

mod boosting;
mod constancy;
mod constancy_samples;
pub(crate) mod drives;
mod encoder;
mod features;
mod filter;
mod filter_samples;
pub(crate) mod inputs;
mod logistic;
mod moves;
mod owner;
mod pairs;
mod ranking;
pub(crate) mod recorded;
pub(crate) mod report;
pub(crate) mod simulated;
mod solve;
mod weights_file;

use crate::flsf;
use raywake_io::Error;

/// What can be trained.
#[derive(clap::Subcommand)]
pub enum Command {
    /// The background filter (section 3.4.2).
    Filter(filter::Args),
    /// The occupancy constancy (section 3.5.1).
    Constancy(constancy::Args),
    /// The encoder (after chapter 4).
    Encoder(encoder::Args),
    /// The features of chapter 4 as printed, off-board
    Flsf(flsf::Args),
    /// P(moves) from its cues (after the refinement, which has no section)
    Moves(moves::Args),
}

/// Trains, writes and reports.
pub fn run(command: &Command) -> Result<(), Error> {
    match command {
        Command::Filter(args) => filter::run(args),
        Command::Constancy(args) => constancy::run(args),
        Command::Encoder(args) => encoder::run(args),
        Command::Flsf(args) => flsf::run(args),
        Command::Moves(args) => moves::run(args),
    }
}

pub use features::LEVELS;
