//! `raywake-lab train`: the learned numbers of chapter 3.

mod features;
mod filter;
mod logistic;
mod samples;
mod solve;
mod weights_file;

use std::error::Error;

/// What can be trained.
#[derive(clap::Subcommand)]
pub enum Command {
    /// The background filter (section 3.4.2).
    Filter(filter::Args),
}

/// Trains, writes and reports.
pub fn run(command: &Command) -> Result<(), Box<dyn Error>> {
    match command {
        Command::Filter(args) => filter::run(args),
    }
}

pub use features::LEVELS;
