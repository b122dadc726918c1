#![forbid(unsafe_code)]
//! `raywake-lab`: one command per experiment.

use clap::Parser;
use raywake_lab::{check, simulate, train};
use std::process::ExitCode;

/// Off-board tools of raywake.
#[derive(Parser)]
#[command(version)]
enum Command {
    /// Train learned numbers on labelled drives.
    #[command(subcommand)]
    Train(train::Command),
    /// Measure a background filter on a recorded drive with boxes.csv.
    CheckFilter(check::Args),
    /// Write simulated drives with exact truth, in the layout of KITTI's raw recordings.
    Sim(simulate::Args),
}

fn main() -> ExitCode {
    let done = match Command::parse() {
        Command::Train(command) => train::run(&command),
        Command::CheckFilter(args) => check::run(&args),
        Command::Sim(args) => simulate::run(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("raywake-lab: {error}");
            ExitCode::FAILURE
        }
    }
}
