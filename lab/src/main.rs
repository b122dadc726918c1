#![forbid(unsafe_code)]
#![warn(missing_docs)]
//! Off-board tools: training the background filter (section 3.4.2) on simulated drives, and
//! checking a filter on a recorded, labelled one.

mod check;
mod features;
mod grid;
mod labels;
mod logistic;
mod samples;
mod solve;
mod train;
mod weights_file;

use clap::Parser;
use std::process::ExitCode;

/// Off-board tools of raywake.
#[derive(Parser)]
#[command(version)]
enum Command {
    /// Train the background filter on simulated drives.
    TrainFilter(train::Args),
    /// Measure a background filter on a recorded drive with boxes.csv.
    CheckFilter(check::Args),
}

fn main() -> ExitCode {
    let done = match Command::parse() {
        Command::TrainFilter(args) => train::run(&args),
        Command::CheckFilter(args) => check::run(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("raywake-lab: {error}");
            ExitCode::FAILURE
        }
    }
}
