//! `raywake-lab train`: the learned numbers of chapter 3.

#![allow(missing_docs)]
pub mod constancy;
pub mod constancy_samples;
pub mod curve;
pub mod drives;
pub mod features;
pub mod filter;
pub mod filter_samples;
pub mod inputs;
pub mod logistic;
pub mod owner;
pub mod pairs;
pub mod ranking;
pub mod recorded;
pub mod report;
pub mod simulated;
mod solve;
pub mod weights_file;

use raywake::error::Error;

/// What can be trained.
#[derive(clap::Subcommand)]
pub enum Command {
    /// The background filter (section 3.4.2).
    Filter(filter::Args),
    /// The occupancy constancy (section 3.5.1).
    Constancy(constancy::Args),
}

/// Trains, writes and reports.
pub fn run(command: &Command) -> Result<(), Error> {
    match command {
        Command::Filter(args) => filter::run(args),
        Command::Constancy(args) => constancy::run(args),
    }
}

pub use features::LEVELS;
