#![forbid(unsafe_code)]
//! `raywake-lab`: one command per experiment.

use clap::Parser;
use raywake_lab::{check, train};
use std::process::ExitCode;

/// Off-board tools of raywake.
#[derive(Parser)]
#[command(version)]
enum Command {
    /// Train learned numbers on labelled drives.
    #[command(subcommand)]
    Train(train::Command),
    /// Measure a background filter on a recorded drive with labels.
    CheckFilter(check::Args),
}

fn main() -> ExitCode {
    let done = match Command::parse() {
        Command::Train(command) => train::run(&command),
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
