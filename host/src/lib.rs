#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! The command-line program: sweeps and poses in, temporal scene flow out.
//!
//! Commands over three libraries: `raywake-core` and its kernels (chapter 3 of the dissertation),
//! `raywake-objects` and `raywake-registration`; files are handled by `raywake-io`.
//!
//! | module | subject |
//! |---|---|
//! | [`args`] | the command line |
//! | [`config`], [`weight_files`], [`choose`] | its profile, model weights and backend |
//! | `batch` | many recordings, distributed over machines |
//! | [`engine`] | `run` and `demo`: a source through the pipeline, results to files |
//! | [`track`], [`map`], `flow`, `clean`, `odometry`, [`budget`] | the other commands |
//! | `session` | the run loop over a source's sweeps, until the last one or a signal |
//! | `live` | a sensor's packets as they arrive |
//! | [`locate`] | poses of sweeps by registration |
//! | [`drive`], [`backend`], [`team`] | one sweep, on the CPU or a device, with several threads |
//! | [`outputs`], [`summary`], `figures`, `settings_file` | files, figures and settings of a run |
//! | [`statistics`], [`order_statistics`], [`laps`], [`latency`] | what is counted and timed |
//! | [`console`], [`progress`], `report`, `shell` | what the user reads and types |
//! | [`error`] | the errors that end a command, and their exit codes |

pub mod args;
pub mod backend;
pub mod batch;
pub mod budget;
pub mod choose;
mod clean;
pub mod config;
pub mod console;
#[cfg(test)]
mod damaged;
#[cfg(feature = "demo")]
mod demo;
pub mod drive;
pub mod engine;
pub mod error;
mod figures;
pub mod flow;
pub mod inventory;
pub mod laps;
pub mod latency;
#[cfg(feature = "pcap")]
pub mod live;
pub mod locate;
pub mod map;
pub mod memory;
mod odometry;
pub mod order_statistics;
pub mod outputs;
pub mod picture;
mod pose_check;
pub mod progress;
mod report;
mod run;
mod session;
mod settings_file;
#[cfg(feature = "shell")]
mod shell;
pub mod statistics;
pub mod summary;
pub mod track;
pub mod weight_files;

pub use raywake_team as team;

use args::{Args, Command};
use clap::{ArgMatches, FromArgMatches};
use error::RunError;

/// Carries out a command line, on as many threads as pay off, and reports errors. Returns the exit
/// code of the process.
///
/// # Errors
/// The command line is invalid.
pub fn run_command_line(line: &ArgMatches) -> Result<u8, clap::Error> {
    let command = Args::from_arg_matches(line)?.command;
    let run =
        || args::inputs::protect(line).map_err(RunError::from).and_then(|()| execute(command));
    Ok(match team::lead(team::available(), run) {
        Ok(true) => 0,
        Ok(false) => console::INTERRUPTED_CODE,
        Err(e) => {
            console::warn(&e.to_string());
            e.exit_code()
        }
    })
}

/// Carries out a command. Returns whether it ran to completion: a signal ends it early.
pub fn execute(command: Command) -> Result<bool, RunError> {
    match command {
        Command::Run(args) => batch::each(&*args),
        Command::Flow(args) => flow::flow(&args).map(|()| true),
        Command::Track(args) => batch::each(&*args),
        Command::Clean(args) => batch::each(&*args),
        #[cfg(feature = "pcap")]
        Command::Live(args) => live::live(&args).map(|()| true),
        Command::Map(args) => map::command::map(&args),
        Command::Odometry(args) => odometry::odometry(&args),
        #[cfg(feature = "demo")]
        Command::Demo(args) => Ok(!demo::demo(&args)?.facts.interrupted),
        Command::Budget(args) => budget::budget(&args).map(|()| true),
        Command::Devices(args) => {
            console::say(false, &choose::list_devices(args.json)?)?;
            Ok(true)
        }
        #[cfg(feature = "shell")]
        Command::Completions { shell } => shell::completions(shell).map(|()| true),
        #[cfg(feature = "shell")]
        Command::Man { of } => shell::man(of.as_deref()).map(|()| true),
    }
}
