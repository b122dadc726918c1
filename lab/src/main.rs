#![forbid(unsafe_code)]
//! `raywake-lab`: one command per experiment.

use clap::Parser;
use raywake::console::{INTERRUPTED_CODE, interrupted};
use raywake::error::RunError;
use raywake_alloc_guard::Guard;
use raywake_lab::metrics::grade;
use raywake_lab::{
    bench, device, eval, flsf, growth, instructions, matching, results, simulate, soak, toy,
    tracks, train,
};
use std::alloc::System;
use std::error::Error;
use std::process::ExitCode;

/// Off-board tools of raywake.
#[derive(Parser)]
#[command(version)]
enum Command {
    /// Train learned numbers on labelled drives.
    #[command(subcommand)]
    Train(train::Command),
    /// Run labelled drives through the pipeline and compare flow and tracklets with the truth.
    Eval(Box<Eval>),
    /// Evaluate variants of a profile, each with one change, in one table.
    Ablate(Box<eval::ablate::Args>),
    /// Grade scene flow on an Argoverse 2 log with the official metrics.
    Grade(grade::Args),
    /// Register a drive's sweeps and compare the poses with the drive's own.
    Match(matching::Args),
    /// Write RESULTS.md from the results of evaluations.
    Results(results::Args),
    /// Feature learning on digits (section 4.3): table 4.1, figures 4.2 and 4.3.
    Toy(toy::Args),
    /// Time two builds of the program in turn: ratios of sweep, CPU and wall times.
    Bench(bench::Args),
    /// Run on a Vulkan device and on the CPU alone: the results must agree; both are timed.
    Device(device::Args),
    /// Time simulated sweeps: how the time grows with returns, the window and traffic.
    Growth(Box<growth::Args>),
    /// Count the instructions of every stage of a sweep with Valgrind, whatever the machine's load.
    Instructions(Box<instructions::Args>),
    /// Run sweeps in a loop for hours, with faults in between: digests, memory, times.
    Soak(Box<soak::Args>),
    /// Write simulated drives with exact truth, in the layout of KITTI's raw recordings.
    Sim(simulate::Args),
    /// Write the packets that a simulated sensor sends, as a capture file.
    Packets(simulate::packets::PacketsArgs),
}

/// `eval DRIVE...` for chapter 3, `eval tracks` for chapter 2, `eval clean` for `raywake clean`.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
struct Eval {
    #[command(flatten)]
    flow: eval::Args,
    #[command(subcommand)]
    of: Option<Other>,
}

#[derive(clap::Subcommand)]
enum Other {
    /// Trajectory and shape of objects against their truth (chapter 2).
    Tracks(Box<tracks::Args>),
    /// Learned features as printed in chapter 4: table 4.2, figures 4.5 to 4.8.
    Flsf(flsf::evaluate::Args),
    /// A cleaned recording against its truth: static kept, dynamic removed.
    Clean(eval::clean::Args),
}

impl Eval {
    fn run(&self) -> Result<(), RunError> {
        match &self.of {
            Some(Other::Tracks(args)) => tracks::run(args),
            Some(Other::Flsf(args)) => Ok(flsf::evaluate::run(args)?),
            Some(Other::Clean(args)) => Ok(eval::clean::run(args)?),
            None => Ok(eval::run(&self.flow)?),
        }
    }
}

#[global_allocator]
static ALLOCATOR: Guard<System> = Guard(System);

fn main() -> ExitCode {
    let done = match Command::parse() {
        Command::Train(command) => train::run(&command).map_err(Into::into),
        Command::Eval(args) => args.run().map_err(Into::into),
        Command::Ablate(args) => eval::ablate::run(&args).map_err(Into::into),
        Command::Grade(args) => grade::run(&args),
        Command::Match(args) => matching::run(&args),
        Command::Sim(args) => simulate::run(&args),
        Command::Packets(args) => simulate::packets::packets(&args).map_err(Into::into),
        Command::Toy(args) => toy::run(&args).map_err(Into::into),
        Command::Bench(args) => bench::run(&args).map_err(Into::into),
        Command::Device(args) => device::run(&args).map_err(Into::into),
        Command::Growth(args) => growth::run(&args).map_err(Into::into),
        Command::Instructions(args) => instructions::run(&args).map_err(Into::into),
        Command::Soak(args) => soak::run(&args),
        Command::Results(args) => results::run(&args).map_err(Into::into),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("raywake-lab: {error}");
            ExitCode::from(exit_code(error.as_ref(), interrupted()))
        }
    }
}

/// The program's exit code for the same error; 1 for errors that only the lab has.
fn exit_code(error: &(dyn Error + 'static), interrupted: bool) -> u8 {
    if interrupted {
        return INTERRUPTED_CODE;
    }
    let io = error.downcast_ref::<raywake_io::Error>().map(raywake_io::Error::exit_code);
    let run = error.downcast_ref::<RunError>().map(RunError::exit_code);
    io.or(run).unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_has_the_programs_exit_code() {
        let missing = raywake_io::Error::Usage("no such drive".into());
        let codes = [exit_code(&missing, false), exit_code(&std::fmt::Error, false)];
        assert_eq!(codes, [missing.exit_code(), 1]);
        assert_eq!(exit_code(&missing, true), 130);
    }

    #[test]
    fn eval_takes_drives_or_a_chapter() {
        let parse = |line: &str| Command::try_parse_from(line.split(' '));
        let Ok(Command::Eval(flow)) = parse("lab eval no/drive other --out results --jobs 2")
        else {
            panic!("no command");
        };
        let error = flow.run().unwrap_err().to_string();
        assert!(error.contains("no/drive"), "{error}");
        let tracks = parse("lab eval tracks --out results a/drive");
        assert!(matches!(tracks, Ok(Command::Eval(e)) if e.of.is_some()));
        for wrong in ["lab eval", "lab eval a/drive", "lab eval tracks", "lab eval --out results"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
