#![forbid(unsafe_code)]
//! `raywake-lab`: one command per experiment.

use clap::Parser;
use raywake::error::Error;
use raywake_lab::metrics::grade;
use raywake_lab::{eval, matching, simulate, tracks, train};
use std::process::ExitCode;

/// Off-board tools of raywake.
#[derive(Parser)]
#[command(version)]
enum Command {
    /// Train learned numbers on labelled drives.
    #[command(subcommand)]
    Train(train::Command),
    /// Run labelled drives through the pipeline and compare flow and tracklets with the truth.
    Eval(Eval),
    /// Evaluate variants of a profile, one thing changed in each: one table.
    Ablate(Box<eval::ablate::Args>),
    /// Grade scene flow on an Argoverse 2 log with the official metrics.
    Grade(grade::Args),
    /// Ego motion of a drive by scan matching, against the drive's own poses.
    Match(matching::Args),
    /// Write simulated drives with exact truth, in the layout of KITTI's raw recordings.
    Sim(simulate::Args),
}

/// Chapter 3 by drives, or another chapter by its name.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
struct Eval {
    #[command(subcommand)]
    of: Option<Chapter>,
    #[command(flatten)]
    flow: Option<Box<eval::Args>>,
}

#[derive(clap::Subcommand)]
enum Chapter {
    /// Trajectory and shape of objects against their truth (chapter 2).
    Tracks(tracks::Args),
}

fn evaluate(args: &Eval) -> Result<(), Error> {
    match (&args.of, &args.flow) {
        (Some(Chapter::Tracks(tracks)), _) => tracks::run(tracks),
        (None, Some(flow)) => eval::run(flow),
        (None, None) => Err(Error::Usage("nothing to evaluate".into())),
    }
}

fn main() -> ExitCode {
    let done = match Command::parse() {
        Command::Train(command) => train::run(&command).map_err(Into::into),
        Command::Eval(args) => evaluate(&args).map_err(Into::into),
        Command::Ablate(args) => eval::ablate::run(&args).map_err(Into::into),
        Command::Grade(args) => grade::run(&args),
        Command::Match(args) => matching::run(&args),
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
